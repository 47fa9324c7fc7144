"""Error and cost of bounces by the widths of ray tubes, in the paper's street.

    export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    python -m bench.tube_widths [REFERENCE_MM]

For the ten pairs of four radars at three times, each row compares the bounces by tubes of two
widths, before and after they are cut, with those of tubes of ``REFERENCE_MM`` (2.5 by default)
everywhere. It gives the median difference of the power of all paths of a pair, in dB, and the power
of the field's error over that of the field, in dB, over the band of the radars, for all pairs and
for those whose bounces are within 30 dB of the strongest pair's, with the rms of their differences;
and the seconds of one thread for a snapshot.
"""

import sys
import time

import numpy as np

from polychirp.channel.base import all_pairs, strength, strongest_of_pair
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import scene_of
from polychirp.testing.shapes import transfer_at
from polychirp.units import to_db

TIMES = (0.0, 8e-3, 16e-3)
FREQUENCIES = 79e9 + np.linspace(-0.5e9, 0.5e9, 65)
MILLIMETRES = ((20, 20), (10, 10), (5, 5), (20, 5), (40, 2.5), (20, 2.5))
"""Widths of the widest and of the narrowest tubes of each row."""
STRONG = 30.0
"""dB by which bounces of a pair may be weaker than those of the strongest pair to be strong."""


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
    """Median errors of the power and of the field, of all pairs and of `strong` ones; seconds."""
    power, error, is_strong = [], [], []
    for run, truth in zip(runs, truths, strict=True):
        power.append(to_db(run[1]) - to_db(truth[1]))
        wrong = np.sum(np.abs(run[0] - truth[0]) ** 2, axis=1)
        error.append(to_db(wrong / np.sum(np.abs(truth[0]) ** 2, axis=1)))
        is_strong.append(strong(truth[1]))
    size, error = np.abs(np.concatenate(power)), np.concatenate(error)
    is_strong = np.concatenate(is_strong)
    medians = [np.median(v[which]) for which in (slice(None), is_strong) for v in (size, error)]
    rms = np.sqrt(np.mean(size[is_strong] ** 2))
    return *medians, rms, np.mean([run[2] for run in runs])


def strong(power):
    """Pairs ``(pair,)`` whose bounces are within `STRONG` of the strongest pair's."""
    return to_db(power) > to_db(np.max(power)) - STRONG


def main():
    reference = float(sys.argv[1]) if len(sys.argv) > 1 else 2.5
    study = paper_study("conventional")
    scene = scene_of(study)
    streets = [street_at(study.tracer, scene.at(moment)) for moment in TIMES]
    bounces(streets[0], 40, 20)  # loads the kernels
    truths = [bounces(street, reference, reference) for street in streets]
    print(f"{reference} mm everywhere: {np.mean([truth[2] for truth in truths]):.1f} s")
    print("  widest  narrowest   all: power  field   strong: power  field    rms      s")
    for widest, narrowest in MILLIMETRES:
        row = row_of([bounces(street, widest, narrowest) for street in streets], truths)
        values = "  {:10.2f} {:+7.1f}  {:13.2f} {:+6.1f} {:6.2f}  {:5.2f}".format(*row)
        print(f"{widest:5} mm  {narrowest:6} mm {values}", flush=True)


if __name__ == "__main__":
    main()
