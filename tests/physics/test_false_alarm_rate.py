"""Noise crosses a CFAR threshold as often as is stated: of receivers, and of one direction."""

import numpy as np
import pytest
from scipy.stats import binom, poisson

from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.detection.cfar import (
    CfarWindow,
    Crossings,
    crosses_its_row,
    ordered_statistic,
    ordered_statistic_factor,
)
from polychirp.receiver.detection.looks import independent_looks
from polychirp.receiver.range_doppler.chain import AROUND, RangeDoppler
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.rng import Streams
from polychirp.study.roc.yardsticks import num_cells
from polychirp.waveform import Mfsk

CONFIDENCE = 1 - 1e-4


def interval(trials: int, probability: float) -> tuple[float, float]:
    """Counts between which a binomial variable lies with the confidence of this file."""
    low, high = binom.interval(CONFIDENCE, trials, probability)
    return float(low), float(high)


@pytest.mark.parametrize("num_looks", [1, 8])
@pytest.mark.parametrize("num_cells", [8, 40])
@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_a_cell_among_independent_training_cells_crosses_as_often_as_stated(
    num_looks: int, num_cells: int, probability: float
):
    """200 000 independent trials: a cell and its own training cells."""
    trials = 200_000
    random = np.random.default_rng([num_looks, num_cells, round(1 / probability)])
    cell = random.gamma(num_looks, size=trials)
    training = random.gamma(num_looks, size=(trials, num_cells))
    rank = round(0.75 * num_cells)
    options = {"false_alarm_probability": probability, "num_looks": num_looks}
    order = (
        ordered_statistic_factor(num_cells, rank, **options)
        * np.partition(training, rank - 1, axis=1)[:, rank - 1]
    )
    low, high = interval(trials, probability)
    assert low <= np.count_nonzero(cell > order) <= high


@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_a_whole_map_of_noise_crosses_as_often_as_stated_edges_included(probability):
    """Neighbouring decisions share training cells, which widens the binomial law a little.

    Their floor, of N ≥ 63 cells, is uncertain by 1/√N, so the conditional probability of a cell
    by a factor of about 1 ± α/√N, common to about N cells; over 262 144 cells that adds less
    than a quarter of the binomial spread at 1e-2 and less at 1e-3. The interval is taken a
    quarter wider.
    """
    power = np.random.default_rng(7).exponential(size=(512, 512))
    window = CfarWindow(guard=(2, 2), training=(5, 5), is_circular=(True, False))
    found = ordered_statistic(power, window=window, false_alarm_probability=probability)
    low, high = interval(power.size, probability)
    expected = probability * power.size
    assert abs(found.row.size - expected) <= 1.25 * max(expected - low, high - expected)
    # the edges, where training cells are fewer, are no exception
    is_edge = (found.column < 7) | (found.column >= 505)
    low, high = interval(512 * 14, probability)
    assert low <= np.count_nonzero(is_edge) <= high


@pytest.mark.parametrize("num_cells", [4, 16, 64])
def test_the_quadrature_for_many_looks_is_rohlings_product_for_one(num_cells: int):
    """The general law at one look, against the closed product formula."""
    from scipy.special import gammaincc

    from polychirp.receiver.detection.cfar import _order_statistic

    rank = 3 * num_cells // 4
    alpha = ordered_statistic_factor(num_cells, rank, false_alarm_probability=1e-4)
    value, weight = _order_statistic(num_cells, rank, 1)
    assert weight @ gammaincc(1, alpha * value) == pytest.approx(1e-4, rel=1e-4)


def crossings_over_stated(inr, *, channels, maps=30, probability=1e-3):
    """Rate of crossings beside thermal noise and a noise-like signal of one direction.

    Returned beside the number of looks in the median.
    """
    random = np.random.default_rng([channels, round(100 * inr)])
    shape = (128, 120)
    found, looks = 0, []
    for _ in range(maps):
        noise = random.normal(size=(channels, *shape, 2)).view(complex)[..., 0]
        other = random.normal(size=(*shape, 2)).view(complex)[..., 0]
        turn = np.exp(2j * np.pi * random.random() * np.arange(channels))[:, None, None]
        amplitude = (noise + np.sqrt(inr) * turn * other).astype(np.complex64)
        looks.append(np.median(independent_looks(amplitude)))
        crossed = ordered_statistic(
            np.mean(np.abs(amplitude) ** 2, axis=0),
            window=AROUND,
            false_alarm_probability=probability,
            quantile=0.6,
            num_looks=independent_looks(amplitude),
        )
        found += crossed.row.size
    return found / (maps * np.prod(shape) * probability), float(np.median(looks))


@pytest.mark.parametrize("channels", [4, 12])
@pytest.mark.parametrize("inr", [0.0, 0.1, 1.0, 10.0, 1e4])
def test_a_signal_of_one_direction_does_not_raise_the_rate_of_crossings(inr, channels):
    """Without it, all channels are looks; where it is far above the noise, there is one look.

    With as many looks as channels, the rate would be 30 to 80 times the stated one at 40 dB.
    Between both ends a threshold for tr R / λ looks lies on the safe side.
    """
    rate, looks = crossings_over_stated(inr, channels=channels)
    assert rate < 1.4
    if inr in (0.0, 1e4):
        assert rate == pytest.approx(1.0, abs=0.15)
        assert looks == (channels if inr == 0.0 else 1.0)


def chirps(*, sign):
    """Schedule and sample times of 128 chirps, whose phases have a sign from chirp to chirp."""
    k = np.arange(128)
    ramps = RampSchedule(
        start_time=k * 60e-6,
        duration=0 * k + 50e-6,
        start_frequency=0 * k + 77e9,
        slope=0 * k + 10e12,
        start_phase=0.25 * (1.0 - sign),
        sweep=k,
    )
    times = SampleTimes(first=ramps.start_time + 5e-6, num_samples=0 * k + 256, rate=6e6)
    return ramps, times


def detections_over_stated(samples, ramps, times, *, probability=1e-3):
    """Detections over the number that is stated for the frame."""
    array = AntennaArray(num_channels=len(samples), spacing=1.95e-3)
    frame = IfFrame(samples=samples, times=times, schedule=ramps, array=array)
    receiver = RangeDoppler(false_alarm_probability=probability)
    return receiver.detect(frame).num_detections / (probability * num_cells(receiver, frame))


def test_a_receiver_stays_at_its_rate_beside_noise_of_one_direction():
    """Samples 40 dB above thermal noise, the same in all channels, as of a radar with codes."""
    random = np.random.default_rng(6)
    ramps, times = chirps(sign=np.ones(128))
    noise = random.normal(size=(4, 128, 256, 2)).view(complex)[..., 0]
    other = random.normal(size=(1, 128, 256, 2)).view(complex)[..., 0]
    for samples in (noise, noise + 100.0 * other):
        assert detections_over_stated(samples, ramps, times) < 1.3


def test_a_receiver_of_codes_stays_at_its_rate_beside_a_signal_without_its_code():
    """The signal is spread over all range rates of one range, 30 dB above the noise there.

    Training cells around a cell would have the floor of other ranges, and all cells of this range
    would cross the threshold. A frame without codes has the line as a single detection.
    """
    random = np.random.default_rng(8)
    ratios = []
    for _ in range(20):
        sign = 1.0 - 2.0 * random.integers(2, size=128)
        ramps, times = chirps(sign=sign)
        noise = random.normal(size=(4, 128, 256, 2)).view(complex)[..., 0]
        tone = np.exp(2j * np.pi * 0.1 * np.arange(256)) * sign[:, None]
        ratios.append(detections_over_stated(noise + 3.0 * tone, ramps, times))
    assert np.mean(ratios) < 1.3


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, 1e38, 1e-44])
def test_looks_are_counted_whatever_a_recording_has(value):
    amplitude = np.full((4, 32, 20), value, dtype=np.complex64)
    amplitude[:, :, :3] = 1.0
    looks = independent_looks(amplitude)
    assert np.all((looks >= 1.0) & (looks <= 4.0))


def detections_on_a_ridge(window, *, ridge, maps=12, probability=1e-4, ramps=128):
    """Detections in frames of noise with a ridge over all range rates, of one direction.

    It is the signal of another radar with the same slope and start whose phases are drawn from ramp
    to ramp: a beat of one range, with a phase that is new on every ramp.
    """
    samples, channels = 160, 4
    k = np.arange(ramps)
    schedule = RampSchedule(
        start_time=k * 25e-6, duration=0 * k + 20e-6, start_frequency=0 * k + 76.5e9,
        slope=0 * k + 15e12, start_phase=0.0 * k, sweep=k,
    )  # fmt: skip
    times = SampleTimes(first=schedule.start_time + 1e-6, num_samples=0 * k + samples, rate=10e6)
    total = 0
    for number in range(maps):
        random = np.random.default_rng([number, round(ridge)])
        noise = random.normal(size=(channels, ramps, samples, 2)) @ [1.0, 1.0j]
        beat = np.exp(2j * np.pi * (0.21 * np.arange(samples) + random.random((ramps, 1))))
        turn = np.exp(1j * 0.7 * np.arange(channels))[:, None, None]
        frame = IfFrame(
            samples=noise + np.sqrt(2.0 * ridge) * turn * beat, times=times, schedule=schedule,
            array=AntennaArray(num_channels=channels),
        )  # fmt: skip
        receiver = RangeDoppler(
            false_alarm_probability=probability, greatest_range=70.0, window=window
        )
        total += receiver.detect(frame).num_detections
        stated = probability * num_cells(receiver, frame)
    return total / maps, stated


def test_a_coded_radar_of_the_same_slope_makes_no_row_of_detections():
    """Victims with equal chirps: the ridge is compared with itself, and noise as before.

    With cells around alone, the ridge gives tens of detections in a frame.
    """
    around, stated = detections_on_a_ridge(AROUND, ridge=0.0)
    assert detections_on_a_ridge(AROUND, ridge=1000.0)[0] > 20.0
    assert detections_on_a_ridge(None, ridge=0.0)[0] == pytest.approx(around, abs=0.5 * stated)
    assert detections_on_a_ridge(None, ridge=1000.0)[0] < 1.5 * stated


@pytest.mark.parametrize("ramps", [2, 3, 8, 48])
def test_maps_of_few_range_rates_are_read(ramps):
    """Not even a ridge has training cells of the same range there; the rate is as stated."""
    found, stated = detections_on_a_ridge(None, ridge=0.0, ramps=ramps, maps=40)
    assert found < 3.0 * stated


@pytest.mark.parametrize("channels", [4, 12])
@pytest.mark.parametrize("ratio", [0.0, 1.0, 1e4])
def test_a_receiver_of_steps_stays_at_its_rate_beside_noise_of_one_direction(channels, ratio):
    """As ramps of another radar make it, which cross some of the steps.

    With both sequences of all channels as looks, 3 detections in a frame of 4 channels and 7 of 12
    were found at 40 dB, where 0.08 are stated.
    """
    schedule = Mfsk(num_steps=512).schedule(num_sweeps=1, streams=Streams(1))
    steps = schedule.num_ramps
    times = SampleTimes(first=schedule.start_time + 3e-6, num_samples=np.full(steps, 4), rate=1e6)
    receiver = MfskReceiver(false_alarm_probability=1e-3)
    found, stated = 0, 0.0
    for number in range(60):
        random = np.random.default_rng([number, channels])
        noise = random.normal(size=(channels, steps, 4, 2)).view(complex)[..., 0]
        other = random.normal(size=(1, steps, 4, 2)).view(complex)[..., 0]
        turn = np.exp(2j * np.pi * random.random() * np.arange(channels))[:, None, None]
        frame = IfFrame(
            samples=noise + np.sqrt(ratio) * turn * other, times=times, schedule=schedule,
            array=AntennaArray(num_channels=channels, spacing=1.95e-3),
        )  # fmt: skip
        found += receiver.detect(frame).num_detections
        stated += receiver.false_alarm_probability * num_cells(receiver, frame)
    assert found <= poisson.ppf(CONFIDENCE, 1.4 * stated)


def test_a_band_of_range_rates_of_one_direction_does_not_raise_the_rate():
    """Bursts of a radar of equal chirps fill some range rates, at all ranges.

    The band is narrower than the window around a cell, whose floor is then that beside the band: 7
    times as many cells as stated for the map were detections at 1e-3.
    """
    ramps, times = chirps(sign=np.ones(128))
    ratios = []
    for number in range(6):
        random = np.random.default_rng([9, number])
        noise = random.normal(size=(4, 128, 256, 2)).view(complex)[..., 0]
        rates = np.fft.fft(random.normal(size=(128, 256, 2)).view(complex)[..., 0], axis=0)
        rates[10:] = 0.0
        band = 30.0 * np.fft.ifft(rates, axis=0)
        ratios.append(detections_over_stated(noise + band, ramps, times))
    assert np.mean(ratios) < 1.3


def test_a_cell_of_a_ridge_crosses_its_row_as_often_as_stated():
    """The order statistic may count the cell itself: rows of independent exponential cells."""
    rows, columns, probability = 600, 512, 1e-2
    power = np.random.default_rng(5).exponential(size=(rows, columns))
    power[: rows // 4] *= 1e3  # ridges, fewer than half of the rows
    row, column = (place.ravel() for place in np.indices((rows // 4, columns)))
    cells = Crossings(
        row=row, column=column, power=power[row, column],
        floor=np.ones(row.size), threshold=np.zeros(row.size),
    )  # fmt: skip
    is_kept = crosses_its_row(
        power, cells, false_alarm_probability=probability, quantile=0.3,
        num_looks=np.ones(columns), side_lobe=np.zeros(columns),
    )  # fmt: skip
    # cells of a row share its level, of 256 cells and uncertain by √(0.3/0.7/256)/0.357 = 11 %;
    # at 1e-2 their probability is by 4.6 times as much
    spread = np.sqrt(row.size * probability) * np.hypot(1.0, np.sqrt(columns * probability) * 0.53)
    assert abs(np.count_nonzero(is_kept) - row.size * probability) < 4.0 * spread
