"""Doppler division with empty bands: which of the folded range rates is right, and for how many.

Four elements in six bands, as the AWR2944 plays them (TI, TIDUF01, §2.4.8), unless a test says
otherwise. SNRs are those of the whole frame: of all samples, elements and channels together.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.radar import Converter
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.transforms import (
    middle_frequency,
    range_profiles,
    taper,
)
from polychirp.receiver.range_doppler.unfolding import unfolded
from polychirp.receiver.signal_model.transmit_codes import code_blocks
from polychirp.rng import Streams
from polychirp.waveform import AnyCoding, DopplerDivision, PhaseCoded, Sawtooth, coded
from tests.support.points import HandPoint, coded_frame

NUM_SWEEPS, INTERVAL = 96, 30e-6
WAVELENGTH = SPEED_OF_LIGHT / 76.75e9
SPAN = WAVELENGTH / (2 * INTERVAL)  # of the range rates that chirps of one element tell apart
CELL = SPAN / NUM_SWEEPS
SIX = DopplerDivision(num_bands=6)
CONVERTER = Converter(sample_rate=12e6, start=1e-6, margin=1e-6)
SAMPLES = NUM_SWEEPS * 241
READER = RangeDoppler(greatest_range=60.0)


def plan(coding: AnyCoding, num_elements: int):
    chirps = Sawtooth(start_frequency=76.5e9, bandwidth=500e6, ramp_duration=22e-6, idle=8e-6)
    ramps = chirps.schedule(num_sweeps=NUM_SWEEPS, streams=Streams(seed=1))
    return coded(ramps, coding, num_elements=num_elements)


def array(num_elements: int, num_channels: int = 4) -> AntennaArray:
    return AntennaArray(
        num_channels=num_channels, spacing=WAVELENGTH / 2, num_transmitters=num_elements
    )


def seen(points, seed, *, coding=SIX, elements=4, channels=4, errors=0.0, placed=()):
    return coded_frame(
        plan(coding, elements),
        points,
        array=replace(array(elements, channels), transmitter_positions=placed),
        converter=CONVERTER,
        errors=errors,
        seed=seed,
    )


def power(snr_db: float, elements: int = 4, channels: int = 4) -> float:
    """Power of one element in one channel for an SNR of the whole frame, dB."""
    return 10 ** (snr_db / 10) / (SAMPLES * channels * elements)


def right(found, point: HandPoint) -> bool:
    """True if the point was found with the range rate that it has."""
    distance = point.range + point.range_rate * found.time
    near = np.abs(found.range - distance) < 0.3
    return bool(np.any(near & (np.abs(found.range_rate - point.range_rate) < 1.2 * CELL)))


def drawn_point(draw, snr_db: float, elements: int = 4, channels: int = 4) -> HandPoint:
    return HandPoint(
        range=draw.uniform(8, 50),
        range_rate=draw.uniform(-0.49, 0.49) * SPAN,
        azimuth=draw.uniform(-0.7, 0.7),
        power=power(snr_db, elements, channels),
    )


@pytest.mark.parametrize(
    ("coding", "elements", "channels", "reader", "spread"),
    [
        (SIX, 4, 4, READER, 0.0),
        (SIX, 4, 4, RangeDoppler(greatest_range=60.0, unfolds=False), 9.0),
        (SIX, 4, 1, READER, 9.0),
        (DopplerDivision(num_bands=4), 3, 4, READER, 0.1),
        (PhaseCoded(), 3, 4, RangeDoppler(greatest_range=60.0, unfolds=False), 9.0),
    ],
    ids=["beams", "unknown phases", "one channel", "AWR1843 with one empty band", "signs"],
)
def test_the_speed_is_right_over_the_whole_span(coding, elements, channels, reader, spread):
    """Of 60 drawn targets of 26 dB all have the right speed: 0.95 or more, at 95 %.

    With phases of channels that are drawn from whole turns, the empty bands alone decide.
    """
    hits = 0
    for seed in range(60):
        draw = np.random.default_rng([61, seed])
        point = drawn_point(draw, 26.0, elements, channels)
        errors = spread * draw.normal(size=(elements, channels))
        frame = seen(
            [point], seed, coding=coding, elements=elements, channels=channels, errors=errors
        )
        found = reader.detect(frame)
        hits += right(found, point) and found.num_detections == 1
    assert hits == 60


@pytest.mark.slow
@pytest.mark.parametrize(("unfolds", "spread", "snr"), [(True, 0.0, 22.0), (False, 9.0, 24.0)])
def test_99_of_100_speeds_are_right_near_the_threshold_of_detection(unfolds, spread, snr):
    """Of 400 targets 9 in 10 are detected, and the speeds of less than 1 % are wrong, at 95 %.

    Without known phases between channels, 2 dB more are needed.
    """
    reader = RangeDoppler(greatest_range=60.0, unfolds=unfolds)
    seen_at_all, wrong = 0, 0
    for seed in range(400):
        draw = np.random.default_rng([62, seed])
        point = drawn_point(draw, snr)
        found = reader.detect(seen([point], seed, errors=spread * draw.normal(size=(4, 4))))
        seen_at_all += found.num_detections > 0
        wrong += found.num_detections > 0 and not right(found, point)
    assert seen_at_all >= 360
    assert binom.cdf(wrong, seen_at_all, 0.01) < 0.05


def test_the_speed_is_right_with_elements_in_two_rows():
    """Of 30 drawn targets of 26 dB all have the right speed: 0.9 or more, at 95 %."""
    raised = ((0, 0), (4, 1), (8, 0), (12, 1))
    reader = replace(READER, angle="bartlett")
    for seed in range(30):
        draw = np.random.default_rng([65, seed])
        point = replace(drawn_point(draw, 26.0), elevation=draw.uniform(-0.3, 0.3))
        found = reader.detect(seen([point], seed, placed=raised))
        assert right(found, point)
        assert found.num_detections == 1


@pytest.mark.parametrize(
    ("ratio", "placed"),
    [(0.0, ()), (10.0, ()), (20.0, ()), (10.0, ((0, 0), (4, 0), (10, 0), (14, 0)))],
    ids=["equal", "10 dB", "20 dB", "10 dB, a line with a gap"],
)
def test_two_targets_of_one_cell_are_both_found(ratio, placed):
    """Their range rates differ by whole bands and up to half a cell; the weaker one has 25 dB.

    Of 24 pairs 21 are both right, and at most one of 48 points is reported that is none.
    """
    both, false = 0, 0
    for seed in range(24):
        draw = np.random.default_rng([63, seed])
        shift = draw.choice(6, 2, replace=False)
        rate = draw.uniform(-0.49, -0.49 + 1 / 6) * SPAN + shift * SPAN / 6
        rate[1] += draw.uniform(-0.5, 0.5) * CELL
        middle, azimuth = draw.uniform(15, 45), draw.uniform(-0.7, 0.7, 2)
        points = [
            HandPoint(
                range=middle - rate[k] * NUM_SWEEPS * INTERVAL / 2,
                range_rate=rate[k],
                azimuth=azimuth[k],
                power=power(25.0 + ratio * (k == 0)),
            )
            for k in (0, 1)
        ]
        found = READER.detect(seen(points, seed, placed=placed))
        hits = sum(right(found, point) for point in points)
        both += hits == 2
        false += found.num_detections - hits
    assert both >= 21
    assert false <= 1


def test_a_strong_target_alone_is_not_two():
    """At 65 dB a share of 1e-4 in the empty bands would be 35 dB above the noise."""
    draw = np.random.default_rng(64)
    for seed in range(12):
        found = READER.detect(seen([drawn_point(draw, 65.0)], seed))
        assert np.unique(found.range.round(1)).size == found.num_detections


def test_the_power_of_each_fold_is_that_of_its_bands_in_the_whole_doppler_spectrum():
    """The slow route: one transform over all sweeps, read where the elements' images are.

    The taper of the six series is that of one series, repeated six times.
    """
    point = HandPoint(range=20.0, range_rate=17.0, azimuth=0.3, power=1.0)
    frame = seen([point], 1)
    blocks = code_blocks(frame.schedule)
    spectra = READER.spectra(frame)
    row, column = np.unravel_index(np.argmax(spectra.mean_power.power), spectra.amplitude.shape[1:])
    cell = spectra.amplitude[:, row, column].reshape(1, 4, 6)
    rate = spectra.range_rate[[row]]
    found = unfolded(frame, blocks, cell, rate, floor=np.array([1e-3]), by_beams=False)
    profiles = range_profiles(frame, greatest_range=60.0).amplitude[:, :, column]
    weight = np.repeat(taper(NUM_SWEEPS // 6), 6) / 6
    k = np.arange(NUM_SWEEPS)
    doppler = 2 * middle_frequency(frame.schedule, frame.times) * found.range_rate[0]
    images = doppler / SPEED_OF_LIGHT * INTERVAL - np.arange(4) / 6  # cycles per sweep
    whole = (profiles * weight) @ np.exp(-2j * np.pi * np.outer(k, images))
    np.testing.assert_allclose(
        np.sum(np.abs(found.amplitude) ** 2), np.sum(np.abs(whole) ** 2), rtol=1e-6
    )
    assert found.range_rate[0] == pytest.approx(17.0, abs=CELL)
