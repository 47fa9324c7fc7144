"""Echoes of isotropic point scatterers."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, path_table
from polychirp.channel.geometry.retarded_delay import (
    range_acceleration,
    retarded_leg,
    turning,
)
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths
from polychirp.model.scene import Scene


def point_echoes(scene: Scene, *, frequency: float, pairs: IntArray) -> PropagationPaths:
    r"""Paths of ``pairs`` ``(pair, 2)`` over every `PointScatterer`; obstacles are ignored.

    .. math:: |A|^2 = \frac{\sigma\lambda^2}{(4\pi)^3 r_1^2 r_2^2}

    This is the radar equation for isotropic antennas, monostatic and bistatic. A point scatters V
    as V and H as H in all directions. Delays are exact for linear motion: a target that is at R at
    the time of reception and recedes at v has :math:`\tau = 2R/(c+v)`.
    """
    found = [
        (index, actor.pose.to_outer(np.array(point.position)), point.rcs)
        for index, actor in enumerate(scene.actors)
        for point in actor.points
    ]
    if not found or not len(pairs):
        return no_paths(scene, frequency)
    pair = np.repeat(pairs, len(found), axis=0)
    rcs = np.tile([entry[2] for entry in found], len(pairs))
    return echoes_over(
        scene,
        frequency=frequency,
        pair=pair,
        actor=np.tile([entry[0] for entry in found], len(pairs)),
        point=np.tile([entry[1] for entry in found], (len(pairs), 1)),
        scattering=np.sqrt(rcs)[:, None, None] * np.eye(2),
    )


def echoes_over(
    scene: Scene,
    *,
    frequency: float,
    pair: IntArray,
    actor: IntArray,
    point: FloatArray,
    scattering: FloatArray | ComplexArray,
    kind: Bounce = Bounce.SCATTERING,
    motion: tuple[FloatArray, FloatArray] | None = None,
) -> PropagationPaths:
    r"""One path over each of the given points, which by default move with their actors.

    .. math:: A = \frac{\lambda}{(4\pi)^{3/2} r_1 r_2}\, S, \qquad
              \frac{\dot A}{A} = -\frac{\dot r_1}{r_1} - \frac{\dot r_2}{r_2}

    S is taken as constant.

    Parameters
    ----------
    pair : (transmitter, receiver), ``(path, 2)``
    actor : number of the actor that carries the point, ``(path,)``
    point : position in the world at the time of the scene, m ``(path, xyz)``
    scattering : S, m, ``(path, 2, 2)``; |S|² is the cross section, m², between two polarisations
    kind : kind of bounce at the points
    motion : velocity and acceleration of points that move otherwise, in the world, m/s and m/s²
        ``(path, xyz)``; the delay is that of a uniform motion, and accelerations, those of the
        radars too, add to its second derivative
    """
    velocity, acceleration = scene.motion_at(actor, point) if motion is None else motion
    place, speed, swerve = scene.radar_position, scene.radar_velocity, scene.radar_acceleration
    back, back_rate, back_flight = retarded_leg(
        source=point,
        source_velocity=velocity,
        sink=place[pair[:, 1]],
        sink_velocity=speed[pair[:, 1]],
    )
    out, out_rate, out_flight = retarded_leg(
        source=place[pair[:, 0]],
        source_velocity=speed[pair[:, 0]],
        sink=point,
        sink_velocity=velocity,
        later_delay=back,
        later_delay_rate=back_rate,
    )
    legs = [SPEED_OF_LIGHT * late[:, None] for late in (out, back)]
    away, nearer = velocity - speed[pair[:, 0]], speed[pair[:, 1]] - velocity
    bend = range_acceleration(legs[0] * out_flight, away)
    bend += range_acceleration(legs[1] * back_flight, nearer)
    bend += np.sum(out_flight * (acceleration - swerve[pair[:, 0]]), axis=-1)
    bend += np.sum(back_flight * (swerve[pair[:, 1]] - acceleration), axis=-1)
    spread = (4 * np.pi) ** 1.5 * out * back * SPEED_OF_LIGHT * frequency
    return path_table(
        scene=scene,
        frequency=frequency,
        pair=pair,
        delay=out + back,
        delay_rate=out_rate + back_rate,
        transfer=np.asarray(scattering / spread[:, None, None], dtype=np.complex128),
        departure=out_flight,
        arrival=-back_flight,
        bounces=[(kind, actor, point - velocity * back[:, None])],
        delay_acceleration=bend / SPEED_OF_LIGHT,
        transfer_drift=-(out_rate / out + back_rate / back),
        departure_rate=turning(out_flight, legs[0][:, 0], away),
        arrival_rate=-turning(back_flight, legs[1][:, 0], nearer),
    )
