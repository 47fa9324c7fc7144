"""`Echoes`: the own paths of a radar as its receiver sees them, with the body that each is of."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import Axes, BoolArray, FloatArray, IntArray, PerPath, PerPathIndex, Sealed
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import direction_angles
from polychirp.model.paths import Bounce, PropagationPaths
from polychirp.model.scene import Scene

_REFLECTING: Final = (Bounce.SCATTERING, Bounce.REFLECTION, Bounce.DIFFUSE)
"""Bounces that send a wave back; at the others it goes on."""

CLUTTER: Final = ("road", "building", "tree", "furniture")
"""Kinds of actors whose echoes are clutter."""


class Folds(NamedTuple):
    r"""Places of echoes beyond the range rates that a receiver of equal ramps tells apart.

    The receiver subtracts a number n of spans from the range rate, and with the beat of a ramp of
    the slope μ at the frequency f,

    .. math:: f_b = \tfrac2c\,(\mu R + f \dot R),

    it adds n times ``shift`` to the range, if S is the span:

    .. math:: \Delta R = f S / \mu

    Both are in m/s and m. Without a finite span, nothing is folded.
    """

    span: float = math.inf
    shift: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Echoes(Sealed):
    """Own paths of a radar as a receiver sees them.

    Parameters
    ----------
    body : name of every actor of the scene, or of the actor that it is a part of
    is_clutter : ``(actor,)``; true for roads, buildings, trees and furniture
    actor : number of the actor that sends the path back, ``(path,)``
    range, range_rate, azimuth, elevation : m, m/s, rad, rad, ``(path,)``
    power : received over transmitted power with the elements' gains, ``(path,)``
    is_mirrored : ``(path,)``; true for multipath (`PropagationPaths.is_mirrored`)
    folds : how the receiver reports range rates beyond those that it tells apart
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
    folds: Folds = Folds()  # noqa: RUF009  a constant


def echoes_of(paths: PropagationPaths, scene: Scene, radar: int) -> Echoes:
    """Echoes over the paths from a radar, by its number, back to itself."""
    is_own = (paths.transmitter == radar) & (paths.receiver == radar) & (paths.num_bounces > 0)
    own = paths.select(is_own)
    turn, pattern = scene.radar_rotation[radar], scene.radars[radar].array.pattern
    arrival, departure = own.arrival @ turn, own.departure @ turn
    azimuth, elevation = direction_angles(arrival)
    gain = pattern.gain(arrival) * pattern.gain(departure)
    return Echoes(
        body=tuple(actor.whole for actor in scene.actors),
        is_clutter=np.array([actor.kind in CLUTTER for actor in scene.actors], dtype=np.bool_),
        actor=sending_back(own),
        range=0.5 * SPEED_OF_LIGHT * own.delay,
        range_rate=0.5 * SPEED_OF_LIGHT * own.delay_rate,
        azimuth=azimuth,
        elevation=elevation,
        power=gain * np.max(np.abs(own.transfer) ** 2, axis=(-2, -1)),
        is_mirrored=own.is_mirrored,
    )


def mean_echoes(several: Sequence[Echoes], elapsed: FloatArray) -> Echoes:
    """Echoes of a radar at several instants, as if all were at one, with the mean of their powers.

    A glint that slides over a body, or one that is seen for a part of a frame only, is a path at
    some instants of the frame and none at others. A detection is made of all of them.

    Parameters
    ----------
    several : echoes of one scene, at one instant each; at least one
    elapsed : from each instant to the one for which the echoes are wanted, s, ``(instant,)``

    Examples
    --------
    A path that is there at one of two instants, 10 ms before the one wanted:

    >>> early = Echoes(body=("wall",), is_clutter=[True], actor=[0], range=[8.0], range_rate=[5.0],
    ...     azimuth=[0.0], elevation=[0.0], power=[1e-9], is_mirrored=[False])
    >>> none = np.zeros(0)
    >>> late = Echoes(body=("wall",), is_clutter=[True], actor=none, range=none, range_rate=none,
    ...     azimuth=none, elevation=none, power=none, is_mirrored=none)
    >>> found = mean_echoes([early, late], np.array([0.01, 0.0]))
    >>> found.range, found.power
    (array([8.05]), array([5.e-10]))
    """

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(one, name) for one in several])

    after = np.repeat(elapsed, [one.range.size for one in several])
    return replace(
        several[0],
        actor=joined("actor"),
        range=joined("range") + after * joined("range_rate"),
        range_rate=joined("range_rate"),
        azimuth=joined("azimuth"),
        elevation=joined("elevation"),
        power=joined("power") / len(several),
        is_mirrored=joined("is_mirrored"),
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
