"""What the coherent receiver finds, beside the ideal detector and the Cramér-Rao bound."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.radar import Converter
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.false_alarms import threshold_of
from polychirp.receiver.estimation.azimuth_rate import TYPICAL_CROSSING_SPEED, sine_basis
from polychirp.receiver.estimation.cramer_rao import cramer_rao_bound
from polychirp.receiver.mitigation.blanking import Blanking
from polychirp.receiver.signal_model.point_signal import path_of
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth, Triangular
from tests.support.interference import with_noisy_ramps
from tests.support.points import HandPoint, frame_of, true_motions
from tests.support.schedules import drawn_chirps

FAST = Converter(sample_rate=20e6, start=2e-6, margin=1e-6)
FAMILIES = {
    "equal": Triangular(bandwidth=1e9, ramp_duration=1e-3),
    "diverse": DiverseTriangular(),
}


def ramps(family, trial):
    return FAMILIES[family].schedule(num_sweeps=16, streams=Streams(trial))


def num_found(found, true):
    """Number of points with a detection within 0.15 m and 0.04 m/s of their own."""
    near = np.abs(found.range - true[:, :1]) / 0.15 + np.abs(found.range_rate - true[:, 1:2]) / 0.04
    return int(np.sum(np.any(near < 1.0, axis=1)))


def drawn_points(draw, count):
    points = [
        HandPoint(
            range=draw.uniform(3.0, 29.0),
            range_rate=draw.uniform(-30.0, 30.0),
            acceleration=draw.uniform(0.0, 3.0),
            azimuth=draw.uniform(-1.0, 1.0),
            power=10.0 ** draw.uniform(-1.0, 1.0),
        )
        for _ in range(count)
    ]
    return [replace(p, power=3e3 * p.power * (3.0 / p.range) ** 4) for p in points]


@pytest.mark.parametrize("family", FAMILIES)
def test_ten_points_over_60_db_are_all_found_and_nothing_else(family):
    found, detections = 0, 0
    for trial in range(2):
        points = drawn_points(np.random.default_rng([51, trial]), 10)
        schedule = ramps(family, trial)
        seen = CoherentReceiver().detect(frame_of(schedule, points, seed=trial))
        found += num_found(seen, true_motions(schedule, points))
        detections += seen.num_detections
    assert found >= 19
    assert detections <= found + 2


def test_drawn_chirps_show_points_60_db_apart_without_folds():
    """Chirps whose slopes, durations and intervals differ; rates far beyond λ/4T of 20 m/s."""
    schedule = drawn_chirps(192, seed=7)
    points = [
        HandPoint(range=25.0, range_rate=28.0, power=10.0),
        HandPoint(range=25.8, range_rate=28.0, power=1e-4, azimuth=0.3),
        HandPoint(range=12.0, range_rate=-26.0, power=0.1, azimuth=-0.5),
        HandPoint(range=39.0, range_rate=1.5, power=1e-3),
    ]
    one = frame_of(schedule, points, seed=3, converter=FAST)
    seen = CoherentReceiver(greatest_range=50.0).detect(one)
    assert seen.num_detections == 4
    assert num_found(seen, true_motions(schedule, points)) == 4


@pytest.mark.parametrize("power", [1e-3, 1e-1])
def test_a_still_point_is_found_on_many_equal_chirps(power):
    """Its side lobes over range rates raise the floor at its range, but hold no power of its ramps.

    Noise of that floor in 512 ramps of four channels has more power than the point.
    """
    chirps = Sawtooth(bandwidth=1e9, ramp_duration=40e-6, idle=20e-6)
    schedule = chirps.schedule(num_sweeps=512, streams=Streams(1))
    point = HandPoint(range=38.67, power=power)
    one = frame_of(schedule, [point], converter=replace(FAST, sample_rate=10e6))
    seen = CoherentReceiver(greatest_range=45.0).detect(one)
    assert seen.range == pytest.approx([38.67], abs=0.01)
    assert seen.range_rate == pytest.approx([0.0], abs=0.01)


@pytest.mark.parametrize("trial", range(6))
def test_strong_points_on_equal_chirps_are_found_up_to_the_sampling_rate(trial):
    """Beats up to 7.3 MHz in complex samples at 10 MHz, whose range of ±5 MHz they fold into."""
    draw = np.random.default_rng([57, trial])
    num_ramps, interval = int(draw.choice([128, 256, 512])), draw.uniform(45e-6, 90e-6)
    chirps = Sawtooth(bandwidth=1e9, ramp_duration=40e-6, idle=interval - 40e-6)
    schedule = chirps.schedule(num_sweeps=num_ramps, streams=Streams(1))
    unambiguous = SPEED_OF_LIGHT / (4.0 * 76.5e9 * interval)
    points = [
        HandPoint(
            range=draw.uniform(4.0, 44.0),
            range_rate=draw.uniform(-0.8, 0.8) * unambiguous,
            azimuth=draw.uniform(-0.6, 0.6),
            power=10.0 ** draw.uniform(-2.0, 1.5),
        )
        for _ in range(int(draw.integers(1, 4)))
    ]
    one = frame_of(schedule, points, converter=replace(FAST, sample_rate=10e6))
    seen = CoherentReceiver(greatest_range=45.0).detect(one)
    assert num_found(seen, true_motions(schedule, points)) == len(points)
    assert seen.range.size == len(points)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_point_that_passes_at_two_metres_is_found(family):
    """Accelerations of 57 to 94 m/s²: over the frame the range rate changes by up to 4 m/s."""
    for trial, speed in enumerate((14.0, 18.0)):
        ahead, aside = 1.8, 2.4
        distance = float(np.hypot(ahead, aside))
        point = HandPoint(
            range=distance,
            range_rate=-speed * ahead / distance,
            acceleration=(speed * aside) ** 2 / distance**3,
            azimuth=float(np.arctan2(aside, ahead)),
            sine_rate=speed * ahead * aside / distance**3,
            power=100.0,
        )
        schedule = ramps(family, trial)
        seen = CoherentReceiver().detect(frame_of(schedule, [point], seed=trial))
        assert num_found(seen, true_motions(schedule, [point])) == 1


@pytest.mark.parametrize("family", FAMILIES)
def test_two_azimuths_in_one_cell_are_two_detections(family):
    """Equal range and range rate, one cell of the array apart: 0.5 in the azimuth's sine."""
    point = HandPoint(range=11.0, range_rate=4.0, azimuth=-0.4, power=0.1)
    sines = np.sin(point.azimuth) + np.array([0.0, 0.5])
    other = replace(point, azimuth=float(np.arcsin(sines[1])))
    seen = CoherentReceiver().detect(frame_of(ramps(family, 4), [point, other], seed=2))
    assert np.sort(np.sin(seen.azimuth)) == pytest.approx(sines, abs=0.05)
    assert np.ptp(seen.range) == 0.0


def test_gaps_of_blanking_are_no_signal():
    """A burst of 30 dB on a part of every ramp is blanked; the point is found as before."""
    schedule = ramps("diverse", 5)
    point = HandPoint(range=14.0, range_rate=-6.0, power=0.01)
    one = frame_of(schedule, [point], seed=6)
    burst = np.zeros(one.samples.shape)
    burst[:, :, 200:240] = 30.0
    hit = one.with_samples(one.samples + burst)
    seen = CoherentReceiver(mitigation=Blanking()).detect(hit)
    assert num_found(seen, true_motions(schedule, [point])) == 1
    assert seen.num_detections <= 2


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_weak_points_are_found_as_by_the_ideal_coherent_detector(family):
    """Derived: Q_M(√(2 SNR), √(2τ)) for M channels; no more than 1 dB is lost."""
    from scipy.stats import ncx2

    receiver, num_trials = CoherentReceiver(), 60
    threshold = threshold_of(receiver.false_alarm_probability, num_channels=4)
    snr = 10.0**1.45
    found = 0
    for trial in range(num_trials):
        draw = np.random.default_rng([52, trial])
        schedule = ramps(family, trial)
        point = replace(drawn_points(draw, 1)[0], acceleration=draw.uniform(0.0, 1.0))
        samples = frame_of(schedule, []).times.is_sample.sum()
        point = replace(point, power=snr / (4.0 * samples))
        seen = receiver.detect(frame_of(schedule, [point], seed=800 + trial))
        found += num_found(seen, true_motions(schedule, [point]))
    least = ncx2.sf(2.0 * threshold, 8, 2.0 * snr / 10.0**0.1)
    assert found / num_trials > least - 2.0 * np.sqrt(least * (1.0 - least) / num_trials)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("axis", ["range", "range rate"])
def test_two_points_one_cell_apart_are_resolved_at_20_db(family, axis):
    """20 drawn pairs, whose phases decide whether their lobes add up or cancel between them."""
    resolved, detections = 0, 0
    for trial in range(20):
        draw = np.random.default_rng([54, trial])
        schedule = ramps(family, trial)
        samples = frame_of(schedule, []).times.is_sample.sum()
        first = replace(drawn_points(draw, 1)[0], acceleration=0.0, power=25.0 / samples)
        wavelength = SPEED_OF_LIGHT / 79e9
        apart = {
            "range": {"range": first.range + 0.5 * SPEED_OF_LIGHT / schedule.bandwidth.max()},
            "range rate": {
                "range_rate": first.range_rate + 0.5 * wavelength / schedule.end_time[-1]
            },
        }
        points = [first, replace(first, **apart[axis])]
        seen = CoherentReceiver().detect(frame_of(schedule, points, seed=600 + trial))
        both = num_found(seen, true_motions(schedule, points)) == 2 and seen.num_detections >= 2
        resolved += both
        detections += seen.num_detections
    assert resolved >= 17
    assert detections <= 2 * 20 + 6


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("level", [-28.0, 10.0])
def test_errors_are_those_of_the_cramer_rao_bound(family, level):
    """Rms over the bound is within 2.5 standard deviations, 0.11 each, of 1."""
    errors = []
    for trial in range(40):
        draw = np.random.default_rng([53, trial])
        schedule = ramps(family, trial)
        point = replace(drawn_points(draw, 1)[0], power=10.0 ** (level / 10.0))
        deviation = TYPICAL_CROSSING_SPEED / point.range
        point = replace(point, sine_rate=deviation * draw.normal(), azimuth=draw.uniform(-0.8, 0.8))
        one = frame_of(schedule, [point], seed=900 + trial)
        late = 0.5 * (schedule.end_time.max() - schedule.start_time.min())
        start = np.array([[point.range, point.range_rate, point.acceleration]])
        (motion,) = path_of(start, np.array(late)).T
        straight, turned = sine_basis(start, np.array([late]))[:, 0, 0]
        azimuth = np.arcsin(np.sin(point.azimuth) * straight + point.sine_rate * turned)
        seen = CoherentReceiver().detect(one)
        if seen.num_detections == 0:
            continue
        bound = cramer_rao_bound(
            schedule,
            one.times,
            one.array,
            motion=motion,
            azimuth=azimuth,
            snr=point.power,
            time=seen.time,
            sine_rate_deviation=deviation,
        )
        error = np.array([seen.range[0], seen.range_rate[0], seen.azimuth[0]])
        error -= [motion[0], motion[1], azimuth]
        errors.append(error / [bound.range, bound.range_rate, bound.azimuth])
    assert len(errors) >= 39
    assert np.sqrt(np.mean(np.square(errors), axis=0)) == pytest.approx(1.0, abs=0.28)


@pytest.mark.parametrize("family", FAMILIES)
def test_interference_on_some_ramps_costs_no_more_than_these_ramps(family):
    """A quarter of the ramps has 30 dB more noise, from one direction.

    A point that is 20 dB above the noise of the others is found, and nothing else. Without weights
    the noise would be 24 dB higher.
    """
    found = others = 0
    for trial in range(10):
        draw = np.random.default_rng([41, trial])
        schedule = ramps(family, trial)
        point = replace(drawn_points(draw, 1)[0], power=1.0)
        quiet = frame_of(schedule, [point], seed=trial)
        is_hit = draw.permutation(schedule.num_ramps) < schedule.num_ramps // 4
        clean = np.sum(quiet.times.is_sample[~is_hit]) * quiet.array.num_channels
        one = frame_of(schedule, [replace(point, power=100.0 / clean)], seed=trial)
        one = with_noisy_ramps(one, 1e3 * is_hit, azimuth=draw.uniform(-1.0, 1.0), seed=trial)
        seen = CoherentReceiver().detect(one)
        here = num_found(seen, true_motions(schedule, [point]))
        found += here
        others += seen.num_detections - here
    assert found >= 9
    assert others <= 1


def test_interference_from_one_direction_on_all_ramps_hides_only_that_direction():
    """It is 20 dB above the noise. A point a beam beside it loses a few dB to the null."""
    found = others = 0
    for trial in range(10):
        draw = np.random.default_rng([42, trial])
        schedule = ramps("diverse", trial)
        point = replace(drawn_points(draw, 1)[0], azimuth=draw.uniform(-0.9, -0.3), power=1.0)
        total = np.sum(frame_of(schedule, []).times.is_sample) * 4
        one = frame_of(schedule, [replace(point, power=300.0 / total)], seed=trial)
        one = with_noisy_ramps(one, np.full(schedule.num_ramps, 100.0), azimuth=0.3, seed=trial)
        seen = CoherentReceiver(false_alarm_probability=1e-8).detect(one)
        here = num_found(seen, true_motions(schedule, [point]))
        found += here
        assert seen.azimuth[np.argmax(seen.snr)] == pytest.approx(point.azimuth, abs=0.12)
        others += seen.num_detections - here
    assert found >= 9
    assert others <= 1


@pytest.mark.parametrize("trial", range(3))
def test_bursts_at_one_place_of_all_equal_ramps_are_no_points(trial):
    """A radar with the same slopes and another start crosses each ramp at the same place.

    Its short chirps fill all ranges, and add up in phase at the range rate by which they turn from
    sweep to sweep.
    """
    draw = np.random.default_rng([59, trial])
    schedule = ramps("equal", trial)
    point = replace(drawn_points(draw, 1)[0], power=1.0)
    frame = frame_of(schedule, [point], seed=trial)
    samples, length = frame.samples.copy(), 60
    n = np.arange(length) - 0.5 * length
    turn, first = draw.uniform(0.0, 1.0), int(draw.integers(100, 800))
    for k in range(schedule.num_ramps):
        chirp = np.exp(1j * np.pi * np.sign(schedule.slope[k]) * 0.9 * n**2 / length)
        phase = np.exp(2j * np.pi * turn * schedule.sweep[k])
        samples[:, k, first : first + length] += 3.0 * phase * chirp
    found = CoherentReceiver().detect(frame.with_samples(samples))
    assert found.num_detections == 1
    assert found.range[0] == pytest.approx(true_motions(schedule, [point])[0, 0], abs=0.02)


@pytest.mark.parametrize("trial", range(3))
@pytest.mark.parametrize("family", FAMILIES)
def test_a_bright_point_on_few_ramps_is_one_detection_with_all_of_its_snr(family, trial):
    """Eight ramps, of whose map the point's side lobes fill all, 50 dB above the noise of a sample.

    As a floor they would end its fit at once, a millimetre beside its place.
    """
    draw = np.random.default_rng([60, trial])
    schedule = FAMILIES[family].schedule(num_sweeps=4, streams=Streams(trial))
    point = replace(drawn_points(draw, 1)[0], range_rate=0.0, acceleration=0.0, power=1e5)
    frame = frame_of(schedule, [point], seed=trial)
    found = CoherentReceiver().detect(frame)
    size = 4 * np.count_nonzero(frame.times.is_sample)
    assert found.range == pytest.approx([point.range], abs=2e-5)
    assert found.snr == pytest.approx([point.power * size], rel=0.3)
