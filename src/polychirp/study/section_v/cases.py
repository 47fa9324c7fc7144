"""Correlation experiment of section V: the paper's cases, and our own ones of slope diversity."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, Self

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

RAMP_DURATION: Final = 100e-6
"""Duration of a ramp, s; chosen, since the paper states none. At given bandwidths, the power of the
correlation's peak for crossing ramps is inversely proportional to it."""

SNRS: Final = (from_db(30.0), from_db(10.0), from_db(0.0))
"""Ratios of signal to noise power at the receiver's converter, without processing gain; chosen."""

NUM_SEEDS: Final = 12
"""Number of draws of noise and phase noise for every confidence interval; chosen."""

OVERSAMPLING: Final = 8
"""Lags of a correlation per sample; chosen: a parabola finds peaks between the lags, and the power
of side lobes is right to 0.1 dB."""

LINK_DELAY: Final = 25e-9
"""Delay of the cable in the loop-back measurement, s; chosen: five metres at 2·10⁸ m/s."""

RECORDER_SCALE: Final = 1e-4
"""Greatest I or Q in a 16-bit recording, V into 1 Ω at the receiver's input; chosen: 5 dB above the
signal at the first of `SNRS`."""

Kind = Literal["auto", "cross"]
"""Kind of a correlation: of a signal with itself, or with another one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CorrelationCase:
    """One pair of waveforms: the transmitted one, and the reference for the correlation.

    Parameters
    ----------
    name : name of the case
    kind : "auto" if both waveforms are the same
    sent, reference : the transmitted waveform and the reference
    carrier : Hz, carrier of the transmitted signal
    tuned : Hz, carrier of the receiver and of the reference
    paper : the paper's result in words; empty for our own cases
    says : description of the case
    num_sweeps : number of sweeps of each waveform
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


def ramp(carrier: float, bandwidth: float, duration: float = RAMP_DURATION) -> Sawtooth:
    """Waveform of rising ramps of ``bandwidth`` Hz about ``carrier`` Hz, of ``duration`` s each."""
    return Sawtooth(
        start_frequency=carrier - 0.5 * bandwidth, bandwidth=bandwidth, ramp_duration=duration
    )


def correlation_cases() -> Iterator[CorrelationCase]:
    """The paper's two cases, the second with the receiver's carrier left and moved, and our own."""
    own = ramp(4e9, 100e6)
    yield CorrelationCase(
        name="auto",
        kind="auto",
        sent=own,
        reference=own,
        carrier=4e9,
        tuned=4e9,
        paper="a sharp peak (fig. 6)",
        says="100 MHz at 4 GHz, correlated with itself",
    )
    yield CorrelationCase(
        name="cross, receiver stays",
        kind="cross",
        sent=ramp(3.75e9, 120e6),
        reference=own,
        carrier=3.75e9,
        tuned=4e9,
        paper="low (fig. 7)",
        says="120 MHz at 3.75 GHz with 100 MHz at 4 GHz: the bands are 140 MHz apart",
    )
    yield CorrelationCase(
        name="cross, receiver follows",
        kind="cross",
        sent=ramp(3.75e9, 120e6),
        reference=replace(own, start_frequency=3.7e9),
        carrier=3.75e9,
        tuned=3.75e9,
        paper="low (fig. 7)",
        says="the same ramps, but the receiver and the reference are tuned to 3.75 GHz",
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

    yield cross("10 MHz less", ramp(4e9, 90e6), "overlapping bands, slopes that differ by 10 %")
    yield cross("1 MHz less", ramp(4e9, 99e6), "overlapping bands, slopes that differ by 1 %")
    yield cross("ramp of 120 µs", ramp(4e9, 100e6, 120e-6), "same band, ramps of 120 and 100 µs")
    yield cross(
        "falling", replace(own, direction="down"), "same band and duration, opposite slopes"
    )
    half = RAMP_DURATION / 2
    yield cross(
        "triangle",
        Triangular(start_frequency=3.94e9, bandwidth=120e6, ramp_duration=half),
        "two triangles of 100 µs, one of 120 MHz and one of 100 MHz",
        reference=Triangular(start_frequency=3.95e9, bandwidth=100e6, ramp_duration=half),
    )
    diverse = DiverseTriangular(
        start_frequency=3.95e9, bandwidth=(80e6, 100e6), ramp_duration=(50e-6, 100e-6)
    )
    yield cross(
        "diverse",
        diverse,
        "the proposal: four triangles; both radars draw duration and bandwidth of each",
        reference=diverse,
        num_sweeps=4,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """A case with the schedules and the samples of its two signals."""

    case: CorrelationCase
    sent_schedule: RampSchedule
    reference_schedule: RampSchedule
    sent: Baseband
    reference: Baseband


def prepared(case: CorrelationCase, radio: Transceiver, *, seed: int) -> Prepared:
    """A case with samples at the radio's rate, each signal about its own carrier."""
    streams = Streams(seed).of("correlation")
    same = case.kind == "auto"
    schedules = [
        waveform.schedule(num_sweeps=case.num_sweeps, streams=streams.of(role))
        for waveform, role in (
            (case.sent, "reference" if same else "sent"),
            (case.reference, "reference"),
        )
    ]
    samples = [
        played(schedule, sample_rate=radio.sample_rate, centre_frequency=carrier)
        for schedule, carrier in zip(schedules, (case.carrier, case.tuned), strict=True)
    ]
    return Prepared(
        case=case,
        sent_schedule=schedules[0],
        reference_schedule=schedules[1],
        sent=samples[0],
        reference=samples[1],
    )


def ideal(case: Prepared) -> Correlation:
    """Correlation in closed form at radio frequency, in the lag steps of `Bench.correlation`."""
    step = 1.0 / (OVERSAMPLING * case.reference.sample_rate)
    before = int(case.reference.duration / step)
    behind = int(case.sent.duration / step)
    lag = np.asarray(np.arange(-before, behind + 1) * step)
    return expected(case.sent_schedule, case.reference_schedule, lag)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bench:
    """Two equal transceivers and the cable between them, for one case at one SNR.

    Parameters
    ----------
    case : the case with its signals
    radio : transceiver at both ends of the cable
    link : the cable
    energy : J, energy of the signal without noise, at the converter of a receiver tuned to it
    """

    case: Prepared
    radio: Transceiver
    link: Link
    energy: float

    def record(self, signal: Baseband, streams: Streams, *, delay: float = 0.0) -> Baseband:
        """Recording of ``signal`` by the receiver; ``delay`` is that of the cable, s."""
        return transceived(
            signal,
            transmitter=self.radio,
            receiver=self.radio,
            link=replace(self.link, delay=delay),
            receive_frequency=self.case.case.tuned,
            streams=streams,
        )

    def correlation(self, record: Baseband) -> Correlation:
        """Correlation with the reference of a record that is as long as the transmitted signal."""
        tuned = replace(record, centre_frequency=self.case.reference.centre_frequency)
        return correlate(tuned, self.case.reference, oversampling=OVERSAMPLING)

    def on_scale(self, found: Correlation, record: Baseband) -> Correlation:
        """The correlation ``found`` of a record, scaled so that its power is that of `level`."""
        factor = math.sqrt(record.energy / self.energy)
        return replace(found, amplitude=factor * found.amplitude)

    def level(self, found: Lobes, record: Baseband) -> float:
        """Power ratio of a record's correlation peak to the energy of the signal without noise.

        It is 1 for equal signals at any SNR. Relative to the record's own energy, the peaks of a
        record of noise alone would be as high as those of crossing ramps.
        """
        return found.peak**2 * record.energy / self.energy


def benches_for(case: Prepared, radio: Transceiver, *, snrs: Sequence[float]) -> list[Bench]:
    """A bench for each SNR, the power ratio of arriving signal to noise at the converter."""
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
    """Recording, cut to the duration of the signal, since noise before and after it adds energy."""
    record = bench.record(bench.case.sent, streams)
    first = round(-record.start_time * record.sample_rate)
    samples = record.samples[first : first + bench.case.sent.num_samples]
    return replace(record, samples=samples, start_time=0.0)


def looped(bench: Bench, streams: Streams, *, stored: Callable[[Baseband], Baseband]) -> Baseband:
    """Recording as in a laboratory: played in a loop, begun at a random time, stored and aligned.

    ``stored`` writes a recording and reads it again.
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
    # on another carrier nothing can be aligned: the first samples, as many as the signal has
    return replace(record, samples=record.samples[: case.sent.num_samples], start_time=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """Mean of several draws, and half width of its 95 % confidence interval (Student's t)."""

    mean: float
    half_width: float

    @classmethod
    def of(cls, values: list[float]) -> Self:
        """Interval of the mean of independent draws.

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
    """Results of the model at one SNR, over all draws; ratios of powers in dB.

    Parameters
    ----------
    snr_db : SNR at the converter
    level_db : `Bench.level` of the peak
    peak_db, width_ns, peak_side_lobe_db, integrated_side_lobe_db : as in `Lobes`
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
    case : the case
    ideal : lobes of the correlation in closed form
    modelled : lobes of the model, at every SNR
    looped : lobes of the loop-back measurement, at the first SNR
    looped_level_db : `Bench.level` of the loop-back measurement's peak
    curves : correlation over lag, for figures: in closed form; by the model and by loop-back at the
        first SNR, both on the scale of `Bench.level`
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
    seed : seed of all random draws
    num_seeds : number of draws of noise and phase noise for every interval
    radio : transceiver at both ends of the cable
    rows : results of every case
    notes : remarks without which the table may be misunderstood
    """

    seed: int
    num_seeds: int
    radio: Transceiver
    rows: tuple[CorrelationRow, ...]
    notes: tuple[str, ...]

    def row(self, name: str) -> CorrelationRow:
        """Row of the case with this name; raises `InputError` if there is none."""
        for row in self.rows:
            if row.case.name == name:
                return row
        raise InputError(f"there is no case '{name}'")


NOTES: Final = (
    "As the paper prints it, the second case correlates two bands that share no frequency: a "
    "receiver at 4 GHz records only its own noise. The correlation is low because the frequencies "
    "differ; it would be as low with equal slopes.",
    "Ramps that share a band and have equal durations T, but bandwidths that differ by ΔB, have a "
    "peak of −10 log₁₀(|ΔB| T) + 1.4 dB. This is the effect of slope diversity; it grows with "
    "|ΔB| T.",
    "The paper states neither the peaks nor the duration of a ramp; ramps here last 100 µs.",
    "Peaks through the model are relative to the energy of the arriving signal without noise. "
    "Relative to the energy of the recording, which includes noise, equal signals would have a "
    "peak of √(SNR/(1 + SNR)), and noise alone one of −31 dB.",
    "The converters hold their samples, which attenuates the edges of the band; the peak becomes "
    "wider and its side lobes lower. The I/Q imbalance of the mixers adds an image, and the image "
    "of a falling ramp is a rising one; on a real radio, image rejection therefore limits the "
    "benefit of opposite slopes.",
)


def run_correlation(
    *,
    seed: int = 1,
    num_seeds: int = NUM_SEEDS,
    radio: Transceiver | None = None,
    progress: Progress = no_progress,
) -> CorrelationResults:
    """Every case in closed form, by the model at every SNR, and by loop-back through SigMF files.

    Parameters
    ----------
    num_seeds : number of draws of noise and phase noise
    radio : transceiver at both ends of the cable; None: `Transceiver` with its defaults

    Raises
    ------
    InputError
        ``num_seeds`` is less than two.
    """
    if num_seeds < 2:
        raise InputError(f"the number of draws is {num_seeds}; an interval needs 2 or more")
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
    """The recording after it was written to 16-bit SigMF files and read again."""
    from pathlib import Path
    from tempfile import TemporaryDirectory

    from polychirp.capture.sigmf import check_sha512, open_sigmf, write_sigmf

    with TemporaryDirectory() as folder:
        found = open_sigmf(write_sigmf(Path(folder) / "loop", record, datatype="ci16_le"))
        check_sha512(found)
        return found.signal()
