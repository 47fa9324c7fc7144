from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import CapabilityError, InputError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.alternatives.sawtooth_receiver import (
    SawtoothReceiver,
    interpolated_peaks,
    range_profiles,
    range_rate_spectra,
    taper,
)


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
        silent.with_samples(np.broadcast_to(tone, silent.samples.shape)), highest_beat=0.5e6
    )
    assert profiles.range.size == 9
    np.testing.assert_allclose(profiles.amplitude[:, :, 3], 5.0 * np.exp(0.4j), rtol=1e-12)
    # beat 3/16 MHz on 10 MHz/µs
    assert profiles.range[3] == pytest.approx(0.1875e6 * 299_792_458 / 2e13)


def test_the_range_rate_axis_is_symmetric_and_folds_at_half_a_span():
    spectra = SawtoothReceiver(highest_beat=1e6, num_transmitters=2).spectra(frame())
    assert spectra.amplitude.shape == (4, 4, 16)
    span = 299_792_458 / (77e9 + 10e12 * 7.5e-6) / (2 * 120e-6)
    np.testing.assert_allclose(spectra.range_rate, span * np.array([-0.5, -0.25, 0.0, 0.25]))


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


def test_one_channel_has_no_azimuth():
    silent = frame(num_ramps=32, num_channels=1)
    random = np.random.default_rng(1)
    samples = 10 + random.normal(size=silent.samples.shape)
    # a still point at zero range, on a map of 32 × 16 cells
    receiver = SawtoothReceiver(highest_beat=1e6)
    receiver = replace(receiver, window=replace(receiver.window, guard=(2, 2), training=(4, 4)))
    found = receiver.detect(silent.with_samples(samples))
    assert found.num_detections >= 1
    assert np.all(np.isnan(found.azimuth))


@pytest.mark.parametrize(
    "changes",
    [
        {"slope": np.array([10e12] * 7 + [11e12])},
        {"start_frequency": np.array([77e9] * 7 + [77.1e9])},
        {"slope": np.full(8, -10e12)},
    ],
)
def test_ramps_that_differ_or_fall_are_refused(changes: dict[str, np.ndarray]):
    with pytest.raises(CapabilityError, match=r"receiver\.chain\.Receiver"):
        range_profiles(frame(**changes), highest_beat=1e6)


def test_ramps_at_unequal_intervals_are_refused():
    late = frame(start_time=np.array([0, 60, 120, 180, 240, 300, 360, 430]) * 1e-6)
    with pytest.raises(CapabilityError, match="from equal intervals"):
        range_rate_spectra(range_profiles(late, highest_beat=1e6), late)


@pytest.mark.parametrize("num_transmitters", [3, 8])
def test_ramps_that_cannot_be_shared_out_are_refused(num_transmitters: int):
    profiles = range_profiles(frame(), highest_beat=1e6)
    with pytest.raises(InputError, match="cannot be shared out"):
        range_rate_spectra(profiles, frame(), num_transmitters=num_transmitters)


def test_beats_above_the_sample_rate_are_refused():
    with pytest.raises(InputError, match=r"above the sample rate of 1 MS/s"):
        range_profiles(frame(), highest_beat=1.1e6)
    with pytest.raises(InputError, match="must be positive"):
        SawtoothReceiver(highest_beat=0.0)


def test_an_axis_that_does_not_grow_is_refused():
    with pytest.raises(InputError, match="must grow"):
        RangeRateMap(power=np.ones((2, 2)), range_rate=np.zeros(2), range=np.arange(2.0))
