"""Propagation of ray tubes over several reflections; `ray_tubes.paths` describes the method."""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import IntArray
from polychirp.channel.geometry.vectors import Vector, dot
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.ray_tubes.fields import (
    NO_DETOUR,
    Ray,
    is_strong,
    launched,
    mirrored,
    passed,
    reflected,
    settled,
    weakened,
)
from polychirp.channel.ray_tubes.flat_parts import NO_PART
from polychirp.channel.ray_tubes.intersections import (
    FACE,
    LEAST_COSINE,
    NO_BODY,
    NO_INTERSECTION,
    NO_SURFACE,
    PANE,
    PLATE,
    Contact,
    Intersection,
    Notes,
    Space,
    contact,
    fade,
    is_behind,
    is_in_front,
    is_near_leaves,
    is_sheet,
    meet,
    meet_body,
    turned_over,
)
from polychirp.channel.ray_tubes.launch_grid import Launch
from polychirp.channel.ray_tubes.radiation import HIT, Hits, record
from polychirp.channel.scene.blockers import Blockers
from polychirp.channel.scene.world import RADAR_CLEARANCE
from polychirp.jit import borrowed, compiled, inlined, inner
from polychirp.threads import in_ranges

TUBES_PER_CHUNK: Final = 256
"""Number of tubes in a chunk, which one thread follows as a unit of work (chosen)."""

HITS_PER_BOUNCE: Final = 2
"""Number of hits for which memory is reserved per tube and reflection after the first (chosen). It
exceeds 1 since rays branch at sheets. If that is too few, all tubes are traced again with more."""

MIN_STEP: Final = 1e-6
"""Distance, m, behind a surface that a ray leaves, at which the search for the next intersection
begins. Chosen: above the rounding of positions, so that the ray does not meet the point again."""


class Tubes(NamedTuple):
    """Some tubes of a launch window: the number and the greatest count of reflections of each."""

    number: IntArray
    max_turns: IntArray


class Tracing(NamedTuple):
    """Scene, limits and memory for the rays of one tube.

    ``wavenumber`` is in 1/m; ``max_turns`` limits the reflections of a ray; ``waiting`` holds the
    rays still to be followed, each with its next intersection; ``notes`` is memory for searches.
    """

    space: Space
    media: Media
    wavenumber: float
    max_turns: int
    waiting: list[tuple[Ray, Intersection]]
    notes: Notes


@inlined
def clearance(at: Contact, direction: Vector) -> float:
    """Distance, m, along a ray from a contact at which the search for the next one begins.

    A point of a curved surface may lie behind the facet that stands for it.
    """
    cosine = dot(direction, at.facet)
    depth = -at.height if cosine > 0.0 else at.height
    return MIN_STEP + 2.0 * max(depth, 0.0) / max(abs(cosine), LEAST_COSINE)


@inlined
def _leads_on(tracing: Tracing, met: Intersection, direction: Vector, turns: int) -> bool:
    """True if a ray with ``turns`` reflections can still end on a body after the intersection."""
    if met.kind == FACE:
        # a face reflects only on its front: most rays inside a vehicle meet the back of a panel
        scatters = tracing.space.body[met.number]["scatters"]
        return bool(scatters and is_in_front(tracing.space, met, direction))
    if met.kind == PLATE and not tracing.space.plate_is_pane[met.number]:
        return 0 < turns < tracing.max_turns - 1
    return met.kind != NO_SURFACE


@inlined
def _pass(tracing: Tracing, ray: Ray, met: Intersection, at: Contact) -> None:
    """Pass a ray through a sheet; add it to ``waiting`` if it leads on and is strong enough."""
    home = met.number if met.kind == PANE else NO_BODY
    next_met = meet(
        tracing.space, at.point, ray.direction, clearance(at, ray.direction), NO_INTERSECTION,
        home, tracing.notes,
    )  # fmt: skip
    if _leads_on(tracing, next_met, ray.direction, ray.turns):
        behind = passed(ray, at, tracing.media, tracing.wavenumber)
        if is_strong(behind):
            tracing.waiting.append((behind, next_met))


@inlined
def _reflect(
    tracing: Tracing,
    ray: Ray,
    met: Intersection,
    at: Contact,
    first_body: int,
    hits: Hits,
    count: int,
) -> int:
    """Reflect a ray and add it to ``waiting`` if it leads on and is strong enough.

    A hit is recorded if the surface is a body's and the ray was reflected by a body before. The
    function returns the number of hits so far; hits that do not fit into ``hits`` are only counted.
    """
    normal, roughness = at.normal, tracing.media.roughness[at.medium]
    is_plate, next_met, after = met.kind == PLATE, NO_INTERSECTION, ray.direction
    if ray.turns + 1 < tracing.max_turns:
        after = mirrored(ray.direction, normal)
        home = NO_BODY if is_plate else met.number
        # a ray that a curved surface would throw into its own facet ends there
        if dot(after, at.facet) > 0.0:
            next_met = meet(
                tracing.space, at.point, after, clearance(at, after), NO_INTERSECTION, home,
                tracing.notes,
            )  # fmt: skip
    goes_on = _leads_on(tracing, next_met, after, ray.turns + 1)
    is_last = not is_plate and ray.num_bodies > 0
    # fields take most of the time: they are computed only for a hit or a ray that goes on
    if not (goes_on or is_last):
        return count
    turned = reflected(ray, at, tracing.media, tracing.wavenumber)
    if is_last:
        if count < hits.size:
            record(hits[count], ray, turned, at, roughness)
            hits[count]["body"] = met.number
            hits[count]["part"][0] = turned.part if turned.turns == 2 else NO_PART
            hits[count]["part"][1] = at.part
        count += 1
    if goes_on:
        if is_plate:
            surface = 0, NO_DETOUR - 1 - met.number
        else:
            surface = 1, NO_DETOUR if met.number == first_body else met.number
        turned = settled(ray, turned, at, tracing.media, tracing.wavenumber, surface)
        if is_strong(turned):
            tracing.waiting.append((turned, next_met))
    return count


@inlined
def _follow(tracing: Tracing, faces: Blockers, first_body: int, hits: Hits, count: int) -> int:
    """Follow all rays in ``waiting`` and their branches; return the number of hits so far."""
    space = tracing.space
    while len(tracing.waiting) > 0:
        ray, met = tracing.waiting.pop()
        at = contact(space, ray.point, ray.direction, met)
        if is_near_leaves(space, ray.point, ray.direction, met.distance):
            loss = fade(space, faces, tracing.media, ray.point, ray.direction, met.distance)
            ray = weakened(ray, loss, 0, ray.detour)
        is_body, is_within = met.kind != PLATE, dot(ray.direction, at.normal) > 0.0
        if is_sheet(space, met):
            # a sheet acts alike on both sides: its normal is turned towards the ray
            if is_within:
                at = turned_over(at)
            _pass(tracing, ray, met, at)
            if is_within and is_body and space.body[met.number]["is_vehicle"]:
                continue
        # the first reflection must be by the body that the launch window encloses
        is_turn = ray.num_bodies > 0 or (is_body and met.number == first_body)
        if dot(ray.direction, at.normal) >= 0.0 or not is_turn:
            continue
        if is_body and not space.body[met.number]["scatters"]:
            continue
        count = _reflect(tracing, ray, met, at, first_body, hits, count)
    return count


@inner
def _trace_some(
    launch: Launch,
    tubes: Tubes,
    space: Space,
    faces: Blockers,
    media: Media,
    wavenumber: float,
    hits: Hits,
) -> int:
    """Follow some tubes of a window; return the number of hits, also of those that did not fit."""
    count, body = 0, launch.body
    has_hider, hider = False, body
    notes = np.empty(space.room, dtype=np.float32)
    # Numba needs the type of the empty list's items
    waiting = [(launched(launch, launch.columns), NO_INTERSECTION) for _ in range(0)]
    for place in range(tubes.number.size):
        ray = launched(launch, tubes.number[place])
        p, d = ray.point, ray.direction
        # a body that hid the window's body from one tube often hides it from the next
        if has_hider and is_behind(space, hider, body, p, d, notes):
            continue
        alone = meet_body(space, body, p, d, (RADAR_CLEARANCE, np.inf), notes)
        if alone.kind == NO_SURFACE:
            continue
        met = meet(space, p, d, RADAR_CLEARANCE, alone, body, notes)
        if met.kind == PLATE and not space.plate_is_pane[met.number]:
            continue
        if met.kind == FACE and met.number != body:
            has_hider, hider = True, met.number
            continue
        waiting.append((ray, met))
        tracing = Tracing(space, media, wavenumber, tubes.max_turns[place], waiting, notes)
        before = count
        count = _follow(tracing, faces, body, hits, count)
        for i in range(before, min(count, hits.size)):
            hits[i]["first_body"], hits[i]["tube"] = body, tubes.number[place]
    return count


@compiled
def _trace(
    begin: int,
    end: int,
    launch: Launch,
    tubes: Tubes,
    space: Space,
    faces: Blockers,
    media: Media,
    wavenumber: float,
    hits: Hits,
    counts: IntArray,
) -> None:
    """Fill the rows ``begin:end`` of ``hits`` ``(chunk, hit)`` and ``counts`` ``(chunk,)``.

    A count may exceed the length of its row of ``hits``; the hits beyond that length are lost.
    """
    launch, tubes, space = borrowed(launch), borrowed(tubes), borrowed(space)
    faces, media, hits = borrowed(faces), borrowed(media), borrowed(hits)
    for chunk in range(begin, end):
        some = slice(chunk * TUBES_PER_CHUNK, (chunk + 1) * TUBES_PER_CHUNK)
        part = Tubes(tubes.number[some], tubes.max_turns[some])
        counts[chunk] = _trace_some(launch, part, space, faces, media, wavenumber, hits[chunk])


def hits_of(
    launch: Launch, tubes: Tubes, space: Space, faces: Blockers, media: Media, wavenumber: float
) -> Hits:
    """Hits of some tubes of a window, in the order of the tubes; ``wavenumber`` in 1/m."""
    num_chunks = -(-len(tubes.number) // TUBES_PER_CHUNK)
    most = HITS_PER_BOUNCE * TUBES_PER_CHUNK * (int(np.max(tubes.max_turns, initial=2)) - 1)
    while True:
        room = most
        hits = np.empty((num_chunks, room), dtype=HIT)
        counts = np.zeros(num_chunks, dtype=np.int64)
        what = launch, tubes, space, faces, media, wavenumber
        in_ranges(_trace, num_chunks, *what, hits, counts)
        most = int(np.max(counts, initial=0))
        if most <= room:
            is_filled = np.arange(room) < counts[:, None]
            return hits.reshape(-1).take(np.flatnonzero(is_filled))
