"""``polychirp process`` — run the receiver on recorded converter samples."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.terminal import figure_text, say, usable_folder
from polychirp.errors import InputError

if TYPE_CHECKING:
    from polychirp.capture.parameters import CaptureParameters
    from polychirp.capture.recording import Recording
    from polychirp.model.detection import Detections
    from polychirp.model.if_frame import IfFrame
    from polychirp.receiver.range_doppler.chain import RangeDoppler

_LONGEST_RANGE = 30
"""Greatest number of characters of ``--frames``. Chosen: no recording needs as many digits."""

_FORMS: Final = (".npy", ".zarr", ".bin")
"""Ends of the names of recordings that are read."""

_ARRAY_FILES: Final = ("zarr.json", ".zarray")
"""Files by which a folder is a Zarr array, such as ``run.zarr/victim-0/samples``, whatever its
name."""

KEPT_FILES: Final = "maps and pictures of finished frames stay in the folder"
"""Part of the message that `cli.app` prints after an interrupt."""

_FASTER: Final = "faster targets are folded, with wrong angles and slightly wrong ranges"
"""A sentence on targets beyond the span of range rates of transmitters in turns."""

_NO_TRUTH = (
    "A recording has no ground truth: nothing here says which detections are right. Echoes at rest "
    "are not removed; channels are not calibrated, so azimuths carry the board's phase errors."
)


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``process``."""
    parser = subparsers.add_parser(
        "process",
        help="run the receiver on a recording",
        description="Run the receiver on recorded converter samples (NAME.npy, NAME.zarr, or "
        "NAME.bin of TI's DCA1000) with their parameters beside them in NAME.toml, or with a "
        "profile of TI's tools: prints what the ramps resolve and what was detected; writes map, "
        "picture and detections.",
    )
    parser.add_argument("capture", metavar="CAPTURE", nargs="?", help="the recording")
    parser.add_argument(
        "--params",
        metavar="FILE",
        help="file of its parameters (default: NAME.toml), or the profile of TI's tools that it "
        "was recorded with: mmWave Studio (.mmwave.json) or mmWave SDK (.cfg)",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="changes",
        help="change one parameter, as in --set device=xwr16xx; may be repeated",
    )
    parser.add_argument("--out", metavar="DIR", help="folder of the results (default: out/NAME)")
    parser.add_argument(
        "--frames", metavar="N|N-M", help="process these frames only, counted from 0"
    )
    parser.add_argument(
        "--pfa",
        metavar="P",
        default="1e-4",
        help="probability of a false alarm in a cell of noise (default: 1e-4)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON in SI units on stdout")
    parser.add_argument(
        "--describe", action="store_true", help="print an example of a parameter file, and end"
    )


def run(arguments: argparse.Namespace) -> int:
    """Read the recording, detect in its frames, write the results and print them."""
    from polychirp.capture.parameter_file import TEMPLATE
    from polychirp.receiver.range_doppler.chain import RangeDoppler

    if arguments.describe:
        print(TEMPLATE, end="")
        return 0
    if arguments.capture is None:
        raise InputError(
            "no recording is given; name one, as in 'polychirp process walk.npy', or print an "
            "example of its parameter file with --describe"
        )
    path = Path(arguments.capture)
    _refuse_no_recording(path)
    parameters = _parameters(
        Path(arguments.params or path.with_suffix(".toml")),
        arguments.changes,
        is_raw=path.suffix == ".bin",
    )
    has_positions = bool(parameters.channel_positions or parameters.transmitter_positions)
    receiver = RangeDoppler(
        least_range=0.5 * parameters.range_resolution,
        greatest_range=parameters.greatest_range,
        # root-MUSIC needs a line; for one wave, its errors are those of the beams
        angle="bartlett" if has_positions else "root-music",
        unfolds=False,  # the phases of a recording's channels are not calibrated
        false_alarm_probability=_probability(arguments.pfa),
    )
    chosen = _frames(arguments.frames)
    recording = _open(path, parameters, chosen)
    numbers = range(recording.num_frames) if chosen is None else chosen
    folder = usable_folder(arguments.out or Path("out") / path.stem)
    folder.mkdir(parents=True, exist_ok=True)
    frames = [_process(recording, receiver, number, folder) for number in numbers]
    record = {
        "capture": str(path),
        "ground_truth": None,
        "note": _NO_TRUTH,
        "derived": _derived(parameters),
        "frames": frames,
    }
    (folder / "results.json").write_text(_as_json(record), encoding="utf-8")
    _write_detections(folder / "detections.csv", frames)
    if arguments.json:
        print(_as_json(record), end="")
    else:
        _print_derived(parameters)
        for frame in frames:
            _print_frame(frame)
        print(_NO_TRUTH)
        say(f"stored in {folder}")
    return 0


def _refuse_no_recording(path: Path) -> None:
    """Refuse what is no recording of a form that is read, before its parameters are asked for."""
    around = (path, path.parent, path / "run.zarr")
    stored = next((samples for one in around if (samples := _samples_of(one))), [])
    is_array = any((path / name).is_file() for name in _ARRAY_FILES)
    if stored and path not in stored:
        named = " or ".join(f"'{one}'" for one in stored)
        raise InputError(
            f"'{path}' is a stored run or a part of one, and no recording; name the samples of a "
            f"radar, {named}, and a file of their parameters with --params"
        )
    if path.suffix not in _FORMS and not is_array:
        raise InputError(
            f"'{path}' is no recording; its name must end in "
            f"{', '.join(_FORMS[:-1])} or {_FORMS[-1]}"
        )
    if not path.exists():
        raise InputError(f"there is no recording '{path}'; check its name and folder")


def _samples_of(run: Path) -> list[Path]:
    """Arrays of the samples of each victim in a stored run; none in any other folder."""
    return sorted(run.glob("victim-*/samples"))


def _parameters(path: Path, changes: Sequence[str], *, is_raw: bool) -> CaptureParameters:
    """Parameters of a TOML file or of a profile of TI's tools, with the changes of ``--set``.

    Only for a raw file, a profile also tells the layout of the recording.
    """
    from polychirp.capture.dca1000 import NUM_LANES
    from polychirp.capture.parameter_file import read_parameters, with_values
    from polychirp.capture.ti_files import SUFFIXES
    from polychirp.capture.ti_profile import recording_parameters
    from polychirp.capture.ti_stream import raw_parameters
    from polychirp.config.override import apply_override

    values: dict[str, Any] = {}
    for change in changes:
        apply_override(values, change)
    is_profile = path.suffix.lower() in SUFFIXES
    parameters = recording_parameters(path) if is_profile else read_parameters(path)
    changed = with_values(parameters, values, name="--set")
    if is_profile and is_raw:
        changed = with_values(raw_parameters(path, device=changed.device), values, name="--set")
        if changed.conjugate and "conjugate" not in values:
            say(
                f"note: {path.name} says that Q was sent before I, so the complex conjugate is "
                "taken; --set conjugate=false if the recording was made with other settings"
            )
    if is_profile and changed.num_transmitters > 1 and not changed.transmitter_positions:
        say(
            f"note: {path.name} does not say where the {changed.num_transmitters} transmitters "
            "are; they are taken to be on one line in the order of their chirps, a whole receiving "
            "array apart; --set transmitter_positions=[[0,0],…] places them elsewhere"
        )
        if changed.num_receivers < NUM_LANES:
            places = ",".join(f"[{NUM_LANES * n},0]" for n in range(changed.num_transmitters))
            say(
                f"note: {path.name} has {changed.num_receivers} of {NUM_LANES} receivers on; "
                f"transmitters that are {NUM_LANES} receivers apart, as on TI's evaluation boards, "
                f"need --set transmitter_positions=[{places}], and azimuths are wrong without it"
            )
    return changed


def _open(path: Path, parameters: CaptureParameters, chosen: range | None) -> Recording:
    from polychirp.capture.dca1000 import open_raw
    from polychirp.capture.recording import from_array, open_numpy
    from polychirp.capture.zarr_file import open_zarr

    match path.suffix:
        case ".bin":
            return open_raw(path, parameters, frames=chosen)
        case ".npy":
            recording = open_numpy(path, parameters, frames=chosen)
        case _:
            recording = from_array(open_zarr(path), parameters, name=path.name, frames=chosen)
    return recording


def _frames(text: str | None) -> range | None:
    """Numbers of the frames that ``--frames`` asks for; None if the option is not given."""
    if text is None:
        return None
    first, _, last = text.partition("-")
    if len(text) > _LONGEST_RANGE or not (
        first.isdecimal() and (last.isdecimal() or not last) and text[-1] != "-"
    ):
        raise InputError(
            f"--frames: '{text}' is not the number of a frame or a range of them; write it like 3 "
            "or 0-3"
        )
    frames = range(int(first), int(last or first) + 1)
    if not frames:
        raise InputError(f"--frames: '{text}' ends before it begins; write the lower one first")
    return frames


def _probability(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"--pfa: '{text}' is not a number; try 1e-4") from None
    if not 0.0 < value < 1.0:
        raise InputError(f"--pfa: {text} is not between 0 and 1; try 1e-4")
    return value


def _process(
    recording: Recording, receiver: RangeDoppler, number: int, folder: Path
) -> dict[str, Any]:
    """Detect in one frame, write its picture and its map, and return its entry of the results."""
    from polychirp.report.figures.range_rate import range_rate_picture

    frame: IfFrame = recording.frame(number)
    spectra = receiver.spectra(frame)
    map_ = spectra.mean_power
    found = receiver.detect_in(spectra, frame)
    expected = receiver.false_alarm_probability * receiver.num_cells(map_)
    drawing = range_rate_picture(
        map_,
        found,
        title=figure_text(f"{recording.name}, frame {number}"),
        note=f"{found.num_detections} detections at a false-alarm probability of "
        f"{receiver.false_alarm_probability:g} per cell; noise alone would give about "
        f"{expected:.2g}.\nNo ground truth. Echoes at rest not removed. Channels not calibrated.",
    )
    name = f"range_rate_{number:04d}"
    (folder / f"{name}.png").write_bytes(drawing.png())
    (folder / f"{name}.csv").write_text(drawing.csv(), encoding="utf-8")
    return {
        "frame": number,
        "picture": f"{name}.png",
        "map": f"{name}.csv",
        "false_alarm_probability": receiver.false_alarm_probability,
        "expected_false_alarms": expected,
        "detections": _rows(found),
    }


def _rows(found: Detections) -> list[dict[str, float | None]]:
    """Detections in SI units, strongest first; None for an angle that the array cannot measure."""
    import numpy as np

    columns = {
        "range_m": found.range,
        "range_rate_m_per_s": found.range_rate,
        "azimuth_rad": found.azimuth,
        "elevation_rad": found.elevation,
        "snr": found.snr,
        "power_full_scale": found.power,
    }
    return [
        {key: float(value) if np.isfinite(value) else None for key, value in row.items()}
        for row in (
            dict(zip(columns, values, strict=True))
            for values in zip(*columns.values(), strict=True)
        )
    ]


def _derived(parameters: CaptureParameters) -> dict[str, float]:
    return {
        "range_resolution_m": parameters.range_resolution,
        "greatest_range_m": parameters.greatest_range,
        "speed_resolution_m_per_s": parameters.speed_resolution,
        "speed_span_m_per_s": parameters.speed_span,
        "virtual_channels": parameters.num_transmitters * parameters.num_receivers,
        "frame_duration_s": parameters.num_ramps * parameters.repetition_interval,
    }


def _print_derived(parameters: CaptureParameters) -> None:
    derived = _derived(parameters)
    half = 0.5 * derived["speed_span_m_per_s"]
    print(
        f"range       cells of {derived['range_resolution_m']:.3g} m to "
        f"{derived['greatest_range_m']:.4g} m"
    )
    print(
        f"range rate  cells of {derived['speed_resolution_m_per_s']:.3g} m/s, unambiguous "
        f"within ±{half:.3g} m/s"
    )
    if parameters.num_transmitters > 1:
        print(f"{'':12}{_FASTER}")
    print(
        f"channels    {derived['virtual_channels']:.0f} "
        f"({_count(parameters.num_transmitters, 'transmitter', ' in turns')} × "
        f"{_count(parameters.num_receivers, 'receiver')})"
    )
    print(f"frame       {derived['frame_duration_s'] * 1e3:.3g} ms")


def _count(number: int, noun: str, sharing: str = "") -> str:
    """A number of antennas in words; of several, with the way in which they share the ramps.

    >>> _count(1, "transmitter", " in turns"), _count(2, "transmitter", " in turns")
    ('one transmitter', '2 transmitters in turns')
    """
    return f"one {noun}" if number == 1 else f"{number} {noun}s{sharing}"


def _print_frame(frame: dict[str, Any]) -> None:
    from math import degrees, log10

    rows = frame["detections"]
    print(
        f"\nframe {frame['frame']}: {len(rows)} detections, strongest first; noise alone would "
        f"give about {frame['expected_false_alarms']:.2g}"
    )
    has_elevation = any(row["elevation_rad"] is not None for row in rows)
    above = "   elevation" if has_elevation else ""
    print(f"  range    range rate   azimuth{above}      SNR      power")

    def shown(angle: float | None, width: int) -> str:
        return "–".rjust(width) if angle is None else f"{degrees(angle):+{width - 1}.1f}°"

    for row in rows:
        elevation = f"   {shown(row['elevation_rad'], 9)}" if has_elevation else ""
        rate = round(row["range_rate_m_per_s"], 2) + 0.0  # 0.00, not −0.00
        print(
            f"{row['range_m']:6.2f} m  {rate:+7.2f} m/s   {shown(row['azimuth_rad'], 7)}{elevation}"
            f"  {10 * log10(row['snr']):4.0f} dB  {10 * log10(row['power_full_scale']):5.0f} dBFS"
        )
    print()


def _write_detections(path: Path, frames: list[dict[str, Any]]) -> None:
    import csv

    keys = [
        "range_m",
        "range_rate_m_per_s",
        "azimuth_rad",
        "elevation_rad",
        "snr",
        "power_full_scale",
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["frame", *keys], lineterminator="\n")
        writer.writeheader()
        for frame in frames:
            writer.writerows({"frame": frame["frame"], **row} for row in frame["detections"])


def _as_json(record: dict[str, Any]) -> str:
    return json.dumps(record, indent=2, allow_nan=False) + "\n"
