"""Composite beside Sionna RT: one snapshot of one street, both in one run."""

import importlib.util
import time
import warnings
from pathlib import Path

import pytest

from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.sionna import SionnaRt, llvm_for_sionna
from polychirp.errors import CapabilityError, ModelWarning

try:
    llvm_for_sionna()
except CapabilityError as missing:
    pytest.skip(str(missing), allow_module_level=True)


def street():
    """That of the channel's own benchmark."""
    place = Path(__file__).with_name("test_channel.py")
    spec = importlib.util.spec_from_file_location("polychirp_bench_channel", place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.street()


def seconds(tracer, scene, start):
    """CPU time of the fastest of three snapshots, s, and the paths of the last one."""
    times = []
    for number in range(3):
        now = scene.at((start + number) * 1e-3)
        begin = time.process_time()
        paths = tracer.trace(now)
        times.append(time.process_time() - begin)
    return min(times), paths


@pytest.mark.parametrize("depth", [1, 3])
def test_a_snapshot_of_a_street_by_both_engines(benchmark, depth):
    """4 × 4 radars; meshes prepared and kernels compiled before. Not of equal worth:

    Composite gives the echoes of bodies by physical optics, single bounce with mirrors on each
    leg; Sionna their mirror images in flat triangles, with transmission, up to ``depth`` bounces.
    """
    scene = street()
    theirs, ours = SionnaRt(max_depth=depth), Composite()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        theirs.trace(scene)
        ours.trace(scene)
        slow, mirrored = seconds(theirs, scene, 1)
    fast, paths = seconds(ours, scene, 1)
    times = iter(range(4, 10_000))
    benchmark(lambda: ours.trace(scene.at(next(times) * 1e-3)))
    benchmark.extra_info.update(
        sionna_over_composite=slow / fast,
        sionna_core_seconds=slow,
        composite_core_seconds=fast,
        sionna_paths=mirrored.num_paths,
        composite_paths=paths.num_paths,
        samples=theirs.num_samples,
        facets=sum(actor.mesh.num_faces for actor in scene.actors),
    )
