"""Drawn pairs of bent panels that turn a wave from one radar to another by two bounces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.base import no_paths
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
from tests.support.references.two_steps import Rectangle

TRACER = Composite(frequency=79e9, max_bounces=2, dynamic_range=1e20)
"""Tracer that leaves out no path."""

FACET = 0.02
"""Longest edge of the panels' facets, m."""


class TwoPanels(NamedTuple):
    """The first and the last panel, between two radars at places, m."""

    first: Rectangle
    last: Rectangle
    transmitter: FloatArray
    receiver: FloatArray

    @property
    def length(self) -> float:
        """Length of the path over the middles of both panels, m."""
        places = self.transmitter, self.first.centre, self.last.centre, self.receiver
        return float(np.sum(np.linalg.norm(np.diff(np.array(places), axis=0), axis=1)))

    def traced(self, tube: float) -> ComplexArray:
        """Transfer ``(receiving, transmitting)`` over the first panel, then the last.

        All tubes are ``tube`` m wide.
        """
        actors = [
            Actor(name=name, kind="object", mesh=mesh_of(corners_of(panel)))
            for name, panel in (("first", self.first), ("last", self.last))
        ]
        world = TRACER.prepare(around(actors, [self.transmitter, self.receiver]))
        found = tube_paths(world, np.array([[0, 1]]), tube=tube, coarsest=tube, max_bounces=2)
        start = found.bounce_start[:-1]
        is_first = found.bounce_actor[start] == 2
        mine = found.select((found.transmitter == 0) & is_first)
        mine = mine if mine.num_paths else no_paths(world.scene, 79e9)
        return transfer_at(mine, 79e9, 0, 1)


def corners_of(panel: Rectangle) -> FloatArray:
    """Triangles of a panel, m ``(face, corner, xyz)``."""
    longest = 2 * max(float(np.linalg.norm(half)) for half in (panel.u, panel.v))
    square = plate(2.0, 2.0 * FACET / longest)
    points, _, _ = panel.at(square[..., 1].reshape(-1), square[..., 2].reshape(-1))
    return np.asarray(points.reshape(square.shape))


def drawn_panels(count: int, off: float, *, seed: int) -> Iterator[TwoPanels]:
    """Panels of 0.15 to 0.35 m along each side with radii of 0.5 to 3 m, 1 to 2 m apart.

    Radars are 2.5 to 3.5 m away. The path over the middles is specular before the last panel is
    turned by ``off`` (rad) about a drawn axis in its plane.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        first = np.zeros(3)
        last = np.array([0.3, rng.uniform(1.0, 2.0), rng.uniform(-0.2, 0.2)])
        angle = rng.uniform(-0.3, 0.3)
        start = np.array([3 * np.cos(angle), 3 * np.sin(angle) - 0.5, rng.uniform(-0.2, 0.2)])
        end = np.array([rng.uniform(2.5, 3.5), last[1] + rng.uniform(0, 1), rng.uniform(-0.2, 0.2)])
        upright = _unit(_unit(start - first) + _unit(last - first))
        turned = _unit(_unit(first - last) + _unit(end - last))
        aside = _unit(np.cross(turned, rng.normal(size=3)))
        turned = np.cos(off) * turned + np.sin(off) * aside
        panels = [_panel(rng, place, n) for place, n in ((first, upright), (last, turned))]
        yield TwoPanels(panels[0], panels[1], start, end)


def _panel(rng: np.random.Generator, place: FloatArray, normal: FloatArray) -> Rectangle:
    along = _unit(np.cross(normal, rng.normal(size=3)))
    sizes, radii = rng.uniform(0.15, 0.35, 2), rng.uniform(0.5, 3.0, 2)
    u, v = 0.5 * sizes[0] * along, 0.5 * sizes[1] * np.cross(normal, along)
    return Rectangle(place, u, v, (float(1 / radii[0]), float(1 / radii[1])))


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
