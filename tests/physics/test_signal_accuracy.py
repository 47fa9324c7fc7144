"""The production engine against full-rate integration, case by case: the table of the docs.

`FullBand` knows no closed form: it looks up both radars' phases at every instant and integrates
their product with the filter. Ramps are 60 µs long, so that it can; slopes, filter, converter and
delays are those of the paper. Laws of single quantities stand beside: Friis, Parseval, kTB.
"""

import numpy as np
import pytest

from polychirp.constants import BOLTZMANN, SPEED_OF_LIGHT
from polychirp.model.antenna import ISOTROPIC, AntennaArray, ElementPattern
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import Bounce
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.links.thermal_noise import noise_density, thermal_noise
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, free_space_gain, paths_of
from polychirp.units import to_db
from tests.support.references.fullband import FullBand

SLOPE, START, DURATION = 1e12, 79e9, 60e-6
BILLIONTH = 1e-9


def ramps(*slopes, start_time=0.0, start_frequency=START, duration=DURATION):
    """Ramps in a row, each from ``start_frequency``."""
    number = np.arange(len(slopes))
    return RampSchedule(
        start_time=start_time + number * duration,
        duration=np.full(len(slopes), duration),
        start_frequency=np.full(len(slopes), start_frequency),
        slope=np.array(slopes),
        start_phase=0.1 + 0.2 * number,
        sweep=number,
    )


def crossing(slope, *, at=0.5, beat=0.0):
    """An interferer's ramp whose beat with the victim's is ``beat`` at a share of the ramp."""
    return ramps(slope, start_frequency=START + (SLOPE - slope) * at * DURATION + beat)


def moving(metres, speed):
    """A round trip, closing at ``speed`` m/s."""
    return {"delay": 2 * metres / SPEED_OF_LIGHT, "delay_rate": -2 * speed / SPEED_OF_LIGHT}


def two_radars(pattern=ISOTROPIC, converter=None, num_channels=2):
    array = AntennaArray(num_channels=num_channels, pattern=pattern)
    radar = Radar(name="victim", array=array, converter=converter or Converter())
    car = Actor(name="car", kind="vehicle")
    return Scene(
        time=0.0, actors=(car,), radars=(radar, Radar(name="b", array=array)), carriers=(0, 0)
    )


EAGER = Converter(start=0.1e-6, margin=0.1e-6)
"""Samples from the ramp's first to its last instant: every window at its ends is cut."""

ECHOES = {
    "at rest, 6.5 m": ({}, moving(6.5, 0.0)),
    "at rest, 30 m": ({}, moving(30.0, 0.0)),
    "closing at 40 m/s, 12.6 m": ({}, moving(12.6, 40.0)),
    "closing at 70 m/s, 9 m": ({}, moving(9.0, 70.0)),
    "20 m, samples up to both ends of the ramp": ({"converter": EAGER}, moving(20.0, 10.0)),
    "200 m, the end of one ramp in the next": ({"converter": EAGER}, moving(200.0, 20.0)),
}

WAY = 13.2 / SPEED_OF_LIGHT

INTERFERERS = {
    "same slope and start": ramps(SLOPE),
    "same slope, starts 20 µs later, 20 MHz lower": ramps(
        SLOPE, start_time=20e-6, start_frequency=START + 20e6
    ),
    "slope + 1e-4": crossing(1.0001 * SLOPE),
    "slope + 0.1 %": crossing(1.001 * SLOPE),
    "slope + 1 %": crossing(1.01 * SLOPE),
    "slope + 50 %": crossing(1.5 * SLOPE),
    "slope × 2": crossing(2.0 * SLOPE),
    "opposite slope": crossing(-SLOPE),
    "begins in the band, in mid-ramp": ramps(
        0.6 * SLOPE, start_time=25e-6, start_frequency=START + 25.1e6
    ),
    "ends in the band, in mid-ramp": ramps(
        0.6 * SLOPE, start_time=-25e-6, start_frequency=START - 1.2e6
    ),
    "opposite slope, crosses where sampling begins": crossing(-SLOPE, at=1 / 6),
}


def difference(scene, plans, path, transmitter):
    """Greatest distance between both engines, in units of the strongest sample."""
    snapshots = [paths_of(path)]
    fast, slow = (
        engine.contribution(scene, plans, snapshots, victim=0, transmitter=transmitter)
        for engine in (Stretch(), FullBand())
    )
    return np.abs(fast - slow).max() / np.abs(slow).max()


@pytest.mark.parametrize("case", ECHOES)
def test_own_echoes_are_those_of_full_rate_integration(case, compare):
    radar, path = ECHOES[case]
    found = difference(
        two_radars(**radar),
        [ramps(SLOPE, -SLOPE), ramps(SLOPE)],
        HandPath(bounces=(Bounce.SCATTERING,), arrival=(0.8, 0.6, 0.0), **path),
        transmitter=0,
    )
    compare(
        page="signals",
        case=case,
        quantity="own echo: greatest error over strongest sample, 1e-9",
        expected=0.0,
        measured=found / BILLIONTH,
        tolerance=1000.0,
        source="integration at full rate",
    )


@pytest.mark.parametrize("case", INTERFERERS)
def test_interference_is_that_of_full_rate_integration(case, compare):
    path = HandPath(transmitter=1, delay=WAY, delay_rate=-1e-7, arrival=(0.6, -0.8, 0.0))
    found = difference(two_radars(), [ramps(SLOPE), INTERFERERS[case]], path, transmitter=1)
    compare(
        page="signals",
        case=case,
        quantity="interference: greatest error over strongest sample, 1e-9",
        expected=0.0,
        measured=found / BILLIONTH,
        tolerance=1000.0,
        source="integration at full rate",
    )


@pytest.mark.parametrize("off", [5e6, 100e6])
def test_what_never_enters_the_band_is_right_to_a_thousandth_of_the_noise(off, compare):
    """Table 2's antennas at 13.2 m: 90 dB above the noise before the filter."""
    scene = two_radars(ElementPattern())
    path = HandPath(transmitter=1, delay=WAY, gain=free_space_gain(13.2))
    plans, snapshots = [ramps(SLOPE), ramps(SLOPE, start_frequency=START + off)], [paths_of(path)]
    fast, slow = (
        engine.contribution(scene, plans, snapshots, victim=0, transmitter=1)
        for engine in (Stretch(), FullBand())
    )
    radar = scene.radars[0]
    noise = np.sqrt(noise_density(radar) * radar.if_filter.noise_bandwidth)
    compare(
        page="signals",
        case=f"direct interferer at 13.2 m, same slope, {off / 1e6:g} MHz off",
        quantity="greatest error over rms of the noise",
        expected=0.0,
        measured=np.abs(fast - slow).max() / noise,
        tolerance=1e-3,
        source="integration at full rate",
    )


def power_of(scene, plan, path, transmitter):
    """Mean power of a sample, W."""
    plans, snapshots = [plan, plan], [paths_of(path)]
    y = Stretch().contribution(scene, plans, snapshots, victim=0, transmitter=transmitter)
    return np.mean(np.abs(y.sum(axis=0)[0, 0]) ** 2)


@pytest.mark.parametrize("metres", [13.2, 50.0])
def test_a_direct_interferer_has_the_power_of_friis(metres, compare):
    scene = two_radars(ElementPattern())
    path = HandPath(transmitter=1, delay=metres / SPEED_OF_LIGHT, gain=free_space_gain(metres))
    radar = scene.radars[0]
    front = radar.transmit_power * radar.transmit_gain * radar.receive_gain
    friis = front * (radar.array.pattern.peak_gain * free_space_gain(metres)) ** 2
    compare(
        page="signals",
        case=f"direct interferer at {metres:g} m, table 2",
        quantity="power at the converter, dBm",
        expected=float(to_db(friis * 1e3)),
        measured=float(to_db(power_of(scene, ramps(SLOPE, duration=5e-4), path, 1) * 1e3)),
        tolerance=0.01,
        source="Friis",
    )


def test_an_echo_has_the_power_of_the_radar_equation(compare):
    scene, metres, rcs = two_radars(ElementPattern()), 12.6, 10.0
    wavelength = SPEED_OF_LIGHT / 79e9
    gain = wavelength * np.sqrt(rcs) / ((4 * np.pi) ** 1.5 * metres**2)
    path = HandPath(gain=gain, bounces=(Bounce.SCATTERING,), **moving(metres, 0.0))
    radar = scene.radars[0]
    front = radar.transmit_power * radar.transmit_gain * radar.receive_gain
    expected = front * (radar.array.pattern.peak_gain * gain) ** 2
    compare(
        page="signals",
        case="10 dBsm at 12.6 m, table 2",
        quantity="power at the converter, dBm",
        expected=float(to_db(expected * 1e3)),
        measured=float(to_db(power_of(scene, ramps(SLOPE, duration=5e-4), path, 0) * 1e3)),
        tolerance=0.01,
        source="radar equation",
    )


@pytest.mark.parametrize("slope", [0.99e12, 0.5e12, -1e12])
def test_a_crossing_leaves_the_energy_that_the_filter_passes(slope, compare):
    """Sampled at 5 MS/s, where a filter that ends at 0.7 MHz leaves no alias."""
    scene = two_radars(converter=Converter(sample_rate=5e6, start=0.0, margin=0.0), num_channels=1)
    duration = 5e-4
    other = ramps(slope, start_frequency=START + (SLOPE - slope) * duration / 2, duration=duration)
    plans = [ramps(SLOPE, duration=duration), other]
    snapshots = [paths_of(HandPath(delay=0.0, transmitter=1))]
    y = Stretch().contribution(scene, plans, snapshots, victim=0, transmitter=1)
    radar = scene.radars[0]
    power = radar.transmit_power * radar.transmit_gain * radar.receive_gain
    expected = power * radar.if_filter.noise_bandwidth / abs(SLOPE - slope)
    compare(
        page="signals",
        case=f"crossing at {abs(SLOPE - slope):.3g} Hz/s",
        quantity="energy of a crossing over P·∫|H|²df/|μ|, dB",
        expected=0.0,
        measured=float(to_db(np.sum(np.abs(y) ** 2) / 5e6 / expected)),
        tolerance=0.01,
        source="Parseval",
    )


def test_thermal_noise_is_ktb(compare):
    """64 channels, 1.3 million samples of which five in six are independent: ± 0.02 dB (4 σ)."""
    radar = Radar(name="a", array=AntennaArray(num_channels=64, pattern=ISOTROPIC))
    times = sample_times(ramps(1e9, duration=20e-3), radar.converter)
    noise = thermal_noise(radar, times, Streams(seed=3)["noise", radar.name])
    band = radar.if_filter.noise_bandwidth
    expected = BOLTZMANN * 290.0 * radar.noise_figure * radar.receive_gain * band
    compare(
        page="signals",
        case="4.5 dB of noise figure, 15 dB of gain, default filter",
        quantity="power at the converter, dBm",
        expected=float(to_db(expected * 1e3)),
        measured=float(to_db(np.mean(np.abs(noise) ** 2) * 1e3)),
        tolerance=0.02,
        source="kT₀FGB",
    )
