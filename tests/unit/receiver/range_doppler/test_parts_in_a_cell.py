"""Parts of the samples in a cell of the range-Doppler map, and the ratios of a target there.

The map itself is the twin: each part alone is transformed as the receiver transforms the frame.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.signal import freqz, lfilter

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import PARTS, IfParts
from polychirp.model.truth import Truth
from polychirp.receiver.attribution import detected, target_levels
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mitigation import Nulling
from polychirp.receiver.mitigation.base import mitigated, with_weights
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.rng import Streams
from polychirp.units import to_db
from polychirp.waveform import Sawtooth, Triangular
from tests.support.points import HandPoint, frame_of

CHIRPS = Sawtooth(start_frequency=77e9, bandwidth=300e6, ramp_duration=200e-6)
RECEIVER = RangeDoppler(greatest_range=60.0)


@dataclass(frozen=True)
class _TakesRampsOut:
    """A mitigation that leaves out every other ramp."""

    def mitigate(self, frame):
        weight = frame.times.is_sample.astype(np.float64)
        weight[::2] = 0.0
        return with_weights(frame, weight)


@dataclass(frozen=True)
class _LeavesTheMiddle:
    """A mitigation that leaves a share of the samples of every other ramp, in its middle."""

    share: float

    def mitigate(self, frame):
        return with_weights(frame, self.weight(frame))

    def weight(self, frame):
        weight = frame.times.is_sample.astype(np.float64)
        out = round(0.5 * (1.0 - self.share) * weight.shape[1])
        weight[::2, :out] = 0.0
        weight[::2, -out:] = 0.0
        return weight


@dataclass(frozen=True, kw_only=True)
class _NullsKnownSamples(Nulling):
    """Nulling that knows which samples are hit: the second half of each ramp."""

    def hit(self, frame):
        hit = frame.times.is_sample.copy()
        hit[:, : hit.shape[1] // 2] = False
        return hit


def schedule_of(num_sweeps=128):
    return CHIRPS.schedule(num_sweeps=num_sweeps, streams=Streams(seed=1))


def frame_with(schedule, *, echo, direct=(), seed=3):
    """A frame of an echo, of a direct signal and of noise, and its parts."""
    several = [
        frame_of(schedule, points, noise=0.0, seed=n).samples
        for n, points in enumerate((list(echo), list(direct)))
    ]
    noise = frame_of(schedule, [], seed=seed)
    samples = np.stack([*several, noise.samples])
    parts = IfParts(samples=samples, names=("echo", "direct", "noise"))
    return noise.with_samples(samples.sum(axis=0)), parts


def truth_at(frame, *, range, range_rate, azimuth=0.0):
    middle = 0.5 * (frame.schedule.start_time[0] + frame.schedule.end_time[-1])
    away = range + range_rate * (middle - frame.schedule.start_time[0])
    return Truth(
        time=float(middle),
        name=("car",),
        range=[away],
        range_rate=[range_rate],
        azimuth=[azimuth],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
    )


def rate_cell(schedule):
    interval = np.diff(schedule.start_time)[0]
    return SPEED_OF_LIGHT / (2 * 77.15e9 * interval * schedule.num_ramps)


@pytest.mark.parametrize("cells_off", [6.5, 11.5, 23.5, -17.5])
def test_a_stronger_signal_some_cells_of_range_rate_away_is_no_cause(cells_off):
    """The receiver's taper has it 51 dB down there, a plain mean over the ramps some 27 dB."""
    schedule = schedule_of()
    aside = cells_off * rate_cell(schedule)
    frame, parts = frame_with(
        schedule,
        echo=[HandPoint(range=20.0, range_rate=1.0, power=0.1)],
        direct=[HandPoint(range=20.0, range_rate=1.0 + aside, power=300.0)],
    )
    found, powers = detected(RECEIVER, frame, parts)
    n = np.argmin(np.abs(found.range_rate - 1.0) + np.abs(found.range - 20.0))
    assert found.range_rate[n] == pytest.approx(1.0, abs=0.1)
    assert PARTS[np.argmax(powers[n])] == "echo"


@pytest.mark.parametrize("cells_off", [1.0, 2.5, 6.5, 14.2])
def test_the_power_of_a_part_is_that_of_its_own_map(cells_off):
    """At a cell's middle, so that both are of the same place."""
    schedule = schedule_of()
    cell, blank = rate_cell(schedule), frame_of(schedule, [], noise=1e-6)
    rate = 8 * cell
    frame, parts = frame_with(
        schedule,
        echo=[HandPoint(range=20.0, range_rate=rate, power=1.0)],
        direct=[HandPoint(range=20.0, range_rate=rate + cells_off * cell, power=1.0)],
    )
    found, powers = detected(RECEIVER, frame, parts)
    n = np.argmin(np.abs(found.range_rate - rate) + np.abs(found.range - 20.0))
    alone = RECEIVER.spectra(blank.with_samples(parts["direct"]))
    row = np.argmin(np.abs(alone.range_rate - found.range_rate[n]))
    column = np.argmin(np.abs(alone.range - found.range[n]))
    near = (slice(None), slice(row - 1, row + 2), slice(column - 1, column + 2))
    of_map = np.sum(np.abs(alone.amplitude[near]) ** 2, axis=0)
    power = powers[n, PARTS.index("direct")]
    assert 0.3 * of_map.min() < power < 2.0 * of_map.max()


def test_interference_beside_a_targets_range_rate_is_no_interference_in_its_cell():
    """As strong as the target, 10.5 cells away: −51 dB of its power at most, below the noise."""
    schedule = schedule_of()
    frame, parts = frame_with(
        schedule,
        echo=[HandPoint(range=20.0, range_rate=1.0, power=0.1)],
        direct=[HandPoint(range=20.0, range_rate=1.0 + 10.5 * rate_cell(schedule), power=0.1)],
    )
    levels = target_levels(RECEIVER, frame, parts, truth_at(frame, range=20.0, range_rate=1.0))
    assert to_db(levels.snr[0]) == pytest.approx(35.7, abs=0.6)
    assert levels.inr[0] < 0.3


def test_the_ratio_to_noise_is_that_of_the_map():
    """With both tapers: the sum of the weights squared over the sum of their squares."""
    schedule = schedule_of()
    echo = HandPoint(range=20.0, range_rate=1.0, power=0.01)
    frame, parts = frame_with(schedule, echo=[echo])
    levels = target_levels(RECEIVER, frame, parts, truth_at(frame, range=20.0, range_rate=1.0))
    fast, slow = taper(frame.times.most_samples), taper(schedule.num_ramps)
    expected = 4 * 0.01 / (np.sum(fast**2) * np.sum(slow**2))
    assert to_db(levels.snr[0]) == pytest.approx(to_db(expected), abs=0.3)
    # the map has the power of each of four channels over the noise of one
    found = RECEIVER.detect(frame)
    assert to_db(levels.snr[0]) == pytest.approx(to_db(4 * found.snr[0]), abs=1.5)


@pytest.mark.parametrize("place", [2.0, 4.0, 20.0])
def test_noise_that_a_high_pass_shapes_is_that_of_the_cell(place):
    """A corner of 50 kHz: at 2 m, four cells from 0 Hz, the noise is 8 dB below that of 20 m."""
    schedule = schedule_of()
    echo = HandPoint(range=place, range_rate=1.0, power=0.1)
    frame, parts = frame_with(schedule, echo=[echo])
    shape = np.exp(-2 * np.pi * 50e3 / frame.times.rate)
    noise = lfilter([1.0, -1.0], [1.0, -shape], frame_of(schedule, [], seed=3).samples)
    parts = IfParts(
        samples=np.stack([parts["echo"], parts["direct"], noise]),
        names=("echo", "direct", "noise"),
    )
    true = truth_at(frame, range=place, range_rate=1.0)
    levels = target_levels(RECEIVER, frame.with_samples(parts.total()), parts, true)
    fast, slow = taper(frame.times.most_samples), taper(schedule.num_ramps)
    turn, response = freqz([1.0, -1.0], [1.0, -shape], 4096, whole=True)
    beat = 2 * np.pi * 2 * (1.5e12 * place + 77.15e9) / SPEED_OF_LIGHT / frame.times.rate
    seen = np.exp(1j * np.outer(turn - beat, np.arange(fast.size))) @ fast
    density = np.mean(np.abs(response * seen) ** 2)
    expected = 4 * 0.1 / (density * np.sum(slow**2))
    # to half a bin, which is 0.6 dB at 2 m
    assert to_db(levels.snr[0]) == pytest.approx(to_db(expected), abs=0.8)


@pytest.mark.parametrize("num_sweeps", [1, 2])
@pytest.mark.parametrize("seed", range(8))
def test_the_ratio_to_noise_is_no_draw_of_the_noise(seed, num_sweeps):
    """A few ramps are enough: their noise is averaged over cells about the target's."""
    schedule = Triangular().schedule(num_sweeps=num_sweeps, streams=Streams(seed=1))
    echo = HandPoint(range=9.0, power=1.0)
    frame, parts = frame_with(schedule, echo=[echo], seed=100 + seed)
    receiver = CoherentReceiver(greatest_range=12.0)
    levels = target_levels(receiver, frame, parts, truth_at(frame, range=9.0, range_rate=0.0))
    count = int(frame.times.is_sample.sum())
    hann = 2.0 / 3.0  # (Σw)²/(N Σw²) of Hann's window
    assert to_db(levels.snr[0]) == pytest.approx(to_db(4 * count * hann), abs=0.9)


def test_ramps_that_are_taken_out_have_neither_echo_nor_noise():
    """Half of the ramps are hit for all of their length: half of the SNR is left."""
    schedule = Triangular().schedule(num_sweeps=4, streams=Streams(seed=1))
    frame, parts = frame_with(schedule, echo=[HandPoint(range=9.0, power=1.0)])
    burst = np.zeros_like(parts["direct"])
    burst[:, ::2] = 1e4 * frame.times.is_sample[::2]
    hit = IfParts(
        samples=np.stack([parts["echo"], burst, parts.noise]), names=("echo", "direct", "noise")
    )
    truth = truth_at(frame, range=9.0, range_rate=0.0)
    plain = target_levels(CoherentReceiver(greatest_range=12.0), frame, parts, truth)
    receiver = CoherentReceiver(greatest_range=12.0, mitigation=_TakesRampsOut())
    left = target_levels(receiver, frame.with_samples(hit.total()), hit, truth)
    assert np.isfinite(left.snr[0])
    assert left.snr[0] / plain.snr[0] == pytest.approx(0.5, abs=0.05)
    assert left.inr[0] < 1e-6


@pytest.mark.parametrize("share", [0.03, 0.1, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_ramps_of_which_little_is_left_count_by_what_is_left(share, seed):
    """The map adds up samples: (Σtwm)²/Σ(tw)²m of tapers t, w, and the mask m that is left."""
    schedule = schedule_of(64)
    echo = HandPoint(range=20.0, range_rate=0.0, power=0.1)
    frame, parts = frame_with(schedule, echo=[echo], seed=seed)
    method = _LeavesTheMiddle(share)
    receiver = RangeDoppler(greatest_range=60.0, mitigation=method)
    true = truth_at(frame, range=20.0, range_rate=0.0)
    levels = target_levels(receiver, frame, parts, true)
    window = taper(schedule.num_ramps)[:, None] * taper(frame.times.most_samples)
    mask = method.weight(frame)
    expected = 4 * 0.1 * np.sum(window * mask) ** 2 / np.sum(window**2 * mask)
    assert to_db(levels.snr[0]) == pytest.approx(to_db(expected), abs=0.6)


def test_a_part_on_ramps_of_which_little_is_left_has_the_power_of_the_map():
    """An interferer with the echo's beat is on the ramps alone of which a tenth is left."""
    schedule = schedule_of(64)
    echo = HandPoint(range=20.0, range_rate=0.0, power=1.0)
    frame, parts = frame_with(schedule, echo=[echo], direct=[echo])
    samples = parts.samples.copy()
    samples[1, :, 1::2] = 0.0
    parts = IfParts(samples=samples, names=parts.names)
    receiver = RangeDoppler(greatest_range=60.0, mitigation=_LeavesTheMiddle(0.1))
    found, powers = detected(receiver, frame.with_samples(parts.total()), parts)
    window = taper(schedule.num_ramps)[:, None] * taper(frame.times.most_samples)
    window *= _LeavesTheMiddle(0.1).weight(frame)
    expected = (window[::2].sum() / window.sum()) ** 2
    assert powers[0, PARTS.index("echo")] == pytest.approx(4.0, rel=0.02)
    ratio = powers[0, PARTS.index("direct")] / powers[0, PARTS.index("echo")]
    assert ratio == pytest.approx(expected, rel=0.02)
    assert found.range[0] == pytest.approx(20.0, abs=0.1)


@pytest.mark.parametrize("azimuth", [0.5, 0.3, 0.0, -0.4])
@pytest.mark.parametrize("seed", range(3))
def test_the_noise_after_nulling_is_that_in_the_direction_of_the_target(azimuth, seed):
    """The map of each part is the twin: its channels are added up as a beam towards the target.

    In the hit half of a ramp a null takes the share |w*v|² of the echo and of the noise.
    """
    schedule = schedule_of(64)
    point = HandPoint(range=20.0, range_rate=0.0, power=0.01, azimuth=azimuth)
    frame, parts = frame_with(schedule, echo=[point], seed=seed)
    wave, beam = (np.exp(-1j * np.pi * np.arange(4) * np.sin(a)) / 2.0 for a in (0.5, azimuth))
    receiver = RangeDoppler(greatest_range=60.0, mitigation=_NullsKnownSamples())
    hit = receiver.mitigation.hit(frame)
    turn = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, hit.shape)
    burst = 1e3 * wave[:, None, None] * np.exp(1j * turn) * hit
    parts = IfParts(samples=np.stack([parts["echo"], burst, parts.noise]), names=parts.names)
    frame = frame.with_samples(parts.total())
    true = truth_at(frame, range=20.0, range_rate=0.0, azimuth=azimuth)
    levels = target_levels(receiver, frame, parts, true)
    repair = mitigated(receiver.mitigation, frame).repair

    def steered(samples):
        seen = RECEIVER.spectra(frame.with_samples(repair(samples))).amplitude
        return np.abs(np.tensordot(beam.conj(), seen, axes=1)) ** 2

    noise = np.mean([np.mean(steered(frame_of(schedule, [], seed=90 + n).samples)) for n in (1, 2)])
    assert to_db(levels.snr[0]) == pytest.approx(
        to_db(steered(parts["echo"]).max() / noise), abs=0.8
    )
