"""Strong points outside of the limits of range and of range rate."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.model.radar import Converter
from polychirp.receiver.coherent.beyond import (
    BINS_PER_BEAT,
    MARGIN,
    with_fast_points,
    with_strong_points,
)
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.coherent_map import MapLimits
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth, Triangular
from tests.support.points import HandPoint, frame_of, true_motions

LIMITS = MapLimits.of(CoherentReceiver())
FAMILIES = [Triangular(), DiverseTriangular()]


def frame_with(family, *points):
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    return frame_of(ramps, list(points), seed=1)


def observed(frame):
    """The observation of a frame, the residual of no points, and its power spectra."""
    seen = Observation.of(frame, mitigated(None, frame))
    residual = Residual.of(seen, Points.none(4))
    return seen, residual, residual.spectra.hann_power(seen, BINS_PER_BEAT)


def searched_of(frame):
    seen, _, power = observed(frame)
    return with_strong_points(seen, power, LIMITS).range, seen.range_cell


@pytest.mark.parametrize("family", FAMILIES)
def test_noise_and_points_within_the_limits_leave_the_search_there(family):
    assert searched_of(frame_with(family))[0] == (0.5, 30.0)
    assert searched_of(frame_with(family, HandPoint(range=20.0, power=1e3)))[0] == (0.5, 30.0)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_search_reaches_a_point_whose_side_lobes_reach_the_limits(family):
    """61 cells behind them, side lobes are 46 dB lower: 87 dB count, 38 dB do not."""
    (nearest, farthest), cell = searched_of(frame_with(family, HandPoint(range=40.0, power=3e3)))
    assert nearest == 0.5
    assert farthest == pytest.approx(40.0 + MARGIN * cell, abs=4.0 * cell)
    weak = searched_of(frame_with(family, HandPoint(range=40.0, power=0.03)))[0]
    assert weak == (0.5, 30.0)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_search_reaches_a_point_at_a_negative_range(family):
    (nearest, farthest), cell = searched_of(frame_with(family, HandPoint(range=-9.0, power=3e3)))
    assert nearest == pytest.approx(-9.0 - MARGIN * cell, abs=4.0 * cell)
    assert farthest == 30.0
    weak = searched_of(frame_with(family, HandPoint(range=-9.0, power=3e-3)))[0]
    assert weak == (0.5, 30.0)


def test_what_folds_into_the_band_is_searched_where_the_limits_have_it():
    """A point at 38 m beats at 6.3 MHz, and so at −3.7 MHz in samples at 10 MHz: at −22 m."""
    chirps = Sawtooth(bandwidth=1e9, ramp_duration=40e-6, idle=20e-6)
    schedule = chirps.schedule(num_sweeps=128, streams=Streams(2))
    converter = Converter(sample_rate=10e6, start=2e-6, margin=1e-6)
    frame = frame_of(schedule, [HandPoint(range=38.0, power=10.0)], converter=converter)
    seen, _, power = observed(frame)
    wide = replace(LIMITS, range=(0.5, 45.0))
    assert with_strong_points(seen, power, wide) == wide
    assert with_strong_points(seen, power, LIMITS).range[0] < -21.0


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(
    "place",
    [
        (32.05, -6.14),
        (45.0, 3.0),
        (33.0, -20.0),
        (-3.0, 8.0),
        (-12.0, -20.0),
        (12.0, 41.0),
        (19.0, -80.0),
    ],
)
def test_a_point_outside_of_the_limits_is_not_detected_within_them(family, place):
    """As strong as a direct interferer, in a frame with a target that is 50 dB weaker."""
    beyond = HandPoint(range=place[0], range_rate=place[1], azimuth=0.1, power=1e4)
    target = HandPoint(range=9.0, range_rate=3.0, power=0.1)
    frame = frame_with(family, beyond, target)
    found = CoherentReceiver().detect(frame)
    assert found.range == pytest.approx(true_motions(frame.schedule, [target])[:, 0], abs=5e-3)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_search_reaches_a_point_faster_than_the_limits(family):
    """It stands 32 dB out of every ramp; two points whose beats pair up on half of them do not."""

    def rates(*points):
        seen, residual, power = observed(frame_with(family, *points))
        return with_fast_points(seen, power, residual, LIMITS).range_rate

    slowest, fastest = rates(HandPoint(range=12.0, range_rate=-50.0, power=5.0))
    assert -55.0 < slowest < -50.0
    assert fastest == 32.0
    pair = HandPoint(range=5.0, power=5.0), HandPoint(range=25.0, power=20.0)
    assert rates(*pair) == (-32.0, 32.0)


@pytest.mark.parametrize("is_weakened", ["rises", "falls"])
def test_a_fast_point_may_be_left_on_the_ramps_of_one_kind(is_weakened):
    """Points within the limits have taken 20 dB of it on the ramps of the other kind."""
    frame = frame_with(FAMILIES[0], HandPoint(range=12.0, range_rate=-50.0, power=5.0))
    seen, _, power = observed(frame)
    weakened = (frame.schedule.slope > 0.0) == (is_weakened == "rises")
    left = frame.samples * np.where(weakened, 0.1, 1.0)[:, None]
    _, residual, _ = observed(frame.with_samples(left))
    slowest, fastest = with_fast_points(seen, power, residual, LIMITS).range_rate
    assert -55.0 < slowest < -50.0
    assert fastest == 32.0
    _, nothing, _ = observed(frame.with_samples(0.1 * frame.samples))
    assert with_fast_points(seen, power, nothing, LIMITS) == LIMITS


@pytest.mark.slow
def test_fast_points_do_not_fill_the_map_of_equal_triangles():
    """Forty drawn places, speeds and powers; the target is up to 55 dB below the fast point."""
    found = []
    for seed in range(40):
        draw = np.random.default_rng([79, seed])
        fast = HandPoint(
            range=draw.uniform(8.0, 28.0),
            range_rate=draw.uniform(34.0, 90.0) * draw.choice([-1.0, 1.0]),
            azimuth=draw.uniform(-0.5, 0.5),
            power=10.0 ** draw.uniform(2.5, 4.5),
        )
        target = HandPoint(
            range=draw.uniform(4.0, 25.0), range_rate=draw.uniform(-20.0, 20.0), power=0.1
        )
        frame = frame_with(FAMILIES[0], fast, target)
        detected = CoherentReceiver().detect(frame).range
        true = true_motions(frame.schedule, [target])[:, 0]
        found.append(detected.shape == (1,) and np.allclose(detected, true, atol=5e-3))
    assert np.mean(found) >= 0.95
