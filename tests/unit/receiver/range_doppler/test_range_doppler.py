from dataclasses import dataclass, replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError, InputError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.mitigation.base import Mitigated, with_weights
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.peaks import interpolated_peaks
from polychirp.receiver.range_doppler.transforms import range_profiles, taper


def frame(num_ramps: int = 8, num_channels: int = 2, **changes: np.ndarray) -> IfFrame:
    """Silence, sampled 16 times on equal ramps; ``changes`` to the schedule."""
    k = np.arange(num_ramps)
    plan = {
        "start_time": k * 60e-6,
        "duration": 0 * k + 50e-6,
        "start_frequency": 0 * k + 77e9,
        "slope": 0 * k + 10e12,
        "start_phase": 0 * k,
        "sweep": k,
    } | changes
    schedule = RampSchedule(**plan)
    return IfFrame(
        samples=np.zeros((num_channels, num_ramps, 16), dtype=complex),
        times=SampleTimes(first=schedule.start_time, num_samples=0 * k + 16, rate=1e6),
        schedule=schedule,
        array=AntennaArray(num_channels=num_channels),
    )


def test_profiles_keep_a_tones_amplitude_and_its_phase_in_the_middle():
    """A tone on cell 3 with the phase 0.4 half-way through the window."""
    n = np.arange(16) - 7.5
    tone = 5.0 * np.exp(1j * (2 * np.pi * 3 * n / 16 + 0.4))
    silent = frame()
    profiles = range_profiles(
        silent.with_samples(np.broadcast_to(tone, silent.samples.shape)), greatest_range=7.5
    )
    assert profiles.range.size == 9
    np.testing.assert_allclose(profiles.amplitude[:, :, 3], 5.0 * np.exp(0.4j), rtol=1e-6)
    # beat 3/16 MHz on 10 MHz/µs
    assert profiles.range[3] == pytest.approx(0.1875e6 * 299_792_458 / 2e13)


@pytest.mark.parametrize("num_ramps", [8, 10])
@pytest.mark.parametrize("rises", [True, False])
def test_spectra_are_sums_of_the_samples_to_130_db(num_ramps: int, rises: bool):
    """Sums over time and ramps about their middles, cell by cell, in double precision."""
    draw = np.random.default_rng(num_ramps + rises)
    turns = np.tile(np.eye(2), (num_ramps // 2, 1))
    silent = frame(
        num_ramps, transmit_weight=turns, slope=np.full(num_ramps, 1e13 * (2 * rises - 1))
    )
    shape = silent.samples.shape
    samples = draw.normal(size=shape) + 1j * draw.normal(size=shape)
    found = RangeDoppler(greatest_range=9.0).spectra(silent.with_samples(samples)).amplitude
    n, m = np.arange(16) - 7.5, np.arange(num_ramps // 2) - (num_ramps // 2 - 1) / 2
    bins = np.arange(found.shape[2]) * (1 if rises else -1)
    rates = np.arange(num_ramps // 2) - num_ramps // 4
    fast = taper(16)[:, None] * np.exp(-2j * np.pi * np.outer(n, bins) / 16)
    slow = taper(num_ramps // 2) * np.exp(-4j * np.pi * np.outer(rates, m) / num_ramps)
    each = samples.reshape(2, -1, 2, 16)
    whole = np.einsum("vk,ckln,nr->clvr", slow, each, fast).reshape(found.shape)
    np.testing.assert_allclose(found, whole, rtol=0, atol=10**-6.5 * np.abs(whole).max())


def test_the_range_rate_axis_is_symmetric_and_folds_at_half_a_span():
    turns = np.tile(np.eye(2), (4, 1))
    spectra = RangeDoppler(greatest_range=15.0).spectra(frame(transmit_weight=turns))
    assert spectra.amplitude.shape == (4, 4, 16)
    span = 299_792_458 / (77e9 + 10e12 * 7.5e-6) / (2 * 120e-6)
    np.testing.assert_allclose(spectra.range_rate, span * np.array([-0.5, -0.25, 0.0, 0.25]))


@dataclass(frozen=True)
class Weights:
    """A mitigation that gives samples these weights, ``(ramp, fast)``."""

    rows: tuple[tuple[float, ...], ...]

    def mitigate(self, frame: IfFrame) -> Mitigated:
        return with_weights(frame, np.array(self.rows))


def test_a_tone_keeps_its_amplitude_where_samples_are_blanked():
    """Samples in the middle of ramps in the middle of the frame count most in tapered sums."""
    weight = np.ones((8, 16))
    weight[3:6, 4:12] = 0.0
    weight[3:6, [3, 12]] = 0.5
    tone = np.exp(2j * np.pi * 3 * np.arange(16) / 16)
    silent = frame()
    one = silent.with_samples(np.broadcast_to(tone, silent.samples.shape))
    blanked = RangeDoppler(
        greatest_range=7.5, mitigation=Weights(tuple(map(tuple, weight.tolist())))
    )
    found, whole = (r.spectra(one).amplitude for r in (blanked, RangeDoppler(greatest_range=7.5)))
    assert np.abs(whole).max() == pytest.approx(1.0)
    assert np.abs(found[:, 4, 3]) == pytest.approx(np.abs(whole[:, 4, 3]), rel=1e-9)


def test_a_taper_leaves_a_constant_alone():
    assert taper(33).sum() == pytest.approx(1.0, rel=1e-14)


def test_a_parabola_is_interpolated_exactly():
    """Logarithm −(i − 4.3)² − 2(j − 5.8)², height e³ above its vertex of 1."""
    i, j = np.mgrid[:9, :11]
    power = np.exp(3.0 - (i - 4.3) ** 2 - 2 * (j - 5.8) ** 2)
    map_ = RangeRateMap(power=power, range_rate=0.5 * np.arange(9.0), range=2.0 * np.arange(11.0))
    rate, distance, peak = interpolated_peaks(map_, row=np.array([4]), column=np.array([6]))
    np.testing.assert_allclose([rate[0], distance[0], peak[0]], [2.15, 11.6, np.exp(3.0)])


@pytest.mark.parametrize("column", [0, 4])
def test_a_peak_at_the_edge_of_the_range_axis_stays_there(column: int):
    power = np.ones((5, 5))
    power[2, column] = 9.0
    map_ = RangeRateMap(power=power, range_rate=np.arange(5.0), range=np.arange(5.0))
    rate, distance, peak = interpolated_peaks(map_, row=np.array([2]), column=np.array([column]))
    np.testing.assert_allclose([rate[0], distance[0], peak[0]], [2.0, column, 9.0])


@pytest.mark.parametrize(
    ("nearest", "farthest", "is_within"),
    [(28.5, 29.5, True), (29.77, 29.98, True), (30.02, 32.0, False)],
)
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_the_greatest_range_is_no_mirror(nearest, farthest, is_within, way):
    """Points before it are found where they are, closing or receding; those beyond are not."""
    random = np.random.default_rng(3)
    blank = frame(num_ramps=64, num_channels=1)
    times = SampleTimes(
        first=blank.schedule.start_time + 5e-6, num_samples=np.full(64, 320), rate=10e6
    )
    late = times.time - blank.schedule.start_time[:, None]
    middle = 0.5 * (blank.schedule.start_time[0] + blank.schedule.end_time[-1])
    for _ in range(20):
        place, rate = random.uniform(nearest, farthest), way * random.uniform(3.0, 15.0)
        delay = 2 * (place + rate * (times.time - middle)) / SPEED_OF_LIGHT
        samples = np.exp(2j * np.pi * (77e9 + 10e12 * (late - 0.5 * delay)) * delay)
        noise = random.normal(scale=0.3, size=(2, *samples.shape))
        found = RangeDoppler(greatest_range=30.0).detect(
            replace(blank, samples=(samples + noise[0] + 1j * noise[1])[None], times=times)
        )
        assert found.num_detections == is_within
        if is_within:
            assert found.range[0] == pytest.approx(place, abs=0.02)


def test_one_channel_has_no_azimuth():
    silent = frame(num_ramps=32, num_channels=1)
    random = np.random.default_rng(1)
    tone = 10 * np.exp(2j * np.pi * 3 * np.arange(16) / 16)
    samples = tone + random.normal(size=silent.samples.shape)
    # a still point at the fourth of 16 ranges, on a map of 32 range rates
    receiver = RangeDoppler(least_range=1e-3, false_alarm_probability=1e-4)
    window = replace(receiver.training(silent.schedule), guard=(2, 2), training=(4, 4))
    receiver = replace(receiver, window=window)
    found = receiver.detect(silent.with_samples(samples))
    assert found.num_detections >= 1
    assert np.all(np.isnan(found.azimuth))


def test_falling_chirps_read_as_rising_ones():
    """A falling chirp has the beat −2bR/c: its profile is that of the conjugate samples."""
    random = np.random.default_rng(2)
    rising, falling = frame(), frame(slope=np.full(8, -10e12))
    samples = random.normal(size=(2, *rising.samples.shape)) @ np.diag(np.ones(16))
    tone = samples[0] + 1j * samples[1]
    up = range_profiles(rising.with_samples(tone), greatest_range=15.0)
    down = range_profiles(falling.with_samples(tone.conj()), greatest_range=15.0)
    np.testing.assert_allclose(down.amplitude, up.amplitude.conj(), rtol=0, atol=1e-6)
    np.testing.assert_array_equal(down.range, up.range)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"slope": np.array([10e12] * 7 + [11e12])}, "differ in slope"),
        ({"start_frequency": np.array([77e9] * 7 + [77.1e9])}, "differ in start frequency"),
        ({"duration": np.array([50e-6] * 7 + [51e-6])}, "differ in duration"),
        (
            {"start_time": np.array([0, 60, 120, 180, 240, 300, 360, 430]) * 1e-6},
            r"8\.57 µs from equal intervals",
        ),
        ({"transmit_weight": np.eye(8)}, "has 1 turns of the elements' code, fewer than 2"),
    ],
)
def test_ramps_that_differ_are_refused(changes: dict[str, np.ndarray], reason: str):
    with pytest.raises(CapabilityError, match=f"{reason}; the receiver 'coherent' reads it"):
        RangeDoppler().detect(frame(**changes))


def test_ramps_that_rise_and_fall_are_left_to_the_coherent_receiver():
    with pytest.raises(CapabilityError, match="the receiver 'coherent' reads it"):
        RangeDoppler().detect(frame(slope=np.array([10e12, -10e12] * 4)))


def test_ramps_that_cannot_be_shared_out_are_refused():
    turns = np.eye(3)[np.arange(8) % 3]
    with pytest.raises(CapabilityError, match="not orthogonal over any block"):
        RangeDoppler().detect(frame(transmit_weight=turns))


def test_ranges_beyond_the_sample_rate_are_not_in_the_map():
    assert range_profiles(frame(), greatest_range=1e3).range.size == 16


@pytest.mark.parametrize("quantile", [0.0, 1.1])
def test_a_quantile_that_is_none_is_refused(quantile: float):
    with pytest.raises(InputError, match="quantile"):
        RangeDoppler(quantile=quantile)


def test_an_axis_that_does_not_grow_is_refused():
    with pytest.raises(InputError, match="must grow"):
        RangeRateMap(power=np.ones((2, 2)), range_rate=np.zeros(2), range=np.arange(2.0))


@pytest.mark.parametrize("elements", [1, 2, 3])
@pytest.mark.parametrize("share", [0.98, -0.98])
def test_rates_near_the_end_of_the_span_keep_their_sign(elements: int, share: float):
    """Such a peak is between the last cell of the map and the first one."""
    silent = frame(12 * elements, transmit_weight=np.tile(np.eye(elements), (12, 1)))
    array = AntennaArray(num_channels=2, num_transmitters=elements)
    half = RangeDoppler().unambiguous_span(silent.schedule, array) / 2
    times = silent.times.time
    delay = 2 * (7.0 + share * half * (times - times.mean())) / SPEED_OF_LIGHT
    in_ramp = times - silent.schedule.start_time[:, None]
    echo = np.exp(2j * np.pi * (77e9 + 10e12 * (in_ramp - delay / 2)) * delay)
    here = replace(silent, array=array, samples=np.stack([echo, echo]))
    draw = np.random.default_rng(1).normal(scale=1e-3, size=(2, *here.samples.shape))
    found = RangeDoppler().detect(here.with_samples(here.samples + draw[0] + 1j * draw[1]))
    assert found.range_rate[0] == pytest.approx(share * half, abs=0.02 * half)
    assert found.range[0] == pytest.approx(7.0, abs=0.03)
