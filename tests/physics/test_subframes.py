"""Range rates that subframes of different repetition intervals tell together.

Points in noise, four channels. SNRs are those of one subframe: of all its samples and channels
together.
"""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError
from polychirp.model.antenna import AntennaArray
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.clustering import Body
from polychirp.receiver.range_doppler.association import SubframeDetections, associated
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.subframes import (
    joint_span,
    subframes,
    unambiguous_span,
    unreadable,
    wrapped,
)
from polychirp.receiver.selection import AutoReceiver, receiver_for
from polychirp.rng import Streams
from polychirp.waveform import Sawtooth, Subframes, TimeDivision, coded
from tests.physics.test_empty_bands import CONVERTER, WAVELENGTH
from tests.support.points import HandPoint, coded_frame

TWO = Subframes(intervals=(50e-6, 58e-6))
THREE = Subframes(intervals=(50e-6, 58e-6, 65e-6))
READER = RangeDoppler(greatest_range=60.0)
ARRAY = AntennaArray(spacing=WAVELENGTH / 2)
GREATEST = 70.0  # m/s, of the drawn range rates; a chirp every 50 µs tells ±19.5 m/s


def plan(waveform: Subframes, count: int = 0) -> RampSchedule:
    count = count or len(waveform.intervals) * waveform.ramps_per_subframe
    return waveform.schedule(num_sweeps=count, streams=Streams(seed=1))


def drawn_point(draw, snr_db: float, **given: float) -> HandPoint:
    values = {
        "range": draw.uniform(8, 50),
        "range_rate": draw.uniform(-GREATEST, GREATEST),
        "azimuth": draw.uniform(-0.7, 0.7),
        "power": 10 ** (snr_db / 10) / (64 * 277 * 4),
    }
    return HandPoint(**(values | given))


def seen(waveform: Subframes, points, seed: int):
    frame = coded_frame(plan(waveform), points, array=ARRAY, converter=CONVERTER, seed=seed)
    return READER.detect(frame)


def is_right(found, point: HandPoint) -> bool:
    distance = point.range + point.range_rate * found.time
    near = np.abs(found.range - distance) < 0.3
    return bool(np.any(near & (np.abs(found.range_rate - point.range_rate) < 0.5)))


def wrong_speeds(found, points) -> int:
    """Number of detections at a point's range, but at no point's range rate."""
    count = 0
    for distance, rate in zip(found.range, found.range_rate, strict=True):
        at = [p for p in points if abs(p.range + p.range_rate * found.time - distance) < 1.0]
        count += bool(at) and all(abs(p.range_rate - rate) > 0.5 for p in at)
    return count


@pytest.mark.parametrize("waveform", [TWO, THREE], ids=["two", "three"])
def test_the_speed_is_right_far_beyond_the_spans_of_the_subframes_at_22_db(waveform):
    """60 drawn targets up to ±70 m/s, where a subframe tells ±19.5 m/s: 0.95 or more, at 95 %."""
    for seed in range(60):
        point = drawn_point(np.random.default_rng([71, seed]), 22.0)
        found = seen(waveform, [point], seed)
        assert is_right(found, point)
        assert found.num_detections == 1


@pytest.mark.slow
def test_no_speed_is_wrong_at_20_db():
    """Of 500 drawn targets at least 450 are detected in both subframes, and none is wrong.

    The probability of a wrong speed is then less than 1 %, at 98 %.
    """
    right, wrong = 0, 0
    for seed in range(500):
        point = drawn_point(np.random.default_rng([72, seed]), 20.0)
        found = seen(TWO, [point], seed)
        right += is_right(found, point)
        wrong += wrong_speeds(found, [point])
    assert right >= 450
    assert wrong == 0


@pytest.mark.parametrize("waveform", [TWO, THREE], ids=["two", "three"])
def test_targets_of_one_range_do_not_exchange_their_speeds(waveform):
    """20 frames of three targets within 0.2 m of each other: no speed is wrong.

    Two cells of the same range and folded speed are one detection, so that some targets are missed:
    of 60, at most 12.
    """
    right, wrong = 0, 0
    middle = plan(waveform).end_time[-1] / 2
    for seed in range(20):
        draw = np.random.default_rng([73, seed])
        common = draw.uniform(18, 45)
        rates = draw.uniform(-GREATEST, GREATEST, 3)
        points = [
            drawn_point(
                draw,
                draw.uniform(24, 34),
                range=common - rate * middle + draw.uniform(-0.1, 0.1),
                range_rate=rate,
            )
            for rate in rates
        ]
        found = seen(waveform, points, seed)
        right += sum(is_right(found, point) for point in points)
        wrong += wrong_speeds(found, points)
    assert wrong == 0
    assert right >= 48


@pytest.mark.parametrize("waveform", [TWO, THREE], ids=["two", "three"])
def test_two_points_that_share_a_peak_are_not_lost(waveform):
    """40 pairs of one range, half a cell to 2.5 cells of a subframe apart, up to 6 dB different.

    They interfere differently in every subframe. One of them is found at least, to 1.2 cells, in
    39 of 40 frames or more, and no speed is another. Of 300 other pairs, one was lost with two
    subframes, and none with three.
    """
    lost = 0
    cell = WAVELENGTH / (2 * 64 * 54e-6)
    middle = plan(waveform).end_time[-1] / 2
    for seed in range(40):
        draw = np.random.default_rng([78, seed])
        one = drawn_point(draw, 30.0)
        rate = one.range_rate + draw.uniform(0.5, 2.5) * cell
        other = drawn_point(
            draw,
            30.0 - draw.uniform(0.0, 6.0),
            range=one.range + (one.range_rate - rate) * middle,
            range_rate=rate,
            azimuth=one.azimuth,
        )
        found = seen(waveform, [one, other], seed)
        off = np.abs(found.range_rate[:, None] - [one.range_rate, rate]).min(axis=1)
        assert found.num_detections <= 2
        assert np.all(off < 1.2 * cell)
        lost += found.num_detections == 0
    assert lost <= 1


def test_elements_that_take_turns_are_read_in_subframes():
    """Two elements: a third of the span in each subframe, and azimuths of the virtual array."""
    array = replace(ARRAY, num_transmitters=2)
    for seed in range(8):
        point = drawn_point(np.random.default_rng([74, seed]), 30.0)
        ramps = coded(plan(THREE), TimeDivision(), num_elements=2)
        frame = coded_frame(ramps, [point], array=array, converter=CONVERTER, seed=seed)
        found = READER.detect(frame)
        assert is_right(found, point)
        assert found.azimuth[0] == pytest.approx(point.azimuth, abs=np.radians(1.5))


def test_elements_in_two_rows_have_elevations_in_subframes():
    """Four channels on a square of λ/2, of 0.25 λ rms: 0.6° at 35 dB, less 4 dB of the windows."""
    square = replace(ARRAY, channel_positions=((0, 0), (1, 0), (0, 1), (1, 1)))
    for seed in range(8):
        draw = np.random.default_rng([77, seed])
        point = drawn_point(draw, 35.0, elevation=draw.uniform(-0.4, 0.4))
        frame = coded_frame(plan(THREE), [point], array=square, converter=CONVERTER, seed=seed)
        found = replace(READER, angle="bartlett").detect(frame)
        assert is_right(found, point)
        assert found.azimuth[0] == pytest.approx(point.azimuth, abs=np.radians(2.5))
        assert found.elevation[0] == pytest.approx(point.elevation, abs=np.radians(2.5))


def test_turns_of_elements_without_phases_have_no_azimuth():
    """The code's folds are then left to the subframes, which have half the span each."""
    point = drawn_point(np.random.default_rng(75), 35.0, range_rate=-41.0)
    ramps = coded(plan(THREE), TimeDivision(), num_elements=2)
    array = replace(ARRAY, num_transmitters=2)
    frame = coded_frame(ramps, [point], array=array, converter=CONVERTER, errors=[[0.0], [2.0]])
    found = replace(READER, unfolds=False).detect(frame)
    assert is_right(found, point)
    assert np.all(np.isnan(found.azimuth))


def subframe(span: float, folded, *, ranges=20.0, levels=0.0, deviation=0.1, **fields):
    """A subframe's detections with ``folded`` range rates, whose other values are alike."""
    rates = np.atleast_1d(folded)
    one = np.ones(rates.size)
    values = {
        "time": 0.0,
        "span": span,
        "beat_range": ranges * one,
        "range_rate": rates,
        "left": 0.0 * one,
        "level": levels * one,
        "acceleration": 30.0 * one,
        "range_variance": 0.01 * one,
        "rate_variance": deviation**2 * one,
        "left_variance": one,
        "level_variance": 1.0,
    }
    return SubframeDetections(**(values | fields))


def test_the_association_finds_the_range_rate_of_greatest_likelihood():
    """The slow route: the sum of squares on a fine grid of range rates, for drawn measurements."""
    spans, deviation = np.array([39.0, 33.6, 30.1]), 0.08
    grid = np.arange(-75.0, 75.0, 2e-3)
    for seed in range(50):
        draw = np.random.default_rng([76, seed])
        rate = draw.uniform(-70, 70) + deviation * draw.normal(size=3)
        folded = wrapped(rate, spans)
        squares = np.sum((wrapped(folded[:, None] - grid, spans[:, None]) / deviation) ** 2, axis=0)
        parts = [
            subframe(span, one, deviation=deviation)
            for span, one in zip(spans, folded, strict=True)
        ]
        found = associated(parts, span=150.0, time=0.0)
        assert found.range_rate == pytest.approx([grid[np.argmin(squares)]], abs=2e-3)


def test_a_speed_that_two_hypotheses_explain_as_well_is_not_reported():
    """Spans of 30 and 20 m/s agree again after 60: −20 and 40 m/s cannot be told apart."""
    parts = [subframe(span, wrapped(40.0, span)) for span in (30.0, 20.0)]
    assert associated(parts, span=59.0, time=0.0).range_rate == pytest.approx([-20.0])
    assert associated(parts, span=110.0, time=0.0).range_rate.size == 0


def test_a_target_is_sought_where_its_speed_takes_it():
    """In 10 ms, 25 m/s are 0.25 m, and −35 m/s, which fold alike, are −0.35 m; 0.1 m is known."""
    for rate in (25.0, -35.0):
        parts = [
            subframe(span, wrapped(rate, span), ranges=20.0 + rate * late, time=late)
            for span, late in ((30.0, 0.0), (20.0, 0.01))
        ]
        found = associated(parts, span=100.0, time=0.0)
        assert found.range_rate == pytest.approx([rate])


def test_no_target_is_made_of_the_detections_of_two_others():
    """5 and −5 m/s fold to themselves, ±25 m/s to one of them in each subframe.

    The target at −5 m/s is 9 dB stronger.
    """
    parts = [subframe(span, [5.0, -5.0], levels=np.array([0.0, 2.0])) for span in (30.0, 20.0)]
    found = associated(parts, span=59.0, time=0.0)
    assert sorted(found.range_rate) == pytest.approx([-5.0, 5.0])
    assert sorted(found.member.tolist()) == [[0, 0], [1, 1]]


def test_the_joint_span_is_the_least_common_multiple():
    """12 m/s are two spans of 6 and three of 4; 5.9 and 4 agree to 0.2 at 11.8, to 0.1 at 112.1."""
    assert joint_span(np.array([6.0, 4.0]), np.full(2, 0.1)) == pytest.approx(12.0)
    assert joint_span(np.array([5.9, 4.0]), np.full(2, 0.25)) == pytest.approx(11.8)
    assert joint_span(np.array([5.9, 4.0]), np.full(2, 0.15)) == pytest.approx(112.1)
    assert joint_span(np.array([59.0, 40.0]), np.full(2, 0.15)) == 300.0


def moved(schedule: RampSchedule, late) -> RampSchedule:
    return replace(schedule, start_time=schedule.start_time + late)


def test_subframes_are_found_with_and_without_a_pause_between_them():
    whole = plan(THREE)
    for pause in (0.0, 1e-3):
        parts = subframes(moved(whole, pause * (whole.sweep // 64)))
        np.testing.assert_array_equal(np.concatenate(parts), np.arange(192))
        assert [part.size for part in parts] == [64, 64, 64]


@pytest.mark.parametrize(
    ("schedule", "reason"),
    [
        (plan(TWO, 70), r"have 64, 6 of its 70 ramps.*fills whole subframes"),
        (plan(replace(TWO, ramps_per_subframe=4)), r"have 4, 4 of its 8 ramps"),
        (plan(replace(TWO, intervals=(50e-6, 50.1e-6))), "too similar intervals"),
        (
            coded(plan(replace(TWO, ramps_per_subframe=63)), TimeDivision(), num_elements=2),
            "codes",
        ),
    ],
    ids=["unfilled", "short", "similar", "cut code"],
)
def test_subframes_that_do_not_fit_are_refused(schedule, reason):
    with pytest.raises(CapabilityError, match=reason):
        READER.detect(
            coded_frame(
                schedule,
                [],
                array=replace(ARRAY, num_transmitters=schedule.num_elements),
                converter=CONVERTER,
            )
        )


def test_auto_reads_subframes_by_range_doppler_processing_and_drawn_intervals_coherently():
    assert receiver_for(AutoReceiver(), plan(THREE)).kind == "range-doppler"
    assert receiver_for(AutoReceiver(), plan(TWO, 70)).kind == "coherent"
    draw = np.random.default_rng(1).uniform(0, 5e-6, 192)
    jittered = moved(plan(THREE), draw)
    assert receiver_for(AutoReceiver(), jittered).kind == "coherent"
    clocked = plan(THREE).as_clocked(start_time=0.3, clock_offset=2e-5, clock_drift=1e-5)
    assert receiver_for(AutoReceiver(), clocked).kind == "range-doppler"


@pytest.mark.parametrize("count", [2, 3, 8, 64])
def test_chirps_without_any_equal_intervals_have_no_subframes(count):
    chirps = Sawtooth(ramp_duration=25e-6, idle=25e-6).schedule(
        num_sweeps=count, streams=Streams(seed=1)
    )
    jittered = moved(chirps, 1e-6 * np.arange(count) ** 2)
    assert subframes(jittered) == ()
    assert (unreadable(jittered) == "") == (count == 2)
    assert receiver_for(AutoReceiver(), jittered).kind == (
        "range-doppler" if count == 2 else "coherent"
    )


def test_a_sawtooth_has_the_span_of_its_interval():
    chirps = Sawtooth(start_frequency=76.5e9, bandwidth=500e6, ramp_duration=25e-6, idle=5e-6)
    schedule = chirps.schedule(num_sweeps=64, streams=Streams(seed=1))
    expected = SPEED_OF_LIGHT / 76.75e9 / 60e-6
    assert unambiguous_span(schedule) == pytest.approx(expected)
    assert unambiguous_span(schedule, code_length=4) == pytest.approx(expected / 4)
    assert unreadable(schedule) == ""


def test_detections_that_remain_unresolved_are_counted():
    """A target seen at 50 µs that no other subframe has, and one that both have."""
    draw = np.random.default_rng(81)
    for seed in range(5):
        known = drawn_point(draw, 26.0)
        frame = coded_frame(plan(TWO), [known], array=ARRAY, converter=CONVERTER, seed=seed)
        alone = drawn_point(draw, 26.0, range=known.range + 5.0 if known.range < 30 else 10.0)
        other = (
            coded_frame(plan(TWO), [alone], array=ARRAY, converter=CONVERTER, seed=seed).samples
            - coded_frame(plan(TWO), [], array=ARRAY, converter=CONVERTER, seed=seed).samples
        )
        other[:, 64:] = 0.0
        assert READER.detect(frame).num_unresolved == 0
        found = READER.detect(frame.with_samples(frame.samples + other))
        assert is_right(found, known)
        assert found.num_detections == 1
        assert found.num_unresolved == 1
        grouped = replace(READER, grouping=Body())
        assert grouped.detect(frame.with_samples(frame.samples + other)).num_unresolved == 1
