"""Receivers measured by ``polychirp roc`` detect as theory says, and alarm no more than stated."""

import numpy as np
import pytest

from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.scoring.ideal_detector import cell_threshold, ideal_detection
from polychirp.scoring.statistics import poisson_mean, proportion
from polychirp.study.roc.plan import roc_plan, silent_frame
from polychirp.study.roc.summary import summary_of
from polychirp.study.roc.trial import measured
from polychirp.study.roc.yardsticks import window_share
from polychirp.units import from_db
from tests.support.roc_study import roc_study

NUM_CHANNELS = 2


def hits(plan, snr_db, num_trials):
    found = [measured(plan, snr_db, trial).found[0] for trial in range(num_trials)]
    return np.array(found, dtype=float)


def straddling(size, share):
    """Power of a tone in the nearest cell over that in a cell's middle, after the taper.

    ``share`` is the tone's distance from the cell, in cells.
    """
    turn = np.exp(2j * np.pi * np.outer(share, np.arange(size) - 0.5 * (size - 1)) / size)
    return np.abs(turn @ taper(size)) ** 2


def expected_detection(plan, snr_db):
    """That of the ideal detector in the cell nearest to the point, averaged over its place in it.

    No neighbouring cell helps, and the floor is known.
    """
    frame = silent_frame(plan)
    share = window_share(plan.curves[0].receiver, frame)
    offset = (np.arange(20) + 0.5) / 20 - 0.5
    fast, slow = (
        straddling(size, offset) for size in (frame.times.most_samples, frame.schedule.num_ramps)
    )
    snr = from_db(snr_db) * share * np.outer(fast, slow)
    threshold = cell_threshold(plan.curves[0].probability, num_channels=NUM_CHANNELS)
    return float(np.mean(ideal_detection(snr, num_channels=NUM_CHANNELS, threshold=threshold)))


@pytest.mark.slow
def test_chirps_lose_windows_straddling_and_half_a_decibel_of_cfar():
    """The windows take 4 dB, straddling 0.8 dB on average, and the estimated floor 0.5 dB or less.

    Two probabilities, at two SNRs each; limits are 3 standard deviations of 120 frames.
    """
    for probability, snrs in ((1e-3, (12.5, 15.0)), (1e-5, (15.0, 17.0))):
        plan = roc_plan(
            roc_study(), snrs_db=snrs, trials=1, noise_trials=1, probabilities=[probability]
        )
        for snr_db in snrs:
            share = hits(plan, snr_db, 120).mean()
            highest = expected_detection(plan, snr_db + 0.2)  # a neighbouring cell may help
            lowest = expected_detection(plan, snr_db - 0.5)
            assert share <= highest + 3 * np.sqrt(highest * (1 - highest) / 120)
            assert share >= lowest - 3 * np.sqrt(lowest * (1 - lowest) / 120)


def noise_maxima(num_trials, shape, probability):
    """Local maxima above the ideal threshold in tapered transforms of drawn noise, per cell.

    Another route to the receiver's false alarms: the floor is known, and noise is white.
    """
    draw = np.random.default_rng(1)
    rows, columns = shape
    window = np.outer(taper(rows), taper(columns))
    scale = 1.0 / np.sum(window**2)
    threshold = cell_threshold(probability, num_channels=NUM_CHANNELS)
    count = 0
    for _ in range(num_trials):
        noise = draw.normal(scale=np.sqrt(0.5), size=(2, NUM_CHANNELS, rows, columns))
        spectrum = np.fft.fft2((noise[0] + 1j * noise[1]) * window)
        power = scale * np.sum(np.abs(spectrum) ** 2, axis=0)
        around = [
            np.roll(power, (i, j), axis=(0, 1))
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
            if (i, j) != (0, 0)
        ]
        count += int(np.sum((power > threshold) & (power > np.max(around, axis=0))))
    return count / (num_trials * rows * columns)


@pytest.mark.slow
def test_noise_alone_is_detected_as_often_as_its_maxima_cross_the_threshold():
    """At 1e-3 a map of 1184 cells has 1.2 crossings, of which two of three are maxima."""
    plan = roc_plan(roc_study(), snrs_db=[14.0], trials=1, noise_trials=150, probabilities=[1e-3])
    records = [measured(plan, None, trial) for trial in range(150)]
    (row,) = summary_of(plan, records).noise
    expected = noise_maxima(400, (32, 150), 1e-3)
    # the CFAR's floor is that of neighbouring cells, which changes the rate by up to a tenth
    assert 0.9 * row.per_cell.low <= expected <= 1.1 * row.per_cell.high
    assert row.detections.low <= row.stated
    counts = np.array([record.others[0] for record in records], dtype=float)
    assert row.detections == poisson_mean(counts)
    # independent peaks: the variance of Poisson numbers is their mean, ± 4 √(2/150)
    assert counts.var(ddof=1) / counts.mean() == pytest.approx(1.0, abs=0.46)


@pytest.mark.slow
def test_the_coherent_receiver_is_within_a_decibel_of_the_ideal_detector():
    """On the same chirps; 3 standard deviations of 60 frames. It has no windows to lose.

    Its speeds are those below λ/4T = 19.6 m/s, which it need not tell from folded ones.
    """
    receiver = CoherentReceiver(greatest_speed=18.0, false_alarm_probability=1e-4)
    plan = roc_plan(roc_study(receiver=receiver), snrs_db=[11.0, 13.0], trials=60, noise_trials=40)
    records = [
        measured(plan, snr_db, trial)
        for n, snr_db in enumerate(plan.cases)
        for trial in range(plan.num_trials(n))
    ]
    found = summary_of(plan, records)
    threshold = summary_threshold(plan)
    for point in found.points:
        lowest, highest = (
            float(
                ideal_detection(
                    from_db(point.snr_db + change), num_channels=NUM_CHANNELS, threshold=threshold
                )
            )
            for change in (-1.0, 0.3)
        )
        share = point.detection.value
        assert share >= lowest - 3 * np.sqrt(lowest * (1 - lowest) / 60)
        assert share <= highest + 3 * np.sqrt(highest * (1 - highest) / 60)
        assert lowest <= point.ideal <= highest
    assert found.noise[0].detections.low <= found.noise[0].stated


def summary_threshold(plan):
    """Threshold at which the ideal detector has one maximum in 10⁴ resolution cells of noise."""
    from polychirp.receiver.coherent.false_alarms import threshold_of

    return threshold_of(plan.curves[0].probability, num_channels=NUM_CHANNELS)


def test_a_strong_point_in_the_next_cell_masks_the_tested_one():
    """30 dB stronger and 0.8 m away it covers it; ten cells away it does not."""
    shares = []
    for distance in (0.8, 8.0):
        plan = roc_plan(
            roc_study(),
            snrs_db=[24.0],
            trials=1,
            noise_trials=1,
            strong=from_db(30.0),
            apart=(distance, 0.0),
        )
        shares.append(proportion(hits(plan, 24.0, 12), np.ones(12)).value)
    assert shares[0] <= 0.25
    assert shares[1] >= 0.9


def test_an_interferer_with_equal_chirps_adds_detections():
    """It starts together with the radar, 37 m away: a ghost at 18.5 m in every frame."""
    plan = roc_plan(roc_study(), snrs_db=[14.0], trials=1, noise_trials=1, interferers=["other"])
    counts = [measured(plan, None, trial).others[0] for trial in range(4)]
    assert min(counts) >= 1
