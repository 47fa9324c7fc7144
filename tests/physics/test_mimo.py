"""Several transmitting elements: their positions, codes and decoded signals."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray, ArrayErrors
from polychirp.model.detection import Detections
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import IfFrame, IfParts, sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.scene import Actor, Scene
from polychirp.model.truth import Truth
from polychirp.receiver.angle.beamform import beamform, steering
from polychirp.receiver.angle.doa import root_music
from polychirp.receiver.attribution import target_levels
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mimo import (
    azimuths_in_motion,
    element_streams,
    phases_in_motion,
    virtual_array,
    virtual_parts,
)
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.synthesis.links.links import links_between
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.units import to_db
from polychirp.waveform import DopplerDivision, PhaseCoded, Sawtooth, TimeDivision, coded

START, SLOPE, INTERVAL = 77e9, 10e12, 60e-6
CODINGS = [TimeDivision(), DopplerDivision(), DopplerDivision(num_bands=6), PhaseCoded()]
WAVEFORM = Sawtooth(start_frequency=START, bandwidth=500e6, ramp_duration=50e-6, idle=10e-6)
HALF_WAVE = 0.5 * SPEED_OF_LIGHT / (START + 0.5 * SLOPE * 50e-6)


def array(num_transmitters=3, num_channels=4, **fields):
    return AntennaArray(
        num_channels=num_channels,
        spacing=HALF_WAVE,
        pattern=ISOTROPIC,
        num_transmitters=num_transmitters,
        **fields,
    )


def world(antenna, *, pose=None, noise_figure=1.0):
    radar = Radar(
        name="front",
        array=antenna,
        noise_figure=noise_figure,
        if_filter=IfFilter(passband=3e6, stopband=4.5e6),
        converter=Converter(sample_rate=10e6),
    )
    car = Actor(name="car", kind="vehicle", pose=pose or Pose())
    return Scene(time=0.0, actors=(car,), radars=(radar,), carriers=(0,))


def plan(num_ramps=12, *, coding=None, num_elements=3):
    ramps = WAVEFORM.schedule(num_sweeps=num_ramps, streams=Streams(seed=1))
    return ramps if coding is None else coded(ramps, coding, num_elements=num_elements)


def one_element(element, num_ramps=12, num_elements=3):
    """The same ramps, all of them from one element."""
    weight = np.zeros((num_ramps, num_elements))
    weight[:, element] = 1.0
    return replace(plan(num_ramps), transmit_weight=weight)


def target(*, distance=12.0, range_rate=0.0, azimuth=0.0, elevation=0.0, gain=1.0):
    """A point as the radar's own echo, moving along the line of sight."""
    level = np.cos(elevation)
    there = (
        float(level * np.cos(azimuth)),
        float(level * np.sin(azimuth)),
        float(np.sin(elevation)),
    )
    return HandPath(
        delay=2 * distance / SPEED_OF_LIGHT,
        delay_rate=2 * range_rate / SPEED_OF_LIGHT,
        gain=gain,
        departure=there,
        arrival=there,
    )


def frame(schedule, *targets, antenna=None):
    """Echoes alone, without noise."""
    antenna = antenna or array()
    scene = world(antenna)
    samples = Stretch().contribution(
        scene, [schedule], [paths_of(*targets)], victim=0, transmitter=0
    )
    times = sample_times(schedule, scene.radars[0].converter)
    return IfFrame(samples=samples.sum(axis=0), times=times, schedule=schedule, array=antenna)


def frequency_at(found, n):
    """Hz, transmitted when sample n of a ramp is taken."""
    into = found.times.first[0] - found.schedule.start_time[0] + n / found.times.rate
    return START + SLOPE * into


MIDDLE = 150
"""A sample near the middle of the ramp."""


# ── positions of the elements ────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("azimuth", [-1.0, 0.3, 1.2])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_delays_are_those_of_the_ways_between_the_places_of_the_elements(azimuth, yaw):
    """From element to a far point and back: lengths in the world, of a turned radar.

    Wave fronts from 10⁵ m bend by (23 mm)²/2·10⁵ m = 3 nm over this array, 1e-17 s.
    """
    scene = world(array(), pose=Pose(yaw=yaw))
    turn = scene.radar_rotation[0]
    way = turn @ np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    point, radar = 1e5 * way, scene.radars[0]
    path = HandPath(delay=2e5 / SPEED_OF_LIGHT, departure=tuple(way), arrival=tuple(way))
    link = links_between(scene, paths_of(path), victim=0, transmitter=0, num_elements=3)
    out = np.linalg.norm(point - radar.array.transmit_position @ turn.T, axis=1)
    back = np.linalg.norm(point - radar.array.position @ turn.T, axis=1)
    expected = (out[:, None] + back) / SPEED_OF_LIGHT
    np.testing.assert_array_equal(link.transmit_element, [0, 1, 2])
    np.testing.assert_allclose(link.delay_at(0.0), expected, rtol=0.0, atol=5e-17)


def test_an_elements_place_is_a_delay_at_the_frequency_of_the_moment():
    """Signal model eq. (2): y ∝ exp j2π(f(t)τ − ½bτ²), with τ shorter by y sin θ/c."""
    azimuth, last = 0.5, 2
    y = array().transmit_position[last, 1]
    tau = 2 * 12.0 / SPEED_OF_LIGHT
    near = tau - y * np.sin(azimuth) / SPEED_OF_LIGHT
    middle = array(num_channels=1, transmit_spacing=4 * HALF_WAVE)
    echoes = [
        frame(one_element(element, 1), target(azimuth=azimuth), antenna=middle).samples[0, 0]
        for element in (1, last)
    ]
    f = frequency_at(frame(one_element(0, 1), target()), np.arange(echoes[0].size))
    cycles = f * (near - tau) - 0.5 * SLOPE * (near**2 - tau**2)
    # the beats differ by 10 Hz, which the filter's pass band lets through alike to 1e-6
    np.testing.assert_allclose(echoes[1] / echoes[0], np.exp(2j * np.pi * cycles), atol=1e-6)


def test_a_schedule_for_more_elements_than_the_array_has_is_refused():
    with pytest.raises(InputError, match="drives 3 transmitting elements, but its array has 2"):
        frame(plan(coding=TimeDivision()), target(), antenna=array(num_transmitters=2))


# ── codes ───────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("coding", CODINGS, ids=repr)
@pytest.mark.parametrize("range_rate", [0.0, 20.0])
def test_decoding_gives_what_each_element_alone_would_have_given(coding, range_rate):
    """At the target's own rate. The correction neglects b τ Δτ, 2e-5 cycles here."""
    moving = target(azimuth=0.3, range_rate=range_rate)
    mixed = frame(plan(coding=coding), moving)
    virtual = virtual_array(mixed, range_rate=range_rate)
    block = 12 // virtual.schedule.num_ramps
    alone = [frame(one_element(element), moving).samples[:, ::block] for element in range(3)]
    difference = np.abs(virtual.samples - np.concatenate(alone)).max()
    assert difference < (1e-9 if range_rate == 0.0 else 3e-4) * np.abs(virtual.samples).max()


@pytest.mark.parametrize("range_rate", [-7.0, 15.0])
def test_time_division_changes_a_moving_targets_phase_from_element_to_element(range_rate, compare):
    """An echo's delay grows by 2vT/c from sweep to sweep: a phase of 2π·2vT/λ."""
    found = virtual_array(frame(plan(coding=TimeDivision()), target(range_rate=range_rate)))
    turns = np.diff(np.unwrap(np.angle(found.samples[::4, 0, MIDDLE]))) / (2 * np.pi)
    wavelength = SPEED_OF_LIGHT / frequency_at(found, MIDDLE)
    assert np.ptp(turns) < 1e-5
    compare(
        page="arrays",
        case=f"time division, {range_rate:g} m/s, {INTERVAL * 1e6:g} µs between sweeps",
        quantity="phase between transmitting elements, cycles",
        expected=2 * range_rate * INTERVAL / wavelength,
        measured=float(turns.mean()),
        tolerance=1e-5,  # of the term bτΔτ, 7e-6 cycles
        source="2vT/λ",
    )


@pytest.mark.parametrize("range_rate", [1.0, -2.0])
def test_time_division_shifts_the_azimuth_of_an_uncorrected_moving_target(range_rate):
    """One channel, elements d apart: the sine is read 2vT/d too small."""
    antenna = array(num_transmitters=4, num_channels=1, transmit_spacing=HALF_WAVE)
    coding = plan(coding=TimeDivision(), num_elements=4)
    mixed = frame(coding, target(azimuth=0.3, range_rate=range_rate), antenna=antenna)
    spacing = HALF_WAVE * frequency_at(mixed, MIDDLE) / SPEED_OF_LIGHT
    for known, expected in ((0.0, -2 * range_rate * INTERVAL / HALF_WAVE), (range_rate, 0.0)):
        found = virtual_array(mixed, range_rate=known).samples[:, :, MIDDLE]
        sine = root_music(found[None], spacing=spacing)[0]
        assert sine - np.sin(0.3) == pytest.approx(expected, abs=1e-4)


def test_doppler_division_puts_each_element_into_its_own_part_of_the_band():
    """Four bands, three elements: in stream l, element i stands (l − i)/4 cycles per sweep up."""
    still = target(azimuth=0.3)
    streams = element_streams(frame(plan(8, coding=DopplerDivision(num_bands=4)), still))
    spectrum = np.fft.fft(streams[:, :, :, MIDDLE], axis=2) / 8
    alone = np.array([frame(one_element(i, 8), still).samples[:, 0, MIDDLE] for i in range(3)])
    expected = np.zeros_like(spectrum)
    for stream in range(3):
        for element in range(3):
            expected[stream, :, 2 * (stream - element) % 8] += alone[element]
    np.testing.assert_allclose(spectrum, expected, atol=1e-9 * np.abs(alone).max())


def test_a_stream_of_time_division_has_its_own_ramps_alone():
    mixed = frame(plan(6, coding=TimeDivision()), target())
    streams = element_streams(mixed)
    for element in range(3):
        own = np.arange(6) % 3 == element
        np.testing.assert_array_equal(streams[element][:, own], mixed.samples[:, own])
        assert not streams[element][:, ~own].any()


def test_elements_that_send_together_each_have_full_power():
    """Three elements in phase: three times the voltage of one, boresight being equally far."""
    together = replace(plan(1), transmit_weight=np.ones((1, 3)))
    ratio = frame(together, target()).samples / frame(one_element(1, 1), target()).samples
    np.testing.assert_allclose(ratio, 3.0, rtol=1e-9)


# ── azimuths ────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("coding", CODINGS, ids=repr)
@pytest.mark.parametrize("azimuth", [-0.7, 0.2])
def test_the_azimuth_from_the_virtual_array_is_the_targets(coding, azimuth):
    """The term bτΔτ shifts the sine by bτ/f, 1e-5."""
    found = virtual_array(frame(plan(coding=coding), target(azimuth=azimuth)))
    assert found.array.num_channels == 12
    spacing = found.array.spacing * frequency_at(found, MIDDLE) / SPEED_OF_LIGHT
    sine = root_music(found.samples[None, :, :, MIDDLE], spacing=spacing)
    assert sine[0] == pytest.approx(np.sin(azimuth), abs=2e-5)


def beam_power(found, sines):
    """Power of beams towards ``sines``, at the middle of the first ramp."""
    weights = steering(found.array, frequency=frequency_at(found, MIDDLE), sine=sines)
    return np.abs(beamform(found.samples[:, :1, MIDDLE : MIDDLE + 1], weights)[:, 0, 0]) ** 2


@pytest.mark.parametrize(("num_transmitters", "expected"), [(1, 2 / 4), (2, 2 / 8), (3, 2 / 12)])
def test_the_beam_narrows_with_the_number_of_virtual_elements(num_transmitters, expected, compare):
    """N elements half a wavelength apart have their first null 2/N from the beam's sine."""
    schedule = plan(6, coding=TimeDivision(), num_elements=num_transmitters)
    mixed = frame(schedule, target(), antenna=array(num_transmitters))
    sines = np.arange(0.0, 0.7, 1e-4)
    power = beam_power(virtual_array(mixed), sines)
    first = np.flatnonzero((power[1:-1] < power[:-2]) & (power[1:-1] < power[2:]))[0] + 1
    compare(
        page="arrays",
        case=f"{num_transmitters} transmitting and 4 receiving elements",
        quantity="first null of the beam, sine",
        expected=expected,
        measured=float(sines[first]),
        tolerance=2e-4,  # of the grid and of f at the sample against the middle of the ramp
        source="uniform line, 2/N",
    )


@pytest.mark.parametrize(("num_transmitters", "expected"), [(1, 1), (3, 2)])
@pytest.mark.parametrize("half", [np.arcsin(1 / 12), np.radians(4.0)])
def test_two_targets_a_beam_of_twelve_apart_are_two_to_it_and_one_to_four(
    half, num_transmitters, expected
):
    """Rayleigh's criterion: 1/6 between the sines, 9.6°; and 8°, with a bare dip between them.

    The echoes are a quarter of a cycle apart, so that their powers add half-way between them;
    two lines sinc² have a dip from 0.83 of Rayleigh's distance on (Sparrow), 8.0°.
    """
    quarter = SPEED_OF_LIGHT / (8 * frequency_at(frame(plan(1), target()), MIDDLE))
    pair = (target(azimuth=-half), target(azimuth=half, distance=12.0 + quarter))
    schedule = plan(6, coding=TimeDivision(), num_elements=num_transmitters)
    found = virtual_array(frame(schedule, *pair, antenna=array(num_transmitters)))
    power = beam_power(found, np.linspace(-0.3, 0.3, 601))
    tops = (power[1:-1] > power[:-2]) & (power[1:-1] > power[2:])
    assert np.sum(tops & (power[1:-1] > 0.5 * power.max())) == expected


@pytest.mark.parametrize("range_rate", [0.0, 3.0])
def test_a_receiver_of_recordings_finds_the_same_target_in_simulated_turns(range_rate):
    """An independent route: its own transform of ramps taken in turns, and its own turning back.

    30 dB above the noise of a sample, so that the sine of 12 × 32 ramps × 300 samples is known
    far better than the cells of the map, whose rate is a tenth of a cell off at most.
    """
    schedule = plan(96, coding=TimeDivision())
    moving = target(azimuth=0.25, range_rate=range_rate)
    mixed = frame(schedule, moving)
    draws = np.random.default_rng(1).normal(size=(2, *mixed.samples.shape))
    level = np.abs(mixed.samples).max() * 10 ** (-30 / 20) / np.sqrt(2)
    noisy = mixed.with_samples(mixed.samples + level * (draws[0] + 1j * draws[1]))
    turns = RangeDoppler(false_alarm_probability=1e-4).detect(noisy)
    virtual = virtual_array(noisy, range_rate=range_rate)
    whole = RangeDoppler(false_alarm_probability=1e-4).detect(virtual)
    for found in (turns, whole):
        assert found.range_rate[0] == pytest.approx(range_rate, abs=0.1)
        assert found.azimuth[0] == pytest.approx(0.25, abs=0.005)


@pytest.mark.parametrize("coding", CODINGS, ids=repr)
@pytest.mark.parametrize("range_rate", [-30.0, 4.0])
def test_a_detections_own_rate_corrects_its_azimuth(coding, range_rate):
    """At 30 m/s the phase changes by 0.9 of a cycle from sweep to sweep. bτΔτ is 2e-5 of one."""
    mixed = frame(plan(coding=coding), target(azimuth=0.25, range_rate=range_rate))
    one = np.ones(1)
    detection = Detections(
        time=0.0,
        range=12.0 * one,
        range_rate=range_rate * one,
        azimuth=0.0 * one,
        power=one,
        snr=one,
    )
    found = azimuths_in_motion(CoherentReceiver(), mixed, detection)
    assert found.azimuth[0] == pytest.approx(0.25, abs=1e-4)


# ── errors of channels and elements ─────────────────────────────────────────────────────────────

ERRORS = {
    "channel_gains": (1.0, 0.8, 1.3, 1.0),
    "channel_phases": (0.0, 0.1, -0.2, 0.5),
}


@pytest.mark.parametrize("range_rate", [0.0, 3.0, -8.0])
def test_elements_in_turns_give_a_moving_target_the_snr_of_a_decoding_for_its_rate(
    range_rate,
):
    """The phase of the motion between the turns is no loss of the target's SNR."""
    received = frame(plan(24, coding=TimeDivision()), target(range_rate=range_rate, azimuth=0.2))
    random = np.random.default_rng(2)
    noise = random.normal(size=(2, *received.samples.shape))
    parts = IfParts(
        samples=np.stack([received.samples, noise[0] + 1j * noise[1]]), names=("echo", "noise")
    )
    middle = float(np.mean(received.schedule.start_time))
    true = Truth(
        time=middle,
        name=("car",),
        range=[12.0 + range_rate * middle],
        range_rate=[range_rate],
        azimuth=[0.2],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
    )

    def snr(rate, motion):
        decoded = virtual_array(received, range_rate=rate)
        own = virtual_parts(received, parts, range_rate=rate)
        levels = target_levels(CoherentReceiver(), decoded, own, true, motion=motion)
        return float(to_db(levels.snr[0]))

    in_motion = phases_in_motion(received, true.range_rate)
    assert snr(0.0, in_motion) == pytest.approx(snr(range_rate, None), abs=0.05)


@pytest.mark.parametrize("range_rate", [0.0, 3.0, -6.0])
@pytest.mark.parametrize("spacing", [0.95, 1.0, 1.05])
def test_speeds_that_beams_do_not_tell_apart_are_the_lowest(range_rate, spacing):
    """Of two elements above each other, the other fold is a wave from another elevation."""
    stacked = array(2, transmitter_positions=((0, 0), (0, 1.5)))
    stacked = replace(stacked, spacing=spacing * HALF_WAVE)
    schedule = plan(64, coding=TimeDivision(), num_elements=2)
    receiver = RangeDoppler(greatest_range=20.0, angle="bartlett")
    assert not receiver.tells_folds_apart(schedule, stacked)
    for seed in range(20):
        draw = np.random.default_rng(seed)
        azimuth, elevation = draw.uniform([-0.7, -0.15], [0.7, 0.15])
        point = target(range_rate=range_rate, azimuth=azimuth, elevation=elevation)
        whole = frame(schedule, point, antenna=stacked)
        level = 0.1 * np.sqrt(np.mean(np.abs(whole.samples) ** 2))
        noise = draw.normal(scale=level, size=(2, *whole.samples.shape))
        found = receiver.detect(whole.with_samples(whole.samples + noise[0] + 1j * noise[1]))
        assert found.range_rate == pytest.approx([range_rate], abs=0.3)


def test_a_channels_error_scales_its_echo_and_its_noise_alike():
    """√g e^{jψ} on what is received is √g e^{−jψ} on the beat, behind the mixer's conjugate."""
    schedule, snapshots = plan(2), [paths_of(target(gain=1e-6))]
    whole = [
        synthesize(
            Stretch(),
            world(antenna, noise_figure=4.0),
            [schedule],
            snapshots,
            victim=0,
            interferers=None,
            streams=Streams(seed=1),
        )[1].samples
        for antenna in (array(), array(**ERRORS))
    ]
    gains, phases = np.array(ERRORS["channel_gains"]), np.array(ERRORS["channel_phases"])
    factor = (np.sqrt(gains) * np.exp(-1j * phases))[:, None, None]
    np.testing.assert_allclose(whole[1], whole[0] * factor, rtol=1e-12, atol=0.0)
    assert np.abs(whole[0][4]).min() > 0.0


def test_the_error_of_a_transmitting_element_is_on_its_echo():
    """The same of what is sent; and the virtual array knows both errors of its channels."""
    errors = {"transmitter_gains": (1.0, 0.5, 2.0), "transmitter_phases": (0.0, 0.3, -0.1)}
    schedule = plan(3, coding=TimeDivision())
    ideal = virtual_array(frame(schedule, target(azimuth=0.2)))
    real = virtual_array(frame(schedule, target(azimuth=0.2), antenna=array(**errors)))
    factor = np.repeat(np.sqrt([1.0, 0.5, 2.0]) * np.exp(-1j * np.array([0.0, 0.3, -0.1])), 4)
    np.testing.assert_allclose(real.samples, ideal.samples * factor[:, None, None], rtol=1e-9)
    np.testing.assert_allclose(real.array.channel_response, np.conj(factor), rtol=1e-12)


def test_drawn_errors_have_the_spread_that_was_asked_for():
    """0.5 dB and 5°, rms of 4000 draws: known to 1/√8000 = 1.1 %."""
    spread = ArrayErrors(gain=10**0.05, phase=np.radians(5.0))
    drawn = spread.draw_array(array(num_channels=4000), streams=Streams(seed=1))
    level = 10 * np.log10(drawn.channel_gains)
    assert np.sqrt(np.mean(level**2)) == pytest.approx(0.5, rel=0.035)
    assert np.sqrt(np.mean(np.square(drawn.channel_phases))) == pytest.approx(
        np.radians(5.0), rel=0.035
    )
    assert abs(np.corrcoef(level, drawn.channel_phases)[0, 1]) < 3 / np.sqrt(4000)


def test_one_channel_more_leaves_the_errors_of_the_others():
    spread, streams = ArrayErrors(gain=1.1, phase=0.1), Streams(seed=3)
    few = spread.draw_array(array(num_channels=4), streams=streams)
    many = spread.draw_array(array(num_channels=5), streams=streams)
    assert many.channel_phases[:4] == few.channel_phases
    assert many.transmitter_gains == few.transmitter_gains
