"""Direct paths and echoes of points with shadows, and with losses in thin sheets and leaves."""

from dataclasses import replace

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.direct.line_of_sight import line_of_sight
from polychirp.channel.direct.point_scatterers import point_echoes
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.transmission import transmission_matrices, with_leg_losses
from polychirp.channel.scene.world import RADAR_CLEARANCE, World
from polychirp.model.paths import PropagationPaths


def visible_line_of_sight(world: World, pairs: IntArray) -> PropagationPaths:
    """Direct paths that no opaque surface blocks, except within `RADAR_CLEARANCE` of a radar."""
    paths = line_of_sight(world.scene, frequency=world.frequency, pairs=pairs)
    place = world.scene.radar_position
    start, end = place[paths.transmitter], place[paths.receiver]
    end = points_before(start, end, RADAR_CLEARANCE)
    free = ~blocked(world, start, end)
    paths = paths.select(free)
    return replace(
        paths, transfer=paths.transfer @ transmission_matrices(world, start[free], end[free])
    )


def visible_point_echoes(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths over point scatterers visible to both radars; a point's own body is no obstacle."""
    paths = point_echoes(world.scene, frequency=world.frequency, pairs=pairs)
    place, free = world.scene.radar_position, np.ones(paths.num_paths, dtype=np.bool_)
    legs = np.empty((2, paths.num_paths, 2, 2), dtype=np.complex128)
    for actor in np.unique(paths.bounce_actor):
        mine = paths.bounce_actor == actor
        own = next(iter(world.bodies_of(int(actor)).tolist()), None)
        point = paths.bounce_point[mine]
        for leg, radar in enumerate((paths.transmitter[mine], paths.receiver[mine])):
            free[mine] &= ~blocked(world, place[radar], point, but_body=own)
            legs[leg, mine] = transmission_matrices(world, place[radar], point, but_body=own)
    return replace(paths, transfer=with_leg_losses(paths.transfer, legs[0], legs[1])).select(free)


def points_before(start: FloatArray, end: FloatArray, gap: float) -> FloatArray:
    """Points ``gap`` m before ``end`` on the way from ``start``, both m ``(…, xyz)``."""
    way = end - start
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    return np.asarray(end - way * np.minimum(1.0, gap / np.maximum(length, 1e-12)))
