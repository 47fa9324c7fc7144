"""Cost of the production engine for a paper-like frame, and against a NumPy sum over paths."""

import time

import numpy as np
import pytest

from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, free_space_gain, paths_of
from polychirp.waveform import DiverseTriangular, Sawtooth

PATHS = 300


@pytest.fixture(scope="module")
def frame():
    """Two radars; from each 300 paths to the first, one of them direct and 20 dB stronger."""
    random = np.random.default_rng(1)
    array = AntennaArray(pattern=ISOTROPIC)
    scene = Scene(
        time=0.0,
        actors=(Actor(name="car", kind="vehicle"),),
        radars=tuple(Radar(name=name, array=array) for name in "ab"),
        carriers=(0, 0),
    )
    plans = [
        DiverseTriangular()
        .schedule(num_sweeps=16, streams=Streams(seed=k))
        .as_clocked(start_time=1e-4 * k)
        for k in range(2)
    ]
    paths = [
        HandPath(
            transmitter=transmitter,
            delay=random.uniform(2e-8, 2e-7),
            delay_rate=random.uniform(-2e-7, 2e-7),
            gain=free_space_gain(15.0) * (1.0 if p == 0 else 10 ** random.uniform(-4.0, -1.0)),
        )
        for transmitter in (0, 1)
        for p in range(PATHS)
    ]
    snapshots = [paths_of(*paths, reference_time=t) for t in (0.008, 0.024, 0.040)]
    return scene, plans, snapshots


def best_of(function, repeats=3):
    taken = []
    for _ in range(repeats):
        begin = time.process_time()
        function()
        taken.append(time.process_time() - begin)
    return min(taken)


def naive_echoes(scene, plans, snapshots):
    """Echoes by NumPy: a complex exponential per path, element and sample, without a filter."""
    paths = snapshots[0].select(snapshots[0].transmitter == 0)
    plan, radar = plans[0], scene.radars[0]
    times = sample_times(plan, radar.converter)
    out = np.zeros((4, plan.num_ramps, times.most_samples), dtype=np.complex128)
    for k in range(2):  # two ramps of the 32 tell the cost
        t = times.time[k] - plan.start_time[k]
        for p in range(paths.num_paths):
            delay = paths.delay[p] + paths.delay_rate[p] * t
            for m in range(4):
                turns = (plan.start_frequency[k] + plan.slope[k] * t) * delay
                out[m, k] += np.exp(2j * np.pi * (turns - 0.5 * plan.slope[k] * delay**2))
    return out


@pytest.mark.parametrize("transmitter", [0, 1], ids=["own echoes", "interference"])
def test_cost_per_path_channel_and_sample(benchmark, frame, transmitter):
    def synthesized():
        return Stretch().contribution(*frame, victim=0, transmitter=transmitter)

    synthesized()
    benchmark.pedantic(synthesized, rounds=3)
    scene, plans, _ = frame
    samples = int(sample_times(plans[0], scene.radars[0].converter).num_samples.sum())
    cost = best_of(synthesized) / (PATHS * 4 * samples)
    benchmark.extra_info["ns per path, channel and sample"] = 1e9 * cost
    assert cost < 25e-9


def test_own_echoes_against_a_naive_sum_without_a_filter(benchmark, frame):
    def synthesized():
        return Stretch().contribution(*frame, victim=0, transmitter=0)

    synthesized()
    benchmark.pedantic(synthesized, rounds=3)
    naive = best_of(lambda: naive_echoes(*frame), repeats=1) * 16
    ratio = naive / best_of(synthesized)
    benchmark.extra_info["times faster than NumPy"] = ratio
    assert ratio > 5


@pytest.mark.parametrize("transmitter", [0, 1], ids=["own echoes", "interference"])
def test_a_thousand_paths_at_once_against_path_by_path(benchmark, frame, transmitter):
    """The frame's paths over and over."""
    scene, plans, snapshots = frame
    first = snapshots[0]
    chosen = first.select(np.flatnonzero(first.transmitter == transmitter))
    many = chosen.select(np.tile(np.arange(chosen.num_paths), 4)[:1000])
    some = (scene, plans, [many])

    def synthesized(backend):
        engine = Stretch(backend=backend)
        return engine.contribution(*some, victim=0, transmitter=transmitter)

    synthesized("auto")
    synthesized("kernels")
    benchmark.pedantic(lambda: synthesized("auto"), rounds=3)
    ratio = best_of(lambda: synthesized("kernels")) / best_of(lambda: synthesized("auto"))
    benchmark.extra_info["times faster than path by path"] = ratio
    assert ratio > 1.5


def chirp_sequences():
    """Eight chirps of 40 µs, and steeper ones from the other radar, both without pauses."""
    random = np.random.default_rng(1)
    array = AntennaArray(pattern=ISOTROPIC)
    victim = Radar(
        name="a",
        array=array,
        if_filter=IfFilter(passband=9e6, stopband=10e6),
        converter=Converter(sample_rate=20e6, start=3e-6, margin=1e-6),
    )
    scene = Scene(
        time=0.0,
        actors=(Actor(name="car", kind="vehicle"),),
        radars=(victim, Radar(name="b", array=array)),
        carriers=(0, 0),
    )
    plans = [
        Sawtooth(start_frequency=76.5e9, bandwidth=1e9, ramp_duration=duration).schedule(
            num_sweeps=count, streams=Streams(seed=1)
        )
        for duration, count in ((40e-6, 8), (33e-6, 10))
    ]
    paths = [
        HandPath(
            transmitter=transmitter,
            delay=random.uniform(2e-8, 3e-7),
            delay_rate=random.uniform(-2e-7, 2e-7),
            gain=free_space_gain(15.0) * 10 ** random.uniform(-3.0, -1.0),
        )
        for transmitter in (0, 1)
        for _ in range(100)
    ]
    return scene, plans, [paths_of(*paths, reference_time=1.6e-4)]


@pytest.mark.parametrize("transmitter", [0, 1], ids=["own echoes", "interference"])
def test_chirps_without_pauses_against_path_by_path(benchmark, transmitter):
    """Many samples' windows contain the end of one chirp and the beginning of the next."""
    some = chirp_sequences()

    def synthesized(backend):
        return Stretch(backend=backend).contribution(*some, victim=0, transmitter=transmitter)

    synthesized("auto")
    synthesized("kernels")
    benchmark.pedantic(lambda: synthesized("auto"), rounds=3)
    slow = best_of(lambda: synthesized("kernels"), repeats=1)
    ratio = slow / best_of(lambda: synthesized("auto"))
    benchmark.extra_info["times faster than path by path"] = ratio
    assert ratio > (3 if transmitter == 0 else 1.5)
