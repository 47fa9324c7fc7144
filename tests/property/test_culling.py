"""Radars that are left out are inaudible: the bounds hold for any radars, and cost little."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.model.antenna import ISOTROPIC, AntennaArray, ElementPattern
from polychirp.model.front_end import FrontEnd, HighPass
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import Bounce
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.links.interferer_culling import (
    NEGLIGIBLE_SHARE,
    _norm,
    audible_radars,
    interference_bounds,
)
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, free_space_gain, paths_of
from polychirp.units import from_db
from tests.support.references.fullband import FullBand


def between(low, high):
    return st.floats(low, high, allow_nan=False)


@st.composite
def schedules(draw, start, carriers):
    """Three ramps, up and down, of 8 to 15 µs, touching or apart, hopping or not."""
    number = 3
    duration = np.array([draw(between(8e-6, 15e-6)) for _ in range(number)])
    idle = np.array([draw(st.sampled_from([0.0, 0.7e-6])) for _ in range(number)])
    bandwidth = np.array([draw(between(20e6, 250e6)) for _ in range(number)])
    sign = np.array([draw(st.sampled_from([-1, 1])) for _ in range(number)])
    return RampSchedule(
        start_time=draw(start) + np.cumsum(duration + idle) - duration - idle,
        duration=duration,
        start_frequency=[draw(carriers) for _ in range(number)],
        slope=sign * bandwidth / duration,
        start_phase=[draw(between(0.0, 1.0)) for _ in range(number)],
        sweep=np.arange(number),
    )


@st.composite
def hand_paths(draw):
    azimuth = draw(between(-1.5, 1.5))
    return HandPath(
        transmitter=1,
        delay=draw(between(0.0, 1e-6)),
        delay_rate=draw(between(-4e-7, 4e-7)),
        gain=draw(between(0.1, 1.0)),
        arrival=(float(np.cos(azimuth)), float(np.sin(azimuth)), 0.0),
        bounces=draw(st.sampled_from([(), (Bounce.SCATTERING,)])),
    )


def two_radars(if_filter, converter):
    radar = Radar(
        name="victim",
        array=AntennaArray(num_channels=2, spacing=5e-3, pattern=ISOTROPIC),
        if_filter=if_filter,
        converter=converter,
    )
    other = Radar(name="other", array=AntennaArray(pattern=ISOTROPIC))
    car = Actor(name="car", kind="vehicle")
    return Scene(time=0.0, actors=(car,), radars=(radar, other), carriers=(0, 0))


def true_rms(engine, scene, plans, snapshots, transmitter=1):
    """V, of the channel that receives most."""
    y = engine.contribution(scene, plans, snapshots, victim=0, transmitter=transmitter)
    count = sample_times(plans[0], scene.radars[0].converter).num_samples.sum()
    return math.sqrt(np.max(np.sum(np.abs(y.sum(axis=0)) ** 2, axis=(1, 2))) / count)


ANYWHERE = st.sampled_from([79e9, 79.007e9, 79.09e9, 78.5e9, 77e9, 82e9])
FILTERS = st.builds(
    lambda edge, ratio, level: IfFilter(
        passband=edge, stopband=ratio * edge, attenuation=from_db(level)
    ),
    between(2e6, 5e6),
    between(1.6, 2.5),
    between(50.0, 100.0),
)


@settings(max_examples=25)
@given(
    own=schedules(st.just(0.0), st.just(79e9)),
    sent=schedules(between(-40e-6, 40e-6), ANYWHERE),
    paths=st.lists(hand_paths(), min_size=1, max_size=3),
    if_filter=FILTERS,
    edge=st.sampled_from([0.1e-6, 2.5e-6]),
)
def test_no_radar_is_stronger_than_its_bound(own, sent, paths, if_filter, edge):
    """In band, out of band, switched on and off within windows, moving; two snapshots."""
    scene = two_radars(if_filter, Converter(sample_rate=10e6, start=edge, margin=edge))
    snapshots = [
        paths_of(*paths, reference_time=4e-6),
        paths_of(*paths[:1], reference_time=30e-6),
    ]
    plans = [own, sent]
    bounds = interference_bounds(scene, plans, snapshots, victim=0, interferers=[1])
    # the engine itself is right to 1e-7 of what one path of 0.5 V brings in
    assert true_rms(Stretch(), scene, plans, snapshots) <= bounds.rms[0] + 1e-7


@pytest.mark.parametrize("offset", [0.3e9, 1e9, 2e9])
@pytest.mark.parametrize("slope", [4e12, -20e12])
@pytest.mark.parametrize("begin", [9.03e-6, -10.97e-6])
def test_far_out_of_band_the_bound_is_close_to_the_truth(offset, slope, begin):
    """A transmitter that is switched on or off in mid-ramp, by the slow engine: within 10 dB."""
    common = {"duration": [20e-6], "start_phase": [0.2], "sweep": [0]}
    own = RampSchedule(start_time=[0.0], start_frequency=[79e9], slope=[10e12], **common)
    sent = RampSchedule(
        start_time=[begin], start_frequency=[79.1e9 - offset], slope=[slope], **common
    )
    scene = two_radars(
        IfFilter(passband=3e6, stopband=7e6), Converter(sample_rate=10e6, start=1e-6, margin=1e-6)
    )
    snapshots = [paths_of(HandPath(transmitter=1, delay=50e-9, delay_rate=-1e-7))]
    truth = true_rms(FullBand(), scene, [own, sent], snapshots)
    bound = interference_bounds(scene, [own, sent], snapshots, victim=0, interferers=[1]).rms[0]
    assert 1.0 < bound / truth < 10**0.5


def test_the_norm_of_a_transfer_is_its_largest_singular_value():
    random = np.random.default_rng(1)
    transfer = random.normal(size=(20, 2, 2)) + 1j * random.normal(size=(20, 2, 2))
    expected = np.linalg.svd(transfer, compute_uv=False)[:, 0]
    assert _norm(transfer) == pytest.approx(expected, rel=1e-12)


# ── two hundred radars ──────────────────────────────────────────────────────────────────────────

NUMBER = 200


def triangles(random, start_time, lowest, num_sweeps=8):
    duration = np.repeat(random.uniform(1e-3, 2e-3, num_sweeps), 2)
    sweep = np.repeat(random.uniform(0.8e9, 1e9, num_sweeps), 2)
    sign = np.tile([1.0, -1.0], num_sweeps)
    return RampSchedule(
        start_time=start_time + np.cumsum(duration) - duration,
        duration=duration,
        start_frequency=np.where(sign > 0, lowest, lowest + sweep),
        slope=sign * sweep / duration,
        start_phase=random.uniform(size=2 * num_sweeps),
        sweep=np.repeat(np.arange(num_sweeps), 2),
    )


@pytest.fixture(scope="module")
def crowd():
    """A victim from 79 GHz; 200 radars in 76–77 GHz at 100 to 500 m, hidden by 20 dB or more; and
    one at 79 GHz, no stronger.
    """
    random = np.random.default_rng(5)
    array = AntennaArray(num_channels=4, pattern=ElementPattern(peak_gain=from_db(11.0)))
    scene = Scene(
        time=0.0,
        actors=(Actor(name="car", kind="vehicle"),),
        radars=tuple(Radar(name=f"r{n}", array=array) for n in range(NUMBER + 2)),
        carriers=(0,) * (NUMBER + 2),
    )
    starts = random.uniform(-1e-3, 1e-3, NUMBER)
    plans = [
        triangles(random, 0.0, 79e9),
        *(triangles(random, start, 76e9) for start in starts),
        triangles(random, 3e-4, 79e9),
    ]
    distance = random.uniform(100.0, 500.0, NUMBER + 1)
    snapshots = [
        paths_of(
            *(
                HandPath(
                    transmitter=n + 1,
                    delay=way / 3e8 * (1 + 0.01 * p),
                    delay_rate=random.uniform(-2e-7, 2e-7),
                    gain=free_space_gain(way) * 10 ** random.uniform(-2.0, -1.0),
                    bounces=(Bounce.SCATTERING,),
                )
                for n, way in enumerate(distance)
                for p in range(3)
            ),
            reference_time=moment,
        )
        for moment in np.linspace(1e-3, 23e-3, 12)
    ]
    return scene, plans, snapshots


def test_radars_of_another_band_are_left_out_and_one_of_the_same_never(crowd):
    found = audible_radars(*crowd, victim=0, interferers=range(1, NUMBER + 2))
    assert found.numbers == (NUMBER + 1,)
    radar = crowd[0].radars[0]
    noise = math.sqrt(noise_density(radar) * radar.if_filter.noise_bandwidth)
    assert 0 < found.neglected <= NEGLIGIBLE_SHARE * noise


def test_the_radars_left_out_are_together_below_the_stated_bound(crowd):
    """Ten of the crowd, summed sample by sample."""
    scene, plans, snapshots = crowd
    few = range(1, 11)
    parts = [Stretch().contribution(scene, plans, snapshots, victim=0, transmitter=n) for n in few]
    count = sample_times(plans[0], scene.radars[0].converter).num_samples.sum()
    power = np.sum(np.abs(np.sum(parts, axis=(0, 1))) ** 2, axis=(1, 2)) / count
    assert math.sqrt(power.max()) <= audible_radars(*crowd, victim=0, interferers=few).neglected


def test_leaving_out_costs_less_than_a_hundredth_of_what_it_saves(crowd):
    scene, plans, snapshots = crowd

    def best_of(function, repeats):
        taken = []
        for _ in range(repeats):
            begin = time.process_time()
            function()
            taken.append(time.process_time() - begin)
        return min(taken)

    def synthesized():
        for n in (7, 77, 177):
            Stretch().contribution(scene, plans, snapshots, victim=0, transmitter=n)

    everyone = range(1, NUMBER + 1)
    synthesized()
    audible_radars(*crowd, victim=0, interferers=everyone)
    full = best_of(synthesized, 2) / 3 * NUMBER
    assert best_of(lambda: audible_radars(*crowd, victim=0, interferers=everyone), 9) < 0.01 * full


def test_a_frame_states_the_rms_that_it_leaves_out(crowd):
    scene, plans, snapshots = crowd

    def made(**options):
        return synthesize(
            Stretch(),
            scene,
            plans,
            snapshots,
            victim=0,
            interferers=[1, 2, NUMBER + 1],
            streams=Streams(seed=1),
            **options,
        )

    frame, parts = made()
    whole, all_parts = made(neglected_share=0.0)
    assert parts.neglected > 0.0 == all_parts.neglected
    missing = np.sqrt(np.sum(np.abs(whole.samples - frame.samples) ** 2, axis=(1, 2)))
    assert np.all(missing <= parts.neglected * math.sqrt(frame.times.num_samples.sum()))
    assert np.array_equal(parts["echo"], all_parts["echo"])


@pytest.mark.parametrize(
    ("beyond", "delay_rate", "reference_time", "is_audible"),
    [
        (-0.05e6, 0.0, 0.0, True),
        (0.05e6, 0.0, 0.0, False),
        (0.05e6, 1e-6, 0.0, True),  # by 79 kHz of Doppler shift
        (0.05e6, 1e-8, 0.0, False),
        (0.05e6, 1e-8, -10.0, True),  # after 10 s the path is 30 m longer: 100 kHz
    ],
)
def test_a_twin_beside_the_band_is_audible_up_to_the_stop_edge(
    beyond, delay_rate, reference_time, is_audible
):
    """Equal ramps, carriers apart: a steady beat that may come within 0.7 MHz, however weak."""
    plan = RampSchedule(
        start_time=[0.0],
        duration=[1e-3],
        start_frequency=[79e9],
        slope=[1e12],
        start_phase=[0.0],
        sweep=[0],
    )
    twin = replace(plan, start_frequency=[79e9 - 0.7e6 - beyond])
    scene = two_radars(IfFilter(), Converter())
    path = HandPath(transmitter=1, delay=0.0, delay_rate=delay_rate, gain=1e-12)
    snapshots = [paths_of(path, reference_time=reference_time)]
    found = audible_radars(scene, [plan, twin], snapshots, victim=0, interferers=[1])
    assert found.numbers == ((1,) if is_audible else ())


def test_a_radar_without_paths_is_not_audible():
    plans = [triangles(np.random.default_rng(1), 0.0, 79e9)] * 2
    scene = two_radars(IfFilter(), Converter())
    found = audible_radars(scene, plans, [paths_of()], victim=0, interferers=[1])
    assert (found.numbers, found.neglected) == ((), 0.0)


@pytest.mark.parametrize("start", [6e-6, 10e-6])
def test_what_a_high_pass_keeps_of_a_crossing_before_the_first_sample_is_not_left_out(start):
    """Ramps cross 1 µs after they begin and are 300 MHz apart when the converter starts.

    A high-pass of 20 kHz still rings then, by e^{-0.6} and e^{-1.1}.
    """
    scene = two_radars(
        IfFilter(passband=4e6, stopband=6e6),
        Converter(sample_rate=12.5e6, start=start, margin=5e-6),
    )
    rings = replace(scene.radars[0], front_end=FrontEnd(high_pass=HighPass(corners=(20e3,))))
    scene = replace(scene, radars=(rings, scene.radars[1]))
    number = np.arange(4)
    own, sent = (
        RampSchedule(
            start_time=50e-6 * number,
            duration=np.full(4, 40e-6),
            start_frequency=np.full(4, frequency),
            slope=np.full(4, slope),
            start_phase=np.zeros(4),
            sweep=number,
        )
        for frequency, slope in ((77e9, 30e12), (77.06e9, -30e12))
    )
    snapshots = [paths_of(HandPath(delay=3e-8, gain=1e-5, transmitter=1))]
    told = {"victim": 0, "interferers": None, "streams": Streams(seed=1)}
    kept, every = (
        synthesize(Stretch(), scene, [own, sent], snapshots, neglected_share=share, **told)[1]
        for share in (NEGLIGIBLE_SHARE, 0.0)
    )
    missing = np.abs(every.interference - kept.interference) ** 2
    assert np.abs(every.interference).max() > 0.0
    assert math.sqrt(missing.mean(axis=(1, 2)).max()) <= kept.neglected
