"""Legs from receivers to hits of tubes: which are not blocked, and what they transmit."""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, dot, plus, vector
from polychirp.channel.geometry.wide_bvh import OPAQUE_KIND, SHEET_KIND
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.physical_optics.kernels import SHADOW_RAY_LIFT
from polychirp.channel.physical_optics.views import View
from polychirp.channel.ray_tubes.intersections import Notes, Space, is_hit, is_in_reach
from polychirp.channel.ray_tubes.radiation import Hits
from polychirp.channel.scene.blockers import Blockers, crosses_plate
from polychirp.channel.scene.transmission import Leg, Wave, transmission_matrix
from polychirp.channel.scene.world import RADAR_CLEARANCE
from polychirp.jit import borrowed, compiled, inlined, inner
from polychirp.threads import in_ranges

FEWEST_HITS: Final = 64
"""Least hits per parallel call of a kernel (chosen: fewer do not repay the call)."""

HITS_PER_SHADOW_TEST: Final = 512
"""Hits tested for shadow before the rest's power is compared with `StopRule` again (chosen)."""

BODIES, PLATES, PANES, VEILED_BODIES = 0, 1, 2, 3
"""Kinds in `Obstacles`, in the order of `View.near`: all bodies; opaque plates; sheets among
plates; bodies with sheets or leaves, which attenuate the wave."""


class Obstacles(NamedTuple):
    """Bodies and plates that may block or weaken the legs between one receiver and every body.

    Obstacles of kind k on the leg to body b are ``number[start[k, b]:start[k, b + 1]]``.
    """

    number: IntArray
    start: IntArray


def obstacles_of(views: list[View]) -> Obstacles:
    """Obstacles of one receiver, from its ``views`` by all bodies in the bodies' order."""
    lists = [view.near[kind] for kind in (BODIES, PLATES, PANES, VEILED_BODIES) for view in views]
    ends = np.cumsum([len(numbers) for numbers in lists]).reshape(4, -1)
    start = np.column_stack([np.concatenate([[0], ends[:-1, -1]]), ends])
    return Obstacles(np.concatenate(lists), start)


@inlined
def _obstacles(table: Obstacles, kind: int, body: int) -> IntArray:
    """Obstacles of one kind on the leg to a body."""
    return table.number[table.start[kind, body] : table.start[kind, body + 1]]


@inlined
def _lifted(hit: np.void) -> Vector:
    """The hit's point, `SHADOW_RAY_LIFT` in front of the surface."""
    return plus(vector(hit["point"]), vector(hit["normal"]), SHADOW_RAY_LIFT)


@inlined
def _heading(start: Vector, end: Vector) -> tuple[Vector, float]:
    """Unit vector and length of a leg, m; the length is 1e-12 m at least."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = max(math.sqrt(dot(way, way)), 1e-12)
    return (way[0] / length, way[1] / length, way[2] / length), length


@inner
def _is_hidden(
    space: Space, bodies: IntArray, plates: IntArray, start: Vector, end: Vector, notes: Notes
) -> bool:
    """True if a body or plate blocks a leg from radar to point; see `occlusion.is_blocked`."""
    direction, length = _heading(start, end)
    span, way = (RADAR_CLEARANCE, length), (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    if length <= RADAR_CLEARANCE:
        return False
    for p in plates:
        if crosses_plate(space.plate, p, start, way, RADAR_CLEARANCE / length):
            return True
    for b in bodies:  # noqa: SIM110 (compiled code knows no generators)
        if is_hit(space, b, start, direction, span, OPAQUE_KIND, notes):
            return True
    return False


@inner
def _find_veils(
    space: Space, bodies: IntArray, start: Vector, end: Vector, notes: Notes, found: IntArray
) -> int:
    """Fill ``found`` with the bodies that veil the leg from a radar to a point; return their count.

    These are the bodies with a sheet on the leg, or with leaves and the leg within their reach.
    """
    direction, length = _heading(start, end)
    span, size = (RADAR_CLEARANCE, length), 0
    for b in bodies:
        body = space.body[b]
        if (body["has_leaves"] and is_in_reach(body, start, direction, span)) or is_hit(
            space, b, start, direction, span, SHEET_KIND, notes
        ):
            found[size] = b
            size += 1
    return size


@compiled
def _find_visible(
    begin: int,
    end: int,
    space: Space,
    obstacles: Obstacles,
    hits: Hits,
    sink: FloatArray,
    which: IntArray,
    out: BoolArray,
) -> None:
    """Mark in ``out`` the hits ``which`` with nothing opaque on the leg to the receiver."""
    space, obstacles, hits = borrowed(space), borrowed(obstacles), borrowed(hits)
    start = vector(sink)
    notes = np.empty(space.room, dtype=np.float32)
    for i in range(begin, end):
        hit = hits[which[i]]
        bodies = _obstacles(obstacles, BODIES, hit["body"])
        plates = _obstacles(obstacles, PLATES, hit["body"])
        out[i] = not _is_hidden(space, bodies, plates, start, _lifted(hit), notes)


def last_legs(
    space: Space,
    faces: Blockers,
    media: Media,
    obstacles: Obstacles,
    hits: Hits,
    sink: FloatArray,
    upwards: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """Transmission of sheets and leaves on legs from a receiver to hits, ``(hit, 2, 2)``."""
    out = np.zeros((len(hits), 2, 2), dtype=np.complex128)
    what = space, faces, media, obstacles, hits, sink, Wave(upwards, wavenumber)
    in_ranges(_fill_last_legs, len(hits), *what, out, least=FEWEST_HITS)
    return out


@compiled
def _fill_last_legs(
    begin: int,
    end: int,
    space: Space,
    faces: Blockers,
    media: Media,
    obstacles: Obstacles,
    hits: Hits,
    sink: FloatArray,
    wave: Wave,
    out: ComplexArray,
) -> None:
    space, faces, media = borrowed(space), borrowed(faces), borrowed(media)
    obstacles, hits = borrowed(obstacles), borrowed(hits)
    notes, veils = (
        np.empty(space.room, dtype=np.float32),
        np.empty(space.body.size, dtype=np.int64),
    )
    for i in range(begin, end):
        body, leg = hits[i]["body"], Leg(vector(sink), _lifted(hits[i]))
        out[i, 0, 0] = out[i, 1, 1] = 1.0
        bodies, plates = (
            _obstacles(obstacles, VEILED_BODIES, body),
            _obstacles(obstacles, PANES, body),
        )
        there = veils[: _find_veils(space, bodies, leg.start, leg.end, notes, veils)]
        if there.size + plates.size > 0:
            transmission_matrix(faces, media, wave, there, plates, leg, RADAR_CLEARANCE, out[i])


class HitPowers(NamedTuple):
    """``number`` of some hits, and their estimated ``power`` at a receiver if they are visible."""

    number: IntArray
    power: FloatArray


class StopRule(NamedTuple):
    """Limits below which the weaker hits are not tested for shadow.

    The tests stop if the sum of the untested hits' powers is below ``share`` of the visible hits'
    or below ``floor``, or if the power of the sum of their amplitudes, as if in phase, is below
    ``floor_in_phase``. The floors are in the unit of `HitPowers.power`.
    """

    share: float
    floor: float = 0.0
    floor_in_phase: float = 0.0


def visible_hits(
    space: Space,
    obstacles: Obstacles,
    hits: Hits,
    sink: FloatArray,
    some: HitPowers,
    stop: StopRule,
) -> HitPowers:
    """The hits among ``some`` that a receiver sees, strongest first, until ``stop`` applies."""
    order = np.argsort(-some.power, kind="stable")
    number, power = some.number[order], some.power[order]
    rest = np.cumsum(power[::-1])[::-1]
    in_phase = np.cumsum(np.sqrt(power)[::-1])[::-1] ** 2
    is_seen, total = np.zeros(len(order), dtype=np.bool_), 0.0
    for begin in range(0, len(order), HITS_PER_SHADOW_TEST):
        if rest[begin] < max(stop.share * total, stop.floor):
            break
        if in_phase[begin] < stop.floor_in_phase:
            break
        part = slice(begin, begin + HITS_PER_SHADOW_TEST)
        what = space, obstacles, hits, sink, number[part]
        in_ranges(_find_visible, len(number[part]), *what, is_seen[part], least=FEWEST_HITS)
        total += float(np.sum(power[part][is_seen[part]]))
    return HitPowers(number[is_seen], power[is_seen])
