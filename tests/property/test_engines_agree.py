"""The fast engine against the slow one, as waveforms: the same samples, not the same energy."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.paths import Bounce
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.stretch import engine, path_batches
from polychirp.synthesis.stretch.engine import NEGLIGIBLE_IN_BAND, NEGLIGIBLE_OUT_OF_BAND, Stretch
from polychirp.synthesis.stretch.ramp_overlaps import strongest_sample
from polychirp.testing.paths import HandPath, paths_of
from polychirp.units import from_db
from tests.support.references.fullband import FullBand

AGREEMENT = 1e-6
"""Of the strongest sample: what full-rate references are compared with."""


SUMMED = 1e-8
"""Of the strongest path: what sums over paths are compared with, path by path. A path's gain at
each of two edges of the window may be wrong by 1e-9 (`EDGE_TOLERANCE`); the amplitudes of 60 paths
of `many_paths` add up to 3.3 on average."""


def between(low, high):
    return st.floats(low, high, allow_nan=False)


@st.composite
def schedules(draw, start):
    """Three ramps, up and down, of 8 to 15 µs, touching or apart, at one carrier or hopping."""
    number = 3
    duration = np.array([draw(between(8e-6, 15e-6)) for _ in range(number)])
    idle = np.array([draw(st.sampled_from([0.0, 0.7e-6])) for _ in range(number)])
    bandwidth = np.array([draw(between(20e6, 250e6)) for _ in range(number)])
    sign = np.array([draw(st.sampled_from([-1, 1])) for _ in range(number)])
    return RampSchedule(
        start_time=draw(start) + np.cumsum(duration + idle) - duration - idle,
        duration=duration,
        start_frequency=[79e9 + draw(st.sampled_from([0.0, 7e6, 90e6])) for _ in range(number)],
        slope=sign * bandwidth / duration,
        start_phase=[draw(between(0.0, 1.0)) for _ in range(number)],
        sweep=np.arange(number),
    )


@st.composite
def mimo_schedules(draw, start):
    """The same from two or three elements, silent or driven with any phase on every ramp."""
    plan = draw(schedules(start))
    drive = st.tuples(st.sampled_from([0.0, 0.3, 1.0]), between(-3.0, 3.0))
    size = (plan.num_ramps, draw(st.integers(2, 3)))
    drawn = np.array([draw(drive) for _ in range(size[0] * size[1])]).reshape(*size, 2)
    weight = drawn[..., 0] * np.exp(1j * drawn[..., 1])
    weight[0, -1] = 1.0
    return replace(plan, transmit_weight=weight)


@st.composite
def hand_paths(draw, transmitter):
    azimuth = draw(between(-1.5, 1.5))
    leaving = draw(between(-1.5, 1.5))
    return HandPath(
        transmitter=transmitter,
        delay=draw(between(0.0, 1e-6)),
        delay_rate=draw(between(-4e-7, 4e-7)),
        delay_acceleration=draw(st.sampled_from([0.0, 1e-6, -1e-5])),
        gain=draw(between(0.1, 1.0)) * np.exp(1j * draw(between(-3.0, 3.0))),
        departure=(float(np.cos(leaving)), float(np.sin(leaving)), 0.0),
        arrival=(float(np.cos(azimuth)), float(np.sin(azimuth)), 0.0),
        arrival_rate=draw(st.sampled_from([(0.0, 0.0, 0.0), (-3.0, 5.0, 0.0)])),
        bounces=draw(st.sampled_from([(), (Bounce.SCATTERING,)])),
    )


FILTERS = st.builds(
    lambda edge, ratio, level: IfFilter(
        passband=edge, stopband=ratio * edge, attenuation=from_db(level)
    ),
    between(2e6, 5e6),
    between(1.6, 2.5),
    between(50.0, 100.0),
)


MIMO = AntennaArray(
    num_channels=2,
    spacing=5e-3,
    pattern=ISOTROPIC,
    num_transmitters=3,
    transmit_spacing=8e-3,
    transmitter_gains=(1.0, 0.8, 1.1),
    transmitter_phases=(0.0, 0.4, -1.0),
)


def two_radars(if_filter):
    """Windows that open with the ramp, so that the filter reaches across every kind of end."""
    radar = Radar(
        name="victim",
        array=MIMO,
        if_filter=if_filter,
        converter=Converter(sample_rate=10e6, start=0.1e-6, margin=0.1e-6),
    )
    other = Radar(name="other", array=MIMO)
    car = Actor(name="car", kind="vehicle")
    return Scene(time=0.0, actors=(car,), radars=(radar, other), carriers=(0, 0))


def largest_difference(scene, plans, snapshots, transmitter):
    """Largest difference over the strongest sample.

    Out of band, the fast engine may leave out 1e-3 of the noise; samples that are so weak that this
    is above `AGREEMENT` of them are compared with it.
    """
    fast = Stretch().contribution(scene, plans, snapshots, victim=0, transmitter=transmitter)
    slow = FullBand().contribution(scene, plans, snapshots, victim=0, transmitter=transmitter)
    radar = scene.radars[0]
    noise = np.sqrt(noise_density(radar) * radar.if_filter.noise_bandwidth)
    left_out = NEGLIGIBLE_OUT_OF_BAND * noise / AGREEMENT
    return np.abs(fast - slow).max() / max(np.abs(slow).max(), left_out)


@settings(max_examples=25)
@given(
    own=schedules(st.just(0.0)),
    sent=schedules(between(-12e-6, 12e-6)),
    paths=st.lists(hand_paths(1), min_size=1, max_size=2),
    if_filter=FILTERS,
)
def test_interference_is_the_same_from_both_engines(own, sent, paths, if_filter):
    snapshots = [paths_of(*paths, reference_time=4e-6)]
    assert largest_difference(two_radars(if_filter), [own, sent], snapshots, 1) < AGREEMENT


@settings(max_examples=15)
@given(
    own=schedules(between(0.0, 1e-4)),
    paths=st.lists(hand_paths(0), min_size=2, max_size=2),
    if_filter=FILTERS,
)
def test_echoes_are_the_same_from_both_engines_over_two_snapshots(own, paths, if_filter):
    snapshots = [
        paths_of(*paths, reference_time=own.start_time[0]),
        paths_of(*paths[:1], reference_time=own.end_time[-1]),
    ]
    plans = [own, own]
    assert largest_difference(two_radars(if_filter), plans, snapshots, 0) < AGREEMENT


@settings(max_examples=10)
@given(
    own=mimo_schedules(st.just(0.0)),
    sent=mimo_schedules(between(-12e-6, 12e-6)),
    paths=st.lists(hand_paths(1), min_size=1, max_size=2),
    if_filter=FILTERS,
)
def test_interference_from_several_elements_is_the_same_from_both_engines(
    own, sent, paths, if_filter
):
    snapshots = [paths_of(*paths, reference_time=4e-6)]
    assert largest_difference(two_radars(if_filter), [own, sent], snapshots, 1) < AGREEMENT


@settings(max_examples=10)
@given(own=mimo_schedules(between(0.0, 1e-4)), path=hand_paths(0), if_filter=FILTERS)
def test_echoes_from_several_elements_are_the_same_from_both_engines(own, path, if_filter):
    snapshots = [paths_of(path, reference_time=own.start_time[0])]
    assert largest_difference(two_radars(if_filter), [own, own], snapshots, 0) < AGREEMENT


@st.composite
def chirps_without_pauses(draw, start):
    """Equal chirps, each of which begins where the one before it ends."""
    number, duration = 4, draw(between(3e-6, 8e-6))
    return RampSchedule(
        start_time=draw(start) + duration * np.arange(number),
        duration=np.full(number, duration),
        start_frequency=np.full(number, 79e9),
        slope=np.full(number, draw(between(20e6, 150e6)) / duration),
        start_phase=[draw(between(0.0, 1.0)) for _ in range(number)],
        sweep=np.arange(number),
    )


@settings(max_examples=6)
@given(
    own=chirps_without_pauses(st.just(0.0)),
    sent=chirps_without_pauses(between(-9e-6, 0.0)),
    paths=st.tuples(hand_paths(0), hand_paths(1)),
    if_filter=FILTERS,
)
def test_chirps_without_pauses_are_the_same_from_both_engines(own, sent, paths, if_filter):
    """Windows contain ends of several chirps, and most beats there are near the band."""
    snapshots = [paths_of(*paths, reference_time=4e-6)]
    for transmitter in (0, 1):
        scene = two_radars(if_filter)
        assert largest_difference(scene, [own, sent], snapshots, transmitter) < AGREEMENT


@settings(max_examples=15)
@given(
    own=chirps_without_pauses(st.just(0.0)),
    sent=chirps_without_pauses(between(-9e-6, 0.0)),
    if_filter=FILTERS,
    seed=st.integers(0, 2**32 - 1),
    count=st.sampled_from([2, 40]),
    transmitter=st.sampled_from([0, 1]),
)
def test_chirps_without_pauses_are_their_sum_path_by_path(
    own, sent, if_filter, seed, count, transmitter
):
    """Windows contain ends of several chirps, near the band and far from it; see `SUMMED`."""
    random = np.random.default_rng(seed)
    paths = many_paths(random, transmitter, longest=1e-6, fastest=4e-7, count=count)
    frame = two_radars(if_filter), [own, sent], [paths_of(*paths)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "NEGLIGIBLE_IN_BAND", 1e-12)
        by_path, summed = (
            Stretch(backend=name).contribution(*frame, victim=0, transmitter=transmitter)
            for name in ("kernels", "auto")
        )
    assert np.abs(summed - by_path).max() < SUMMED


@settings(max_examples=12)
@given(
    own=chirps_without_pauses(st.just(0.0)),
    sent=chirps_without_pauses(between(-9e-6, 0.0)),
    if_filter=FILTERS,
    carrier=between(79.1e9, 79.4e9),
    seed=st.integers(0, 2**32 - 1),
    longest=between(0.3e-6, 3e-6),
)
def test_corners_far_out_of_band_are_their_sum_path_by_path(
    own, sent, if_filter, carrier, seed, longest
):
    """Delays differ by up to twice the filter's window, which holds the ends of some paths only."""
    sent = replace(sent, start_frequency=np.full(sent.num_ramps, carrier))
    paths = many_paths(np.random.default_rng(seed), 1, longest=longest, fastest=4e-7, count=60)
    frame = two_radars(if_filter), [own, sent], [paths_of(*paths)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "NEGLIGIBLE_IN_BAND", 1e-12)
        patch.setattr(engine, "NEGLIGIBLE_OUT_OF_BAND", 1e-12)
        by_path = Stretch(backend="kernels").contribution(*frame, victim=0, transmitter=1)
        patch.setattr(path_batches, "SECONDS_PER_SAMPLE", (1.0, 1.0))
        batched = Stretch().contribution(*frame, victim=0, transmitter=1)
    assert np.abs(batched - by_path).max() < SUMMED


@pytest.mark.parametrize("slope", [1e12, 1.0005e12, 1.01e12, 2e12, -3e12])
def test_a_paper_like_ramp_is_the_same_from_both_engines(slope):
    """60 µs behind the default filter, met in the middle at equal, like and quite other slopes."""
    common = {"duration": [60e-6], "start_phase": [0.2], "sweep": [0]}
    own = RampSchedule(start_time=[0.0], start_frequency=[79e9], slope=[1e12], **common)
    crossing = 79e9 + (1e12 - slope) * 30e-6 + 1e6
    sent = RampSchedule(start_time=[1e-6], start_frequency=[crossing], slope=[slope], **common)
    radar = Radar(name="a", array=AntennaArray(num_channels=1, pattern=ISOTROPIC))
    car = Actor(name="car", kind="vehicle")
    other = Radar(name="b", array=AntennaArray(pattern=ISOTROPIC))
    scene = Scene(time=0.0, actors=(car,), radars=(radar, other), carriers=(0, 0))
    snapshots = [paths_of(HandPath(transmitter=1, delay=50e-9, delay_rate=-1e-7))]
    assert largest_difference(scene, [own, sent], snapshots, 1) < AGREEMENT


def many_paths(random, transmitter, *, longest, fastest, count=300):
    """Half of them mirrored; one is 20 dB stronger than most."""
    gain = 10 ** random.uniform(-2.0, -1.0, count) * np.exp(2j * np.pi * random.random(count))
    gain[0] = 1.0
    azimuth = random.uniform(-1.5, 1.5, count)
    return [
        HandPath(
            transmitter=transmitter,
            delay=random.uniform(0.0, longest),
            delay_rate=random.uniform(-fastest, fastest),
            gain=gain[p],
            arrival=(float(np.cos(azimuth[p])), float(np.sin(azimuth[p])), 0.0),
            bounces=((), (Bounce.SCATTERING,), (Bounce.REFLECTION, Bounce.SCATTERING))[p % 3],
            actors=((), (0,), (1, 0))[p % 3],
        )
        for p in range(count)
    ]


OWN = 0.0
"""In place of a ratio: the radar's own echoes."""


def many_paths_on_two_ramps(seed, ratio, longest, attenuation, *, fastest=4e-7):
    """A scene, plans and 300 paths; ramps of the one are ``ratio`` times as steep."""
    random, transmitter = np.random.default_rng(seed), int(ratio != OWN)
    duration = np.array([400e-6, 250e-6])
    slope = random.uniform(0.5e12, 1e12) * np.array([1.0, -1.0])
    meeting = 79.2e9 + random.uniform(-1e6, 1e6, 2)
    own, sent = (
        RampSchedule(
            start_time=start + np.array([0.0, 401e-6]),
            duration=duration,
            start_frequency=meeting - steepness * np.array([150e-6, 120e-6]),
            slope=steepness,
            start_phase=random.random(2),
            sweep=[0, 1],
        )
        for start, steepness in ((0.0, slope), (random.uniform(-1e-6, 1e-6), ratio * slope))
    )
    converter = Converter(sample_rate=1e6, start=1e-6, margin=1e-6)
    if_filter = IfFilter(attenuation=from_db(attenuation))
    array = AntennaArray(num_channels=3, pattern=ISOTROPIC)
    victim = Radar(name="victim", array=array, converter=converter, if_filter=if_filter)
    other = Radar(name="other", array=array)
    car = Actor(name="car", kind="vehicle")
    scene = Scene(time=0.0, actors=(car,), radars=(victim, other), carriers=(0, 0))
    paths = many_paths(random, transmitter, longest=longest, fastest=fastest)
    snapshots = [paths_of(*paths, reference_time=100e-6)]
    return (scene, [own, sent], snapshots), transmitter


@pytest.mark.parametrize("backend", ["auto", "numpy"])
@pytest.mark.parametrize("ratio", [OWN, 1.0, 1.0 + 1e-7, 1.0005, 1.02, 0.4, -1.0])
@settings(max_examples=4)
@given(
    seed=st.integers(0, 2**32 - 1),
    longest=st.sampled_from([20e-9, 200e-9, 2e-6]),
    attenuation=between(55.0, 100.0),
)
def test_batches_of_paths_are_their_sum_path_by_path(backend, ratio, seed, longest, attenuation):
    """Rates equal, nearly so and crossing; delays up to an echo that wraps into the next ramp.

    Batches are made as if path by path cost a second a sample, else they would be rare. Both may
    leave out as much, but not the same, of the strongest sample, or of the rms that the paths
    bring, where few samples are all that come into the band and weaker than that.
    """
    frame, transmitter = many_paths_on_two_ramps(seed, ratio, longest, attenuation)
    brought = []

    def noted(overlaps):
        brought.append(strongest_sample(overlaps))
        return brought[-1]

    def samples(name):
        return Stretch(backend=name).contribution(*frame, victim=0, transmitter=transmitter)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "strongest_sample", noted)
        by_path = samples("kernels")
        patch.setattr(path_batches, "SECONDS_PER_SAMPLE", (1.0, 1.0))
        batched = samples(backend)
    strongest = max(np.abs(by_path).max(), *brought)
    assert np.abs(batched - by_path).max() < 2 * NEGLIGIBLE_IN_BAND * strongest


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1.0005, 1.02, 0.4, -1.0])
@settings(max_examples=6)
@given(
    seed=st.integers(0, 2**32 - 1),
    longest=st.sampled_from([20e-9, 200e-9, 600e-9]),
    fastest=st.sampled_from([0.0, 4e-7, 3e-6]),
    attenuation=st.sampled_from([60.0, 90.0]),
)
def test_batches_that_leave_nothing_out_are_right_to_1e_7(
    ratio, seed, longest, fastest, attenuation
):
    """Corners near the band included, which else are batched from some thousand paths on.

    The greatest error of 144 drawn cases was 5e-8, where slopes differ by 2 %.
    """
    frame, transmitter = many_paths_on_two_ramps(seed, ratio, longest, attenuation, fastest=fastest)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "NEGLIGIBLE_IN_BAND", 1e-12)
        by_path = Stretch(backend="kernels").contribution(*frame, victim=0, transmitter=transmitter)
        patch.setattr(path_batches, "SECONDS_PER_SAMPLE", (1.0, 1.0))
        batched = Stretch().contribution(*frame, victim=0, transmitter=transmitter)
    assert np.abs(batched - by_path).max() < 1e-7 * np.abs(by_path).max()


@settings(max_examples=8)
@given(
    seed=st.integers(0, 2**32 - 1),
    duration=between(25e-6, 60e-6),
    sign=st.sampled_from([-1.0, 1.0]),
    attenuation=between(50.0, 100.0),
)
def test_fast_chirps_in_a_slow_receiver_are_their_sum_path_by_path(
    seed, duration, sign, attenuation
):
    """Chirps cross the pass band in a fraction of a sample, and end in it now and then."""
    random, number = np.random.default_rng(seed), 12
    own = RampSchedule(
        start_time=[0.0],
        duration=[350e-6],
        start_frequency=[79.4e9],
        slope=[5e11],
        start_phase=[0.2],
        sweep=[0],
    )
    # one chirp begins in the band, another ends in it
    start_frequency = random.uniform(79.0e9, 79.2e9, number)
    start_frequency[3] = 79.4e9 + 5e11 * 3 * duration
    start_frequency[6] = 79.4e9 + 5e11 * 7 * duration - 800e6 * sign
    sent = RampSchedule(
        start_time=duration * np.arange(number),
        duration=np.full(number, duration),
        start_frequency=start_frequency,
        slope=np.full(number, sign * 800e6 / duration),
        start_phase=random.random(number),
        sweep=np.arange(number),
    )
    converter = Converter(sample_rate=1e6, start=1e-6, margin=1e-6)
    array = AntennaArray(num_channels=2, pattern=ISOTROPIC)
    if_filter = IfFilter(attenuation=from_db(attenuation))
    victim = Radar(name="victim", array=array, converter=converter, if_filter=if_filter)
    car = Actor(name="car", kind="vehicle")
    radars = victim, Radar(name="other", array=array)
    scene = Scene(time=0.0, actors=(car,), radars=radars, carriers=(0, 0))
    paths = many_paths(random, 1, longest=200e-9, fastest=4e-7, count=12)
    frame = scene, [own, sent], [paths_of(*paths)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "NEGLIGIBLE_IN_BAND", 1e-12)
        by_path, summed = (
            Stretch(backend=name).contribution(*frame, victim=0, transmitter=1)
            for name in ("kernels", "auto")
        )
    assert np.abs(summed - by_path).max() < 1e-8 * np.abs(by_path).max()


@pytest.mark.parametrize("first", [1e-6, 10e-6])
@pytest.mark.parametrize("length", [4e-6, 9e-6, 11e-6, 16e-6])
def test_batches_of_chirps_shorter_than_a_window_are_their_sum_path_by_path(length, first):
    """Ramps far out of band, of which only the end and only the beginning are received."""
    common = {"start_phase": [0.1], "sweep": [0]}
    own = RampSchedule(
        start_time=[0.0], duration=[400e-6], start_frequency=[79e9], slope=[1e12], **common
    )
    sent = RampSchedule(
        start_time=[length - 300e-6, length + 1e-6, 400e-6 - length],
        duration=[300e-6, 370e-6 - length, 200e-6],
        start_frequency=[79.6e9, 79.3e9, 78.5e9],
        slope=[-2e11, -5e11, 3e11],
        start_phase=[0.1, 0.2, 0.3],
        sweep=[0, 1, 2],
    )
    converter = Converter(sample_rate=1e6, start=first, margin=1e-6)
    array = AntennaArray(num_channels=3, pattern=ISOTROPIC)
    radars = Radar(name="a", array=array, converter=converter), Radar(name="b", array=array)
    car = Actor(name="car", kind="vehicle")
    scene = Scene(time=0.0, actors=(car,), radars=radars, carriers=(0, 0))
    paths = many_paths(np.random.default_rng(1), 1, longest=200e-9, fastest=4e-7, count=60)
    frame = scene, [own, sent], [paths_of(*paths)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "NEGLIGIBLE_IN_BAND", 1e-12)
        by_path = Stretch(backend="kernels").contribution(*frame, victim=0, transmitter=1)
        batched = Stretch().contribution(*frame, victim=0, transmitter=1)
    strongest = np.abs(by_path).max()
    ends = np.r_[: int(length * 1e6) + 8, by_path.shape[-1] - 20 : by_path.shape[-1]]
    assert np.abs(by_path[..., ends]).max() > 1e-5 * strongest
    assert np.abs(batched - by_path).max() < 1e-8 * strongest
