"""Error and cost of bounces by the widths of ray tubes, in the paper's street.

    export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    python -m bench.tube_widths [REFERENCE_MM]

For the ten pairs of four radars at three times, each row compares the bounces by tubes of two
widths, before and after they are cut, with those of tubes of ``REFERENCE_MM`` (2.5 by default)
everywhere. It gives the median, the rms and the worst difference of the power of all paths of a
pair, in dB; the power of the field's error over that of the field, in dB, over the band of the
radars; and the seconds of one thread for a snapshot.
"""

import sys
import time

import numpy as np

from polychirp.channel.base import all_pairs, strength, strongest_of_pair
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import scene_of
from polychirp.testing.shapes import transfer_at

TIMES = (0.0, 8e-3, 16e-3)
FREQUENCIES = 79e9 + np.linspace(-0.5e9, 0.5e9, 65)
MILLIMETRES = ((20, 20), (10, 10), (5, 5), (20, 2.5), (40, 5), (40, 2.5), (80, 2.5))
"""Widths of the widest and of the narrowest tubes of each row."""


def street_at(tracer, scene):
    """A prepared world, its pairs, and the power of each pair's strongest other path."""
    world, pairs = tracer.prepare(scene), all_pairs(scene, max_length=tracer.max_length)
    strongest = np.zeros((len(scene.radars),) * 2)
    for part in tracer.parts(world):
        if not part.name.startswith("bounces"):
            found = part.trace(world, pairs, strongest)
            power = strength(found, scene)
            strongest = np.maximum(strongest, strongest_of_pair(found, power, len(strongest)))
    return world, pairs, strongest


def bounces(street, widest, narrowest):
    """Transfer of every pair ``(pair, frequency)``, power of its paths ``(pair,)``, seconds."""
    world, pairs, strongest = street
    began = time.process_time()
    paths = tube_paths(world, pairs, strongest, tube=narrowest * 1e-3, coarsest=widest * 1e-3)
    taken = time.process_time() - began
    fields, power = [], []
    for i, j in (pair for pair in pairs if pair[0] <= pair[1]):
        own = paths.select((paths.transmitter == i) & (paths.receiver == j))
        fields.append([transfer_at(own, f, i, j)[0, 0] for f in FREQUENCIES])
        power.append(float(np.sum(strength(own, world.scene))))
    return np.array(fields), np.array(power), taken


def row_of(runs, truths):
    """Median, rms and worst difference of the power, median error of the field, and seconds."""
    pairs = list(zip(runs, truths, strict=True))
    power = np.concatenate([10 * np.log10(run[1] / truth[1]) for run, truth in pairs])
    error = np.concatenate(
        [
            np.sum(np.abs(run[0] - truth[0]) ** 2, axis=1) / np.sum(np.abs(truth[0]) ** 2, axis=1)
            for run, truth in pairs
        ]
    )
    size = np.abs(power)
    return (
        np.median(size),
        np.sqrt(np.mean(size**2)),
        power[np.argmax(size)],
        10 * np.log10(np.median(error)),
        np.mean([run[2] for run in runs]),
    )


def main():
    reference = float(sys.argv[1]) if len(sys.argv) > 1 else 2.5
    study = paper_study("conventional")
    scene = scene_of(study)
    streets = [street_at(study.tracer, scene.at(moment)) for moment in TIMES]
    bounces(streets[0], 40, 20)  # loads the kernels
    truths = [bounces(street, reference, reference) for street in streets]
    print(f"{reference} mm everywhere: {np.mean([truth[2] for truth in truths]):.1f} s")
    print("  widest  narrowest  median    rms   worst  field     s")
    for widest, narrowest in MILLIMETRES:
        row = row_of([bounces(street, widest, narrowest) for street in streets], truths)
        values = "  {:6.2f} {:6.2f} {:+7.1f} {:+6.1f}  {:.2f}".format(*row)
        print(f"{widest:5} mm  {narrowest:6} mm {values}", flush=True)


if __name__ == "__main__":
    main()
