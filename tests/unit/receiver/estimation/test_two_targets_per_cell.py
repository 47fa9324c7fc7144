"""Two points in one cell of range and range rate."""

import numpy as np
import pytest

from polychirp.receiver.chain import Receiver, _Search
from polychirp.receiver.estimation.coherence_test import coherence
from polychirp.receiver.estimation.two_targets_per_cell import _histories, two_histories
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of

FAMILIES = [Triangular(), DiverseTriangular()]

PLACES = {
    "two of one lane": (0.02, 0.15, 4.0),
    "two lanes": (0.09, 0.22, 10.0),
    "half a range cell": (-0.07, -0.5, 7.0),
    "an alias apart": (0.03, 0.95, 10.0),
}
"""m, m/s and degrees from the first to the second: 0.15 m and 1 to 2 m/s are a cell."""


def pair(case):
    away, faster, left = PLACES[case]
    return [
        HandPoint(range=15.0, range_rate=-9.0, acceleration=0.4, azimuth=0.2, power=300.0),
        HandPoint(
            range=15.0 + away,
            range_rate=-9.0 + faster,
            acceleration=0.2,
            azimuth=0.2 - np.radians(left),
            power=200.0,
        ),
    ]


def schedule(family):
    return family.schedule(num_sweeps=16, streams=Streams(2))


@pytest.mark.parametrize("family", FAMILIES, ids=["equal", "diverse"])
@pytest.mark.parametrize("case", PLACES)
def test_two_points_in_one_cell_are_both_found_with_their_own_azimuths(case, family):
    """25 dB over the noise of a sample; a beam of four channels is 26° wide.

    Residues that are detected as well are 30 dB weaker.
    """
    points = pair(case)
    found = Receiver().detect(frame_of(schedule(family), points))
    assert found.num_detections >= 2
    assert np.all(found.power[2:] < 1e-3 * found.power[1])
    for point in points:
        n = int(np.argmin(np.abs(found.range_rate[:2] - point.range_rate)))
        assert found.range[n] == pytest.approx(point.range, abs=2e-3)
        assert found.range_rate[n] == pytest.approx(point.range_rate, abs=0.02)
        assert found.azimuth[n] == pytest.approx(point.azimuth, abs=np.radians(0.12))
        assert found.power[n] == pytest.approx(point.power, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES, ids=["equal", "diverse"])
def test_one_point_is_never_split(family):
    """None of 200: by less than 1.5 % with 95 % confidence, at 3 to 30 dB over a sample's noise."""
    ramps = schedule(family)
    draw = np.random.default_rng(3)
    for seed in range(200):
        point = HandPoint(
            range=draw.uniform(8.0, 28.0),
            range_rate=draw.uniform(-25.0, 25.0),
            acceleration=draw.uniform(-5.0, 5.0),
            azimuth=draw.uniform(-0.9, 0.9),
            power=10.0 ** draw.uniform(0.3, 3.0),
        )
        assert Receiver().detect(frame_of(ramps, [point], seed=seed)).num_detections == 1


def test_what_a_pair_hid_is_found_once_it_is_gone():
    """A third point shares the pair's beats on half of the ramps, 10 dB weaker."""
    third = HandPoint(range=16.4, range_rate=-17.7, azimuth=-0.3, power=20.0)
    frame = frame_of(schedule(DiverseTriangular()), [*pair("two lanes"), third])
    found = Receiver().detect(frame)
    assert found.num_detections == 3
    n = int(np.argmin(found.range_rate))
    assert found.range[n] == pytest.approx(third.range, abs=5e-3)
    assert found.azimuth[n] == pytest.approx(third.azimuth, abs=np.radians(0.3))


def histories(*motions, amplitudes=(1.0, 1.0), seed=0):
    """Amplitudes of points at rates and accelerations about the middle, ``(channel, ramp)``."""
    draw = np.random.default_rng(seed)
    elapsed = np.cumsum(draw.uniform(1e-3, 2e-3, 32))
    elapsed -= elapsed.mean()
    wave = np.exp(2j * np.pi * draw.random((2, 4, 1)))
    way = [rate * elapsed + 0.5 * bend * elapsed**2 for rate, bend in motions]
    return elapsed, sum(
        size * a * np.exp(4j * np.pi * 77e9 / 299792458.0 * w)
        for size, a, w in zip(amplitudes, wave, way, strict=False)
    )


def tried(elapsed):
    return _histories(np.full(32, 77e9), elapsed)


def test_two_histories_a_tenth_of_a_metre_per_second_apart_are_separated():
    elapsed, amplitude = histories((0.06, 0.0), (-0.05, 2.0))
    assert coherence(amplitude[None], np.full(32, 77e9), elapsed)[0] < 0.8
    corrections, turns = tried(elapsed)
    both = two_histories(amplitude, turns)
    assert both is not None
    assert sorted(corrections[both][:, 0]) == pytest.approx([-0.05, 0.06], abs=0.015)


@pytest.mark.parametrize(
    ("motions", "amplitudes"),
    [([(0.06, 1.0)], (1.0, 0.0)), ([(0.06, 0.0), (-0.3, 2.0)], (1.0, 0.3))],
    ids=["one", "one and a tenth of its power"],
)
def test_what_one_history_explains_is_not_two(motions, amplitudes):
    elapsed, amplitude = histories(*motions, amplitudes=amplitudes)
    assert two_histories(amplitude, tried(elapsed)[1]) is None


def test_noise_and_crossing_ridges_are_not_two():
    """The up-beat of one echo with the down-beat of another: each history on half of the ramps."""
    elapsed, one = histories((0.1, 0.0))
    _, other = histories((-0.6, 0.0), seed=0)
    ridges = np.where(np.arange(32) % 2, one, other)
    draw = np.random.default_rng(5)
    noise = draw.normal(size=(4, 32)) + 1j * draw.normal(size=(4, 32))
    _, turns = tried(elapsed)
    assert two_histories(ridges, turns) is None
    assert two_histories(noise, turns) is None


def test_a_steady_wave_that_is_taken_out_leaves_nothing_but_noise():
    """The fit's residual is noise: its power per bin is 1 within 5 %, with 1600 bins near."""
    points = pair("two lanes")
    search = _Search(Receiver(), frame_of(schedule(DiverseTriangular()), points))
    while search.next_points():
        pass
    assert search.split()
    (found,) = search.pairs.found
    assert found.share == pytest.approx(1.0, abs=0.002)
    assert search.map.noise.mean() == pytest.approx(1.0, rel=0.1)
