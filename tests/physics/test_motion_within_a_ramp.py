"""What moves within a ramp: curved delays, drifting amplitudes, turning directions.

The reference for hand-made paths is integration at full rate; that for points is the field of each
instant, with the exact delay of a point in uniform motion.
"""

from dataclasses import fields, replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.synthesis.links.links import links_between
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.units import to_db
from tests.support.references.fullband import FullBand

SLOPE, START, DURATION = 1e12, 79e9, 1e-3
RADAR = Radar(name="victim", array=AntennaArray(num_channels=4))
BOTH = Scene(
    time=0.0,
    actors=(Actor(name="car", kind="vehicle"),),
    radars=(RADAR, Radar(name="b", array=RADAR.array)),
    carriers=(0, 0),
)


def ramps(*slopes, duration=DURATION, lowest=START):
    number, slope = np.arange(len(slopes)), np.array(slopes)
    return RampSchedule(
        start_time=number * duration,
        duration=np.full(len(slopes), duration),
        start_frequency=np.where(slope > 0, lowest, lowest - slope * duration),
        slope=slope,
        start_phase=0.1 + 0.2 * number,
        sweep=number,
    )


def passer(metres, *, closing, across):
    """The echo of a body that passes at the given speeds, m/s, with all that changes."""
    turn = across / metres
    return HandPath(
        delay=2 * metres / SPEED_OF_LIGHT,
        delay_rate=-2 * closing / SPEED_OF_LIGHT,
        delay_acceleration=2 * across**2 / metres / SPEED_OF_LIGHT,
        drift=2 * closing / metres,
        departure_rate=(0.0, turn, 0.0),
        arrival_rate=(0.0, turn, 0.0),
    )


STILL = HandPath(delay=0.0)
EFFECTS = {
    "curved delay": ("delay_acceleration",),
    "drifting amplitude": ("drift",),
    "turning direction": ("departure_rate", "arrival_rate"),
    "all of them": ("delay_acceleration", "drift", "departure_rate", "arrival_rate"),
}


def without(path, names):
    return replace(path, **{name: getattr(STILL, name) for name in names})


@pytest.mark.parametrize("effect", EFFECTS)
def test_echoes_are_those_of_full_rate_integration(effect, compare):
    """A body at 6 m that closes at 10 m/s and moves across at 25 m/s, on the paper's ramp."""
    whole = passer(6.0, closing=10.0, across=25.0)
    others = {field.name for field in fields(HandPath)} - set(EFFECTS[effect])
    path = without(whole, others & set(EFFECTS["all of them"]))
    plan = [ramps(SLOPE)] * 2
    shots = [paths_of(path, reference_time=0.4 * DURATION)]
    slow = FullBand(sample_rate=4e7).contribution(BOTH, plan, shots, victim=0, transmitter=0)
    bare = [paths_of(without(path, EFFECTS[effect]), reference_time=0.4 * DURATION)]
    fast, left_out = (
        Stretch().contribution(BOTH, plan, some, victim=0, transmitter=0) for some in (shots, bare)
    )
    strongest = np.abs(slow).max()
    assert np.abs(left_out - slow).max() > 1e-3 * strongest
    compare(
        page="signals",
        case=f"body at 6 m, 10 m/s closing, 25 m/s across: {effect}",
        quantity="own echo: greatest error over strongest sample, 1e-9",
        expected=0.0,
        measured=np.abs(fast - slow).max() / strongest / 1e-9,
        tolerance=1000.0,
        source="integration at full rate",
    )


def drawn_paths(rng, count):
    """Ways of 3 to 30 m from the other radar at up to 60 m/s, for sums over few or many links."""
    for _ in range(count):
        metres, along, across = rng.uniform(3, 30), rng.uniform(-60, 60), rng.uniform(0, 60)
        angle = rng.uniform(-1, 1)
        ahead = (np.cos(angle), np.sin(angle), 0.0)
        aside = tuple(across / metres * np.array([-np.sin(angle), np.cos(angle), 0.0]))
        yield HandPath(
            transmitter=1,
            delay=metres / SPEED_OF_LIGHT,
            delay_rate=along / SPEED_OF_LIGHT,
            delay_acceleration=across**2 / metres / SPEED_OF_LIGHT,
            gain=np.exp(2j * np.pi * rng.uniform()) / metres,
            drift=complex(-along / metres, 30.0 * rng.normal()),
            departure=ahead,
            arrival=ahead,
            departure_rate=aside,
            arrival_rate=aside,
        )


@pytest.mark.parametrize("count", [1, 6, 60])
@pytest.mark.parametrize("ratio", [1.0001, 1.01, -1.0, 1.5])
def test_interference_is_that_of_full_rate_integration(count, ratio):
    """The drift of an amplitude within a filter's window of 5 µs, up to 2e-5 here, is left out."""
    duration = 60e-6
    middle = START + 0.5 * SLOPE * duration
    sent = ramps(ratio * SLOPE, duration=duration)
    sent = replace(sent, start_frequency=np.array([middle - 0.5 * ratio * SLOPE * duration]))
    plans = [ramps(SLOPE, duration=duration), sent]
    shots = [paths_of(*drawn_paths(np.random.default_rng(count), count), reference_time=-0.5e-3)]
    fast, slow = (
        engine.contribution(BOTH, plans, shots, victim=0, transmitter=1)
        for engine in (Stretch(), FullBand())
    )
    assert np.abs(fast - slow).max() < 5e-5 * np.abs(slow).max()


def exact(scene, plan, times):
    """Samples of a point's echo at ``times`` from the start of the first ramp, ``(channel, n)``.

    Filter and sampling are left out: the filter passes the beat of a near body unchanged.
    """
    out = np.empty((RADAR.array.num_channels, times.size), dtype=np.complex128)
    slope, start = plan.slope[0], plan.start_frequency[0]
    for n, time in enumerate(times):
        paths = FreeSpace().trace(scene.at(float(time)))
        link = links_between(scene, paths, victim=0, transmitter=0)
        late = (link.delay[:, None] + link.element_delay)[0]
        turns = start * late + 0.5 * slope * (time**2 - (time - late) ** 2)
        out[:, n] = np.conj(link.amplitude[0]) * np.exp(2j * np.pi * turns)
    return out


@pytest.mark.parametrize(
    ("place", "velocity", "before", "limit"),
    [
        ((12.0, 1.0, 0.0), (3.0, 0.0, 0.0), -80, 3e-6),
        ((12.0, 3.0, 0.0), (-10.0, 0.0, 0.0), -70, 5e-6),
        ((3.0, 3.0, 0.0), (-25.0, 0.0, 0.0), -40, 5e-5),
        ((0.5, 2.5, 0.0), (-25.0, 0.0, 0.0), -30, 1e-4),
    ],
)
@pytest.mark.parametrize("slope", [SLOPE, -SLOPE])
def test_a_moving_point_is_right_within_a_ramp(place, velocity, before, limit, slope, compare):
    target = Actor(
        name="t",
        kind="object",
        velocity=velocity,
        points=(PointScatterer(position=place, rcs=1.0),),
    )
    scene = replace(BOTH, actors=(*BOTH.actors, target), radars=(RADAR,), carriers=(0,))
    plan = ramps(slope)
    shot = FreeSpace().trace(scene.at(0.5 * DURATION))
    times = sample_times(plan, RADAR.converter).time[0][::7]
    truth = exact(scene, plan, times)

    def error(paths):
        y = Stretch().contribution(scene, [plan], [paths], victim=0, transmitter=0)[0, :, 0, ::7]
        return float(to_db(np.mean(np.abs(y - truth) ** 2) / np.mean(np.abs(truth) ** 2)))

    zeros = np.zeros_like(shot.departure_rate)
    linear = replace(
        shot,
        delay_acceleration=np.zeros(1),
        transfer_drift=np.zeros(1, dtype=np.complex128),
        departure_rate=zeros,
        arrival_rate=zeros,
    )
    assert error(linear) > before
    compare(
        page="signals",
        case=f"point at {place[:2]} m, {velocity[0]:g} m/s along x, slope {slope:g} Hz/s",
        quantity="rms of the error over a ramp of 1 ms, over that of the echo, 1e-6",
        expected=0.0,
        measured=10 ** (error(shot) / 20) * 1e6,
        tolerance=limit * 1e6,
        source="exact delay and radar equation at every instant",
    )


INTERVAL = 1.2e-3
"""Time between traces, s, shorter than the ramps of `FADED`."""

FADED = ramps(*[SLOPE, -SLOPE] * 2, duration=1.7e-3)


def samples(engine, *shots):
    """Own echoes of one radar with the schedule `FADED`."""
    scene = replace(BOTH, radars=(RADAR,), carriers=(0,))
    return engine.contribution(scene, [FADED], shots, victim=0, transmitter=0)


def faded(before, after):
    """Traces between two paths: the share of the second is 0, 1/3, 2/3, and 0 again.

    The second share changes by more than itself on a ramp of `FADED`.
    """
    fade = 1.0 / (3.0 * INTERVAL)
    for number in range(8):
        share = (number % 3) / 3.0
        both = [
            replace(path, gain=path.gain * part, drift=rate / part)
            for path, part, rate in ((before, 1.0 - share, -fade), (after, share, fade))
            if part > 0.0
        ]
        yield paths_of(*(both if share else [before]), reference_time=number * INTERVAL)


def test_two_traces_of_one_path_that_fade_into_each_other_are_that_path():
    """Without the second share's rate, amplitudes were wrong by up to a third."""
    steady = HandPath(delay=12.0 / SPEED_OF_LIGHT, gain=1e-6)
    alone = [paths_of(steady, reference_time=number * INTERVAL) for number in range(8)]
    true = samples(Stretch(), *alone)
    error = np.abs(samples(Stretch(), *faded(steady, steady)) - true).max()
    assert error < 1e-5 * np.abs(true).max()


def test_paths_that_fade_are_those_of_full_rate_integration():
    """A path of 12 m that fades into one of 12.3 m and another phase."""
    before = HandPath(delay=12.0 / SPEED_OF_LIGHT, gain=1e-6)
    after = replace(before, delay=12.3 / SPEED_OF_LIGHT, gain=0.7e-6j)
    shots = list(faded(before, after))
    slow = samples(FullBand(sample_rate=2e7), *shots)
    error = np.abs(samples(Stretch(), *shots) - slow).max()
    assert error < 1e-5 * np.abs(slow).max()


def test_a_time_of_paths_without_a_decimal_point_is_the_same_time():
    """Python's 0 is a number of seconds, too."""
    path = passer(6.0, closing=10.0, across=25.0)
    plans = [ramps(SLOPE), ramps(SLOPE)]
    whole, decimal = (
        Stretch().contribution(
            BOTH, plans, [paths_of(path, reference_time=time)], victim=0, transmitter=0
        )
        for time in (0, 0.0)
    )
    np.testing.assert_array_equal(whole, decimal)
