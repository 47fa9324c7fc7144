"""The receiver of codes where mitigation leaves gaps: powers, side lobes and ratios to noise."""

from dataclasses import dataclass

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfParts
from polychirp.model.radar import Converter
from polychirp.model.truth import Truth
from polychirp.receiver.attribution import target_levels
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.mitigation.base import with_weights
from polychirp.rng import Streams
from polychirp.units import to_db
from polychirp.waveform import PhaseCodedRamp, Pmcw
from tests.support.points import HandPoint, frame_of

CHIRPS = PhaseCodedRamp(start_frequency=79e9, bandwidth=200e6, ramp_duration=40e-6)
CASES = {
    "coded chirps": (CHIRPS, Converter(sample_rate=20e6, start=3e-6, margin=1e-6)),
    "one period": (Pmcw(order=7, periods=2), Converter(sample_rate=5e8, start=254e-9, margin=0.0)),
    "three periods": (
        Pmcw(order=7, periods=4),
        Converter(sample_rate=5e8, start=254e-9, margin=0.0),
    ),
}


@dataclass(frozen=True)
class _LeavesAShare:
    """A mitigation that takes a run of the samples of every fourth ramp out, at a drawn place."""

    left: float
    seed: int

    def mitigate(self, frame):
        draw = np.random.default_rng(self.seed)
        weight = frame.times.is_sample.astype(np.float64)
        lost = round((1.0 - self.left) * weight.shape[1])
        for row in weight[::4]:
            first = draw.integers(0, row.size - lost + 1)
            row[first : first + lost] = 0.0
        return with_weights(frame, weight)


@dataclass(frozen=True)
class _TakesTheMiddle:
    """A mitigation that takes the middle fifth of every ramp out."""

    def mitigate(self, frame):
        weight = frame.times.is_sample.astype(np.float64)
        size = weight.shape[1]
        weight[:, round(0.4 * size) : round(0.6 * size)] = 0.0
        return with_weights(frame, weight)


def frame_and_parts(name, *, seed, place=12.0):
    """A frame of a point at ``place``, m, and its parts."""
    waveform, converter = CASES[name]
    schedule = waveform.schedule(num_sweeps=64, streams=Streams(1))
    echo = frame_of(schedule, [HandPoint(range=place, power=0.1)], noise=0.0, converter=converter)
    noise = frame_of(schedule, [], seed=seed, converter=converter).samples
    parts = IfParts(samples=np.stack([echo.samples, noise]), names=("echo", "noise"))
    return echo.with_samples(parts.total()), parts


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("left", [0.5, 0.2, 0.02, 0.0])
@pytest.mark.parametrize("seed", range(3))
def test_an_echo_keeps_its_power_and_has_no_side_lobes_by_ramps_of_which_little_is_left(
    name, left, seed
):
    frame, _ = frame_and_parts(name, seed=seed)
    whole = Decoding(greatest_range=30.0).detect(frame)
    mended = Decoding(greatest_range=30.0, mitigation=_LeavesAShare(left, seed)).detect(frame)
    assert mended.num_detections == whole.num_detections == 1
    # the noise of a quarter of the ramps is another one: at 30 dB some tenths of a decibel
    assert to_db(mended.power[0]) == pytest.approx(to_db(whole.power[0]), abs=0.5)


@pytest.mark.parametrize("seed", range(3))
def test_an_echo_keeps_its_power_if_the_middle_of_all_chirps_is_taken_out(seed):
    """The taper over a chirp weighs its middle most, so that less than four fifths are left.

    The point is in the middle of a cell: without its middle, a chirp has a narrower main lobe.
    """
    cell = SPEED_OF_LIGHT / (2.0 * 5e12 * 721 / 20e6)
    frame, _ = frame_and_parts("coded chirps", seed=seed, place=14 * cell)
    whole = Decoding(greatest_range=30.0).detect(frame)
    mended = Decoding(greatest_range=30.0, mitigation=_TakesTheMiddle()).detect(frame)
    assert to_db(mended.power[0]) == pytest.approx(to_db(whole.power[0]), abs=0.5)


def ratios(receiver, frame, parts):
    """SNR of the point by its levels, and by maps of the echo and of the noise alone."""
    read = receiver.reading(frame)

    def powers(samples):
        seen = read.receiver.spectra(read.frame.with_samples(read.decode(samples)))
        return np.sum(np.abs(seen.amplitude) ** 2, axis=0)

    found = receiver.detect(frame)
    there = Truth(
        time=found.time,
        name=("point",),
        range=found.range,
        range_rate=[0.0],
        azimuth=[0.0],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
    )
    snr = target_levels(receiver, frame, parts, there).snr[0]
    return snr, powers(parts["echo"]).max() / np.mean(powers(parts["noise"]))


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("left", [0.5, 0.1])
@pytest.mark.parametrize("seed", range(2))
def test_the_loss_of_snr_is_that_of_the_maps_of_each_part(name, left, seed):
    frame, parts = frame_and_parts(name, seed=seed)
    bare = ratios(Decoding(greatest_range=30.0), frame, parts)
    blanked = Decoding(greatest_range=30.0, mitigation=_LeavesAShare(left, seed))
    of_levels, of_maps = np.array(ratios(blanked, frame, parts)) / bare
    assert to_db(of_levels) == pytest.approx(to_db(of_maps), abs=0.5)
