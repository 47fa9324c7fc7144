"""Shadow tests of patches replace those of most facets, and change little."""

from dataclasses import dataclass

import numpy as np

from polychirp.channel.materials.library import material_table
from polychirp.channel.physical_optics.illumination import (
    faces_of,
    facet_levels,
    illumination_of,
)
from polychirp.channel.physical_optics.kernels import (
    ILLUMINATED,
    MIXED,
    SHADOWED,
    TURNED_AWAY,
    common_state,
    illumination_states,
    refine_shadow_edge,
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


def test_rays_at_shadow_edges_give_what_a_ray_to_every_facet_gives():
    world = half_hidden_sphere()
    table, blockers = looked_at(world)
    surface, faces = world.surfaces[0], faces_of(world.surfaces[0])
    every = illumination_states(faces, table, blockers)
    found = illumination_states(faces.select(surface.patch_face), table, blockers)
    common = common_state(found, surface.patch_near)
    refined = refine_shadow_edge(faces, table, blockers, surface.patch, common)
    counts = [np.mean(every == state) for state in (TURNED_AWAY, SHADOWED, ILLUMINATED)]
    assert min(counts) > 0.05
    # nothing of the shadow is smaller than patches, so that nothing is missed
    assert np.mean(every != refined) < 1e-3
    # most facets that face the view need no ray
    of_facets = common[0][surface.patch][every[0] != TURNED_AWAY]
    assert np.mean(np.isin(of_facets, (TURNED_AWAY, MIXED))) < 0.5


def test_with_mixed_patches_every_facet_has_its_ray():
    world = half_hidden_sphere()
    table, blockers = looked_at(world)
    faces, patch = faces_of(world.surfaces[0]), world.surfaces[0].patch
    mixed = np.full((1, patch.max() + 1), MIXED, dtype=np.int8)
    np.testing.assert_array_equal(
        refine_shadow_edge(faces, table, blockers, patch, mixed),
        illumination_states(faces, table, blockers),
    )


def test_views_that_see_no_patch_are_left_out_and_change_nothing_in_others():
    """One radar sees half of a sphere behind a box, and one nothing of it behind a wall."""
    world = half_hidden_sphere()
    wall = Actor(
        name="wall",
        kind="object",
        mesh=mesh_of(box((0.2, 4.0, 4.0), 0.4)),
        pose=Pose(x=-3.0),
    )
    scene = around([*world.scene.actors[1:], wall], [(-10.0, 0.0, 0.0), (10.0, 0.0, 0.0)])
    both = world_of(scene, frequency=79e9, dynamic_range=1e6, table=material_table({}))
    views = [View(world=both, radar=radar, body=0) for radar in range(2)]
    found = illumination_of(both, 0, views)
    alone = illumination_of(world, 0, [View(world=world, radar=0, body=0)])
    assert found.views == (views[1],)
    np.testing.assert_array_equal(found.lit.face, alone.lit.face)
    assert illumination_of(both, 0, views[:1]).views == ()


def test_what_is_above_the_horizon_is_seen_as_by_its_ray():
    """Patches, which know their horizons, against the same facets without."""
    world = half_hidden_sphere()
    table, blockers = looked_at(world)
    patches = facet_levels(world.surfaces[0]).patches
    assert np.any(patches.horizon < 0.5)
    unknown = patches._replace(horizon=np.ones(len(patches.area)))
    found = illumination_states(patches, table, blockers)
    np.testing.assert_array_equal(found, illumination_states(unknown, table, blockers))


def test_the_common_state_is_that_of_all_patches_around_that_face_the_view():
    lit, away = ILLUMINATED, TURNED_AWAY
    found = np.array([[lit, lit, away, SHADOWED, away]], dtype=np.int8)
    near = np.array([[0, 1], [1, 2], [2, 1], [3, 0], [4, 2]])
    expected = [[lit, lit, lit, MIXED, away]]
    np.testing.assert_array_equal(common_state(found, near), expected)


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
