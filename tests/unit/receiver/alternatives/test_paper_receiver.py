"""The paper's own receiver, its abilities and its limits."""

import numpy as np
import pytest

from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of

RAMPS = Triangular().schedule(num_sweeps=16, streams=Streams(2))


def nearest(found, distance):
    return int(np.argmin(np.abs(found.range - distance)))


def test_one_strong_target_has_its_range_rate_and_azimuth():
    """Eqs 9 and 10: half a cell of range is 0.08 m, half a Doppler cell 0.6 m/s."""
    point = HandPoint(range=9.0, range_rate=-6.0, azimuth=0.3, power=1e4)
    found = PaperReceiver().detect(frame_of(RAMPS, [point]))
    first = 0  # strongest
    assert found.range[first] == pytest.approx(9.0, abs=0.1)
    assert found.range_rate[first] == pytest.approx(-6.0, abs=0.7)
    assert found.azimuth[first] == pytest.approx(0.3, abs=0.02)


def test_with_the_mean_as_threshold_noise_is_detected():
    """Half of the noise stands above its mean: dozens of false detections."""
    frame = frame_of(RAMPS, [])
    assert PaperReceiver().detect(frame).num_detections > 20
    assert CoherentReceiver().detect(frame).num_detections == 0


def test_detections_are_the_strongest_first():
    """Also where the up-peaks, by which pairs are formed, have another order than the pairs."""
    found = PaperReceiver().detect(frame_of(RAMPS, []))
    assert np.all(np.diff(found.power) <= 0)
    assert np.any(np.diff(found.snr) > 0)


def test_averaging_over_diverse_slopes_smears_what_moves():
    """The trap of errata 10: the same target, 20 m/s, loses most of its peak under diversity.

    Four sweeps, so that the target itself moves by little more than a cell meanwhile.
    """
    point = HandPoint(range=15.0, range_rate=20.0, power=1e4)
    levels = []
    for family in (Triangular(), DiverseTriangular()):
        ramps = family.schedule(num_sweeps=4, streams=Streams(2))
        found = PaperReceiver().detect(frame_of(ramps, [point]))
        near = np.abs(found.range - 15.0) < 1.5
        levels.append(found.power[near].max(initial=0.0))
    assert levels[1] < 0.5 * levels[0]
