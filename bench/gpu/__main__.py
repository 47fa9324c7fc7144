"""Times of the channel's kernels on a GPU and on one thread of a processor, by CUDA.

    export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    python -m bench.gpu [--json]

The kernels have the data of one snapshot of the paper's street (`rows`). It needs a GPU with CUDA,
the package numba-cuda and, for synthesis, CuPy.
"""

import json
import sys
from functools import partial

from bench.gpu import rows
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import scene_of

RAYS_PER_SIDE = 1000
NUM_PATHS = (500, 5000)


def main():
    study = paper_study("conventional")
    scene, tracer = scene_of(study), study.tracer
    rows.noted_calls(tracer, scene)  # prepares the meshes and loads the kernels
    noted = rows.noted_calls(tracer, scene.at(1e-3))
    largest = max(tracer.prepare(scene).surfaces, key=lambda one: one.area.size)
    snapshot = tracer.trace(scene)
    makers = [
        rows.launch_row,
        partial(rows.state_row, noted["states"]),
        partial(rows.wave_row, noted["waves"]),
        partial(rows.term_row, noted["terms"]),
        partial(rows.hit_row, largest.centroid[:, None] + largest.corner, RAYS_PER_SIDE),
        *(partial(rows.synthesis_row, study, scene, snapshot, number) for number in NUM_PATHS),
    ]
    measured = []
    for make in makers:
        measured.append(make())
        print(line_of(measured[-1]), file=sys.stderr, flush=True)
    if "--json" in sys.argv[1:]:
        print(json.dumps([vars(row) for row in measured]))


def line_of(row):
    """A row in words."""
    cpu, on_gpu, copying = (1e3 * t for t in (row.cpu, row.gpu, row.copying))
    return (
        f"{row.name:20} {row.calls:4} calls, {row.work:9,} {row.what:18} CPU {cpu:8.2f} ms, "
        f"GPU {on_gpu:8.3f} ms ({cpu / on_gpu:.0f} times), copying {copying:.1f} ms, "
        f"error {row.error:.1e}"
    )


if __name__ == "__main__":
    main()
