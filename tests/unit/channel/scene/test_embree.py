"""Embree and the tree of boxes find the same hits and shadows."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.geometry.bvh import Caster
from polychirp.channel.materials.library import material_table
from polychirp.channel.scene.embree import EmbreeCaster, caster_of, has_embree
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.world import world_of
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, sphere

NUM_RAYS = 100_000
EDGE = 2e-5
"""Share of rays that may differ: those that pass an edge within single precision, 1e-6 m."""

needs_embree = pytest.mark.skipif(not has_embree(), reason="the package embreex is not installed")


def bumpy():
    """A closed body with a waist, so that it hides parts of itself, of 15 000 faces."""
    corners = sphere(1.0, 45e-3)
    squeeze = 0.6 + 0.4 * np.cos(3 * corners[..., :1]) ** 2
    return corners * np.concatenate([np.full_like(squeeze, 2.0), squeeze, squeeze], axis=-1)


def rays(kind, corners):
    rng = np.random.default_rng(3)
    if kind == "random":
        away = rng.normal(size=(NUM_RAYS, 3))
        return 4 * away / np.linalg.norm(away, axis=-1, keepdims=True), rng.normal(size=away.shape)
    face = corners[rng.integers(len(corners), size=NUM_RAYS)]
    if kind == "grazing":  # along an edge, up to millimetres from it
        along = face[:, 1] - face[:, 0]
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        near = face.mean(axis=1) + 2e-3 * rng.normal(size=along.shape)
        return near - 5 * along, near + 5 * along
    normal = np.cross(face[:, 1] - face[:, 0], face[:, 2] - face[:, 0])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.tile([9.0, 2.0, 0.5], (NUM_RAYS, 1)), face.mean(axis=1) + 3e-3 * normal


@needs_embree
@pytest.mark.parametrize("kind", ["random", "grazing", "shadow"])
def test_both_casters_find_the_same_faces_and_distances(kind):
    corners = bumpy()
    start, end = rays(kind, corners)
    own, face = Caster(corners).closest(start, end - start)
    other, other_face = EmbreeCaster(corners).closest(start, end - start)
    hit, other_hit = np.isfinite(own), np.isfinite(other)
    assert np.mean(hit) > 0.1
    assert np.mean(hit != other_hit) <= EDGE
    both = hit & other_hit
    alike = face[both] == other_face[both]
    # a hit of the same face is at the same place; another face shares the edge that was hit
    np.testing.assert_allclose(own[both][alike], other[both][alike], rtol=1e-9, atol=1e-9)
    far = np.abs(own[both] - other[both]) > 1e-4
    assert np.mean(far) <= 2 * EDGE
    assert np.mean(~alike) < 1e-3


@needs_embree
@pytest.mark.parametrize("kind", ["random", "grazing", "shadow"])
def test_both_casters_find_the_same_shadows(kind):
    corners = bumpy()
    start, end = rays(kind, corners)
    own, other = (caster(corners).occluded(start, end) for caster in (Caster, EmbreeCaster))
    assert 0.1 < np.mean(own) < 0.999
    assert np.mean(own != other) <= EDGE


@needs_embree
def test_far_from_the_origin_nothing_changes():
    corners = bumpy() + np.array([3e4, -2e4, 10.0])
    start, end = (x + np.array([3e4, -2e4, 10.0]) for x in rays("random", bumpy()))
    own, other = (caster(corners).occluded(start, end) for caster in (Caster, EmbreeCaster))
    assert np.mean(own != other) <= EDGE


@needs_embree
def test_no_triangles_stop_no_ray():
    caster = EmbreeCaster(np.zeros((0, 3, 3)))
    start, end = np.zeros((2, 3)), np.ones((2, 3))
    assert np.all(np.isinf(caster.closest(start, end)[0]))
    assert not np.any(caster.occluded(start, end))


@needs_embree
def test_no_rays_have_no_answers():
    caster = EmbreeCaster(bumpy())
    assert caster.closest(np.zeros((0, 3)), np.zeros((0, 3)))[0].shape == (0,)
    assert caster.occluded(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)


def test_without_the_package_embree_says_what_to_do(monkeypatch):
    monkeypatch.setattr("polychirp.channel.scene.embree.has_embree", lambda: False)
    with pytest.raises(InputError, match="install it, or use the caster 'numba'"):
        caster_of(bumpy(), "embree")
    assert isinstance(caster_of(bumpy(), "auto"), Caster)


def test_numba_can_always_be_asked_for():
    assert isinstance(caster_of(bumpy(), "numba"), Caster)


@needs_embree
def test_a_scene_blocks_the_same_on_both():
    actors = [
        Actor(
            name=f"body {i}",
            kind="object",
            mesh=mesh_of(sphere(1.0, 0.1)),
            pose=Pose(x=4.0 * i, y=0.3 * i, yaw=0.4 * i, pitch=0.1 * i),
        )
        for i in range(4)
    ]
    scene = around(actors, [(30.0, 0.0, 0.0)])
    world = world_of(scene, frequency=79e9, dynamic_range=1e6, table=material_table({}))
    rng = np.random.default_rng(5)
    start, end = rng.uniform([-3, -3, -2], [15, 4, 2], size=(2, 20_000, 3))
    own = blocked(world, start, end)
    assert 0.1 < np.mean(own) < 0.9
    other = blocked(replace(world, caster="embree"), start, end)
    assert np.mean(own != other) <= EDGE * 5  # no more than two of so few
