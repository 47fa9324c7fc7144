"""Line of sight and point scatterers where surfaces block."""

from __future__ import annotations

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.line_of_sight import line_of_sight
from polychirp.channel.occlusion import blocked
from polychirp.channel.points import point_echoes
from polychirp.channel.world import SKIN, World
from polychirp.model.paths import PropagationPaths


def visible_line_of_sight(world: World, pairs: IntArray) -> PropagationPaths:
    """Direct paths with nothing between the two radars but their own skins."""
    paths = line_of_sight(world.scene, frequency=world.frequency, pairs=pairs)
    place = world.scene.radar_position
    start, end = place[paths.transmitter], place[paths.receiver]
    return paths.select(~blocked(world, start, _short_of(start, end, SKIN)))


def visible_point_echoes(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths over point scatterers that both radars see; a point's own body does not hide it."""
    paths = point_echoes(world.scene, frequency=world.frequency, pairs=pairs)
    place, free = world.scene.radar_position, np.ones(paths.num_paths, dtype=np.bool_)
    for actor in np.unique(paths.bounce_actor):
        mine = paths.bounce_actor == actor
        own = next(iter(world.bodies_of(int(actor)).tolist()), None)
        for radar in (paths.transmitter[mine], paths.receiver[mine]):
            free[mine] &= ~blocked(world, place[radar], paths.bounce_point[mine], but_body=own)
    return paths.select(free)


def _short_of(start: FloatArray, end: FloatArray, gap: float) -> FloatArray:
    """Points ``gap`` m before ``end`` on the way from ``start``."""
    way = end - start
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    return np.asarray(end - way * np.minimum(1.0, gap / np.maximum(length, 1e-12)))
