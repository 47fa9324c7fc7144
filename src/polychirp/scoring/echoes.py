"""`Echoes`: the own paths of a radar as its receiver sees them, with the body that each is of."""

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, BoolArray, FloatArray, IntArray, PerPath, PerPathIndex, Sealed
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import direction_angles
from polychirp.model.paths import Bounce, PropagationPaths
from polychirp.model.scene import Scene

_REFLECTING: Final = (Bounce.SCATTERING, Bounce.REFLECTION, Bounce.DIFFUSE)
"""Bounces that send a wave back; at the others it goes on."""

CLUTTER: Final = ("road", "building", "tree", "furniture")
"""Kinds of actors whose echoes are clutter."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Echoes(Sealed):
    """Own paths of a radar as a receiver sees them.

    Parameters
    ----------
    body : name of every actor of the scene
    is_clutter : ``(actor,)``; true for roads, buildings, trees and furniture
    actor : number of the actor that sends the path back, ``(path,)``
    range, range_rate, azimuth, elevation : m, m/s, rad, rad, ``(path,)``
    power : received over transmitted power with the elements' gains, ``(path,)``
    is_mirrored : ``(path,)``; true for multipath (`PropagationPaths.is_mirrored`)
    """

    body: tuple[str, ...]
    is_clutter: Annotated[BoolArray, Axes("actor", dtype=np.bool_)]
    actor: PerPathIndex
    range: PerPath
    range_rate: PerPath
    azimuth: PerPath
    elevation: PerPath
    power: PerPath
    is_mirrored: Annotated[BoolArray, Axes("path", dtype=np.bool_)]


def echoes_of(paths: PropagationPaths, scene: Scene, radar: int) -> Echoes:
    """Echoes over the paths from a radar, by its number, back to itself."""
    is_own = (paths.transmitter == radar) & (paths.receiver == radar) & (paths.num_bounces > 0)
    own = paths.select(is_own)
    turn, pattern = scene.radar_rotation[radar], scene.radars[radar].array.pattern
    arrival, departure = own.arrival @ turn, own.departure @ turn
    azimuth, elevation = direction_angles(arrival)
    gain = pattern.gain(arrival) * pattern.gain(departure)
    return Echoes(
        body=tuple(actor.name for actor in scene.actors),
        is_clutter=np.array([actor.kind in CLUTTER for actor in scene.actors], dtype=np.bool_),
        actor=sending_back(own),
        range=0.5 * SPEED_OF_LIGHT * own.delay,
        range_rate=0.5 * SPEED_OF_LIGHT * own.delay_rate,
        azimuth=azimuth,
        elevation=elevation,
        power=gain * np.max(np.abs(own.transfer) ** 2, axis=(-2, -1)),
        is_mirrored=own.is_mirrored,
    )


def power_by_body(echoes: Echoes, near: BoolArray) -> FloatArray:
    """Power of the echoes that are no multipath, by actor, ``(actor, detection)``.

    ``near`` ``(path, detection)`` is true for the paths that count at each detection.
    """
    power = np.where(echoes.is_mirrored, 0.0, echoes.power)
    by_actor = np.zeros((len(echoes.body), power.size))
    by_actor[echoes.actor, np.arange(power.size)] = power
    return np.asarray(by_actor @ near)


def sending_back(paths: PropagationPaths) -> IntArray:
    """Actor of the last bounce of every path that sends the wave back, or else of its last one."""
    number = np.arange(paths.bounce_kind.size)
    is_sent_back = np.isin(paths.bounce_kind, _REFLECTING)
    last = np.asarray(paths.bounce_start[1:] - 1)
    if not last.size:
        return last
    latest = np.maximum.accumulate(np.where(is_sent_back, number, 0))[last]
    is_own = latest >= paths.bounce_start[:-1]
    return np.asarray(paths.bounce_actor[np.where(is_own, latest, last)])
