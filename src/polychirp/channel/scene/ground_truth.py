"""Visible metal of targets for a radar; a check that no radar is inside a body."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.enclosure import winding_numbers
from polychirp.channel.materials.library import known_materials, material_table
from polychirp.errors import InputError
from polychirp.frames import direction_angles
from polychirp.model.material import Material
from polychirp.model.scene import Actor, Scene
from polychirp.model.truth import Truth

if TYPE_CHECKING:
    from polychirp.channel.scene.world import World

VISIBLE_POWER: Final = 0.5
"""Least power ratio that sheets and leaves must transmit, in every polarisation, for a point to be
visible. Chosen: a bumper transmits more (0.87), a pane of glass less (0.29)."""

PIECE_SIZE: Final = 0.05
"""Longest edge of the pieces into which the faces of a partly hidden body are cut to find its
nearest visible point, m. Chosen: far below the size of a target."""

PLACE_SPACING: Final = 0.2
"""Edge of the cubes, m, of which each has one place at most of a body's visible metal. Chosen: half
of the margin in range with which detections belong to a body; half of it takes four times as long.
"""

FIRST_BATCH_SIZE: Final = 64
"""Points in the first batch of visibility tests, the nearest ones; each later batch is four times
larger. Chosen: mostly one of the nearest points is visible, so that few are tested."""

ENCLOSED_SHARE: Final = 0.6
"""Share of the full solid angle that a body's faces must span at a point that is inside.
Chosen: it is 0.5 close behind a single sheet, and almost 1 in a body with windows."""


def truth(
    scene: Scene,
    receiver: int,
    targets: Sequence[str],
    *,
    materials: Mapping[str, Material] | None = None,
    frequency: float = 79e9,
    has_occlusion: bool = True,
) -> Truth:
    r"""Visible metal of every target from a radar's phase centre, and its nearest point.

    Places on the visible metal are `PLACE_SPACING` apart. Without metal, all faces of the body are
    searched; without faces, its plates; without plates, its point scatterers and the reflecting
    points of its moving parts, which have range rates of their own. If the nearest point
    is visible, it is exact. If not, the result is the nearest visible one of pieces of
    `PIECE_SIZE`; on a hidden body, it is the nearest point.

    The range rate is :math:`(v_B - v_X)\cdot u`, with the velocities of body and radar and the
    unit vector u from the radar to the point. The movement of the nearest point over a curved body
    is neglected: to first order it is across the line of sight.

    Parameters
    ----------
    receiver : number of the radar; targets : names of actors
    materials : added to the known materials, for the transmission of what is in between
    frequency : Hz, at which that transmission is computed
    has_occlusion : False for paths that no body blocks: all nearest points are then visible

    Raises
    ------
    InputError
        There is no such actor, or it has neither faces, plates nor points.
    """
    from polychirp.channel.scene.world import world_of

    world = None
    if has_occlusion:
        table = material_table(materials)
        world = world_of(scene, frequency=frequency, dynamic_range=1.0, table=table)
    eye = scene.radar_position[receiver]
    seen = [_seen(world, _parts_of(scene, name), eye, scene.time) for name in targets]
    point = np.array([one.nearest for one in seen]).reshape(-1, 3)
    velocity = np.array([one.velocity for one in seen]).reshape(-1, 3)
    found = [one.all_places for one in seen]
    of_target = np.repeat(np.arange(len(seen)), [len(some) for some, _ in found])
    seen_from = partial(_as_seen, scene, receiver)
    distance, rate, azimuth, elevation = seen_from(point, velocity)
    nothing = np.zeros((0, 3))  # for a scene without targets
    place_distance, place_rate, place_azimuth, place_elevation = seen_from(
        np.concatenate([*(places for places, _ in found), nothing]),
        np.concatenate([*(velocities for _, velocities in found), nothing]),
    )
    return Truth(
        time=scene.time,
        name=tuple(targets),
        range=distance,
        range_rate=rate,
        azimuth=azimuth,
        elevation=elevation,
        point=point,
        is_visible=np.array([one.is_visible for one in seen], dtype=np.bool_),
        visible_share=np.array([one.places.share for one in seen]),
        place_target=of_target,
        place_range=place_distance,
        place_range_rate=place_rate,
        place_azimuth=place_azimuth,
        place_elevation=place_elevation,
    )


def _as_seen(
    scene: Scene, receiver: int, point: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Range, m, range rate, m/s, azimuth and elevation, rad, of moving points ``(point, xyz)``."""
    way = point - scene.radar_position[receiver]
    distance = np.linalg.norm(way, axis=-1)
    towards = way / np.maximum(distance, 1e-12)[:, None]
    azimuth, elevation = direction_angles(towards @ scene.radar_rotation[receiver])
    rate = np.sum((velocity - scene.radar_velocity[receiver]) * towards, axis=-1)
    return distance, rate, azimuth, elevation


def _parts_of(scene: Scene, name: str) -> tuple[Actor, ...]:
    """The actors of which a target consists: one, or a tractor and its trailer."""
    if parts := scene.parts_of(name):
        return parts
    known = ", ".join(dict.fromkeys(actor.whole for actor in scene.actors))
    raise InputError(f"there is no actor '{name}'; the scene has {known}")


class _Faces(NamedTuple):
    """Faces of a body towards an eye, or all if it sees only backs, in the body's frame.

    ``corners`` m ``(face, corner, xyz)``; ``point`` m ``(face, xyz)``, the nearest one of each to
    the eye, which is at ``eye`` m, ``(xyz,)``.
    """

    corners: FloatArray
    point: FloatArray
    eye: FloatArray


def _faces_towards(actor: Actor, eye: FloatArray) -> _Faces:
    """Faces of a body that `truth` searches, towards ``eye`` in the world, m, ``(xyz,)``."""
    from polychirp.channel.geometry.closest_point import closest_points

    corners, place = target_corners(actor), actor.pose.to_inner(eye)
    point, is_front = closest_points(corners, place)
    if np.any(is_front):
        corners, point = corners[is_front], point[is_front]
    return _Faces(corners, point, place)


def _nearest_visible(
    world: "World | None", actor: Actor, faces: _Faces, eye: FloatArray, time: float
) -> tuple[FloatArray, bool]:
    """Nearest visible point in world axes and True; if all are hidden, the nearest and False.

    Without a world, all points are visible.
    """
    from polychirp.channel.geometry.closest_point import closest_points

    if not len(faces.corners):
        points, _ = _points_of(actor, eye, time)
        if not len(points):
            raise InputError(
                f"'{actor.name}' has no faces, plates or points, and no moving parts; a target "
                "needs some of them"
            )
        found = _first_visible(world, points, eye)
        nearest = points[np.argmin(np.linalg.norm(points - eye, axis=-1))]
        return (nearest, False) if found is None else (found, True)
    distance = np.sum((faces.point - faces.eye) ** 2, axis=-1)
    nearest = actor.pose.to_outer(faces.point[np.argmin(distance)])
    if _first_visible(world, nearest[None], eye) is not None:
        return nearest, True
    pieces = closest_points(_cut(faces.corners, PIECE_SIZE), faces.eye)[0]
    found = _first_visible(world, actor.pose.to_outer(pieces), eye)
    return (nearest, False) if found is None else (found, True)


def _points_of(actor: Actor, eye: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
    """Points of a body without faces, m, and their velocities, m/s, in the world: ``(point, xyz)``.

    They are its point scatterers, and the points of its moving parts that reflect to ``eye`` and
    that the body itself does not hide.
    """
    points = actor.pose.to_outer(np.array([p.position for p in actor.points]).reshape(-1, 3))
    velocity = actor.velocity_at(points)
    if actor.movement is None:
        return points, velocity
    from polychirp.channel.geometry.part_reflections import moving_reflections

    still = eye[None], np.zeros((1, 3))
    found = moving_reflections(actor, time, (still, still), wavenumber=1.0)
    is_open = found.is_open[0]
    return (
        np.concatenate([points, found.point[0, is_open]]),
        np.concatenate([velocity, found.velocity[0, is_open]]),
    )


class _Places(NamedTuple):
    """Visible places on a body, m, and their velocities, m/s, in the world: ``(place, xyz)``.

    ``share`` is that of the surface towards the radar which is visible, by its solid angle, which
    is ``size`` in all, sr; of points, it is that of their number, ``size``.
    """

    point: FloatArray
    velocity: FloatArray
    share: float
    size: float


_NO_PLACES: Final = _Places(np.zeros((0, 3)), np.zeros((0, 3)), 0.0, 0.0)


def _joined(several: Sequence[_Places]) -> _Places:
    """Visible places on several bodies."""
    size = sum(some.size for some in several)
    return _Places(
        np.concatenate([some.point for some in several]),
        np.concatenate([some.velocity for some in several]),
        sum(some.share * some.size for some in several) / max(size, 1e-300),
        size,
    )


class _Seen(NamedTuple):
    """A target as a radar sees it.

    It has the nearest visible point, m, or the nearest one if all are hidden, with its velocity,
    m/s, ``(xyz,)``, and the visible ``places``.
    """

    nearest: FloatArray
    velocity: FloatArray
    is_visible: bool
    places: _Places

    @property
    def all_places(self) -> tuple[FloatArray, FloatArray]:
        """Visible places and their velocities, the nearest one first."""
        if not self.is_visible:
            return self.places.point, self.places.velocity
        return (
            np.concatenate([self.nearest[None], self.places.point]),
            np.concatenate([self.velocity[None], self.places.velocity]),
        )


def _seen(world: "World | None", parts: Sequence[Actor], eye: FloatArray, time: float) -> _Seen:
    """A target that consists of some actors, as a radar at ``eye`` sees it."""
    several = []
    for actor in parts:
        faces = _faces_towards(actor, eye)
        nearest, is_visible = _nearest_visible(world, actor, faces, eye, time)
        # a part that is all hidden counts in the visible share of the whole
        is_searched = is_visible or len(parts) > 1
        places = _NO_PLACES
        if is_searched:
            places = _visible_places(world, actor, faces, eye, time)
        several.append(_Seen(nearest, actor.velocity_at(nearest), is_visible, places))
    first = min(several, key=lambda one: (not one.is_visible, np.linalg.norm(one.nearest - eye)))
    if len(several) == 1:
        return first
    return first._replace(places=_joined([one.places for one in several]))


def _visible_places(
    world: "World | None", actor: Actor, faces: _Faces, eye: FloatArray, time: float
) -> _Places:
    """Visible places on a body.

    On faces, each cube of `PLACE_SPACING` has one place at most, which moves with the body.
    The pieces of faces in a cube are as visible as its place. Points count alike.
    """
    from polychirp.channel.geometry.closest_point import closest_points

    if not len(faces.corners):
        points, velocity = _points_of(actor, eye, time)
        seen = _are_visible(world, points, eye)
        share = float(np.mean(seen)) if seen.size else 0.0
        return _Places(points[seen], velocity[seen], share, float(seen.size))
    pieces = _cut(faces.corners, PLACE_SPACING)
    inner = closest_points(pieces, faces.eye)[0]
    cube = np.floor(inner / PLACE_SPACING).astype(np.int64)
    cube -= cube.min(axis=0)
    number = np.ravel_multi_index(tuple(cube.T), tuple(cube.max(axis=0) + 1))
    _, few, cube_of = np.unique(number, return_index=True, return_inverse=True)
    places = actor.pose.to_outer(inner[few])
    seen = _are_visible(world, places, eye)
    filled = np.bincount(cube_of.ravel(), _solid_angles(pieces, faces.eye))
    velocity = actor.velocity_at(places[seen])
    size = float(filled.sum())
    return _Places(places[seen], velocity, float(filled[seen].sum() / size), size)


def _solid_angles(corners: FloatArray, eye: FloatArray) -> FloatArray:
    """Solid angles of small triangles ``(face, corner, xyz)`` at a point, sr, ``(face,)``."""
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    away = corners.mean(axis=1) - eye
    distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
    return np.asarray(np.abs(np.sum(area * away, axis=1)) / distance**3)


def _are_visible(world: "World | None", candidates: FloatArray, eye: FloatArray) -> BoolArray:
    """Mask of the points ``(candidate, xyz)`` that are visible, as in `_first_visible`."""
    if world is None:
        return np.ones(len(candidates), dtype=np.bool_)
    from polychirp.channel.scene.occlusion import blocked
    from polychirp.channel.scene.transmission import transmission_matrices

    ends = _before(candidates, eye)
    is_open = ~blocked(world, eye[None], ends)
    power = least_power(transmission_matrices(world, eye[None], ends[is_open]))
    is_open[is_open] = power >= VISIBLE_POWER
    return np.asarray(is_open)


def _before(candidates: FloatArray, eye: FloatArray) -> FloatArray:
    """Points 1 mm before the candidates ``(candidate, xyz)``, as seen from ``eye``."""
    gap = eye - candidates
    away = np.linalg.norm(gap, axis=-1, keepdims=True)
    return np.asarray(candidates + 1e-3 * gap / np.maximum(away, 1e-12))


def _first_visible(
    world: "World | None", candidates: FloatArray, eye: FloatArray
) -> FloatArray | None:
    """The nearest of points ``(candidate, xyz)`` that is visible from ``eye``, or None.

    A point is visible if nothing opaque hides it, and if sheets and leaves transmit at least
    `VISIBLE_POWER` in every polarisation; without a world, every point is visible.
    """
    if world is None:
        return np.asarray(candidates[np.argmin(np.linalg.norm(candidates - eye, axis=-1))])
    from polychirp.channel.scene.occlusion import blocked
    from polychirp.channel.scene.transmission import transmission_matrices

    away = np.linalg.norm(eye - candidates, axis=-1)
    ends = _before(candidates, eye)
    for batch in _growing(np.argsort(away, kind="stable")):
        open_ones = batch[~blocked(world, eye[None], ends[batch])]
        for some in _growing(open_ones):
            is_clear = (
                least_power(transmission_matrices(world, eye[None], ends[some])) >= VISIBLE_POWER
            )
            if np.any(is_clear):
                return np.asarray(candidates[some[np.argmax(is_clear)]])
    return None


def _growing(numbers: IntArray) -> Iterator[IntArray]:
    """Batches of numbers in order: `FIRST_BATCH_SIZE`, then each four times the one before."""
    begin, size = 0, FIRST_BATCH_SIZE
    while begin < len(numbers):
        yield numbers[begin : begin + size]
        begin, size = begin + size, 4 * size


def least_power(matrix: ComplexArray) -> FloatArray:
    r"""Least power ratio that matrices ``(…, 2, 2)`` transmit, over all polarisations: ``(…,)``.

    It is the smaller singular value squared, :math:`2|d|^2/(s + \sqrt{s^2 - 4|d|^2})`, with the
    determinant d and the sum s of the entries' squared magnitudes.

    >>> least_power(np.diag([0.5j, 2.0]))
    array(0.25)
    """
    power = np.abs(matrix) ** 2
    total = np.sum(power, axis=(-2, -1))
    product = (
        np.abs(matrix[..., 0, 0] * matrix[..., 1, 1] - matrix[..., 0, 1] * matrix[..., 1, 0]) ** 2
    )
    root = np.sqrt(np.maximum(total**2 - 4.0 * product, 0.0))
    return np.asarray(2.0 * product / np.maximum(total + root, 1e-300))


def target_corners(actor: Actor) -> FloatArray:
    """Triangles that `truth` searches, m, ``(face, corner, xyz)`` in the actor's frame."""
    mesh = actor.mesh
    if not mesh.num_faces:
        return _plate_corners(actor)
    if "metal" in mesh.materials:
        is_metal = mesh.material == mesh.materials.index("metal")
        if np.any(is_metal):
            return np.asarray(mesh.vertex[mesh.face[is_metal]])
    return mesh.corners


def _plate_corners(actor: Actor) -> FloatArray:
    """Two triangles per plate, m, ``(face, corner, xyz)`` in the actor's frame."""
    return np.array([plate.triangles for plate in actor.plates]).reshape(-1, 3, 3)


def _cut(corners: FloatArray, size: float) -> FloatArray:
    """Triangles ``(face, corner, xyz)``, halved until no edge is longer than ``size``, m."""
    done = []
    while len(corners):
        edge = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)
        long = edge.max(axis=1) > size
        done.append(corners[~long])
        first = np.argmax(edge, axis=1)[long]
        turned = np.take_along_axis(
            corners[long], ((first[:, None] + np.arange(3)) % 3)[..., None], axis=1
        )
        half = 0.5 * (turned[:, 0] + turned[:, 1])
        corners = np.concatenate(
            [
                np.stack([turned[:, 0], half, turned[:, 2]], axis=1),
                np.stack([half, turned[:, 1], turned[:, 2]], axis=1),
            ]
        )
    return np.concatenate(done)


def refuse_radar_inside_body(scene: Scene) -> None:
    """Check that no radar is inside a body or below a road.

    `InputError` is raised if a radar is inside a closed mesh (its own vehicle's body too), inside a
    building, or below the road. Faces of sheets that transmit `VISIBLE_POWER`, such as bumpers, do
    not count.
    """
    for radar, position in zip(scene.radars, scene.radar_position, strict=True):
        for actor in scene.actors:
            place = actor.pose.to_inner(position)
            if _is_in_mesh(actor, place) or _is_in_box(actor, place):
                raise InputError(
                    f"radar '{radar.name}' is inside '{actor.name}'; move its mount outwards"
                )
            if actor.kind == "road" and _is_below(actor, place):
                raise InputError(f"radar '{radar.name}' is below '{actor.name}'; raise its mount")


def _is_in_mesh(actor: Actor, place: FloatArray) -> bool:
    mesh = actor.mesh
    if not mesh.num_faces:
        return False
    solid = np.array([not _is_sheet(name) for name in mesh.materials])[mesh.material]
    corners = mesh.corners[solid]
    if not len(corners) or not _is_within(corners.reshape(-1, 3), place):
        return False
    return bool(winding_numbers(corners, place[None])[0] > ENCLOSED_SHARE)


def _is_sheet(material: str) -> bool:
    from polychirp.channel.materials.fresnel import power_through

    row = known_materials().get(material)
    return row is not None and power_through(row, 79e9) >= VISIBLE_POWER


def _is_within(points: FloatArray, place: FloatArray) -> bool:
    """True if a place is strictly within the axis-parallel box of points."""
    return bool(np.all((points.min(axis=0) < place) & (place < points.max(axis=0))))


def _is_in_box(actor: Actor, place: FloatArray) -> bool:
    """True if a place is behind all plates of an actor, and within the box that they span."""
    if actor.kind == "road" or not actor.plates:
        return False
    behind = all(np.dot(place - plate.centre, plate.normal) < 0 for plate in actor.plates)
    return behind and _is_within(_plate_corners(actor).reshape(-1, 3), place)


def _is_below(actor: Actor, place: FloatArray) -> bool:
    """True if a place is under one of a road's plates."""
    for plate in actor.plates:
        gap = place - np.array(plate.centre)
        u, v = np.array(plate.half_u), np.array(plate.half_v)
        if gap @ plate.normal < 0 and abs(gap @ u) <= u @ u and abs(gap @ v) <= v @ v:
            return True
    return False
