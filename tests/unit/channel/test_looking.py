"""Shadows of patches spare rays to facets, and change little."""

from dataclasses import dataclass

import numpy as np

from polychirp.channel.materials.library import material_table
from polychirp.channel.physical_optics.illumination import faces_of, parts_of
from polychirp.channel.physical_optics.kernels import (
    AWAY,
    HIDDEN,
    LIT,
    agree,
    look,
    look_closer,
    sees_any,
)
from polychirp.channel.physical_optics.views import View, view_table
from polychirp.channel.scene.blockers import in_frame_of
from polychirp.channel.scene.world import bodies_near, world_of
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, sphere


def half_hidden_sphere():
    """A world of a sphere of 1 m at 10 m, in part behind a box half-way."""
    actors = [
        Actor(name="ball", kind="object", mesh=mesh_of(sphere(1.0, 0.03))),
        Actor(
            name="box",
            kind="object",
            mesh=mesh_of(box((0.5, 1.0, 1.0), 0.2)),
            pose=Pose(x=5.0, y=0.5, z=0.3),
        ),
    ]
    scene = around(actors, [(10.0, 0.0, 0.0)])
    return world_of(scene, frequency=79e9, dynamic_range=1e6, table=material_table({}))


def looked_at(world):
    view = View(world=world, radar=0, body=0)
    blockers = in_frame_of(world, world.rotation[0], world.position[0])
    return view_table([view], world.rotation[0], world.position[0]), blockers


def test_looking_closer_gives_what_a_ray_to_every_facet_gives():
    world = half_hidden_sphere()
    table, blockers = looked_at(world)
    surface, faces = world.surfaces[0], faces_of(world.surfaces[0])
    every = look(faces, table, blockers)
    found = look(faces.of(surface.patch_face), table, blockers)
    agreed = agree(found, surface.patch_near)
    closer = look_closer(faces, table, blockers, surface.patch, agreed)
    counts = [np.mean(every == side) for side in (AWAY, HIDDEN, LIT)]
    assert min(counts) > 0.05
    # nothing of the shadow is smaller than patches, so that nothing is missed
    assert np.mean(every != closer) < 1e-3
    # and rays were spared: most facets that turn to the view were not asked
    asked = agreed[0][surface.patch][every[0] != AWAY] == AWAY
    assert np.mean(asked) < 0.5


def test_with_nothing_agreed_every_facet_has_its_ray():
    world = half_hidden_sphere()
    table, blockers = looked_at(world)
    faces, patch = faces_of(world.surfaces[0]), world.surfaces[0].patch
    nothing = np.full((1, patch.max() + 1), AWAY, dtype=np.int8)
    np.testing.assert_array_equal(
        look_closer(faces, table, blockers, patch, nothing), look(faces, table, blockers)
    )


def test_a_view_sees_any_of_a_body_if_one_of_its_facets_is_lit():
    world = half_hidden_sphere()
    table, blockers = looked_at(world)
    faces = faces_of(world.surfaces[0])
    sides = look(faces, table, blockers)[0]
    for side, expected in ((LIT, True), (HIDDEN, False), (AWAY, False)):
        some = faces.of(np.flatnonzero(sides == side))
        assert sees_any(some, table, blockers).tolist() == [expected]


def test_what_is_above_the_horizon_is_seen_as_by_its_ray():
    """Patches, which know their horizons, against the same facets without."""
    world = half_hidden_sphere()
    table, blockers = looked_at(world)
    patches = parts_of(world.surfaces[0]).patches
    assert np.any(patches.horizon < 0.5)
    unknown = patches._replace(horizon=np.ones(len(patches.area)))
    found = look(patches, table, blockers)
    np.testing.assert_array_equal(found, look(unknown, table, blockers))


def test_parts_agree_where_all_around_them_that_turn_to_the_view_say_the_same():
    found = np.array([[LIT, LIT, AWAY, HIDDEN, AWAY]], dtype=np.int8)
    near = np.array([[0, 1], [1, 2], [2, 1], [3, 0], [4, 2]])
    expected = [[LIT, LIT, LIT, AWAY, AWAY]]
    np.testing.assert_array_equal(agree(found, near), expected)


@dataclass
class Spheres:
    """As much of a world as `bodies_near` asks for."""

    centre: np.ndarray
    radius: np.ndarray

    @property
    def surfaces(self):
        return self.radius


def test_a_body_is_near_where_some_ray_of_the_cone_meets_its_sphere():
    rng = np.random.default_rng(4)
    ends, radius = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]), 2.0
    world = Spheres(rng.uniform([-3, -4, -4], [13, 4, 4], size=(400, 3)), np.full(400, 0.5))
    around_end = rng.normal(size=(4000, 3))
    around_end /= np.linalg.norm(around_end, axis=-1, keepdims=True)
    way = ends[1] + radius * around_end
    share = np.clip(world.centre @ way.T / np.sum(way**2, axis=-1), 0.0, 1.0)
    gap = np.linalg.norm(world.centre[:, None] - share[..., None] * way, axis=-1)
    met = np.any(gap <= 0.5, axis=1)
    near = np.zeros(400, dtype=bool)
    near[bodies_near(world, ends, radius)] = True
    assert not np.any(met & ~near)
    # rays within the cone, not on its skin, meet the rest
    inside = np.linalg.norm(world.centre[:, 1:], axis=-1) < 0.2 * world.centre[:, 0] + 0.5
    assert np.mean(near & ~met & ~inside) < 0.02
