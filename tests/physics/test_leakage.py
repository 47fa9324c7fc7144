"""What a radar hears of itself: leakage and its bumper, against Friis and geometry."""

import math

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError, ModelWarning
from polychirp.model.antenna import ISOTROPIC, AntennaArray, ElementPattern
from polychirp.model.front_end import FrontEnd, HighPass
from polychirp.model.if_frame import PARTS
from polychirp.model.leakage import Bumper, Leakage
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.links.leakage import LEAKAGE_PART, all_links, num_parts, own_links
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.units import from_db

SLOPE = 1e12
CARRIER = 79e9
PLAN = RampSchedule(
    start_time=[0.0],
    duration=[500e-6],
    start_frequency=[CARRIER],
    slope=[SLOPE],
    start_phase=[0.0],
    sweep=[0],
)


def radar(*, gain=from_db(11.0), num_channels=4, **fields):
    pattern = ElementPattern(peak_gain=gain)
    return Radar(
        name="front", array=AntennaArray(num_channels=num_channels, pattern=pattern), **fields
    )


def own(victim):
    return own_links(victim, frequency=CARRIER, reference_time=0.0)


def watts(victim):
    return victim.transmit_power * victim.transmit_gain * victim.receive_gain


def heard(victim, *paths):
    car = Actor(name="car", kind="vehicle")
    scene = Scene(time=0.0, actors=(car,), radars=(victim,), carriers=(0,))
    return synthesize(
        Stretch(),
        scene,
        [PLAN],
        [paths_of(*paths)],
        victim=0,
        interferers=None,
        streams=Streams(seed=3),
    )


def test_leakage_arrives_with_the_power_that_isolation_leaves():
    """P_t G_ft G_fr / I in every channel, at the beat b·τ, whatever the antennas are."""
    leak = Leakage(isolation=from_db(35.0), delay=60e-9)
    victim = radar(leakage=(leak,))
    _, parts = heard(victim)
    samples = parts["leakage"][:, 0]
    assert np.mean(np.abs(samples) ** 2, axis=1) == pytest.approx(
        watts(victim) / from_db(35.0), rel=1e-4
    )
    turns = np.unwrap(np.angle(samples[0])) / (2 * np.pi)
    assert np.polyfit(np.arange(turns.size) / 1e6, turns, 1)[0] == pytest.approx(60e3, rel=1e-6)
    assert np.array_equal(samples, samples[:1].repeat(4, axis=0))


@pytest.mark.parametrize("distance", [0.03, 0.05, 0.1])
def test_a_bumper_returns_what_a_mirror_at_its_distance_does(compare, distance):
    """P_t G_ft G_fr · r · (G λ / 4π·2d)²: Friis over the way to the transmitter's image."""
    victim = radar(gain=from_db(5.0), bumper=Bumper(distance=distance, reflection=from_db(-12.0)))
    link = own(victim)
    friis = (from_db(5.0) * SPEED_OF_LIGHT / CARRIER / (4 * np.pi * 2 * distance)) ** 2
    compare(
        page="impairments",
        case=f"bumper at {100 * distance:g} cm",
        quantity="power, dBm",
        expected=10 * math.log10(watts(victim) * friis) - 12.0 + 30.0,
        measured=20 * math.log10(abs(link.amplitude[0])) + 30.0,
        tolerance=1e-9,
        source="Friis over the way to the mirrored transmitter",
    )


def test_each_element_has_its_own_distance_to_the_transmitters_image():
    """At 3 cm the outer elements of eight are √(60² + 6.6²) − 60 = 0.37 mm, 35°, behind."""
    victim = radar(num_channels=8, bumper=Bumper(distance=0.03))
    delay = own(victim).delay_at(0.0)[0]
    y = (np.arange(8) - 3.5) * victim.array.spacing
    assert delay * SPEED_OF_LIGHT == pytest.approx(np.hypot(0.06, y), rel=1e-12)
    turned = np.degrees(2 * np.pi * CARRIER * (delay[0] - delay[3]))
    assert turned == pytest.approx(360 * 79e9 / SPEED_OF_LIGHT * (6.64e-3**2 / 0.12), rel=0.03)


def test_each_transmitting_element_has_its_own_image_in_the_bumper():
    """Three elements 2λ apart, the middle one raised: √((2d)² + Δy² + Δz²) of every pair."""
    array = AntennaArray(
        num_channels=4, num_transmitters=3, transmitter_positions=((0, 0), (4, 1), (8, 0))
    )
    victim = Radar(name="front", array=array, bumper=Bumper(distance=0.15))
    link = own_links(victim, frequency=CARRIER, reference_time=0.0, num_elements=3)
    away = array.position[None, :, 1:] - array.transmit_position[:, None, 1:]
    expected = np.hypot(0.3, np.linalg.norm(away, axis=-1))
    assert np.ptp(expected[:, 0]) > 1e-4
    assert link.transmit_element.tolist() == [0, 1, 2]
    assert link.delay_at(0.0) * SPEED_OF_LIGHT == pytest.approx(expected, rel=1e-12)


def test_a_bumper_is_read_at_its_distance():
    """b · 2d/c is 667 Hz at 10 cm: one third of a cycle in 500 µs, 0.1 m after c f/2b."""
    victim = radar(num_channels=1, bumper=Bumper(distance=0.1))
    _, parts = heard(victim)
    turns = np.unwrap(np.angle(parts["leakage"][0, 0])) / (2 * np.pi)
    beat = np.polyfit(np.arange(turns.size) / 1e6, turns, 1)[0]
    assert SPEED_OF_LIGHT * beat / (2 * SLOPE) == pytest.approx(0.1, rel=1e-6)


def test_the_phases_of_leakage_and_reflection_are_those_that_are_given():
    """The sample is tx·conj(rx): a lead of the path turns it back."""
    plain, turned = (
        heard(radar(leakage=(Leakage(isolation=1e3, phase=phase),)))[1]["leakage"]
        for phase in (0.0, 0.5)
    )
    assert turned == pytest.approx(plain * np.exp(-0.5j), rel=1e-9)


def test_a_high_pass_takes_leakage_away_and_leaves_echoes():
    """A first-order 50-kHz corner weakens 200 Hz by 48 dB and 200 kHz by 0.26 dB."""
    leak = (Leakage(isolation=from_db(30.0), delay=0.2e-9),)
    path = HandPath(delay=0.2e-6, gain=1e-5)
    _, plain = heard(radar(leakage=leak), path)
    _, passed = heard(
        radar(leakage=leak, front_end=FrontEnd(high_pass=HighPass(corners=(50e3,)))), path
    )
    late = np.s_[..., 150:]

    def kept(part):
        power = [np.mean(np.abs(parts[part][late]) ** 2) for parts in (passed, plain)]
        return 10 * math.log10(power[0] / power[1])

    assert kept("leakage") == pytest.approx(20 * math.log10(200 / 50e3), abs=0.05)
    assert kept("echo") == pytest.approx(-10 * math.log10(1 + (50 / 200) ** 2), abs=0.01)


def test_leakage_is_a_part_of_its_own_that_only_the_radar_itself_hears():
    victim = radar(leakage=(Leakage(isolation=1e4),), bumper=Bumper(distance=0.3))
    frame, parts = heard(victim, HandPath(delay=1e-7, gain=1e-5))
    _, without = heard(radar(), HandPath(delay=1e-7, gain=1e-5))
    assert parts.names == (*PARTS[:5], "leakage")
    assert np.array_equal(frame.samples, parts.samples.sum(axis=0))
    assert np.array_equal(parts["echo"], without["echo"])
    assert not without["leakage"].any()
    assert num_parts(victim, is_own=False) == 2


def test_a_radar_receives_itself_besides_what_is_traced_and_others_do_not():
    victim = radar(leakage=(Leakage(isolation=1e4, delay=1e-9),), bumper=Bumper(distance=0.3))
    car = Actor(name="car", kind="vehicle")
    scene = Scene(time=0.0, actors=(car,), radars=(victim, Radar(name="other")), carriers=(0, 0))
    paths = paths_of(HandPath(delay=1e-7, transmitter=1))
    (other,) = all_links(scene, [paths], victim=0, transmitter=1)
    assert other.part.tolist() == [0]
    (both,) = all_links(scene, [paths_of(HandPath(delay=1e-7))], victim=0, transmitter=0)
    assert both.delay == pytest.approx([1e-7, 1e-9, 0.6 / SPEED_OF_LIGHT])
    assert both.part.tolist() == [0, LEAKAGE_PART, LEAKAGE_PART]
    assert both.amplitude[1:].tolist() == own(victim).amplitude.tolist()


def test_no_more_comes_back_than_was_sent():
    """Two 27-dBi antennas 5 cm before a mirror: Friis would return (Gλ/4π·2d)² = 2.3 times it."""
    victim = radar(gain=from_db(27.0), bumper=Bumper(distance=0.05, reflection=1.0))
    with pytest.warns(ModelWarning, match=r"near field.*return 2\.29 times the"):
        link = own(victim)
    assert abs(link.amplitude[0]) ** 2 == pytest.approx(watts(victim))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Leakage(isolation=0.0), "write it like '35 dB'"),
        (lambda: Leakage(isolation=1e3, delay=-1e-9), "delay of a leakage is negative"),
        (lambda: Bumper(distance=0.0), "a positive distance"),
        (lambda: Bumper(distance=0.1, reflection=2.0), "at most 0 dB"),
    ],
)
def test_nonsense_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_an_isotropic_radar_without_leakage_hears_nothing_of_itself():
    silent = Radar(name="a", array=AntennaArray(pattern=ISOTROPIC))
    assert not silent.receives_itself
    assert own(silent).delay.size == 0
