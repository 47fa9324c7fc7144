r"""Echoes of bodies by waves that bend around the edges of a vehicle in front of them.

`physical_optics.paths` lets the straight waves of the radars illuminate a body, with a shadow that
begins at once. In truth the field behind a vehicle's edge is Fresnel's: at the edge of the shadow,
it is half of the field without the vehicle; behind, it falls; and beside, it has ripples. It is the
straight wave, where that is free, and one wave over every edge (`edge_waves` has the equations).
This module computes the paths with such a wave on one leg or on both; together with the straight
paths, the echo is continuous while a body moves into the shadow.

A wave over an edge arrives at a facet along its own direction and with its own phase, so it is one
more view of the body, and its facets are summed by physical optics as those of any view.

**Limits.** One vehicle bends a wave; if another one hides the body from the edge, or the edge from
the radar, there is no wave. A vehicle is a box for its edges: a top edge across the line of sight,
and two upright sides, each with two corners at most, in which its surface absorbs
(`diffraction.paths` has the limits of that). The bottom edge is missing, since the road is near:
what passes below a vehicle comes by way of the road (`physical_optics.paths.mirrored_echoes`), with
sharp shadows. Paths with a bend on one leg and a mirror on the other are left out. Only vehicles
and objects bend waves, and only such as stand between a radar and a body, not beside them. Edges
whose wave is below `bent_views.WEAKEST_EDGE` are left out.
"""

from typing import Final

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.base import gather, no_paths
from polychirp.channel.bent_echoes.bent_views import BentView, bent_illumination, bent_views
from polychirp.channel.physical_optics.flat_faces import NO_NEIGHBOUR, Flats
from polychirp.channel.physical_optics.paths import (
    PairSums,
    combinations_of,
    direct_illumination,
    direct_views,
    only_pairs,
    radars_of,
    wanted_pairs,
    within_dynamic_range,
)
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import World, bodies_near
from polychirp.model.paths import PropagationPaths

BENDING_KINDS: Final = ("vehicle", "object")
"""Kinds of actors that bend waves. Trees have no edge, and furniture is thinner than a Fresnel zone
or as long as the road."""

ZONE_MARGIN: Final = 0.5
"""Margin, m, about the rays to a body within which another body's edges may matter. Chosen: halfway
of 20 m, that is a Fresnel parameter of 5, where an edge's wave begins to be weakened."""


def bent_echoes(
    world: World, pairs: IntArray, strongest: FloatArray, *, body: int
) -> PropagationPaths:
    """Paths of ``pairs`` over the facets of one body, with one leg or both over a vehicle's edge.

    Parameters
    ----------
    pairs : ``(pair, 2)``
    strongest : power of the strongest path found so far, ``(transmitter, receiver)``; paths that
        are weaker by more than the dynamic range are left out
    body : number of the body

    Examples
    --------
    A small plate on the edge of a screen's shadow: half of the field arrives, and half of it
    returns.

    >>> from polychirp.channel.base import all_pairs
    >>> from polychirp.channel.physical_optics.paths import facet_echoes
    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.scene import Actor
    >>> from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
    >>> target = Actor(name="plate", kind="object", mesh=mesh_of(plate(0.02, 0.002)),
    ...     pose=Pose(x=20.0, yaw=3.14159265))
    >>> screen = Actor(name="screen", kind="vehicle", mesh=mesh_of(plate(20.0, 0.5)),
    ...     pose=Pose(x=10.0, z=-10.0))
    >>> def echo(*actors):
    ...     scene = around(actors, [(0, 0, 0)])
    ...     world, pairs = Composite(dynamic_range=1e12).prepare(scene), all_pairs(scene)
    ...     paths = gather([facet_echoes(world, pairs, body=len(actors) - 1),
    ...         bent_echoes(world, pairs, np.zeros((1, 1)), body=len(actors) - 1)])
    ...     return abs(transfer_at(paths, 79e9)[0, 0])
    >>> float(round(echo(screen, target) / echo(target), 2))
    0.25
    """
    direct = direct_views(world, body, radars_of(world, pairs, body))
    seen = direct_illumination(world, body, direct)
    bent = [over for view in direct for over in _views_over_edges(world, view)]
    once = within_dynamic_range(
        world, combinations_of(list(seen.number), bent, wanted_pairs(pairs)), strongest
    )
    twice = within_dynamic_range(world, combinations_of(bent, bent, wanted_pairs(pairs)), strongest)
    if not once and not twice:
        return no_paths(world.scene, world.frequency)
    views: dict[View, None] = dict.fromkeys([b for _, b in once + twice] + [a for a, _ in twice])
    over_edges = bent_illumination(
        world, body, [view for view in views if isinstance(view, BentView)], seen
    )
    size = len(world.surfaces[body].area)
    one_by_one = Flats(
        False, np.zeros(size, dtype=np.bool_), np.full((size, 3), NO_NEIGHBOUR, dtype=np.int64)
    )
    sums = [
        PairSums(first, over_edges, some, strongest, flats=one_by_one)
        for first, some in ((seen, once), (over_edges, twice))
    ]
    # waves are computed only for facets that meet a kept cell
    is_needed = np.zeros(over_edges.lit.face.shape, dtype=np.bool_)
    sums[0].mark((np.zeros(seen.lit.face.shape, dtype=np.bool_), is_needed))
    sums[1].mark((is_needed, is_needed))
    over_edges = over_edges.select(is_needed).with_waves()
    found = [sums[0].paths(seen, over_edges), sums[1].paths(over_edges, over_edges)]
    return only_pairs(pairs, gather(found))


def _views_over_edges(world: World, view: View) -> list[BentView]:
    """Views of ``view``'s body over edges of vehicles that stand before it."""
    ends = np.array([view.source, world.centre[view.body]])
    near = bodies_near(world, ends, float(world.radius[view.body]) + ZONE_MARGIN)
    return bent_views(world, view, [int(body) for body in near if _bends_waves(world, view, body)])


def _bends_waves(world: World, view: View, body: int) -> bool:
    """True if a body has edges that bend the waves of ``view``."""
    actor = int(world.body[body])
    is_own = body == view.body or actor == world.scene.carriers[view.radar]
    return not is_own and world.scene.actors[actor].kind in BENDING_KINDS
