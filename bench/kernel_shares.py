"""Share of a snapshot's time that each kind of kernel takes, in the paper's street.

    export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    python -m bench.kernel_shares

The functions that call kernels are timed within a snapshot of `bench.snapshot`; what is left is
Python's own.
"""

import time
from collections import Counter
from functools import wraps

from bench.snapshot import street, times_of
from polychirp.channel.bent_echoes import bent_views
from polychirp.channel.physical_optics import illumination, paths
from polychirp.channel.ray_tubes import paths as tubes
from polychirp.study.spec import scene_of

KINDS = {
    "rays": (
        (illumination, "illumination_states", "refine_shadow_edge", "sees_any_facet"),
        (bent_views, "_reached_patches"),
        (tubes, "hits_of", "visible_hits"),
    ),
    "facets": (
        (illumination, "lit_facets", "incident_waves"),
        (bent_views, "incident_waves"),
        (paths, "sum_in_cells", "estimated_amplitudes", "mark_needed_rows"),
    ),
    "edges": ((bent_views, "facets_lit", "edge_waves", "edges_between"),),
    "sheets": ((illumination, "view_losses"), (bent_views, "_losses")),
    "paths from cells": ((paths, "cell_paths"), (tubes, "cell_paths", "radiate")),
}


def timed(function, kind, taken):
    """A function that adds the seconds of its calls to those of a kind."""

    @wraps(function)
    def call(*arguments, **options):
        began = time.perf_counter()
        try:
            return function(*arguments, **options)
        finally:
            taken[kind] += time.perf_counter() - began

    return call


def main():
    taken = Counter()
    for kind, rows in KINDS.items():
        for module, *names in rows:
            for name in names:
                setattr(module, name, timed(getattr(module, name), kind, taken))
    study = street(1.0)
    scene = scene_of(study)
    for number in range(4):  # the first ones prepare the meshes and load the kernels
        taken.clear()
        whole = sum(times_of(study.tracer, scene.at(1e-3 * number)).values())
    taken["all else"] = whole - sum(taken.values())
    print(f"snapshot: {whole:.2f} s")
    for kind, seconds in taken.most_common():
        print(f"{kind:17} {seconds:.2f} s, {100 * seconds / whole:.0f} %")


if __name__ == "__main__":
    main()
