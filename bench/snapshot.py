"""CPU time of one snapshot of the paper's street, 4 × 4 radars, part by part.

    export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    python -m bench.snapshot [--json] [--fittings]

with the default meshes, whose facets are 5 cm on flats and finer where bodies curve, and with
facets of 5 cm everywhere; with direct views alone, and with everything. With ``--fittings``, all
vehicles have number plates, bumper beams, lamps and open rims. Meshes are prepared before
the clock starts; the best of some snapshots counts.
"""

import json
import sys
import time
from dataclasses import replace

import numpy as np

from polychirp.channel.base import all_pairs, strength, strongest_of_pair
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import scene_of
from polychirp.traffic.fittings import Fittings

SNAPSHOTS = 4

COARSENESS = {"default facets": 1.0, "facets of 5 cm": 4.0}

SWITCHES = {
    "single bounce": {
        "reflecting_planes": False,
        "max_bounces": 1,
        "diffraction": False,
        "transmission": False,
    },
    "everything": {},
}


def street(coarseness):
    study = paper_study("conventional")
    fittings = Fittings() if "--fittings" in sys.argv[1:] else None
    cars = tuple(
        replace(car, coarseness=coarseness, fittings=fittings) for car in study.street.vehicles
    )
    return replace(study, street=replace(study.street, vehicles=cars))


def best_times(tracer, scene):
    """Seconds of every kind of part."""
    runs = [times_of(tracer, scene.at(1e-3 * number)) for number in range(SNAPSHOTS + 1)]
    return {kind: min(run[kind] for run in runs[1:]) for kind in runs[0]}


def times_of(tracer, scene):
    began = time.process_time()
    world, pairs = tracer.prepare(scene), all_pairs(scene, max_length=tracer.max_length)
    strongest = np.zeros((len(scene.radars),) * 2)
    taken = {"preparation": time.process_time() - began}
    for part in tracer.parts(world):
        began = time.process_time()
        found = part.trace(world, pairs, strongest)
        kind = part.name.split(" of ")[0].split(" from ")[0].split(" at ")[0]
        taken[kind] = taken.get(kind, 0.0) + time.process_time() - began
        power = strength(found, scene)
        strongest = np.maximum(strongest, strongest_of_pair(found, power, len(strongest)))
    return taken


def main():
    measured = {}
    for name, coarseness in COARSENESS.items():
        study = street(coarseness)
        scene = scene_of(study)
        surfaces = study.tracer.prepare(scene).surfaces
        facets = sum(surface.area.size for surface in surfaces)
        measured[name] = {"facets": facets}
        print(f"{name}: {facets:,}", file=sys.stderr)
        for switch, options in SWITCHES.items():
            taken = best_times(replace(study.tracer, **options), scene)
            parts = ", ".join(f"{kind} {1e3 * t:.0f}" for kind, t in taken.items() if t > 5e-4)
            total = sum(taken.values())
            print(f"  {switch}: {1e3 * total:.0f} ms ({parts})", file=sys.stderr, flush=True)
            seconds = {kind: round(t, 3) for kind, t in taken.items() if t > 5e-4}
            measured[name][switch] = seconds | {"sum": round(total, 3)}
    if "--json" in sys.argv[1:]:
        print(json.dumps(measured))


if __name__ == "__main__":
    main()
