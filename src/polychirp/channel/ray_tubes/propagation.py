"""Kernels that follow ray tubes; `tubes` says what they compute and why."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.bvh import Vector
from polychirp.channel.geometry.vectors import dot
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.ray_tubes.fields import (
    Ray,
    ahead,
    bounced,
    is_heard,
    launched,
    mirrored,
    passed,
    weakened,
)
from polychirp.channel.ray_tubes.intersections import (
    FACE,
    FILLED,
    IS_PANE,
    NOTHING,
    PANE,
    PLATE,
    SCATTERS,
    Meeting,
    Space,
    fade,
    is_behind,
    is_in_front,
    is_near_leaves,
    meet,
    meet_body,
    surface_of,
)
from polychirp.channel.ray_tubes.radiation import TUBE, Hits, record
from polychirp.channel.scene.blockers import Blockers
from polychirp.channel.scene.world import SKIN

PER_CHUNK = 256
"""Rays that one thread follows at a time."""

OFF = 1e-6
"""m by which a ray has to be off a surface to meet another."""

MISS: Meeting = (np.inf, NOTHING, -1, 0)

Waiting = list[tuple[Ray, Meeting]]
"""Rays and what they meet, to be looked at yet."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _leads_on(met: Meeting, direction: Vector, space: Space, turns: int, most_turns: int) -> bool:
    """Whether a ray that has turned so often may bring anything at what it meets."""
    if met[1] == FACE:
        # most rays that come in by a window end at the back of a panel
        return bool(space.body[met[2], SCATTERS] > 0.0) and is_in_front(space, met, direction)
    if met[1] == PLATE and space.plate[met[2], IS_PANE] == 0.0:
        return 0 < turns < most_turns - 1
    return met[1] != NOTHING


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _pass(
    ray: Ray,
    point: Vector,
    met: Meeting,
    surface: tuple[Vector, int],
    space: Space,
    media: Media,
    limits: tuple[int, float],
    waiting: Waiting,
    boxes: NDArray[np.float32],
) -> None:
    """Let a ray through a sheet at a point; it waits if it meets anything behind."""
    home = met[2] if met[1] == PANE else -1
    next_met = meet(space, point, ray.direction, OFF, MISS, home, boxes)
    if _leads_on(next_met, ray.direction, space, ray.turns, limits[0]):
        behind = passed(ray, point, met[0], surface[0], media, surface[1], limits[1])
        if is_heard(behind):
            waiting.append((behind, next_met))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _bounce(  # noqa: PLR0913, PLR0917 (flat, as parallel loops take them)
    ray: Ray,
    point: Vector,
    met: Meeting,
    surface: tuple[Vector, int, Vector],
    space: Space,
    media: Media,
    limits: tuple[int, float],
    waiting: Waiting,
    boxes: NDArray[np.float32],
    hits: Hits,
    slots: tuple[int, int],
) -> int:
    """Keep where a ray turns if that is a last body; it waits if it meets anything then."""
    distance, kind, number, _ = met
    normal, medium, velocity = surface
    most_turns, wavenumber = limits
    slot, next_met, after = slots[0], MISS, ray.direction
    if ray.turns + 1 < most_turns:
        after = mirrored(ray.direction, normal)
        home = -1 if kind == PLATE else number
        next_met = meet(space, point, after, OFF, MISS, home, boxes)
    goes_on = _leads_on(next_met, after, space, ray.turns + 1, most_turns)
    is_last = kind != PLATE and ray.met > 0
    # fields are dear: only for what leads somewhere
    if not (goes_on or is_last):
        return slot
    turned = bounced(ray, point, distance, normal, media, medium, wavenumber)
    if is_last:
        if slot < slots[1]:
            record(hits, slot, ray, turned, normal, number, media.roughness[medium])
        slot += 1
    if goes_on:
        cosine = -dot(ray.direction, normal)
        phase = wavenumber * media.roughness[medium] * cosine
        # v·(d − r): by Fermat's principle the point may glide along the surface
        rate = -2.0 * cosine * dot(velocity, normal)
        loss = math.exp(-2.0 * phase * phase) if phase != 0.0 else 1.0
        turned = weakened(turned, loss, rate, 0 if kind == PLATE else 1)
        if is_heard(turned):
            waiting.append((turned, next_met))
    return slot


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _follow(
    space: Space,
    faces: Blockers,
    media: Media,
    first_body: int,
    limits: tuple[int, float],
    waiting: Waiting,
    boxes: NDArray[np.float32],
    hits: Hits,
    slots: tuple[int, int],
) -> int:
    """Follow all rays that wait, and their branches.

    Fills hits from ``slots[0]`` on, and returns the slot after the last. Beyond ``slots[1]`` hits
    are counted, but not kept.
    """
    slot = slots[0]
    while len(waiting) > 0:
        ray, met = waiting.pop()
        distance, kind, number, _ = met
        normal, medium, velocity = surface_of(space, met)
        point = ahead(ray.point, ray.direction, distance)
        cosine = -dot(ray.direction, normal)
        if is_near_leaves(space, ray.point, ray.direction, distance):
            loss = fade(faces, media, space.body, ray.point, ray.direction, distance)
            ray = weakened(ray, loss, 0.0, 0)
        if kind == PANE or (kind == PLATE and space.plate[number, IS_PANE] > 0.0):
            is_within = cosine < 0.0
            # both faces of a sheet are alike
            if is_within:
                normal, cosine = (-normal[0], -normal[1], -normal[2]), -cosine
            _pass(ray, point, met, (normal, medium), space, media, limits, waiting, boxes)
            if is_within and kind == PANE and space.body[number, FILLED] > 0.0:
                continue
        is_body = kind != PLATE
        # the first to reflect is the window's body
        is_turn = ray.met > 0 or (is_body and number == first_body)
        if cosine <= 0.0 or not is_turn or (is_body and space.body[number, SCATTERS] == 0.0):
            continue
        slot = _bounce(
            ray,
            point,
            met,
            (normal, medium, velocity),
            space,
            media,
            limits,
            waiting,
            boxes,
            hits,
            (slot, slots[1]),
        )
    return slot


@njit(cache=True, nogil=True, error_model="numpy")
def _trace_some(
    window: FloatArray,
    tubes: tuple[int, IntArray, IntArray],
    space: Space,
    faces: Blockers,
    media: Media,
    first_body: int,
    wavenumber: float,
    hits: Hits,
    slots: tuple[int, int],
) -> int:
    """Follow some tubes of a window."""
    columns, numbers, most_turns = tubes
    slot, hider = slots[0], MISS[2]
    boxes = np.empty(space.room, dtype=np.float32)
    waiting = [(launched(window, columns, columns), MISS) for _ in range(0)]
    for place in range(numbers.size):
        tube = numbers[place]
        ray = launched(window, tube // columns, tube % columns)
        p, d = ray.point, ray.direction
        # what hid the body from a tube will often hide it from the next
        if hider >= 0 and is_behind(space, hider, first_body, p, d, boxes):
            continue
        alone = meet_body(space, first_body, p, d, (SKIN, np.inf), boxes)
        if alone[1] == NOTHING:
            continue
        met = meet(space, p, d, SKIN, alone, first_body, boxes)
        if met[1] == PLATE and space.plate[met[2], IS_PANE] == 0.0:
            continue
        if met[1] == FACE and met[2] != first_body:
            hider = met[2]
            continue
        waiting.append((ray, met))
        begin, limits = slot, (most_turns[place], wavenumber)
        slot = _follow(
            space, faces, media, first_body, limits, waiting, boxes, hits, (slot, slots[1])
        )
        hits.number[begin : min(slot, slots[1]), TUBE] = tube
    return slot


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def trace(
    window: FloatArray,
    tubes: tuple[int, IntArray, IntArray],
    space: Space,
    faces: Blockers,
    media: Media,
    first_body: int,
    wavenumber: float,
    hits: Hits,
    room: int,
) -> IntArray:
    """Hits of some tubes of a window; how many in every chunk, ``(chunk,)``.

    Chunk c fills ``hits`` from ``c * room`` on. If one needs more than its ``room``, its number
    says so, and what did not fit is lost.

    Parameters
    ----------
    window : `Window.rows`, ``(7, xyz)``
    tubes : number of the window's columns; numbers of the tubes, counted row by row; and the
        greatest number of reflections of each that is followed
    space, faces : the same world, as `tube_meetings.place_of` makes it
    wavenumber : 1/m
    """
    columns, numbers, most_turns = tubes
    num_chunks = (numbers.size + PER_CHUNK - 1) // PER_CHUNK
    counts = np.zeros(num_chunks, dtype=np.int64)
    for chunk in prange(num_chunks):
        slot = chunk * room
        begin, end = chunk * PER_CHUNK, (chunk + 1) * PER_CHUNK
        counts[chunk] = -slot + _trace_some(
            window,
            (columns, numbers[begin:end], most_turns[begin:end]),
            space,
            faces,
            media,
            first_body,
            wavenumber,
            hits,
            (slot, slot + room),
        )
    return counts
