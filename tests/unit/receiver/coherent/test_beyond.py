"""Strong points beyond the greatest range."""

import pytest

from polychirp.receiver.coherent.beyond import MARGIN, farthest_range
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of, true_motions

FAMILIES = [Triangular(), DiverseTriangular()]


def frame_with(family, *points):
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    return frame_of(ramps, list(points), seed=1)


def farthest_of(frame):
    seen = Observation.of(frame, mitigated(None, frame))
    return farthest_range(seen, 30.0), seen.range_cell


@pytest.mark.parametrize("family", FAMILIES)
def test_noise_and_points_within_the_limits_leave_the_search_there(family):
    assert farthest_of(frame_with(family))[0] == 30.0
    assert farthest_of(frame_with(family, HandPoint(range=20.0, power=1e3)))[0] == 30.0


@pytest.mark.parametrize("family", FAMILIES)
def test_the_search_reaches_a_point_whose_side_lobes_reach_the_limits(family):
    """61 cells behind them, side lobes are 46 dB lower: 87 dB count, 38 dB do not."""
    strong = farthest_of(frame_with(family, HandPoint(range=40.0, power=3e3)))
    assert strong[0] == pytest.approx(40.0 + MARGIN * strong[1], abs=3.0 * strong[1])
    assert farthest_of(frame_with(family, HandPoint(range=40.0, power=0.03)))[0] == 30.0


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("place", [(32.05, -6.14), (45.0, 3.0), (33.0, -20.0)])
def test_a_target_beyond_the_greatest_range_is_not_detected_within_it(family, place):
    """As strong as a direct interferer, in a frame with a target that is 50 dB weaker."""
    beyond = HandPoint(range=place[0], range_rate=place[1], azimuth=0.1, power=1e4)
    target = HandPoint(range=9.0, range_rate=3.0, power=0.1)
    frame = frame_with(family, beyond, target)
    found = CoherentReceiver().detect(frame)
    assert found.range == pytest.approx(true_motions(frame.schedule, [target])[:, 0], abs=5e-3)
