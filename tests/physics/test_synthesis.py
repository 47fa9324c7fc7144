"""Laws that the dechirped samples obey: levels, beats, delays, array phases, filtered chirps."""

import numpy as np
import pytest

from polychirp.constants import BOLTZMANN, SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray, ElementPattern
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import Bounce
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.links.links import links_between
from polychirp.synthesis.links.thermal_noise import noise_density, thermal_noise
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, free_space_gain, paths_of
from polychirp.units import from_db
from tests.support.references.fullband import FullBand

SLOPE = 1e12
START = 79e9
DURATION = 500e-6
ONE_HUNDREDTH_OF_A_DB = 10**0.001 - 1


def ramp(*, start_time=0.0, slope=SLOPE, start_frequency=START, duration=DURATION):
    return RampSchedule(
        start_time=[start_time],
        duration=[duration],
        start_frequency=[start_frequency],
        slope=[slope],
        start_phase=[0.0],
        sweep=[0],
    )


def world(*radars, pose=None):
    car = Actor(name="car", kind="vehicle", pose=pose or Pose())
    return Scene(time=0.0, actors=(car,), radars=radars, carriers=(0,) * len(radars))


def isotropic(name="victim", *, num_channels=1, **fields):
    array = AntennaArray(num_channels=num_channels, pattern=ISOTROPIC)
    return Radar(name=name, array=array, **fields)


def received(scene, plans, *paths, transmitter=0, reference_time=0.0):
    """Both parts, ``(part, channel, fast)``, on a single ramp."""
    snapshots = [paths_of(*paths, reference_time=reference_time)]
    y = Stretch().contribution(scene, plans, snapshots, victim=0, transmitter=transmitter)
    return y[:, :, 0]


def beat_of(samples, rate=1e6):
    """Frequency of a tone, Hz, from the least-squares slope of its unwrapped phase."""
    return np.polyfit(np.arange(samples.size) / rate, np.unwrap(np.angle(samples)), 1)[0] / (
        2 * np.pi
    )


# ── levels ──────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("pattern", [ISOTROPIC, ElementPattern()])
def test_a_direct_interferer_arrives_with_the_power_of_friis(pattern):
    """P = P_t G_ft G_t G_r G_fr (λ/4πd)², 20° off the axis of both: −12·(20/160)² dB each."""
    array = AntennaArray(num_channels=1, pattern=pattern)
    sender = Radar(name="a", array=array, transmit_power=5e-3, transmit_gain=7.0)
    victim = Radar(name="b", array=array, receive_gain=30.0)
    angle = np.radians(20.0)
    there = (float(np.cos(angle)), float(np.sin(angle)), 0.0)
    distance = 17.0
    path = HandPath(
        delay=distance / SPEED_OF_LIGHT,
        gain=free_space_gain(distance),
        transmitter=1,
        departure=there,
        arrival=there,
    )
    y = received(world(victim, sender), [ramp(), ramp()], path, transmitter=1)
    gain = 1.0 if pattern is ISOTROPIC else from_db(27.0 - 12.0 * (20.0 / 160.0) ** 2)
    wavelength = SPEED_OF_LIGHT / 79e9
    friis = 5e-3 * 7.0 * 30.0 * (gain * wavelength / (4 * np.pi * distance)) ** 2
    power = np.mean(np.abs(y[0, 0]) ** 2)  # a beat of 57 kHz, where the filter is flat to 1e-5
    assert power == pytest.approx(friis, rel=ONE_HUNDREDTH_OF_A_DB)


def test_a_point_target_echoes_with_the_power_of_the_radar_equation():
    """P = P_t G_ft G_fr G² λ² σ / ((4π)³ R⁴); the path's amplitude is λ√σ/((4π)^{3/2} R²)."""
    distance, rcs, gain = 20.0, 3.0, from_db(27.0)
    radar = Radar(name="a", array=AntennaArray(num_channels=1))
    wavelength = SPEED_OF_LIGHT / 79e9
    path = HandPath(
        delay=2 * distance / SPEED_OF_LIGHT,
        gain=wavelength * np.sqrt(rcs) / ((4 * np.pi) ** 1.5 * distance**2),
        bounces=(Bounce.SCATTERING,),
    )
    y = received(world(radar), [ramp()], path)
    expected = (
        (radar.transmit_power * radar.transmit_gain * radar.receive_gain)
        * (gain**2 * wavelength**2 * rcs)
        / ((4 * np.pi) ** 3 * distance**4)
    )
    assert np.mean(np.abs(y[0, 0]) ** 2) == pytest.approx(expected, rel=ONE_HUNDREDTH_OF_A_DB)


def test_a_cross_polarised_antenna_receives_nothing():
    across = AntennaArray(
        num_channels=1,
        pattern=ElementPattern(
            peak_gain=1.0,
            azimuth_beamwidth=np.inf,
            elevation_beamwidth=np.inf,
            floor=1.0,
            polarisation="horizontal",
        ),
    )
    scene = world(Radar(name="v", array=across), isotropic("other"))
    y = received(scene, [ramp(), ramp()], HandPath(delay=1e-7, transmitter=1), transmitter=1)
    assert np.abs(y).max() == 0.0


def test_a_radar_that_is_rolled_by_a_third_loses_a_quarter_of_its_voltage_squared():
    """Malus: a vertical antenna rolled by 30° about the wave's direction takes cos² of it."""
    rolled = Radar(
        name="v", mount=Pose(roll=np.pi / 6), array=isotropic().array
    )  # the wave comes along its x axis
    scene = world(rolled, isotropic("other"))
    link = links_between(
        scene, paths_of(HandPath(delay=1e-7, transmitter=1)), victim=0, transmitter=1
    )
    full = scene.radars[1].transmit_power * scene.radars[1].transmit_gain * rolled.receive_gain
    assert abs(link.amplitude[0]) ** 2 == pytest.approx(0.75 * full, rel=1e-12)


# ── beats and phases ────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("slope", [SLOPE, -SLOPE])
def test_an_echo_beats_at_slope_times_delay_with_the_residual_video_phase(slope):
    """tx·rx* of a delayed ramp has the phase f₀τ − bτ²/2 + bτt in cycles, from the ramp's start."""
    delay = 2e-7
    y = received(
        world(isotropic()), [ramp(slope=slope, start_frequency=START)], HandPath(delay=delay)
    )
    t = 10e-6 + np.arange(y.shape[-1]) / 1e6
    turns = START * delay - 0.5 * slope * delay**2 + slope * delay * t
    response = IfFilter().response(np.array([slope * delay]))[0]
    scale = np.sqrt(
        isotropic().transmit_power * isotropic().transmit_gain * isotropic().receive_gain
    )
    assert y[0, 0] == pytest.approx(scale * response * np.exp(2j * np.pi * turns), rel=1e-9)


def test_the_voltage_of_a_path_appears_conjugated():
    """The sample is tx·conj(rx): a path that advances the field by 90° retards the beat."""
    plain = received(world(isotropic()), [ramp()], HandPath(delay=1e-7))
    turned = received(world(isotropic()), [ramp()], HandPath(delay=1e-7, gain=1j))
    assert turned == pytest.approx(-1j * plain, rel=1e-12)


@pytest.mark.parametrize("slope", [SLOPE, -SLOPE])
def test_an_opening_target_shifts_the_beat_by_its_frequency_times_the_delay_rate(slope):
    """d/dt of φ(t) − φ(t − τ₀ − τ't) at mid-ramp: f(t) − (1 − τ')·f(t − τ)."""
    delay, rate = 2e-7, 2e-7  # 30 m/s, opening
    plan = ramp(slope=slope)
    y = received(
        world(isotropic()),
        [plan],
        HandPath(delay=delay, delay_rate=rate),
        reference_time=DURATION / 2,
    )
    centre = START + slope * DURATION / 2
    expected = centre - (1 - rate) * (centre - slope * delay)
    # the window is centred in the ramp to half a sample; the chirp 2bτ' moves by 0.2 Hz in it
    assert beat_of(y[0, 0]) == pytest.approx(expected, abs=0.5)


def test_a_synchronous_twin_appears_at_half_its_distance():
    """A one-way path is read as a two-way one: R = c f/2b = d/2."""
    distance = 13.2
    scene = world(isotropic(), isotropic("twin"))
    path = HandPath(delay=distance / SPEED_OF_LIGHT, transmitter=1)
    y = received(scene, [ramp(), ramp()], path, transmitter=1)
    ghost = SPEED_OF_LIGHT * beat_of(y[0, 0]) / (2 * SLOPE)
    assert ghost == pytest.approx(6.6, abs=1e-6)


def test_a_twin_with_a_shifted_start_beats_at_the_shift():
    """Starting late by Δ adds bΔ to the beat, as a longer path would."""
    scene = world(isotropic(), isotropic("twin"))
    path = HandPath(delay=20e-9, transmitter=1)
    y = received(scene, [ramp(), ramp(start_time=150e-9)], path, transmitter=1)
    assert beat_of(y[0, 0]) == pytest.approx(SLOPE * 170e-9, rel=1e-6)


# ── the array ───────────────────────────────────────────────────────────────────────────────────


def test_a_wave_from_the_left_reaches_the_left_element_first():
    """Azimuth +30°: the left element (+y) is nearer by d·sin 30°, so its echo is less delayed.

    Its beat phase fτ is smaller: neighbours differ by −f·d·sin(θ)/c = −1/4 cycle at half-
    wavelength spacing, times (f + bt)/f for the true delay, less b·τ for its residual phase.
    """
    arrival = (float(np.cos(np.pi / 6)), 0.5, 0.0)
    radar = isotropic(num_channels=4)
    delay = 1e-7
    y = received(world(radar), [ramp()], HandPath(delay=delay, arrival=arrival))[0]
    t = 10e-6 + np.arange(y.shape[-1]) / 1e6
    step = -radar.array.spacing * 0.5 / SPEED_OF_LIGHT
    turns = (START + SLOPE * t) * step - 0.5 * SLOPE * (
        (delay + 0.5 * step) ** 2 - (delay - 0.5 * step) ** 2
    )
    assert turns[0] == pytest.approx(-0.25, abs=1e-4)
    between = y[2] * np.conj(y[1]) / np.abs(y[2] * y[1])
    assert between == pytest.approx(np.exp(2j * np.pi * turns), abs=1e-9)


def test_turning_the_vehicle_turns_the_array():
    """A radar yawed by +30° sees a wave from the world's azimuth 60° as one from 30°."""
    radar = isotropic(num_channels=3)

    def wave(azimuth):
        return HandPath(delay=1e-7, arrival=(float(np.cos(azimuth)), float(np.sin(azimuth)), 0.0))

    straight = received(world(radar), [ramp()], wave(np.pi / 6))
    turned = received(world(radar, pose=Pose(yaw=np.pi / 6)), [ramp()], wave(np.pi / 3))
    assert turned == pytest.approx(straight, rel=1e-9)


# ── what is not there ───────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("engine", [Stretch(), FullBand()])
def test_a_radar_that_has_not_begun_is_not_heard(engine):
    """It starts after 30 µs: half a filter (0.7 µs) before its first wave arrives all is silent."""
    fast = IfFilter(passband=3e6, stopband=7e6)
    converter = Converter(sample_rate=10e6, start=1e-6, margin=1e-6)
    scene = world(isotropic(if_filter=fast, converter=converter), isotropic("late"))
    plans = [ramp(duration=50e-6), ramp(start_time=30e-6, duration=50e-6, start_frequency=79.03e9)]
    snapshots = [paths_of(HandPath(delay=1e-7, transmitter=1))]
    y = engine.contribution(scene, plans, snapshots, victim=0, transmitter=1)[0, 0, 0]
    t = 1e-6 + np.arange(y.size) / 10e6
    before = t < 30e-6 + 1e-7 - 0.5 * fast.support
    assert np.all(y[before] == 0)
    assert np.all(np.abs(y[t > 31e-6]) > 1.0)


@pytest.mark.parametrize("engine", [Stretch(), FullBand()])
def test_paths_of_other_radars_are_not_mixed_in(engine):
    scene = world(isotropic(), isotropic("b"), isotropic("c"))
    plans = [ramp(duration=30e-6)] * 3
    own = HandPath(delay=1e-7, transmitter=1, receiver=0)
    foreign = [
        HandPath(delay=1e-7, transmitter=t, receiver=r)
        for t in range(3)
        for r in range(3)
        if (t, r) != (1, 0)
    ]
    both = [paths_of(own), paths_of(own, *foreign)]
    y = [engine.contribution(scene, plans, [paths], victim=0, transmitter=1) for paths in both]
    assert np.abs(y[0]).max() > 0
    assert np.array_equal(y[0], y[1])


def test_paths_go_to_the_part_that_their_bounces_say():
    """Own: by way of one body, or of two. Others: no bounce or some."""
    scene = world(isotropic(), isotropic("b"))
    mirrored = (Bounce.REFLECTION, Bounce.SCATTERING)
    cases = [
        (0, (Bounce.SCATTERING,), (0,), 0),
        (0, (Bounce.REFLECTION,), (0,), 0),
        (0, mirrored, (0, 0), 0),
        (0, mirrored, (1, 0), 1),
        (1, (), (), 0),
        (1, (Bounce.SCATTERING,), (0,), 1),
    ]
    for transmitter, bounces, actors, part in cases:
        path = HandPath(delay=1e-7, transmitter=transmitter, bounces=bounces, actors=actors)
        y = received(scene, [ramp(), ramp()], path, transmitter=transmitter)
        assert np.abs(y[part]).max() > 0
        assert np.abs(y[1 - part]).max() == 0


def test_every_ramp_takes_the_snapshot_nearest_to_its_middle():
    """Three ramps, snapshots at 0 and 1 ms with delays 100 and 200 ns: beats 100, 200, 200 kHz."""
    plan = RampSchedule(
        start_time=[0.0, 0.5e-3, 1e-3],
        duration=[0.5e-3] * 3,
        start_frequency=[START] * 3,
        slope=[SLOPE] * 3,
        start_phase=[0.0] * 3,
        sweep=[0, 1, 2],
    )
    snapshots = [
        paths_of(HandPath(delay=100e-9), reference_time=0.0),
        paths_of(HandPath(delay=200e-9), reference_time=1e-3),
    ]
    y = Stretch().contribution(world(isotropic()), [plan], snapshots, victim=0, transmitter=0)
    beats = [beat_of(y[0, 0, k]) for k in range(3)]
    assert beats == pytest.approx([100e3, 200e3, 200e3], rel=1e-5)


# ── the filter on a crossing ────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("other_slope", [0.9e12, 0.5e12, -1e12])
def test_a_crossing_leaves_the_energy_of_the_filter_over_the_chirp_rate(other_slope):
    """Parseval: a chirp has 1/|μ| J/Hz everywhere, so ∫|y|² dt = P·∫|H|² df / |μ|.

    Sampled without aliasing (5 MS/s for a filter that ends at 0.7 MHz), the sum over samples is
    the integral; tails outside the ramp are below 1e-4.
    """
    converter = Converter(sample_rate=5e6, start=0.0, margin=0.0)
    victim = isotropic(converter=converter)
    middle = START + (SLOPE - other_slope) * DURATION / 2  # the crossing is in mid-ramp
    plans = [ramp(), ramp(slope=other_slope, start_frequency=middle)]
    y = received(
        world(victim, isotropic("b")), plans, HandPath(delay=0.0, transmitter=1), transmitter=1
    )
    power = victim.transmit_power * victim.transmit_gain * victim.receive_gain
    frequency = np.linspace(-3e6, 3e6, 6001)
    passed = np.trapezoid(victim.if_filter.response(frequency) ** 2, frequency)
    expected = power * passed / abs(SLOPE - other_slope)
    assert np.sum(np.abs(y[0, 0]) ** 2) / 5e6 == pytest.approx(expected, rel=5e-4)


# ── noise and the sum ───────────────────────────────────────────────────────────────────────────


def noise_of(radar, duration=20e-3, seed=3):
    times = sample_times(ramp(duration=duration, slope=1e9), radar.converter)
    return thermal_noise(radar, times, Streams(seed=seed)["noise", radar.name])[:, 0]


def test_noise_has_the_power_of_its_figure_gain_and_bandwidth():
    """kT₀ F G B_n with B_n = ∫|H|² df, about 1 MHz here.

    64 channels of 20 000 samples, of which one in 1/(T B_n) seconds is independent: 1.3 million
    samples of an exponential power, relative deviation below 4·√(1.2/1.28e6) = 0.4 %.
    """
    radar = isotropic(num_channels=64, noise_figure=3.0, receive_gain=200.0)
    frequency = np.linspace(-2e6, 2e6, 4001)
    bandwidth = np.trapezoid(radar.if_filter.response(frequency) ** 2, frequency)
    expected = BOLTZMANN * 290.0 * 3.0 * 200.0 * bandwidth
    assert np.mean(np.abs(noise_of(radar)) ** 2) == pytest.approx(expected, rel=4e-3)


def test_noise_is_correlated_as_the_filter_folded_at_the_sample_rate():
    """r_m = N₀ ∫|H|² e^{j2πfm/f_s} df, at 4 MS/s where neighbours are alike; 5-sigma bounds."""
    converter = Converter(sample_rate=4e6)
    radar = isotropic(num_channels=64, converter=converter)
    noise = noise_of(radar)
    frequency = np.linspace(-3e6, 3e6, 6001)
    spectrum = radar.if_filter.response(frequency) ** 2
    count = noise.shape[1]
    tolerance = 5.0 * noise_density(radar) * 1e6 / np.sqrt(64 * count / 4)
    for lag in (0, 1, 2, 3, 5, 30, 80):
        wave = np.cos(2 * np.pi * frequency * lag / 4e6)
        expected = noise_density(radar) * np.trapezoid(spectrum * wave, frequency)
        measured = np.mean(noise[:, lag:] * np.conj(noise[:, : count - lag]))
        assert measured == pytest.approx(expected, abs=tolerance)


def test_the_end_of_a_ramp_knows_nothing_of_its_beginning():
    """40 µs apart, beyond the filter's 14 µs; neighbours 0.25 µs apart correlate to 0.9."""
    converter = Converter(sample_rate=4e6)
    noise = noise_of(isotropic(num_channels=2000, converter=converter), duration=60e-6)
    correlation = np.mean(noise[:, 0] * np.conj(noise[:, -1])) / np.mean(np.abs(noise) ** 2)
    assert abs(correlation) < 5 / np.sqrt(2000)


def test_noise_follows_the_seed():
    again, same, other = (noise_of(isotropic(), duration=1e-3, seed=s) for s in (1, 1, 2))
    assert np.array_equal(again, same)
    assert not np.any(again == other)


def test_channels_have_independent_noise():
    noise = noise_of(isotropic(num_channels=2))
    coherence = abs(np.vdot(noise[0], noise[1])) / (
        np.linalg.norm(noise[0]) * np.linalg.norm(noise[1])
    )
    assert coherence < 5 / np.sqrt(noise.shape[1])


def test_parts_sum_to_the_samples_and_follow_the_interferers_that_are_named():
    scene = world(isotropic(num_channels=2), isotropic("b"), isotropic("c"))
    plans = [ramp(), ramp(start_time=1e-7), ramp(slope=0.7e12)]
    snapshots = [
        paths_of(
            HandPath(delay=1e-7, gain=1e-4, bounces=(Bounce.SCATTERING,)),
            HandPath(delay=5e-8, gain=1e-3, transmitter=1),
            HandPath(delay=7e-8, gain=1e-4, transmitter=2, bounces=(Bounce.SCATTERING,)),
        )
    ]

    def made(interferers):
        return synthesize(
            Stretch(),
            scene,
            plans,
            snapshots,
            victim=0,
            interferers=interferers,
            streams=Streams(seed=5),
        )

    frame, parts = made(None)
    _, alone = made([])
    _, first = made([1])
    assert np.array_equal(frame.samples, parts.samples.sum(axis=0))
    assert np.array_equal(parts["echo"], alone["echo"])
    assert np.array_equal(parts.noise, alone.noise)
    assert np.abs(alone.interference).max() == 0.0
    assert np.array_equal(first["direct"], parts["direct"])
    assert np.abs(first["indirect"]).max() == 0.0 < np.abs(parts["indirect"]).max()
