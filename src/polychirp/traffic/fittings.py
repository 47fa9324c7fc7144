"""Parts of a vehicle that echo beside its shell: plates, beams, lamps, rims, handles, tow bar.

Shells are smooth and curved, so they mirror to a radar from single points. Real vehicles also have
flat metal that stands upright, and cavities that return a wave after two or three reflections.

=============== ================================================== ==============================
fitting         size                                               source
=============== ================================================== ==============================
number plates   520 mm by 110 mm; strokes of 75 mm by 47.5 mm,     FZV, annex 4 (Germany)
                10 mm wide
                upright within 5°, or inclined upwards by up to    Regulation (EU) 1003/2010,
                30°; upper edge at 1.20 m at most                  annex II
bumper beams    100 mm high, 405 mm to 505 mm over the ground      RCAR bumper test; 49 CFR 581
                                                                   (16 to 20 inches)
tow bar         ball of 50 mm                                      ISO 1103
rear lock rods  27 mm thick                                        chosen, as on box trailers
all else                                                           chosen as typical
=============== ================================================== ==============================

**Cavities.** Lamps, exhausts and wheels are open to the front with walls inside, at right angles:
a wave of two or three reflections returns to where it came from, over a wide range of aspects. The
tracer sees them with ``max_bounces`` of 2 and more; from one bounce it has their floors alone. The
paraboloids and steps of real lamps are left out: a lamp is a box of aluminised walls as large as
one reflector. Rims are open between five spokes as far as the brake disc.
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.spec import Spec
from polychirp.traffic.outline import Outline
from polychirp.traffic.surface import FINEST_EDGE, Fineness, SurfaceBuilder
from polychirp.traffic.vehicle_parts import sheet
from polychirp.units import Unit

PLATE_SIZE: Final = (0.52, 0.11)
"""Width and height of a number plate, m: Germany, FZV, annex 4, and most of Europe."""

CHARACTER: Final = (0.0475, 0.075, 0.01)
"""Width and height of a character of a number plate and width of its strokes, m: FZV, annex 4."""

CHARACTER_PITCH: Final = 0.06
"""Distance of the characters' middles, m; chosen: eight on a plate."""

EMBOSSING: Final = 1.0e-3
"""Height of embossed characters over the plate, m; chosen: a quarter of a wavelength, as real ones
of about 1 mm. Each character is modelled as an upright rectangle of strokes, like an O."""

PLATE_GAP: Final = 0.006
"""Distance from the outermost plastic or metal to the middle of a number plate, m; chosen."""

FRONT_PLATE_HEIGHT: Final = 0.38
"""Height of the middle of the front plate, m; chosen: below a radar in the middle of the bumper."""

REAR_PLATE_RISE: Final = 0.12
"""Height of the middle of the rear plate over the ledge of the rear bumper, m; chosen."""

BEAM: Final = (0.405, 0.505)
"""Lower and upper edge of bumper beams, m: the zone that the RCAR bumper test and 49 CFR 581
(16 to 20 inches) ask for. The face is upright and flat in vertical section."""

BEAM_GAP: Final = 0.08
"""Distance from a bumper's plastic in to the beam, m; chosen: the depth of its foam."""

BEAM_SHARE: Final = 0.66
"""Length of a beam over the vehicle's width; chosen: from rail to rail and a little more."""

RADIATOR: Final = (0.62, 0.28, 0.66)
"""Width, lower and upper edge of the radiator, m; chosen for a car, flat and metal."""

RADIATOR_LEAN: Final = math.radians(4.0)
"""Angle by which the radiator's face is turned up, rad; chosen."""

RADIATOR_GAP: Final = 0.10
"""Distance from the beam back to the middle of the radiator, m; chosen."""

SHADED_ROW: Final = 0.25
"""Height of the rows of facets of radiator and beam over ``max_edge``. Facets are lit or dark as a
whole, and edges of plate and beam, which are level, cast their shadows on them."""

LAMP: Final = (0.11, 0.075, 0.05)
"""Width, height and depth of the chamber of a lamp, m; chosen."""

HANDLE: Final = (0.17, 0.012)
"""Length and radius of a door handle, m; chosen: half a round bar of metal."""

PIPE: Final = (0.035, 0.15, 12)
"""Radius and depth of an exhaust pipe, m, and number of its sides; chosen."""

TOW_BALL: Final = (0.025, 0.39, 0.1)
"""Radius of a tow bar's ball (ISO 1103), height of its middle (within the 350 to 420 mm of UN
Regulation 55), and its distance behind the plastic, m."""

ROD: Final = (0.0135, 0.16, 0.56)
"""Radius of the lock rods of a box's rear doors, and their distances from the middle, m; chosen."""


ROUND_COARSENESS: Final = 1.0
"""Factor on `edge_limit` for rods, handles and balls (chosen). With 2, as for wheels, lock rods
were wrong by −8 dB of their power and handles by −3 dB, mostly in phase; with 1, by −20 dB."""


BEAM_COARSENESS: Final = 0.5
"""Factor on `edge_limit` for beams, which give a car's strongest echo ahead. With 1, a beam echoes
0.7 dB too strongly at 10 m, beside an integral over its face; with 0.5, 0.1 dB."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fittings(Spec):
    """Parts of a vehicle that echo beside its smooth shell; see the module for sizes and sources.

    Parameters
    ----------
    number_plates : flat metal plates with embossed characters at front and rear
    plate_tilt : rad, by which a number plate's face is turned up
    bumper_beams : upright beams of metal behind the plastic of the bumpers
    radiator : flat metal behind the front beam
    lamps : chambers of metal behind the plastic at front and rear
    open_rims : spokes before a rim that is open as far as the brake disc; otherwise rims are closed
    door_handles : bars of metal
    exhaust : pipes of metal below the rear bumper
    tow_bar : a ball behind the rear bumper

    Examples
    --------
    >>> Fittings(number_plates=False).plate_tilt
    0.0873
    """

    number_plates: bool = True
    plate_tilt: Annotated[float, Unit("rad", least="-30 deg", greatest="30 deg")] = math.radians(
        5.0
    )
    bumper_beams: bool = True
    radiator: bool = True
    lamps: bool = True
    open_rims: bool = True
    door_handles: bool = True
    exhaust: bool = True
    tow_bar: bool = False


def x_at(outline: Outline, y: float, facing: int) -> float:
    """X, m, where an outline's front (``facing`` 1) or rear (−1) is ``y`` (m) off the middle."""
    arcs = (0, 1) if facing > 0 else (4, 3)
    angles = [np.linspace(*outline.angles(arc), 200)[::facing] for arc in arcs]
    points = np.concatenate(
        [outline.point(arc, angle) for arc, angle in zip(arcs, angles, strict=True)]
    )
    return float(np.interp(y, points[:, 1], points[:, 0]))


def number_plate(
    builder: SurfaceBuilder,
    fine: Fineness,
    *,
    x: float,
    z: float,
    tilt: float,
    facing: int,
    part: str,
) -> None:
    """Add the left half of a number plate: flat, with embossed strokes that stand off its face.

    ``x`` and ``z`` are those of its middle, m; ``facing`` is 1 for the front and −1 for the rear.
    """
    outward = np.array([facing * math.cos(tilt), 0.0, math.sin(tilt)])
    up = np.array([-facing * math.sin(tilt), 0.0, math.cos(tilt)])
    for (right, left), (low, high), is_raised in _plate_cells():
        middle = np.array([x, 0.0, z]) + is_raised * EMBOSSING * outward
        corners = [
            middle + np.array([0.0, y, 0.0]) + w * up
            for y, w in ((right, low), (left, low), (left, high), (right, high))
        ]
        _facing(builder, fine, corners, outward, part=part, material="metal")


def _plate_cells() -> list[tuple[tuple[float, float], tuple[float, float], bool]]:
    """Rectangles of the left half of a plate: limits across, limits up, m, and if raised."""
    width, height, stroke = CHARACTER
    half, edge = PLATE_SIZE[0] / 2, PLATE_SIZE[1] / 2
    outer, inner = height / 2, height / 2 - stroke
    count = int(half / CHARACTER_PITCH)
    cells = []
    for number in range(count):
        middle = (number + 0.5) * CHARACTER_PITCH
        ends = (number * CHARACTER_PITCH, (number + 1) * CHARACTER_PITCH)
        a, b = middle - width / 2, middle - width / 2 + stroke
        c, d = middle + width / 2 - stroke, middle + width / 2
        for across in ((ends[0], a), (d, ends[1])):
            cells.append((across, (-edge, edge), False))
        for across in ((a, b), (c, d)):
            cells += [(across, (-edge, -outer), False), (across, (-outer, outer), True)]
            cells.append((across, (outer, edge), False))
        levels = (-edge, -outer, -inner, inner, outer, edge)
        for level, is_raised in enumerate((False, True, False, True, False)):
            cells.append(((b, c), (levels[level], levels[level + 1]), is_raised))
    cells.append(((count * CHARACTER_PITCH, half), (-edge, edge), False))
    return cells


def bumper_beam(
    builder: SurfaceBuilder,
    fine: Fineness,
    *,
    x: float,
    radius: float,
    length: float,
    facing: int,
    part: str,
) -> None:
    """Add the left half of a beam of ``radius`` (m) from above, with its middle at ``x`` (m)."""
    fine = replace(fine, coarseness=BEAM_COARSENESS * fine.coarseness)
    stop = math.asin(length / 2 / radius)
    turn = np.linspace(0.0, stop, fine.steps(radius * stop, radius) + 1)
    place = np.column_stack([x + facing * radius * (np.cos(turn) - 1), radius * np.sin(turn)])
    lines = [
        builder.line(np.column_stack([place, np.full(len(turn), z)]))
        for z in _shaded_rows(fine, *BEAM)
    ]
    builder.net(lines[::facing], part=part, material="metal")


def radiator(builder: SurfaceBuilder, fine: Fineness, *, x: float) -> None:
    """Add the left half of a flat radiator with its middle at ``x`` (m)."""
    width, low, high = RADIATOR
    middle, lean = 0.5 * (low + high), math.tan(RADIATOR_LEAN)
    for below, above in pairwise(_shaded_rows(fine, low, high)):
        corners = [
            np.array([x - lean * (z - middle), y, z])
            for y, z in ((0.0, below), (width / 2, below), (width / 2, above), (0.0, above))
        ]
        _facing(builder, fine, corners, np.array([1.0, 0, 0]), part="radiator", material="metal")


def _shaded_rows(fine: Fineness, low: float, high: float) -> list[float]:
    """Heights, m, between rows of facets that lie in shadows with level edges."""
    edge = max(FINEST_EDGE, SHADED_ROW * fine.max_edge)
    rows: list[float] = np.linspace(low, high, math.ceil((high - low) / edge - 1e-9) + 1).tolist()
    return rows


def lamp(
    builder: SurfaceBuilder,
    fine: Fineness,
    *,
    x: float,
    y: float,
    z: float,
    facing: int,
    part: str,
    has_cover: bool,
) -> None:
    """Add the chamber of a lamp, open at ``x`` (m) towards its side, and its cover of plastic."""
    width, height, depth = LAMP
    back = x - facing * depth
    near, far = y - width / 2, y + width / 2
    low, high = z - height / 2, z + height / 2
    ring = [(near, low), (far, low), (far, high), (near, high)]
    middle = np.array([0.5 * (x + back), y, z])
    for (y1, z1), (y2, z2) in zip(ring, [*ring[1:], ring[0]], strict=True):
        wall = [np.array(c) for c in ((x, y1, z1), (x, y2, z2), (back, y2, z2), (back, y1, z1))]
        inward = middle - np.mean(wall, axis=0)
        _facing(builder, fine, wall, inward, part=part, material="metal")
    out = np.array([float(facing), 0.0, 0.0])
    floor = [np.array([back, a, b]) for a, b in ring]
    _facing(builder, fine, floor, out, part=part, material="metal")
    if has_cover:
        cover = [np.array([x, a, b]) for a, b in ring]
        _facing(builder, fine, cover, out, part=f"{part}-cover", material="plastic")


def pipe(builder: SurfaceBuilder, *, x: float, y: float, z: float, part: str) -> None:
    """Add an exhaust pipe that is open to the rear at ``x`` (m), seen from inside, with a floor."""
    radius, depth, sides = PIPE
    turn = np.arange(sides) * 2 * math.pi / sides
    ring = np.column_stack([y + radius * np.cos(turn), z + radius * np.sin(turn)])
    rear, front = (
        builder.line(np.column_stack([np.full(sides, at), ring])) for at in (x, x + depth)
    )
    rear, front = np.append(rear, rear[0]), np.append(front, front[0])
    builder.strip(rear, front, part=part, material="metal")
    hub = builder.line(np.array([[x + depth, y, z]]))
    builder.strip(front, hub, part=part, material="metal")


def door_handle(
    builder: SurfaceBuilder, fine: Fineness, *, x: float, y: float, z: float, part: str
) -> None:
    """Add half a round bar along the vehicle, with its middle at ``x``, and its axis at ``y``."""
    length, radius = HANDLE
    fine = replace(fine, coarseness=ROUND_COARSENESS * fine.coarseness)
    turn = np.linspace(-math.pi / 2, math.pi / 2, fine.steps(math.pi * radius, radius) + 1)
    along = np.linspace(x + length / 2, x - length / 2, fine.steps(length) + 1)
    lines = [
        builder.line(
            np.column_stack(
                [
                    along,
                    np.full_like(along, y + radius * math.cos(a)),
                    np.full_like(along, z + radius * math.sin(a)),
                ]
            )
        )
        for a in turn
    ]
    builder.net(lines, part=part, material="metal")


def lock_rod(
    builder: SurfaceBuilder, fine: Fineness, *, x: float, y: float, limits: tuple[float, float]
) -> None:
    """Add the rear half of an upright round rod between two heights (m)."""
    radius, fine = ROD[0], replace(fine, coarseness=ROUND_COARSENESS * fine.coarseness)
    turn = np.linspace(math.pi / 2, 3 * math.pi / 2, fine.steps(math.pi * radius, radius) + 1)
    heights = np.linspace(*limits, fine.steps(limits[1] - limits[0]) + 1)
    lines = [
        builder.line(
            np.column_stack(
                [
                    np.full_like(heights, x + radius * math.cos(a)),
                    np.full_like(heights, y + radius * math.sin(a)),
                    heights,
                ]
            )
        )
        for a in turn
    ]
    builder.net(lines[::-1], part="lock-rod-left", material="metal")


def tow_ball(builder: SurfaceBuilder, fine: Fineness, *, x: float) -> None:
    """Add the left half of a tow bar's ball and of the neck below it; ``x`` of the plastic, m."""
    radius, z, reach = TOW_BALL
    fine = replace(fine, coarseness=ROUND_COARSENESS * fine.coarseness)
    count = fine.steps(math.pi * radius, radius)
    neck = 0.5 * radius
    start = -math.pi / 2 + math.asin(neck / radius)
    profile = [(neck, z - 4 * radius)]
    profile += [
        (radius * math.cos(a), z + radius * math.sin(a))
        for a in np.linspace(start, math.pi / 2, count + 1)[:-1]
    ]
    turn = np.linspace(-math.pi / 2, math.pi / 2, count + 1)
    lines = []
    for r, height in profile:
        # from the front over the left to the rear, x = −reach behind the plastic
        place = [x - reach - r * np.sin(turn), r * np.cos(turn), np.full(len(turn), height)]
        lines.append(builder.line(np.column_stack(place)))
    lines.append(builder.line(np.array([[x - reach, 0.0, z + radius]])))
    builder.net(lines, part="tow-bar", material="metal")


def _facing(
    builder: SurfaceBuilder,
    fine: Fineness,
    corners: list[FloatArray],
    towards: FloatArray,
    *,
    part: str,
    material: str,
) -> None:
    """Add a flat sheet between four corners, its normal turned ``towards`` a direction."""
    a, b, _, d = corners
    order = 1 if np.dot(np.cross(b - a, d - a), towards) > 0 else -1
    sheet(builder, fine, np.array(corners[::order]), part=part, material=material)
