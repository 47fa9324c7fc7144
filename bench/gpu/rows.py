"""Rows of the comparison: one kernel of the channel on one thread of a processor, and on a GPU.

Each row has all calls that a tracer makes of a kernel in one snapshot, with their own data. The
time on the GPU is that with all data there; what copying them takes is given besides. The results
of both have to agree.
"""

import time
from dataclasses import dataclass
from typing import Final

import numpy as np
from numba import cuda, njit

from bench.gpu import kernels as gpu
from polychirp.channel.base import all_pairs, strength, strongest_of_pair
from polychirp.channel.geometry.bvh import grow_tree
from polychirp.channel.geometry.vectors import row
from polychirp.channel.geometry.wide_bvh import SearchRay, bundles_of, nearest_hit
from polychirp.channel.physical_optics import illumination, paths
from polychirp.channel.physical_optics.delay_cells import sum_in_cells
from polychirp.channel.physical_optics.flat_faces import Flats
from polychirp.channel.physical_optics.kernels import MIXED
from polychirp.channel.physical_optics.term_sums import TERM_WIDTH
from polychirp.study.spec import schedules_of
from polychirp.synthesis.stretch.engine import Stretch

REPEATS: Final = 5
"""Calls on the GPU after the one that compiles; the least time counts."""

NOTED: Final = (
    (illumination, "illumination_states", "states"),
    (illumination, "refine_shadow_edge", "states"),
    (illumination, "incident_waves", "waves"),
    (paths, "sum_in_cells", "terms"),
)
"""Modules, and names in them, of the kernels whose calls are noted, and under which key."""


@dataclass(kw_only=True)
class Row:
    """Sums over all calls of one kernel.

    ``work`` is the number of its items, ``what``; ``cpu``, ``gpu`` and ``copying`` are seconds;
    ``error`` is the greatest difference of the results, relative to the greatest result.
    """

    name: str
    what: str
    calls: int = 0
    work: int = 0
    cpu: float = 0.0
    gpu: float = 0.0
    copying: float = 0.0
    error: float = 0.0

    def add(self, work, cpu, on_gpu, copying, error):
        """Count one more call."""
        self.calls, self.work = self.calls + 1, self.work + work
        self.cpu, self.gpu = self.cpu + cpu, self.gpu + on_gpu
        self.copying, self.error = self.copying + copying, max(self.error, float(error))


def gpu_seconds(call):
    """Least wall time of a call over `REPEATS`, after one that compiles."""
    call()
    taken = []
    for _ in range(REPEATS):
        cuda.synchronize()
        began = time.perf_counter()
        call()
        cuda.synchronize()
        taken.append(time.perf_counter() - began)
    return min(taken)


def cpu_seconds(call):
    """Least wall time of two calls, and their result."""
    taken = []
    for _ in range(2):
        began = time.perf_counter()
        found = call()
        taken.append(time.perf_counter() - began)
    return min(taken), found


def copied(*what):
    """Copies on the GPU, and the seconds that they took."""
    began = time.perf_counter()
    there = [gpu.on_device(one) for one in what]
    cuda.synchronize()
    return there, time.perf_counter() - began


def noted_calls(tracer, scene):
    """Arguments of all calls of the kernels in `NOTED`, for the facets of one snapshot."""
    noted = {key: [] for _, _, key in NOTED}
    before = [getattr(module, name) for module, name, _ in NOTED]

    def noting(function, key):
        def call(*arguments):
            noted[key].append((function, arguments))
            return function(*arguments)

        return call

    for (module, name, key), function in zip(NOTED, before, strict=True):
        setattr(module, name, noting(function, key))
    try:
        world, pairs = tracer.prepare(scene), all_pairs(scene, max_length=tracer.max_length)
        strongest = np.zeros((len(scene.radars),) * 2)
        for part in tracer.parts(world):
            if "facets" in part.name:
                found = part.trace(world, pairs, strongest)
                power = strength(found, scene)
                strongest = np.maximum(strongest, strongest_of_pair(found, power, len(strongest)))
    finally:
        for (module, name, _), function in zip(NOTED, before, strict=True):
            setattr(module, name, function)
    return noted


def launch_row():
    """A kernel that does nothing but start."""
    out = Row(name="empty kernel", what="launch")
    one, run = cuda.to_device(np.zeros(1)), gpu.nothing[1, 1]
    out.add(1, 0.0, gpu_seconds(lambda: [run(one) for _ in range(100)]) / 100, 0.0, 0.0)
    return out


def state_row(calls):
    """Shadow rays; the error is the share of facets with another state."""
    out = Row(name="shadow rays", what="facets and views")
    for function, arguments in calls:
        taken, expected = cpu_seconds(lambda f=function, a=arguments: f(*a))
        faces, views, blockers, *known = arguments
        if not known:  # `illumination_states`: one patch, whose state is unknown
            unknown = np.full((len(views.plate), 1), MIXED, dtype=np.int8)
            known = np.zeros(len(faces.area), dtype=np.int64), unknown
        given, copying = copied(faces, views, blockers, *known)
        found = cuda.to_device(np.zeros(expected.shape, dtype=np.int8))
        run = gpu.fill_states[gpu.blocks(expected.size), gpu.THREADS]
        on_gpu = gpu_seconds(lambda r=run, g=given, f=found: r(*g, f))
        error = np.mean(found.copy_to_host() != expected)
        out.add(expected.size, taken, on_gpu, copying, error)
    return out


def wave_row(calls):
    """Fields on facets."""
    out = Row(name="fields on facets", what="facets")
    for function, arguments in calls:
        taken, expected = cpu_seconds(lambda f=function, a=arguments: f(*a))
        given, copying = copied(*arguments, arguments[-1].view)
        found = cuda.device_array(expected.shape, dtype=np.complex64)
        run = gpu.fill_waves[gpu.blocks(len(expected)), gpu.THREADS]
        on_gpu = gpu_seconds(lambda r=run, g=given, f=found: r(*g, f))
        error = relative_error(found.copy_to_host(), expected)
        out.add(len(expected), taken, on_gpu, copying, error)
    return out


def term_row(calls):
    """Sums of facets' terms in cells. Flat parts are summed facet by facet, as others are."""
    out = Row(name="sums of terms", what="facets and pairs")
    for _, (faces, flats, media, first, second, pairs, velocity, wavenumber) in calls:
        if not len(pairs.views):
            continue
        none = Flats(False, np.zeros_like(flats.is_flat), flats.neighbour)
        given = faces, none, media, first, second, pairs, velocity, wavenumber
        taken, expected = cpu_seconds(lambda a=given: sum_in_cells(*a))
        table = gpu.Pairs(pairs.views, pairs.first_cell, gpu.next_kept_of(pairs.is_kept))
        there, copying = copied(faces, media, first, second, table, velocity, second.view)
        found, on_gpu = summed_on_gpu(there, expected.shape, wavenumber)
        error = relative_error(np.where(pairs.is_kept[..., None], found, 0.0), expected[..., :4])
        work = sum(
            len(np.intersect1d(faces_of(first, a), faces_of(second, b))) for a, b in pairs.views
        )
        out.add(work, taken, on_gpu, copying, error)
    return out


def summed_on_gpu(there, shape, wavenumber):
    """Sums of transfer matrices ``(pair, cell, 4)``, and the seconds that they take."""
    faces, media, first, second, table, velocity, view = there
    num_pairs, num_cells, _ = shape
    start = second.start.copy_to_host()
    row_of = cuda.to_device(np.full((len(start) - 1, faces.area.size), -1))
    cells = cuda.to_device(np.zeros((num_pairs, num_cells + 1, TERM_WIDTH)))
    most = int(np.max(np.diff(first.start.copy_to_host()), initial=1))
    note = gpu.note_rows[gpu.blocks(int(start[-1])), gpu.THREADS]
    add = gpu.add_terms[(gpu.blocks(most), num_pairs), gpu.THREADS]

    def run():
        note(second, view, row_of)
        add(faces, media, first, second, row_of, table, velocity, wavenumber, cells)

    taken = gpu_seconds(run)
    cells.copy_to_device(np.zeros(cells.shape))
    run()
    sums = cells.copy_to_host()[:, :-1]
    return sums[..., :4] + 1j * sums[..., 4:8], taken


def faces_of(lit, view):
    """Numbers of the facets that a view illuminates."""
    return lit.face[lit.start[view] : lit.start[view + 1]]


def hit_row(corners, rays_per_side):
    """Closest hits of a grid of rays, from 10 m, on triangles ``(triangle, corner, xyz)``."""
    tree = grow_tree(corners)
    bundles = bundles_of((tree,), (np.zeros(len(tree.face), dtype=np.int64),), (1,))
    if bundles.stack_size > gpu.DEEPEST:
        raise SystemExit(f"closest hits need {bundles.stack_size} numbers; enlarge DEEPEST")
    start, way = grid_of_rays(corners, rays_per_side)
    distance, triangle = np.empty(len(way)), np.empty(len(way), dtype=np.int64)
    closest_hits(bundles, start[:1], way[:1], distance[:1], triangle[:1])
    taken, _ = cpu_seconds(lambda: closest_hits(bundles, start, way, distance, triangle))
    given, copying = copied(bundles, start, way)
    found, number = cuda.device_array_like(distance), cuda.device_array_like(triangle)
    run = gpu.fill_hits[gpu.blocks(len(way)), gpu.THREADS]
    on_gpu = gpu_seconds(lambda: run(*given, found, number))
    out = Row(name="closest hits", what="rays")
    misses = np.where(np.isfinite(distance), distance, -1.0)
    back = found.copy_to_host()
    error = relative_error(np.where(np.isfinite(back), back, -1.0), misses)
    out.add(len(way), taken, on_gpu, copying, error)
    return out


def grid_of_rays(corners, per_side):
    """Origins and directions of rays from 10 m beside a body to a grid over its side."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    origin = np.array([0.5 * (low[0] + high[0]), low[1] - 10.0, 0.5 * (low[2] + high[2])])
    x, z = np.meshgrid(*(np.linspace(low[axis], high[axis], per_side) for axis in (0, 2)))
    way = np.stack([x, np.full_like(x, low[1]), z], axis=-1).reshape(-1, 3) - origin
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return np.tile(origin, (len(way), 1)), way


@njit(error_model="numpy")
def closest_hits(bundles, origin, direction, distance, triangle):
    """`nearest_hit` of every ray."""
    stack = np.empty(bundles.stack_size, dtype=np.float32)
    for i in range(distance.size):
        ray = SearchRay(row(origin, i), row(direction, i), (0.0, gpu.FARTHEST), 0.0)
        distance[i], triangle[i] = nearest_hit(bundles, (0, 0), ray, 0, stack)


def relative_error(found, expected):
    """Greatest difference of two arrays over the greatest magnitude."""
    greatest = np.max(np.abs(expected), initial=1e-300)
    return np.max(np.abs(found - expected), initial=0.0) / greatest


def synthesis_row(study, scene, snapshot, num_paths):
    """Interference of radar 2 at radar 0, by compiled kernels and by CuPy's matrix products.

    The paths of the snapshot are taken again and again until there are ``num_paths``.
    """
    is_this = (snapshot.transmitter == 2) & (snapshot.receiver == 0)
    some = snapshot.select(is_this)
    many = some.select(np.arange(num_paths) % some.num_paths)
    schedules = schedules_of(study)

    def frame(backend):
        engine = Stretch(backend=backend)
        return engine.contribution(scene, schedules, [many], victim=0, transmitter=2)

    frame("auto")
    taken, expected = cpu_seconds(lambda: frame("auto"))
    out = Row(name=f"synthesis of {num_paths}", what="paths")
    on_gpu = gpu_seconds(lambda: frame("cupy"))
    out.add(num_paths, taken, on_gpu, 0.0, relative_error(frame("cupy"), expected))
    return out
