"""Section V of the paper: its correlation experiment as printed, and what tests slope diversity."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from polychirp.correlation.alignment import aligned
from polychirp.correlation.base import Correlation, correlate
from polychirp.correlation.lobes import Lobes, lobes
from polychirp.correlation.theory import expected
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband, Progress, no_progress
from polychirp.model.ramp import RampSchedule
from polychirp.model.transceiver import Link, Transceiver
from polychirp.radio.base import measured
from polychirp.radio.loopback import LoopbackRadio
from polychirp.rng import Streams
from polychirp.synthesis.sdr.transceiver import arriving_power, transceived
from polychirp.units import from_db
from polychirp.waveform import AnyWaveform, DiverseTriangular, Sawtooth, Triangular
from polychirp.waveform.playing import played

RAMP: Final = 100e-6
"""s, of a ramp: the paper does not say; the law for crossing ramps scales any other."""

SNRS: Final = (from_db(30.0), from_db(10.0), from_db(0.0))
"""Ratios, of powers at the receiver's converter, before any processing gain."""

NUM_SEEDS: Final = 12
"""Draws of noise and phase noise behind every interval."""

OVERSAMPLING: Final = 8
"""Lags per sample; peaks between them are found by a parabola, side lobes to 0.1 dB."""

LINK_DELAY: Final = 25e-9
"""s, of five metres of cable."""

RECORDER_SCALE: Final = 1e-4
"""V at the receiver's input that fills a recording's 16 bits, well above what arrives."""

Kind = Literal["auto", "cross"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CorrelationCase:
    """One pair of waveforms: what is transmitted, and what it is correlated with.

    Parameters
    ----------
    name : of the case
    kind : whether both are the same
    sent, reference : waveforms
    carrier : Hz, of what is sent
    tuned : Hz, of the receiver and the reference
    paper : what the paper prints of it, empty where it is ours
    says : what the case shows, one sentence
    num_sweeps : of both
    """

    name: str
    kind: Kind
    sent: AnyWaveform
    reference: AnyWaveform
    carrier: float
    tuned: float
    paper: str = ""
    says: str = ""
    num_sweeps: int = 1


def ramp(carrier: float, bandwidth: float, duration: float = RAMP) -> Sawtooth:
    """One rising ramp about a carrier."""
    return Sawtooth(
        start_frequency=carrier - 0.5 * bandwidth, bandwidth=bandwidth, ramp_duration=duration
    )


def correlation_cases() -> Iterator[CorrelationCase]:
    """The paper's two cases, in every reading of the second, and those that are ours."""
    own = ramp(4e9, 100e6)
    yield CorrelationCase(
        name="auto",
        kind="auto",
        sent=own,
        reference=own,
        carrier=4e9,
        tuned=4e9,
        paper="a sharp peak (fig. 6)",
        says="100 MHz at 4 GHz with itself",
    )
    yield CorrelationCase(
        name="cross, receiver stays",
        kind="cross",
        sent=ramp(3.75e9, 120e6),
        reference=own,
        carrier=3.75e9,
        tuned=4e9,
        paper="low (fig. 7)",
        says="120 MHz at 3.75 GHz against 100 MHz at 4 GHz: bands 140 MHz apart",
    )
    yield CorrelationCase(
        name="cross, receiver follows",
        kind="cross",
        sent=ramp(3.75e9, 120e6),
        reference=replace(own, start_frequency=3.7e9),
        carrier=3.75e9,
        tuned=3.75e9,
        paper="low (fig. 7)",
        says="the same, both at baseband: the receiver is tuned to what is sent",
    )
    yield from _ours(own)


def _ours(own: Sawtooth) -> Iterator[CorrelationCase]:
    def cross(name: str, sent: AnyWaveform, says: str, **more: object) -> CorrelationCase:
        fields: dict[str, object] = {"reference": own, "carrier": 4e9, "tuned": 4e9, **more}
        return CorrelationCase(
            name=name,
            kind="cross",
            sent=sent,
            says=says,
            **fields,  # type: ignore[arg-type]
        )

    yield cross("10 MHz less", ramp(4e9, 90e6), "overlapping bands, slopes 10 % apart")
    yield cross("1 MHz less", ramp(4e9, 99e6), "overlapping bands, slopes 1 % apart")
    yield cross("ramp of 120 µs", ramp(4e9, 100e6, 120e-6), "same band, time diversity alone")
    yield cross("falling", replace(own, direction="down"), "same band and time, the opposite slope")
    yield cross(
        "triangle",
        Triangular(start_frequency=3.94e9, bandwidth=120e6, ramp_duration=RAMP / 2),
        "two triangles of 100 µs, 120 against 100 MHz",
        reference=Triangular(start_frequency=3.95e9, bandwidth=100e6, ramp_duration=RAMP / 2),
    )
    drawn = DiverseTriangular(
        start_frequency=3.95e9, bandwidth=(80e6, 100e6), ramp_duration=(50e-6, 100e-6)
    )
    yield cross(
        "diverse",
        drawn,
        "the proposal: four triangles, time and bandwidth drawn for each by both radars",
        reference=drawn,
        num_sweeps=4,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """A case as ramps and samples."""

    case: CorrelationCase
    sent_plan: RampSchedule
    reference_plan: RampSchedule
    sent: Baseband
    reference: Baseband


def prepared(case: CorrelationCase, radio: Transceiver, *, seed: int) -> Prepared:
    """Both plans and their samples at the radio's rate, each about its own carrier."""
    streams = Streams(seed).of("correlation")
    same = case.kind == "auto"
    plans = [
        waveform.schedule(num_sweeps=case.num_sweeps, streams=streams.of(role))
        for waveform, role in (
            (case.sent, "reference" if same else "sent"),
            (case.reference, "reference"),
        )
    ]
    samples = [
        played(plan, sample_rate=radio.sample_rate, centre_frequency=carrier)
        for plan, carrier in zip(plans, (case.carrier, case.tuned), strict=True)
    ]
    return Prepared(
        case=case,
        sent_plan=plans[0],
        reference_plan=plans[1],
        sent=samples[0],
        reference=samples[1],
    )


# ── one measurement ───────────────────────────────────────────────────────────


def ideal(case: Prepared) -> Correlation:
    """Correlation in closed form, at radio frequency, on the lags of a sampled one."""
    step = 1.0 / (OVERSAMPLING * case.reference.sample_rate)
    before = int(case.reference.duration / step)
    behind = int(case.sent.duration / step)
    return expected(
        case.sent_plan, case.reference_plan, np.asarray(np.arange(-before, behind + 1) * step)
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bench:
    """Two equal transceivers and the cable between them, for one case at one SNR.

    Parameters
    ----------
    case : what is played
    radio : at both ends
    link : between them
    energy : J, of the signal alone at a receiver that is tuned to it
    """

    case: Prepared
    radio: Transceiver
    link: Link
    energy: float

    def record(self, signal: Baseband, streams: Streams, *, delay: float = 0.0) -> Baseband:
        """What the receiver makes of ``signal``."""
        return transceived(
            signal,
            transmitter=self.radio,
            receiver=self.radio,
            link=replace(self.link, delay=delay),
            receive_frequency=self.case.case.tuned,
            streams=streams,
        )

    def correlation(self, record: Baseband) -> Correlation:
        """Of a record, as long as what was sent, with the reference."""
        tuned = replace(record, centre_frequency=self.case.reference.centre_frequency)
        return correlate(tuned, self.case.reference, oversampling=OVERSAMPLING)

    def on_scale(self, found: Correlation, record: Baseband) -> Correlation:
        """A record's correlation on the scale of `level`."""
        factor = math.sqrt(record.energy / self.energy)
        return replace(found, amplitude=factor * found.amplitude)

    def level(self, found: Lobes, record: Baseband) -> float:
        """Power of a peak on the scale of the signal's own energy, noise left out, a ratio.

        1 for like signals at any SNR; normalised by its own energy, a record of noise alone has
        peaks as high as crossing ramps.
        """
        return found.peak**2 * record.energy / self.energy


def benches_for(case: Prepared, radio: Transceiver, *, snrs: Sequence[float]) -> list[Bench]:
    """A bench for each ratio of the arriving signal's power to the noise's, at the converter."""
    full = arriving_power(case.sent, transmitter=radio, receiver=radio)
    return [
        Bench(
            case=case,
            radio=radio,
            link=Link(attenuation=full / (snr * radio.noise_power)),
            energy=snr * radio.noise_power * case.sent.duration,
        )
        for snr in snrs
    ]


def modelled(bench: Bench, streams: Streams) -> Baseband:
    """What the receiver records while the signal lasts: silence has energy too."""
    record = bench.record(bench.case.sent, streams)
    first = round(-record.start_time * record.sample_rate)
    samples = record.samples[first : first + bench.case.sent.num_samples]
    return replace(record, samples=samples, start_time=0.0)


def looped(bench: Bench, streams: Streams, *, stored: Callable[[Baseband], Baseband]) -> Baseband:
    """The same as a lab does it: play in a loop, record from anywhere, store, find.

    Parameters
    ----------
    stored : writes a recording and reads it again
    """
    case = bench.case
    loop = LoopbackRadio(
        channel=lambda signal: bench.record(signal, streams, delay=LINK_DELAY),
        full_scale=RECORDER_SCALE,
        seed=streams.seed,
    )
    record = stored(measured(loop, case.sent, repetitions=1))
    record = replace(record, samples=RECORDER_SCALE * record.samples)
    if case.case.carrier == case.case.tuned:
        return aligned(record, case.sent).signal
    return _first(record, case.sent)


def _first(record: Baseband, signal: Baseband) -> Baseband:
    """As many samples as the signal has, from anywhere: it is not in the record."""
    return replace(record, samples=record.samples[: signal.num_samples], start_time=0.0)


# ── all of them ───────────────────────────────────────────────────────────────


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """Mean of several draws, and the half width of its 95 % interval (Student's t)."""

    mean: float
    half_width: float

    @classmethod
    def of(cls, values: list[float]) -> Interval:
        """From independent draws.

        >>> Interval.of([1.0, 2.0, 3.0]).mean
        2.0
        """
        from scipy.stats import t

        spread = float(np.std(values, ddof=1)) if len(values) > 1 else math.nan
        count = len(values)
        quantile = float(t.ppf(0.975, count - 1)) if count > 1 else math.nan
        return cls(mean=float(np.mean(values)), half_width=quantile * spread / math.sqrt(count))


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelledLobes:
    """What the model gives at one SNR; ratios of powers in dB.

    Parameters
    ----------
    snr_db : at the converter
    level_db : of the peak, on the scale of the signal's own energy, see `Bench.level`
    peak_db, peak_side_lobe_db, integrated_side_lobe_db : as `Lobes`
    width_ns : as `Lobes`
    """

    snr_db: float
    level_db: Interval
    peak_db: Interval
    width_ns: Interval
    peak_side_lobe_db: Interval
    integrated_side_lobe_db: Interval


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CorrelationRow:
    """A case with its results.

    Parameters
    ----------
    case : what was done
    ideal : lobes of the closed form
    modelled : for every SNR
    looped : lobes of the loop-back measurement, at the first SNR
    looped_level_db : as `ModelledLobes.level_db`
    curves : over lag, for figures: the closed form, the model and the loop at the first SNR,
        on the scale of `Bench.level`
    """

    case: CorrelationCase
    ideal: Lobes
    modelled: tuple[ModelledLobes, ...]
    looped: Lobes
    looped_level_db: float
    curves: tuple[Correlation, Correlation, Correlation]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CorrelationResults:
    """All cases of section V.

    Parameters
    ----------
    seed : of all random draws
    num_seeds : draws behind every interval
    radio : the transceiver, both ends alike
    rows : one for every case
    notes : what must be said with the table
    """

    seed: int
    num_seeds: int
    radio: Transceiver
    rows: tuple[CorrelationRow, ...]
    notes: tuple[str, ...]

    def row(self, name: str) -> CorrelationRow:
        """The case with a name; raises `InputError` where there is none."""
        for row in self.rows:
            if row.case.name == name:
                return row
        raise InputError(f"there is no case '{name}'")


NOTES: Final = (
    "As printed, the second case correlates bands that share no frequency: a receiver at 4 GHz "
    "records its own noise. What is low there is low by frequency division; it would be as low for "
    "equal slopes.",
    "Where bands overlap, crossing ramps of equal time have a peak of −10 log₁₀(|ΔB| T) + 1.4 dB: "
    "slope diversity, and it needs |ΔB| T.",
    "The paper prints no number and no ramp time; ramps here last 100 µs.",
    "Peaks through the model are on the scale of the arriving signal's own energy; normalised by "
    "the record's, noise included, like signals have √(SNR/(1 + SNR)), and noise alone −31 dB.",
    "Holding samples rounds the band off, which widens the peak and lowers its side lobes. The "
    "image of a falling ramp is a rising one: what opposite slopes are worth on a real radio is "
    "its image rejection.",
)


def run_correlation(
    *,
    seed: int = 1,
    num_seeds: int = NUM_SEEDS,
    radio: Transceiver | None = None,
    progress: Progress = no_progress,
) -> CorrelationResults:
    """Every case: closed form, model at every SNR with intervals, and loop-back through SigMF.

    Parameters
    ----------
    radio : both ends; the paper's set-up if absent

    Raises
    ------
    InputError
        Fewer than two draws.
    """
    if num_seeds < 2:
        raise InputError("an interval needs two draws or more")
    radio = radio or Transceiver()
    cases = list(correlation_cases())
    rows = []
    for n, case in enumerate(cases):
        progress("correlations", n, len(cases))
        rows.append(_row(prepared(case, radio, seed=seed), radio, seed, num_seeds))
    progress("correlations", len(cases), len(cases))
    return CorrelationResults(
        seed=seed, num_seeds=num_seeds, radio=radio, rows=tuple(rows), notes=NOTES
    )


def _row(case: Prepared, radio: Transceiver, seed: int, num_seeds: int) -> CorrelationRow:
    streams = [Streams(seed).of("correlation", case.case.name, n) for n in range(num_seeds)]
    benches = benches_for(case, radio, snrs=SNRS)
    first = benches[0]
    closed = ideal(case)
    model, loop = modelled(first, streams[0]), looped(first, streams[0], stored=through_sigmf)
    found = lobes(first.correlation(loop))
    shown = [first.on_scale(first.correlation(one), one) for one in (model, loop)]
    return CorrelationRow(
        case=case.case,
        ideal=lobes(closed),
        modelled=tuple(
            _at_snr(bench, snr, streams) for bench, snr in zip(benches, SNRS, strict=True)
        ),
        looped=found,
        looped_level_db=_level(first.level(found, loop)),
        curves=(closed, shown[0], shown[1]),
    )


def _level(ratio: float) -> float:
    return 10.0 * math.log10(ratio)


def _at_snr(bench: Bench, snr: float, streams: list[Streams]) -> ModelledLobes:
    records = [modelled(bench, one) for one in streams]
    found = [lobes(bench.correlation(record)) for record in records]
    levels = [bench.level(one, record) for one, record in zip(found, records, strict=True)]
    return ModelledLobes(
        snr_db=_level(snr),
        level_db=Interval.of([_level(value) for value in levels]),
        peak_db=Interval.of([_level(one.peak**2) for one in found]),
        width_ns=Interval.of([one.width * 1e9 for one in found]),
        peak_side_lobe_db=Interval.of([_level(one.peak_side_lobe) for one in found]),
        integrated_side_lobe_db=Interval.of([_level(one.integrated_side_lobe) for one in found]),
    )


def through_sigmf(record: Baseband) -> Baseband:
    """A recording as it comes back from 16-bit SigMF files."""
    from pathlib import Path
    from tempfile import TemporaryDirectory

    from polychirp.capture.sigmf import check_sha512, open_sigmf, write_sigmf

    with TemporaryDirectory() as folder:
        found = open_sigmf(write_sigmf(Path(folder) / "loop", record, datatype="ci16_le"))
        check_sha512(found)
        return found.signal()
