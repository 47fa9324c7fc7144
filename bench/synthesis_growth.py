"""CPU time of a frame over paths and radars: data and figure of the docs.

    OMP_NUM_THREADS=1 python bench/synthesis_growth.py docs/images [most paths]

writes synthesis_growth.png, and synthesis_growth.json beside it; some five minutes.
"""

import json
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import free_space_gain
from polychirp.waveform import DiverseTriangular
from tools.figures.growth import growth_picture

MOST = {"path by path": 3_000, "NumPy, no filter": 1_000, "by blocks": 3_000}
"""Paths up to which a way is measured."""


SIZES = (10, 30, 100, 300, 1_000, 3_000, 10_000, 100_000, 1_000_000)


def paths_to_first(random, count, transmitters, reference_time):
    """From every transmitter ``count`` paths; the first is direct, most are 20 to 80 dB weaker."""
    total = count * len(transmitters)
    gain = 10 ** random.uniform(-4.0, -1.0, total)
    gain[::count] = 1.0
    azimuth = random.uniform(-1.0, 1.0, total)
    direction = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(total)], axis=1)
    return PropagationPaths(
        reference_time=reference_time,
        frequency=79e9,
        transmitter=np.repeat(transmitters, count).astype(np.int64),
        receiver=np.zeros(total, dtype=np.int64),
        delay=random.uniform(2e-8, 2e-7, total),
        delay_rate=random.uniform(-2e-7, 2e-7, total),
        transfer=free_space_gain(15.0) * gain[:, None, None] * np.eye(2, dtype=complex),
        departure=direction,
        arrival=direction,
        bounce_start=np.zeros(total + 1, dtype=np.int64),
        bounce_actor=np.zeros(0, dtype=np.int64),
        bounce_kind=np.zeros(0, dtype=np.int64),
        bounce_point=np.zeros((0, 3)),
    )


def frame(num_radars, count, transmitters):
    """The first radar of four channels, its paths at three instants of a frame of 48 ms."""
    random = np.random.default_rng(1)
    array = AntennaArray(pattern=ISOTROPIC)
    scene = Scene(
        time=0.0,
        actors=(Actor(name="car", kind="vehicle"),),
        radars=tuple(Radar(name=f"{k}", array=array) for k in range(num_radars)),
        carriers=(0,) * num_radars,
    )
    plans = [
        DiverseTriangular()
        .schedule(num_sweeps=16, streams=Streams(seed=k))
        .as_clocked(start_time=1e-4 * k)
        for k in range(num_radars)
    ]
    first = paths_to_first(random, count, transmitters, 0.008)
    later = [
        replace(first, reference_time=t, delay=first.delay + first.delay_rate * (t - 0.008))
        for t in (0.024, 0.040)
    ]
    return scene, plans, [first, *later]


def naive_seconds(scene, plans, snapshots):
    """An exponential per path, element and sample of one of 32 ramps, as NumPy simulators do."""
    paths, plan, radar = snapshots[0], plans[0], scene.radars[0]
    times = sample_times(plan, radar.converter)
    t = times.time[0] - plan.start_time[0]
    out = np.zeros((4, t.size), dtype=np.complex128)
    start = time.process_time()
    for p in range(paths.num_paths):
        delay = paths.delay[p] + paths.delay_rate[p] * t
        for m in range(4):
            turns = (plan.start_frequency[0] + plan.slope[0] * t) * delay
            out[m] += np.exp(2j * np.pi * (turns - 0.5 * plan.slope[0] * delay**2))
    return (time.process_time() - start) * times.num_samples.sum() / t.size


def seconds(engine, some, transmitters):
    """CPU time of a frame: the lesser of two, where one does not take long."""
    taken = []
    for _ in range(2):
        start = time.process_time()
        for transmitter in transmitters:
            engine.contribution(*some, victim=0, transmitter=transmitter)
        taken.append(time.process_time() - start)
        if taken[0] > 5.0:
            break
    return min(taken)


def path_curves(transmitter, sizes):
    ways = {
        "path by path": Stretch(backend="kernels"),
        "by blocks": Stretch(backend="numpy"),
        "chosen": Stretch(),
    }
    lines = {"NumPy, no filter": [], **{name: [] for name in ways}}
    for size in sizes:
        some = frame(2, size, [transmitter])
        if size <= MOST["NumPy, no filter"] and transmitter == 0:
            lines["NumPy, no filter"].append((size, round(naive_seconds(*some), 5)))
        for name, engine in ways.items():
            if size <= MOST.get(name, size):
                lines[name].append((size, round(seconds(engine, some, [transmitter]), 5)))
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
                print(transmitter, size, name, lines[name][-1][1], f"{peak:.0f} MB", flush=True)
    return {name: points for name, points in lines.items() if points}


def radar_curves(sizes):
    """Own echoes and all interference of the first radar, from every other 300 paths."""
    lines = {"path by path": [], "chosen": []}
    for size in sizes:
        some = frame(size, 300, list(range(size)))
        for name, engine in (("path by path", Stretch(backend="kernels")), ("chosen", Stretch())):
            if name == "chosen" or size <= 8:
                lines[name].append((size, round(seconds(engine, some, range(size)), 5)))
                print(size, "radars", name, lines[name][-1][1], flush=True)
    return lines


def main(folder, most):
    sizes = [n for n in SIZES if n <= most]
    seconds(Stretch(), frame(2, 300, [0]), [0])  # compiles
    panels = {
        "paths of own echoes": path_curves(0, sizes),
        "paths of a diverse interferer": path_curves(1, sizes[:8]),
        "radars, 300 paths from each": radar_curves((2, 4, 8, 16, 32, 64)),
    }
    note = "32 ramps of 1–2 ms, 4 channels at 1 MS/s (48 000 samples each), one thread"
    picture = growth_picture(panels, cost="CPU time of a frame (s)", note=note)
    (folder / "synthesis_growth.png").write_bytes(picture.png())
    text = json.dumps(panels, indent=1) + "\n"
    (folder / "synthesis_growth.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1_000_000)
