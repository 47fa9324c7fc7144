"""``polychirp correlate`` — auto- and cross-correlation of waveforms and recordings."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.terminal import (
    add_option,
    figure_text,
    positive_value,
    printable,
    say,
    tables,
    usable_file,
    usable_folder,
)
from polychirp.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from polychirp.correlation.base import Correlation
    from polychirp.correlation.lobes import Lobes
    from polychirp.radio.base import Radio
    from polychirp.study.section_v.operands import Operand, Pair

RADIOS: Final = ("loopback", "soapy", "pluto")
"""Kinds of radios that ``--radio`` accepts."""

_IGNORED_BY_SEARCH: Final[tuple[str, ...]] = (
    *("rate", "align", "offset", "snr", "radio", "i_hold_a_licence"),
    *("figure", "ambiguity", "save", "doppler", "draws"),
)
_IGNORED_BY_PAPER: Final[tuple[str, ...]] = (
    *("rate", "sweeps", "baseband", "align", "offset", "search"),
    *("snr", "radio", "i_hold_a_licence", "ambiguity", "save", "doppler"),
)
_IGNORED_BY_PAIR: Final[tuple[str, ...]] = ("draws",)
"""Options without an effect on a search, on 'paper', and on all other correlations."""

_DESCRIPTION: Final = """\
Correlate A with B (or with itself) on one scale: a signal with itself has a peak of 1.

A and B are each one of
  NAME.sigmf-meta      a recording
  STUDY.toml:RADAR     the first sweeps of a radar of a study
  paper-100, paper-120 the paper's chirps: 100 MHz at 4 GHz, 120 MHz at 3.75 GHz, 100 us

'polychirp correlate paper' runs all of the paper's section V: its two cases and those that really
test slope diversity, in theory, through transceivers at three SNRs, and by loop-back."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``correlate``."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        "correlate",
        help="correlate waveforms and recordings with each other or with themselves",
        description=_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("a", metavar="A", help="received signal; or 'paper'")
    parser.add_argument("b", metavar="B", nargs="?", help="reference signal (default: A)")
    common = parser.add_argument_group("signals")
    common.add_argument("--rate", metavar="R", help="common sample rate, as in '130 MS/s'")
    add_option(common, "--sweeps", "N", 1, "number of sweeps of a radar of a study")
    common.add_argument(
        "--baseband", action="store_true", help="remove the carriers and compare the basebands"
    )
    common.add_argument(
        "--align", action="store_true", help="find B in A, and remove the delay of A"
    )
    common.add_argument(
        "--offset",
        metavar="F",
        help="as --align, but also remove a frequency offset of up to F, as in '20 kHz'",
    )
    common.add_argument(
        "--search",
        action="store_true",
        help="find every place of B in the long recording A, block by block",
    )
    _add_bench(parser)
    out = parser.add_argument_group("results")
    out.add_argument(
        "--figure",
        metavar="FILE",
        help="write a picture (PNG) of the correlation; with 'paper', a folder of pictures",
    )
    out.add_argument(
        "--csv",
        metavar="FILE",
        help="write the data of that picture; with --search, the places found; with 'paper', "
        "the table",
    )
    out.add_argument(
        "--ambiguity",
        metavar="FILE",
        help="write a picture (PNG) of the ambiguity function, over delay and Doppler shift",
    )
    add_option(out, "--doppler", "F", "1 MHz", "greatest Doppler shift in that picture")
    out.add_argument("--save", metavar="DIR", help="write A and B as SigMF recordings")
    out.add_argument("--json", action="store_true", help="print JSON in SI units on stdout")
    every = (*_IGNORED_BY_SEARCH, *_IGNORED_BY_PAPER)
    parser.set_defaults(defaults={name: parser.get_default(name) for name in every})


def _add_bench(parser: argparse.ArgumentParser) -> None:
    bench = parser.add_argument_group("transceivers")
    bench.add_argument(
        "--snr",
        metavar="X",
        help="pass A through the model of two transceivers first, at this SNR, as in '30 dB'",
    )
    bench.add_argument(
        "--radio",
        metavar="R",
        help="play and record A by a radio first: loopback, soapy:ARGUMENTS or pluto:ADDRESS",
    )
    bench.add_argument(
        "--i-hold-a-licence",
        action="store_true",
        help="state that you may transmit in A's band, or that a cable with an attenuator joins "
        "the connectors",
    )
    bench.add_argument("--seed", type=int, default=1, help="seed of all random draws (default: 1)")
    draws = "with 'paper': number of draws of noise for each interval"
    add_option(bench, "--draws", "N", 12, draws)


def run(arguments: argparse.Namespace) -> int:
    """Read A and B, correlate them, write the files and print the table."""
    if arguments.seed < 0:
        raise InputError(f"--seed: {arguments.seed} is negative; use 0 or more")
    _refuse_ignored(arguments)
    _refuse_unwritable(arguments)
    if arguments.a == "paper":
        return _paper(arguments)
    if arguments.search:
        return _search(arguments)
    from polychirp.correlation.base import correlate
    from polychirp.correlation.lobes import lobes
    from polychirp.study.section_v.operands import aligned_pair, closed_form, fine_step, paired

    a, b = _operands(arguments)
    pair = paired(
        a,
        b,
        sample_rate=_read(arguments, "rate", "S/s"),
        compare_basebands=arguments.baseband,
    )
    pair = _on_the_bench(arguments, pair)
    found: dict[str, float] = {}
    if arguments.align or arguments.offset:
        pair, found = aligned_pair(pair, greatest_offset=_read(arguments, "offset", "Hz") or 0.0)
    measured = correlate(pair.a, pair.b, oversampling=fine_step(pair))
    theory = closed_form(pair, measured.lag)
    rows = {"correlation": lobes(measured)}
    if theory is not None:
        rows["closed form"] = lobes(theory)
    _write(arguments, pair, measured, theory)
    _show(arguments, pair, rows, found)
    return 0


def _refuse_ignored(arguments: argparse.Namespace) -> None:
    """Refuse options that would have no effect; the message says which command takes them."""
    if arguments.a == "paper":
        if arguments.b is not None:
            raise InputError(f"'correlate paper' takes no B; leave out '{arguments.b}'")
        here, ignored = "correlate paper", _IGNORED_BY_PAPER
    elif arguments.search:
        here, ignored = "correlate A B --search", _IGNORED_BY_SEARCH
    else:
        here, ignored = "correlate A B", _IGNORED_BY_PAIR
    for name in ignored:
        if getattr(arguments, name) != arguments.defaults[name]:
            there = "correlate paper" if name == "draws" else "correlate A B"
            option = f"--{name.replace('_', '-')}"
            raise InputError(f"{option}: '{here}' does not take it, but '{there}' does")


def _refuse_unwritable(arguments: argparse.Namespace) -> None:
    """Refuse, before the computation, places where results cannot be written."""
    is_paper = arguments.a == "paper"
    if arguments.figure and is_paper:
        usable_folder(arguments.figure, option="--figure")
    for name in ("csv", "ambiguity") if is_paper else ("figure", "csv", "ambiguity"):
        if getattr(arguments, name):
            usable_file(getattr(arguments, name), option=f"--{name}")
    if arguments.save:
        usable_folder(arguments.save, option="--save")


def _read(arguments: argparse.Namespace, name: str, unit: str) -> float | None:
    """Positive value of the option ``name`` in SI; None if the option is not given."""
    return None if getattr(arguments, name) is None else positive_value(arguments, name, unit)


def _operands(arguments: argparse.Namespace) -> tuple[Operand, Operand]:
    a = _operand(arguments.a, arguments)
    return a, a if arguments.b is None else _operand(arguments.b, arguments)


def _operand(text: str, arguments: argparse.Namespace) -> Operand:
    from polychirp.capture.sigmf import DATA, META, check_sha512, open_sigmf
    from polychirp.cli.progress import progress_bar
    from polychirp.study.section_v.operands import NAMED, from_recording, from_study, named

    if Path(text).suffix in (META, DATA):
        recording = open_sigmf(text)
        with progress_bar("correlate") as show:
            check_sha512(recording, progress=show)
        return from_recording(text, recording)
    if text in NAMED:
        return named(text)
    path, colon, radar = text.rpartition(":")
    if colon and path.endswith(".toml"):
        from polychirp.config.load import load_study

        return from_study(load_study(path), radar, num_sweeps=arguments.sweeps)
    if text.endswith(".toml"):
        raise InputError(_which_radar(text))
    raise InputError(
        f"'{text}' is neither a recording (NAME{META}), nor a radar (STUDY.toml:RADAR), nor a "
        f"named waveform; {did_you_mean(text, ('paper', *NAMED))}"
    )


def _which_radar(path: str) -> str:
    """Error message about an operand that names a study without one of its radars."""
    from polychirp.config.load import load_study

    names = [radar.name for radar in load_study(path).radars] if Path(path).exists() else []
    one = names[0] if names else "front"
    others = f"; it has {', '.join(names)}" if names else ""
    return f"'{path}' is a whole study; name one of its radars, as in '{path}:{one}'{others}"


def _on_the_bench(arguments: argparse.Namespace, pair: Pair) -> Pair:
    """The pair, with A passed through the transceiver model or a radio if an option asks for it."""
    from polychirp.study.section_v.operands import through_model, through_radio

    snr = _read(arguments, "snr", "dB")
    if snr is not None and arguments.radio:
        raise InputError("--snr and --radio: give one of them, the model or a radio")
    if snr is not None:
        return through_model(pair, snr=snr, seed=arguments.seed)
    if arguments.radio:
        return through_radio(pair, _radio(arguments), i_hold_a_licence=arguments.i_hold_a_licence)
    return pair


def _radio(arguments: argparse.Namespace) -> Radio:
    kind, _, rest = arguments.radio.partition(":")
    match kind:
        case "loopback":
            from polychirp.radio.loopback import LoopbackRadio

            return LoopbackRadio(seed=arguments.seed)
        case "soapy":
            from polychirp.radio.soapy import SoapyRadio

            return SoapyRadio(rest)
        case "pluto":
            from polychirp.radio.pluto import PlutoRadio

            return PlutoRadio(rest) if rest else PlutoRadio()
    raise InputError(f"--radio: there is no '{kind}'; {did_you_mean(kind, RADIOS)}")


def _write(
    arguments: argparse.Namespace, pair: Pair, measured: Correlation, theory: Correlation | None
) -> None:
    """Write the figures, data and recordings that options ask for."""
    if arguments.figure or arguments.csv:
        from polychirp.report.figures.correlation import pair_picture

        drawing = pair_picture(measured, theory, title=figure_text(pair.title))
        if arguments.figure:
            _store(arguments.figure, drawing.png())
        if arguments.csv:
            _store(arguments.csv, drawing.csv().encode())
    if arguments.ambiguity:
        _store(arguments.ambiguity, _ambiguity(arguments, pair))
    if arguments.save:
        from polychirp.capture.sigmf import write_sigmf

        folder = Path(arguments.save)
        for name, signal, plan in (("a", pair.a, pair.a_schedule), ("b", pair.b, pair.b_schedule)):
            told = write_sigmf(folder / name, signal, schedule=plan, description=pair.title)
            say(f"stored {told}")


def _store(name: str, content: bytes) -> None:
    Path(name).write_bytes(content)
    say(f"stored {name}")


def _ambiguity(arguments: argparse.Namespace, pair: Pair) -> bytes:
    from polychirp.cli.progress import progress_bar
    from polychirp.report.figures.correlation import ambiguity_picture
    from polychirp.study.section_v.operands import ambiguity_of

    doppler = _read(arguments, "doppler", "Hz") or 0.0
    with progress_bar("ambiguity") as show:
        found = ambiguity_of(pair, greatest_doppler=doppler, progress=show)
    return ambiguity_picture(found, title=figure_text(pair.title)).png()


def _show(
    arguments: argparse.Namespace, pair: Pair, rows: dict[str, Lobes], found: dict[str, float]
) -> None:
    if arguments.json:
        from dataclasses import asdict

        from polychirp.report.words import finite

        values = {name: finite(asdict(row)) for name, row in rows.items()}
        print(json.dumps({"title": pair.title, **found, **values}, indent=1, allow_nan=False))
        return
    print(printable(pair.title))
    for name, value in found.items():
        shown = f"{_fixed(value * 1e9, 3)} ns" if name == "delay" else f"{_fixed(value, 1)} Hz"
        print(f"  {name} removed: {shown}")
    print(f"  {'':<14}{'peak':>10}{'lag':>14}{'width':>12}{'side lobe':>12}{'integrated':>12}")
    for name, row in rows.items():
        print(
            f"  {name:<14}{_db(row.peak**2):>10}{_fixed(row.lag * 1e6, 4):>11} us"
            f"{_width(row.width):>12}"
            f"{_db(row.peak_side_lobe):>12}{_db(row.integrated_side_lobe):>12}"
        )
    law = pair.law
    if law is not None:
        print(f"  theory of the peak {_db(law[0])}: {law[1]}")


def _width(width: float) -> str:
    return f"{_fixed(width * 1e9, 2)} ns" if math.isfinite(width) else "unknown"


def _db(ratio: float) -> str:
    return f"{_fixed(10.0 * math.log10(max(ratio, 1e-40)), 2)} dB"


def _fixed(value: float, digits: int) -> str:
    """The value with ``digits`` decimals; a value that is rounded to zero has no minus sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _search(arguments: argparse.Namespace) -> int:
    from polychirp.cli.progress import progress_bar
    from polychirp.correlation.search import search
    from polychirp.study.section_v.operands import reference_for

    if arguments.b is None:
        raise InputError("--search needs B, the reference to look for")
    a, b = _operands(arguments)
    if a.recording is None:
        raise InputError(f"--search needs a recording as A; '{a.name}' is not one")
    reference = reference_for(a.recording, b, compare_basebands=arguments.baseband)
    with progress_bar("search") as show:
        found = search(a.recording, reference, progress=show)
    if arguments.csv:
        lines = [f"{t:.9g},{v:.6g}" for t, v in zip(found.lag, found.peak, strict=True)]
        _store(arguments.csv, ("time_s,peak\n" + "\n".join(lines) + "\n").encode())
    if arguments.json:
        record = {"time": found.lag.tolist(), "peak": found.peak.tolist()}
        print(json.dumps(record, indent=1))
        return 0
    seconds = a.recording.num_samples / a.recording.sample_rate
    print(printable(f"{b.name} in {a.name}, {seconds:.6g} s: found {found.peak.size} times"))
    for time, value in list(zip(found.lag, found.peak, strict=True))[:20]:
        print(f"  {time * 1e6:>14.4f} us   {value:.4f}")
    if found.peak.size > 20:
        print(f"  and {found.peak.size - 20} more; --csv writes all")
    return 0


def _paper(arguments: argparse.Namespace) -> int:
    from polychirp.cli.progress import progress_bar
    from polychirp.report.correlation import correlation_csv, correlation_json, write_correlation
    from polychirp.study.section_v.cases import run_correlation

    with progress_bar("correlate") as show:
        results = run_correlation(seed=arguments.seed, num_seeds=arguments.draws, progress=show)
    if arguments.figure:
        write_correlation(results, Path(arguments.figure))
        say(f"stored in {arguments.figure}")
    if arguments.csv:
        _store(arguments.csv, correlation_csv(results).encode())
    if arguments.json:
        print(json.dumps(correlation_json(results), indent=1, allow_nan=False))
        return 0
    _print_tables(results)
    return 0


def _print_tables(results: Any) -> None:
    from polychirp.report.correlation import correlation_table, shape_table

    console = tables()
    console.print(correlation_table(results))
    console.print(shape_table(results))
    for note in results.notes:
        console.print(note)
