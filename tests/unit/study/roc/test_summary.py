"""Estimates from records that are made up."""

import math

import numpy as np
import pytest

from polychirp.model.antenna import AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import IfParts
from polychirp.model.radar import Converter
from polychirp.model.truth import Truth
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.attribution import target_levels
from polychirp.receiver.coherent.false_alarms import AREA_OF_A_CELL, expected_peaks
from polychirp.receiver.decoding.chain import Decoding
from polychirp.rng import Streams
from polychirp.scoring.ideal_detector import cell_threshold, ideal_detection
from polychirp.scoring.statistics import wilson
from polychirp.study.roc.frames import DrawnPoint, frame_with, middle_of
from polychirp.study.roc.plan import as_read, of_trial, roc_plan, silent_frame
from polychirp.study.roc.summary import crossing, summary_of
from polychirp.study.roc.trial import RocRecord
from polychirp.study.roc.yardsticks import num_cells, num_looks, resolution, window_share
from polychirp.units import from_db, to_db
from polychirp.waveform import Noise, PhaseCodedRamp, Pmcw, TimeDivision
from tests.support.roc_study import TRIANGLES, roc_study

ASK = {"snrs_db": [10.0, 14.0, 18.0], "trials": 20, "noise_trials": 50}


def records(shares, *, others=0, curves=1, trials=20):
    """One record for every trial; the first ones of each case are found."""
    for case, share in shares.items():
        for trial in range(trials):
            hit = trial < share * trials
            yield RocRecord(
                case=case, trial=trial, found=(hit,) * curves, others=(others,) * curves
            )


def some_records():
    yield from records({"10.0 dB": 0.2, "14.0 dB": 0.4, "18.0 dB": 0.9}, others=2)
    yield from records({"noise": 0.0}, others=3, trials=50)


def test_a_curve_is_the_share_of_frames_with_the_ideal_beside_it():
    found = summary_of(roc_plan(roc_study(), **ASK), some_records())
    assert [point.detection for point in found.points] == [wilson(p, 20) for p in (0.2, 0.4, 0.9)]
    assert [point.num_trials for point in found.points] == [20] * 3
    assert [point.others.value for point in found.points] == [2.0] * 3
    threshold = cell_threshold(1e-4, num_channels=2)
    ideal = ideal_detection(from_db(14.0), num_channels=2, threshold=threshold)
    assert found.points[1].ideal == pytest.approx(float(ideal))
    assert found.points[1].ideal_windowed < found.points[1].ideal
    assert found.looks == (2,)


def test_half_of_the_points_are_found_between_two_snrs():
    """From 0.4 at 14 dB to 0.9 at 18 dB, one half is at 14.8 dB."""
    (needed,) = summary_of(roc_plan(roc_study(), **ASK), some_records()).needed
    assert needed.snr_db.value == pytest.approx(14.8)
    assert needed.snr_db.low < 14.8 < needed.snr_db.high
    assert needed.windowed_db - needed.ideal_db == pytest.approx(
        -10 * math.log10(window_share_of_the_plan()), abs=1e-6
    )


def window_share_of_the_plan():
    plan = roc_plan(roc_study(), **ASK)
    return window_share(plan.curves[0].receiver, silent_frame(plan))


def test_two_windows_of_kaiser_take_four_decibels():
    """1.58 cells of noise bandwidth each, 2.0 dB."""
    assert 10 * math.log10(window_share_of_the_plan()) == pytest.approx(-4.0, abs=0.15)


A = from_db(60.0)
CODED = {
    "one sample per chip": (
        Pmcw(order=7, periods=3, idle=0.0, chip_duration=5e-9),
        IfFilter(passband=80e6, stopband=140e6, attenuation=A),
        Converter(sample_rate=200e6, start=0.6e-6, margin=0.0),
    ),
    "two samples per chip": (
        Pmcw(order=7, periods=3, idle=0.0, chip_duration=5e-9),
        IfFilter(passband=90e6, stopband=120e6, attenuation=A),
        Converter(sample_rate=400e6, start=0.6e-6, margin=0.0),
    ),
    "noise": (
        Noise(bandwidth=150e6, chip_duration=5e-9, num_chips=254, periods=3, idle=0.0),
        IfFilter(passband=90e6, stopband=120e6, attenuation=A),
        Converter(sample_rate=400e6, start=0.6e-6, margin=0.0),
    ),
    "chips in chirps": (
        PhaseCodedRamp(num_chips=64),
        IfFilter(passband=11e6, stopband=14e6, attenuation=A),
        Converter(sample_rate=25e6, start=2e-6, margin=1e-6),
    ),
}


@pytest.mark.parametrize("case", CODED)
def test_the_greatest_snr_of_an_echo_with_a_code_is_that_of_simulated_samples(case):
    """The mean of twelve points, of whose SNR the spectra of echo and noise tell 0.1 dB each."""
    waveform, if_filter, converter = CODED[case]
    study = roc_study(
        waveform,
        Decoding(greatest_range=60.0),
        num_sweeps=64,
        if_filter=if_filter,
        converter=converter,
    )
    plan = roc_plan(study, snrs_db=[40.0], trials=1, noise_trials=1)
    receiver = plan.curves[0].receiver
    expected = window_share(receiver, silent_frame(plan))
    measured = [share_of_a_point(plan, receiver, trial) for trial in range(12)]
    assert to_db(np.mean(measured) / expected) == pytest.approx(0.0, abs=0.35)


def share_of_a_point(plan, receiver, trial):
    """SNR of a drawn point in its cell over its coherent SNR."""
    study, random = of_trial(plan.study, trial), np.random.default_rng(trial)
    point = DrawnPoint(
        range=random.uniform(5.0, 50.0),
        range_rate=random.uniform(-4.0, 4.0),
        azimuth=random.uniform(-0.5, 0.5),
        snr=from_db(40.0),
    )
    silent, frame = (frame_with(study, points, streams=Streams(trial)) for points in ([], [point]))
    parts = IfParts(
        samples=np.stack([frame.samples - silent.samples, silent.samples]), names=("echo", "noise")
    )
    truth = Truth(
        time=middle_of(frame.schedule),
        name=("point",),
        range=[point.range],
        range_rate=[point.range_rate],
        azimuth=[point.azimuth],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
    )
    return target_levels(receiver, frame, parts, truth).snr[0] / point.snr


def test_false_alarms_are_counted_per_frame_and_cell():
    (row,) = summary_of(roc_plan(roc_study(), **ASK), some_records()).noise
    assert (row.num_trials, row.detections.value) == (50, 3.0)
    assert row.per_cell.value == pytest.approx(3.0 / row.num_cells)
    assert row.stated == pytest.approx(1e-4 * row.num_cells)
    assert row.chance == wilson(0.0, 50)


def test_frames_that_the_plan_does_not_ask_for_are_left_out():
    extra = records({"14.0 dB": 1.0, "12.0 dB": 1.0}, trials=40)
    found = summary_of(roc_plan(roc_study(), **ASK), [*some_records(), *list(extra)[20:]])
    assert found.points[1].detection == wilson(0.4, 20)


def test_no_record_is_no_estimate():
    found = summary_of(roc_plan(roc_study(), **ASK), [])
    assert math.isnan(found.points[0].detection.value)
    assert math.isnan(found.noise[0].detections.value)
    assert math.isnan(found.needed[0].snr_db.value)


@pytest.mark.filterwarnings("ignore:the .* equal ramps of:polychirp.errors.ModelWarning")
def test_cells_are_those_of_each_receivers_map():
    """32 rates and ranges of c fs/2bN up to 30 m; λ/2T by c/2B cells for the coherent receiver.

    The coherent receiver's area is that of the samples, whose windows leave 0.92 of each ramp.
    """
    plan = roc_plan(roc_study(), kinds=["range-doppler", "coherent"], **ASK)
    frame = silent_frame(plan)
    by_fft, coherent = (num_cells(curve.receiver, frame) for curve in plan.curves)
    step = 299792458.0 * 4e6 / (2 * 5e12 * frame.times.most_samples)
    assert by_fft == 32 * (math.floor(30.0 / step) - math.ceil(0.5 / step) + 1)
    cell = resolution(plan.curves[1].receiver, frame.schedule, frame.times)
    assert coherent == pytest.approx(29.5 * 64.0 / (cell.range * cell.range_rate), rel=0.15)
    assert expected_peaks(20.0, num_channels=2) * AREA_OF_A_CELL < 1e-5


def test_the_papers_receiver_is_beside_an_ideal_one_with_as_many_false_detections():
    with pytest.warns(UserWarning, match="serves for comparison"):
        plan = roc_plan(roc_study(TRIANGLES, num_sweeps=6, receiver=PaperReceiver()), **ASK)
    found = summary_of(plan, some_records())
    row = found.noise[0]
    assert math.isnan(row.stated)
    threshold = cell_threshold(3.0 / row.num_cells, num_channels=2)
    expected = ideal_detection(from_db(10.0), num_channels=2, threshold=threshold)
    assert found.points[0].ideal == pytest.approx(float(expected))
    assert math.isnan(found.points[0].ideal_windowed)


@pytest.mark.filterwarnings("ignore:the .* equal ramps of:polychirp.errors.ModelWarning")
@pytest.mark.filterwarnings("ignore:the 3 transmitting elements:polychirp.errors.ModelWarning")
def test_looks_of_a_code_are_those_of_the_virtual_array():
    array = AntennaArray(num_channels=2, num_transmitters=3)
    study = roc_study(num_sweeps=24, array=array, coding=TimeDivision())
    plan = roc_plan(study, kinds=["range-doppler", "coherent"], **ASK)
    silent = silent_frame(plan)
    looks = [num_looks(c.receiver, as_read(c.receiver, silent)) for c in plan.curves]
    assert looks == [6, 6]


@pytest.mark.parametrize(
    ("values", "expected"),
    [([0.0, 1.0, 1.0], 11.0), ([0.0, 0.2, 0.4], math.nan), ([0.9, 1.0, 1.0], math.nan)],
)
def test_a_level_is_crossed_between_values_or_not_at_all(values, expected):
    np.testing.assert_equal(crossing([10.0, 12.0, 14.0], values, 0.5), expected)
