"""Rays with our own tree and with Embree: building, random rays, and rays from one point."""

import numpy as np
import pytest

from polychirp.channel.scene.embree import caster_of, has_embree
from polychirp.testing.shapes import sphere

NUM_RAYS = 200_000

casters = pytest.mark.parametrize(
    "name",
    [
        "numba",
        pytest.param(
            "embree", marks=pytest.mark.skipif(not has_embree(), reason="no package embreex")
        ),
    ],
)


@casters
def test_building(benchmark, name):
    corners = sphere(1.0, 16e-3)
    caster_of(corners[:100], name)
    benchmark(caster_of, corners, name)


@casters
@pytest.mark.parametrize("query", ["closest", "occluded"])
@pytest.mark.parametrize("kind", ["random", "shadow"])
def test_rays(benchmark, name, query, kind):
    corners, rng = sphere(1.0, 16e-3), np.random.default_rng(0)
    if kind == "random":
        start = rng.normal(size=(NUM_RAYS, 3))
        start *= 3 / np.linalg.norm(start, axis=-1, keepdims=True)
        end = 0.7 * rng.normal(size=start.shape)
    else:
        face = corners[np.sort(rng.integers(len(corners), size=NUM_RAYS))]
        start, end = np.tile([10.0, 2.0, 0.5], (NUM_RAYS, 1)), 1.003 * face.mean(axis=1)
    caster = caster_of(corners, name)
    work = getattr(caster, query)
    others = end - start if query == "closest" else end
    work(start[:8], others[:8])
    benchmark(work, start, others)
    benchmark.extra_info["rays_per_second"] = NUM_RAYS / benchmark.stats.stats.min
