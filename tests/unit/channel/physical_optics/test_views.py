"""Views are made of no radar that no wanted pair needs, and views are selected from tables."""

import numpy as np
import pytest

from polychirp.channel.materials.library import material_table
from polychirp.channel.physical_optics.paths import direct_views, radars_of
from polychirp.channel.physical_optics.views import view_table
from polychirp.channel.scene.world import world_of
from polychirp.model.scene import Actor, Scene
from polychirp.testing.shapes import around, box, mesh_of


@pytest.fixture(scope="module")
def world():
    """Three radars about a box, the first of which is mounted on it."""
    target = Actor(name="box", kind="vehicle", mesh=mesh_of(box((1.0, 1.0, 1.0), 0.5)))
    scene = around([target], [(1.0, 0.0, 0.0), (10.0, 2.0, 0.0), (0.0, -8.0, 0.0)])
    own = Scene(
        time=0.0,
        actors=scene.actors,
        radars=scene.radars,
        carriers=(len(scene.actors) - 1, *scene.carriers[1:]),
    )
    return world_of(own, frequency=79e9, dynamic_range=1e6, table=material_table({}))


@pytest.mark.parametrize(
    ("pairs", "expected"),
    [
        ([[0, 0], [1, 0], [0, 2]], ()),
        ([[0, 0], [1, 0], [2, 2]], (2,)),
        ([[1, 2], [1, 0]], (1, 2)),
    ],
)
def test_a_body_is_seen_only_by_radars_of_pairs_that_are_both_off_it(world, pairs, expected):
    """A path over a body needs views of both of its radars."""
    radars = radars_of(world, np.array(pairs), 0)
    assert radars == expected
    assert tuple(view.radar for view in direct_views(world, 0, radars)) == expected


def test_selected_views_of_a_table_are_those_of_a_table_of_the_selected_views(world):
    views = direct_views(world, 0, (1, 2))
    whole = view_table(views, np.eye(3), np.zeros(3)).select(np.array([False, True]))
    alone = view_table(views[1:], np.eye(3), np.zeros(3))
    for name in ("source", "image", "is_mirrored", "plate"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(alone, name))
    for kind in range(whole.start.shape[1] - 1):
        np.testing.assert_array_equal(
            whole.near[whole.start[0, kind] : whole.start[0, kind + 1]],
            alone.near[alone.start[0, kind] : alone.start[0, kind + 1]],
        )
