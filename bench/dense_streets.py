"""Streets of ten ray-traced targets: errors between traces, and what passes below vehicles.

    OPENBLAS_NUM_THREADS=1 python -m bench.dense_streets errors [SEED ...]
    OPENBLAS_NUM_THREADS=1 python -m bench.dense_streets below [FIRST LAST]

``errors`` compares the paths half way between the latest traces that a frame may have, every 17 ms,
with tracing anew: own echoes of the victim, and interference of all other radars (seeds 11 to 16 by
default). ``below`` compares what arrives by way of the road with what would arrive without
obstacles, for every other radar whose reflection an obstacle hides (streets 2000 to 2059).
"""

import sys

import numpy as np

import polychirp.study.trial as trials
from bench.frame import responses
from bench.trial import study_of
from polychirp.channel.specular.plates import reflections
from polychirp.study.paper.statistics import with_situation
from polychirp.threads import limit_cores

HALF_WAY = (2, 6, 10)
"""Refresh times, 4 ms apart, half way between traces every 16 or 20 ms."""


class _PreparedError(Exception):
    """Ends a trial before its tracing."""


def traced_scene(seed):
    """Tracer, scene, refresh times and receivers of a street's trial."""
    found = {}

    def note(tracer, scene, times, **options):
        found.update(tracer=tracer, scene=scene, times=times, receivers=options["receivers"])
        raise _PreparedError

    follow, trials.interpolate_paths = trials.interpolate_paths, note
    try:
        trials.run_trial(with_situation(study_of(seed), "diverse", "interfered"))
    except _PreparedError:
        pass
    finally:
        trials.interpolate_paths = follow
    return found["tracer"], found["scene"], found["times"], found["receivers"]


def errors_of(seed):
    """Power of the errors over that of the paths, dB: own echoes, and all other radars."""
    tracer, scene, times, receivers = traced_scene(seed)
    followed = trials.interpolate_paths(tracer, scene, times, receivers=receivers)
    wrong = right = 0.0
    for number in HALF_WAY:
        moment = scene.at(float(times[number]))
        true = responses(tracer.trace(moment), moment)[:, 0]
        gap = responses(followed[number], moment)[:, 0] - true
        wrong = wrong + np.sum(np.abs(gap) ** 2, axis=-1)
        right = right + np.sum(np.abs(true) ** 2, axis=-1)
    return [10 * np.log10(np.sum(wrong[s]) / np.sum(right[s])) for s in (slice(1), slice(1, None))]


def below_of(seed):
    """Levels by way of the road over those without obstacles, dB, and the number of all radars.

    The levels are those of the radars whose reflection an obstacle hides.
    """
    from polychirp.channel.diffraction.mirrored_paths import diffracted_mirror_paths

    tracer, scene, _, _ = traced_scene(seed)
    world, num_radars = tracer.prepare(scene), len(scene.radars)
    road = [actor.name for actor in scene.actors].index("road")
    levels, count = [], 0
    for radar in range(1, num_radars):
        pair = np.array([[radar, 0]])
        mirror = reflections(world, pair, actor=road)
        if not mirror.paths.num_paths:
            continue
        count += 1
        if mirror.is_free[0]:
            continue
        none = np.zeros((num_radars, num_radars))
        edges = diffracted_mirror_paths(world, pair, none, actor=road)
        power = [
            np.mean(np.abs(responses(paths, scene)[radar, 0]) ** 2)
            for paths in (edges, mirror.paths)
        ]
        levels.append(10 * np.log10(power[0] / power[1]))
    return levels, count


def main():
    limit_cores(1)
    what, *numbers = sys.argv[1:]
    if what == "errors":
        for seed in [int(number) for number in numbers] or range(11, 17):
            own, others = errors_of(seed)
            print(f"seed {seed}: own echoes {own:.1f} dB, others {others:.1f} dB", flush=True)
        return
    first, last = (int(number) for number in numbers or (2000, 2059))
    found = [below_of(seed) for seed in range(first, last + 1)]
    levels = np.concatenate([some for some, _ in found])
    print(f"{len(levels)} of {sum(count for _, count in found)} reflections are hidden")
    print("quartiles, dB:", np.round(np.percentile(levels, [25, 50, 75]), 1))
    print(f"{np.sum(levels > -10)} have -10 dB or more")


if __name__ == "__main__":
    main()
