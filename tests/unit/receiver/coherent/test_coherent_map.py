"""The coherent map against sums over all samples, and the number of its peaks in noise."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.front_end import HighPass
from polychirp.model.radar import Converter
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.coherent_map import (
    MapLimits,
    coherent_map,
    coherent_power,
    map_axes,
)
from polychirp.receiver.coherent.false_alarms import (
    AREA_OF_A_CELL,
    expected_peaks,
    map_area,
    threshold_of,
)
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.peaks import floors, peaks
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.spectra import Spectra
from polychirp.receiver.mitigation.base import mitigated, with_weights
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth, Triangular
from tests.support.points import HandPoint, frame_of
from tests.support.schedules import drawn_chirps

RECEIVER = CoherentReceiver(greatest_range=20.0, greatest_speed=12.0)
LIMITS = MapLimits.of(RECEIVER)
FAST = Converter(sample_rate=20e6, start=2e-6, margin=1e-6)
FRAMES = {
    "equal": (Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule, None),
    "diverse": (DiverseTriangular().schedule, None),
    "chirps": (lambda **_: drawn_chirps(64, seed=4), FAST),
}


def frame(kind, points, **options):
    schedule, converter = FRAMES[kind]
    ramps = schedule(num_sweeps=8, streams=Streams(3))
    return frame_of(ramps, points, seed=5, converter=converter, **options)


def observed(one, cleaned=None):
    return Observation.of(one, cleaned or mitigated(None, one))


def mapped(seen, axes):
    return coherent_map(
        seen, Profiles.of(seen, Spectra.of(seen, seen.samples), axes).mixed(seen.mixing)
    )


@pytest.mark.parametrize("kind", FRAMES)
@pytest.mark.parametrize("is_filtered", [False, True])
def test_the_map_is_the_sum_over_all_samples(kind, is_filtered):
    """The nearest steps of the profiles lose some per cent, more where a filter bends the phase."""
    one = frame(kind, [HandPoint(range=12.3, range_rate=-7.7, power=0.05)])
    if is_filtered:
        one = replace(one, high_pass=HighPass(corners=(50e3,)))
    seen = observed(one)
    axes = map_axes(seen, LIMITS)
    fast = mapped(seen, axes).power
    drawn = np.random.default_rng(6).integers(0, fast.shape, size=(60, 2))
    top = np.array(np.unravel_index(np.argmax(fast), fast.shape))
    cells = np.vstack([top + np.array([[0, 0], [1, 0], [0, 1]]), drawn])
    motion = np.stack([axes.range[cells[:, 1]], axes.range_rate[cells[:, 0]], 0 * cells[:, 0]], 1)
    slow = coherent_power(seen, seen.samples, motion)
    found = fast[tuple(cells.T)]
    assert found[:3] == pytest.approx(slow[:3], abs=(0.2 if is_filtered else 0.06) * slow[0])
    assert np.median(np.abs(found[3:] - slow[3:])) < 0.15 * np.median(slow[3:])
    assert np.median(found[3:]) == pytest.approx(np.median(slow[3:]), rel=0.15)


def test_the_map_of_a_point_peaks_at_its_place_with_all_its_power():
    one = frame("diverse", [HandPoint(range=12.3, range_rate=-7.7, power=1.0)], noise=1e-9)
    seen = observed(one)
    axes = map_axes(seen, LIMITS)
    whole = mapped(seen, axes)
    found = peaks(whole, axes, 10.0)
    best = np.argmax(found.power)
    late = seen.model.time - float(one.schedule.start_time[0])
    assert found.range[best] == pytest.approx(12.3 - 7.7 * late, abs=0.02)
    assert found.range_rate[best] == pytest.approx(-7.7, abs=0.02)
    assert found.power[best] == pytest.approx(4.0 * seen.count.sum(), rel=0.1)


def test_missing_samples_neither_add_power_nor_count():
    one = frame("diverse", [], noise=2.0)
    weight = one.times.is_sample * (np.arange(one.times.most_samples) % 3 > 0)
    seen = observed(one, with_weights(one, weight))
    axes = map_axes(seen, LIMITS)
    assert mapped(seen, axes).power.mean() == pytest.approx(4 * 2.0, rel=0.04)


def test_the_floor_is_the_noise_power():
    one = frame("diverse", [], noise=2.0)
    seen = observed(one)
    whole = mapped(seen, map_axes(seen, LIMITS))
    cells = np.random.default_rng(3).integers(0, whole.power.shape, size=(200, 2))
    floor = floors(whole, cells)
    assert np.median(floor) == pytest.approx(2.0, rel=0.05)


def test_beside_a_residue_the_floor_is_the_mean_of_a_window():
    seen = observed(frame("diverse", [], noise=2.0))
    whole = mapped(seen, map_axes(seen, LIMITS))
    near = np.zeros_like(whole.power)
    near[300:330, 40:44] = 1e4
    whole = replace(whole, power=whole.power + near)
    slow = whole.power[310 - 64 : 310 + 65 : 2, 42 - 4 : 42 + 5].mean() / 4
    assert floors(whole, np.array([[310, 42]]))[0] == pytest.approx(slow, rel=1e-4)


def test_a_resolution_cell_of_gapless_sawtooths_is_the_unit_of_area():
    """Derived: uniform distributions of width B and T have the variances B²/12 and T²/12."""
    ramps = Sawtooth(bandwidth=1e9, ramp_duration=50e-6).schedule(num_sweeps=64, streams=Streams(1))
    one = frame_of(ramps, [], converter=Converter(sample_rate=20e6, start=0.0, margin=0.0))
    seen = observed(one)
    wavelength = SPEED_OF_LIGHT / float(seen.frequency.mean())
    duration = float(ramps.end_time[-1] - ramps.start_time[0])
    area = map_area(
        seen, range_span=0.5 * SPEED_OF_LIGHT / 1e9, range_rate_span=0.5 * wavelength / duration
    )
    assert area == pytest.approx(AREA_OF_A_CELL, rel=0.03)


@pytest.mark.parametrize("num_channels", [1, 4, 12])
@pytest.mark.parametrize("probability", [1e-3, 1e-6, 1e-12])
def test_the_threshold_has_the_stated_number_of_peaks(num_channels, probability):
    level = threshold_of(probability, num_channels=num_channels)
    found = AREA_OF_A_CELL * expected_peaks(level, num_channels=num_channels)
    assert found == pytest.approx(probability, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FRAMES)
def test_noise_is_detected_no_more_often_than_stated(kind):
    """Peaks between cells are interpolated, which loses a little: never more than stated × 1.25."""
    receiver = replace(RECEIVER, false_alarm_probability=1e-4)
    schedule, converter = FRAMES[kind]
    expected, found = 0.0, 0
    for trial in range(100 if kind == "chirps" else 25):
        ramps = schedule(num_sweeps=8, streams=Streams(trial))
        one = frame_of(ramps, [], seed=700 + trial, converter=converter)
        expected += receiver.expected_false_detections(one)
        found += receiver.detect(one).num_detections
    assert expected > 20
    assert 0.25 * expected < found < 1.25 * expected + 2.0 * np.sqrt(expected)


def test_ramps_must_leave_a_range_cell():
    ramps = RampSchedule(
        start_time=[0.0, 1e-3],
        duration=[1e-3, 1e-3],
        start_frequency=[79e9, 79e9],
        slope=[1e9, -1e9],
        start_phase=[0.0, 0.0],
        sweep=[0, 0],
    )
    with pytest.raises(InputError, match="less than a range cell of"):
        RECEIVER.detect(frame_of(ramps, []))
