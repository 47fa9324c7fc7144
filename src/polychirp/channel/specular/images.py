"""Mirror images in plates, and the coefficients of their reflections."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.scene.world import Plates, World


def mirrored(vector: FloatArray, normal: FloatArray) -> FloatArray:
    """Vectors ``(…, xyz)`` mirrored in planes with the unit normals ``(…, xyz)``."""
    return np.asarray(vector - 2 * np.sum(vector * normal, axis=-1, keepdims=True) * normal)


def image_of(point: FloatArray, plates: Plates) -> FloatArray:
    """Mirror images of points in the plates' planes, m ``(path, xyz)``."""
    return np.asarray(mirrored(point - plates.centre, plates.normal) + plates.centre)


def image_velocity(world: World, plates: Plates, velocity: FloatArray) -> FloatArray:
    """Velocities of mirror images in plates that move with their actors, m/s ``(path, xyz)``."""
    carried = np.array([actor.velocity for actor in world.scene.actors])[plates.actor]
    return np.asarray(mirrored(velocity - carried, plates.normal) + carried)


def nearest_on_plates(plates: Plates, point: FloatArray) -> FloatArray:
    """Point of each plate that is nearest to a point, m ``(path, xyz)``."""
    gap = point - plates.centre
    u = np.clip(np.sum(gap * plates.across, axis=-1), -plates.half_across, plates.half_across)
    v = np.clip(np.sum(gap * plates.along, axis=-1), -plates.half_along, plates.half_along)
    return np.asarray(plates.centre + u[:, None] * plates.across + v[:, None] * plates.along)


def coefficients_of(world: World, plates: Plates, cosine: FloatArray) -> ComplexArray:
    """Coefficients (Γs, Γp) of plates at cosines of the angles of incidence, ``(2, path)``."""
    gamma = np.empty((2, len(cosine)), dtype=np.complex128)
    for medium in np.unique(plates.medium):
        mine = plates.medium == medium
        material = world.table[world.materials[medium]]
        gamma[:, mine] = reflection(material, cosine[mine], world.frequency)
    return gamma


def across_incidence(plates: Plates, direction: FloatArray) -> FloatArray:
    """Unit vectors s normal to the planes of incidence of waves along ``direction``."""
    # at normal incidence s may be any direction in the plate, since Γs = −Γp
    side = np.cross(direction, plates.normal)
    size = np.linalg.norm(side, axis=-1, keepdims=True)
    return np.asarray(np.where(size > 1e-9, side / np.maximum(size, 1e-9), plates.across))
