"""A point stands where it is, with its power, in the maps of all kinds of ramps."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.radar import Converter
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.mitigation.blanking import Blanking
from polychirp.receiver.overview.range_azimuth import elevation_sines, range_azimuth_map
from polychirp.receiver.overview.range_rate import range_profile, range_rate_map
from polychirp.receiver.overview.spectrogram import spectrogram
from polychirp.receiver.overview.sums import ChirpSums, LongRampMeans, RampSums, sums_of
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth
from tests.support.points import HandPoint, coded_frame, frame_of
from tests.support.schedules import drawn_chirps

FAST = Converter(sample_rate=10e6, start=2e-6, margin=2e-6)
KINDS = {
    "equal chirps": (
        Sawtooth(start_frequency=77e9, bandwidth=0.6e9, ramp_duration=50e-6).schedule(
            num_sweeps=128, streams=Streams(1)
        ),
        FAST,
        ChirpSums,
    ),
    "triangles": (
        DiverseTriangular().schedule(num_sweeps=8, streams=Streams(1)),
        Converter(),
        LongRampMeans,
    ),
    "drawn chirps": (drawn_chirps(128, seed=1), FAST, RampSums),
}
POINT = HandPoint(range=12.0, range_rate=-6.0, azimuth=0.4, power=1e-3)


@pytest.fixture(params=KINDS)
def case(request):
    """A receiver, a frame of one point with little noise, and its class of sums."""
    schedule, converter, kind = KINDS[request.param]
    frame = frame_of(schedule, [POINT], seed=1, noise=1e-7, converter=converter)
    return AutoReceiver().chosen(schedule), frame, kind


def middle_range(frame) -> float:
    """Range of the point in the middle of the frame, m."""
    schedule = frame.schedule
    elapsed = 0.5 * (schedule.end_time[-1] - schedule.start_time[0])
    return POINT.range + POINT.range_rate * elapsed


def test_the_map_has_the_point_with_its_power(case):
    receiver, frame, kind = case
    assert isinstance(sums_of(receiver, frame), kind)
    map_ = range_rate_map(receiver, frame)
    row, column = np.unravel_index(np.argmax(map_.power), map_.power.shape)
    assert map_.range_rate[row] == pytest.approx(POINT.range_rate, abs=0.3)
    assert map_.range[column] == pytest.approx(middle_range(frame), abs=0.3)
    # between cells in range and range rate, 2 dB are lost at most
    assert 0.6 * POINT.power < map_.power.max() < 1.05 * POINT.power


def test_the_profile_is_the_maximum_over_range_rates(case):
    receiver, frame, _ = case
    profile = range_profile(receiver, frame)
    assert profile.range[np.argmax(profile.power)] == pytest.approx(middle_range(frame), abs=0.3)
    assert profile.power.max() == pytest.approx(range_rate_map(receiver, frame).power.max())


def test_the_point_has_its_azimuth(case):
    receiver, frame, _ = case
    map_ = range_azimuth_map(receiver, frame)
    beam, column = np.unravel_index(np.argmax(map_.power), map_.power.shape)
    assert map_.sine[beam] == pytest.approx(np.sin(POINT.azimuth), abs=0.02)
    assert map_.range[column] == pytest.approx(middle_range(frame), abs=0.3)
    assert map_.power.max() == pytest.approx(range_rate_map(receiver, frame).power.max(), rel=0.05)


PLANE = AntennaArray(
    num_channels=16, channel_positions=tuple((x, z) for z in range(4) for x in range(4))
)
"""Four rows of four elements, half a wavelength aside and above each other."""


@pytest.mark.parametrize("seed", range(6))
def test_elements_at_several_heights_show_a_point_at_any_elevation_with_its_power(seed):
    """At u = cos ε sin φ; at ε = 30° the beam at zero elevation has a null."""
    rng = np.random.default_rng(seed)
    schedule, converter, _ = KINDS["equal chirps"]
    point = HandPoint(
        range=12.0,
        range_rate=-6.0,
        azimuth=np.radians(rng.uniform(-60.0, 60.0)),
        elevation=np.radians([30.0, -30.0, *rng.uniform(-60.0, 60.0, 4)][seed]),
        power=1e5,
    )
    frame = coded_frame(schedule, [point], array=PLANE, converter=converter, seed=seed)
    receiver = AutoReceiver().chosen(schedule)
    map_ = range_azimuth_map(receiver, frame)
    beam, column = np.unravel_index(np.argmax(map_.power), map_.power.shape)
    sine = np.cos(point.elevation) * np.sin(point.azimuth)
    assert map_.sine[beam] == pytest.approx(sine, abs=0.02)
    assert map_.range[column] == pytest.approx(12.0, abs=0.3)
    # 0.7 dB are lost between two elevations at most
    power = range_rate_map(receiver, frame).power.max()
    assert 0.85 * power < map_.power.max() < 1.01 * power


@pytest.mark.parametrize("rows", range(2, 12))
def test_the_elevations_of_the_map_lose_less_than_stated(rows):
    """0.7 dB with two rows; with many, a quarter of a beam loses sinc²(1/8), 0.22 dB."""
    place = 0.5 * np.arange(rows)
    elements = Elements(place=np.stack([0.0 * place, place], axis=1))
    wave = np.linspace(-1.0, 1.0, 2001)
    apart = wave[:, None] - elevation_sines(elements)
    power = np.abs(np.exp(2j * np.pi * apart[..., None] * place).mean(axis=-1)) ** 2
    assert power.max(axis=1).min() > (0.85 if rows == 2 else 0.9)


def test_elements_on_a_horizontal_line_have_beams_at_zero_elevation(case):
    receiver, frame, _ = case
    sums, map_ = sums_of(receiver, frame), range_azimuth_map(receiver, frame)
    beam, column = np.unravel_index(np.argmax(map_.power), map_.power.shape)
    place = sums.place[:, 1] * np.mean(frame.schedule.centre_frequency) / SPEED_OF_LIGHT
    weight = np.exp(2j * np.pi * map_.sine[beam] * (place - place.mean())) / place.size
    cell = np.array([[row, column] for row in range(sums.map.range_rate.size)])
    expected = sums.beam_power(cell, weight[None]).max()
    assert map_.power[beam, column] == pytest.approx(expected, rel=1e-9)


def test_a_tone_has_its_power_and_beat_in_all_windows(case):
    receiver, frame, _ = case
    seen = spectrogram(receiver, frame, channel=1)
    assert seen.power.shape[0] == frame.schedule.num_ramps
    rising = int(np.argmax(frame.schedule.slope > 0))
    beat = 2.0 * frame.schedule.slope[rising] * middle_range(frame) / SPEED_OF_LIGHT
    doppler = 2.0 * POINT.range_rate * frame.schedule.centre_frequency[rising] / SPEED_OF_LIGHT
    cell = seen.beat[1] - seen.beat[0]
    strongest = np.argmax(seen.power[rising], axis=1)
    np.testing.assert_allclose(seen.beat[strongest], beat + doppler, atol=cell)
    # Hann's window loses 1.4 dB between two bins
    assert 0.7 * POINT.power < seen.power[rising].max() < 1.05 * POINT.power


def test_mitigation_comes_first(case):
    receiver, frame, _ = case
    samples = frame.samples.copy()
    samples[:, 0, 100:104] += 10.0
    hit = frame.with_samples(samples)
    assert spectrogram(receiver, hit).power.max() > 1.0
    repaired = type(receiver)(mitigation=Blanking(guard=1e-6))
    assert spectrogram(repaired, hit).power.max() < 2.0 * POINT.power
    assert range_rate_map(repaired, hit).power.max() < 1.2 * POINT.power


@pytest.mark.parametrize("place", [0.42, 0.6])
def test_a_burst_is_at_its_share_of_a_ramp_of_any_length(place):
    """Ramps of 800 and of 100 samples, whose windows are of 64 samples."""
    one = Sawtooth(start_frequency=77e9, bandwidth=0.6e9, ramp_duration=80e-6).schedule(
        num_sweeps=2, streams=Streams(1)
    )
    count = np.array([800, 100])
    samples = np.zeros((1, 2, 800), dtype=np.complex128)
    for ramp, number in enumerate(count):
        samples[0, ramp, round(place * number) - 1 : round(place * number) + 2] = 1.0
    frame = IfFrame(
        samples=samples,
        times=SampleTimes(first=one.start_time, num_samples=count, rate=10e6),
        schedule=one,
        array=AntennaArray(num_channels=1),
    )
    seen = spectrogram(RangeDoppler(), frame)
    brightest = np.argmax(seen.power.sum(axis=-1), axis=1)
    np.testing.assert_allclose(seen.share[brightest], place, atol=0.02)
