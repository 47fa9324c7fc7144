"""Slow and plain ray tubes, one ray after the other: the reference for the compiled ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.materials.fresnel import reflection, sheet
from polychirp.channel.physical_optics.kernels import SHADOW_RAY_LIFT
from polychirp.channel.ray_tubes.launch_grid import box_windows
from polychirp.channel.ray_tubes.radiation import BEAM_WIDTH
from polychirp.channel.scene.world import RADAR_CLEARANCE
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import polarisation_basis
from polychirp.model.material import Material
from tests.support.references.geometry import closest_by_trying_all


@dataclass(frozen=True, kw_only=True, eq=False)
class PlainBody:
    """Triangles of one smooth material, m ``(face, corner, xyz)``, of a plate or of a body.

    They stand for a curved surface if its ``normals`` at their corners are given, shaped likewise.
    The sheets of a body that ``is_filled`` reflect only outwards.
    """

    corners: FloatArray
    material: Material
    normals: FloatArray | None = None
    is_plate: bool = False
    is_filled: bool = False


STEP = 1e-4
"""Distance of the rays beside a tube's own, in tubes, from which its shape is found."""


class _Line(NamedTuple):
    """A ray without a field."""

    point: FloatArray
    direction: FloatArray


class _Facet(NamedTuple):
    """A triangle ``(corner, xyz)`` and the normals at its corners, or None if it is flat."""

    corner: FloatArray
    normals: FloatArray | None

    @property
    def plane(self) -> FloatArray:
        """Unit vector at right angles to the triangle."""
        return _unit(np.cross(self.corner[1] - self.corner[0], self.corner[2] - self.corner[0]))

    def at(self, line: _Line) -> tuple[FloatArray, FloatArray]:
        """Point and normal where a line meets the surface, beyond the triangle's border too."""
        n, d = self.plane, line.direction
        flat = line.point + d * ((self.corner[0] - line.point) @ n / (d @ n))
        if self.normals is None:
            return flat, n
        sides = (self.corner[1:] - self.corner[0]).T
        v, w = np.linalg.lstsq(sides, flat - self.corner[0], rcond=None)[0]
        share = np.array([1 - v - w, v, w])
        height = 0.0
        for i, j in ((0, 1), (0, 2), (1, 2)):
            bend = (self.normals[j] - self.normals[i]) @ (self.corner[j] - self.corner[i])
            height += 0.5 * bend * share[i] * share[j]
        return flat + d * height / (d @ n), _unit(share @ self.normals)


class _Wave(NamedTuple):
    """A ray as in `fields`, with ``field`` ``(polarisation, xyz)``.

    ``beside`` are four rays beside it, as (point, direction, length), that met the same facets:
    before and behind along each side of the window. ``solid`` is the tube's solid angle.
    """

    point: FloatArray
    direction: FloatArray
    beside: tuple[_Line, ...]
    solid: float
    length: float
    field: ComplexArray
    is_curved: bool = False
    num_bodies: int = 0
    turns: int = 0


def multiple_bounces(
    bodies: Sequence[PlainBody],
    transmitter: FloatArray,
    receiver: FloatArray,
    frequency: float,
    *,
    tube: float,
    max_bounces: int = 3,
) -> ComplexArray:
    """Transfer of tubes from one point to another, ``(receiving, transmitting)``, at one frequency.

    The mean of both ways round, as in `polychirp.channel.ray_tubes.paths`, with all phase in it.

    Parameters
    ----------
    transmitter, receiver : m, ``(xyz,)``
    frequency : Hz
    tube : m, width of all tubes where they meet the first body
    """
    there = _Plain(bodies, transmitter, receiver, frequency, tube, max_bounces).total()
    back = _Plain(bodies, receiver, transmitter, frequency, tube, max_bounces).total()
    return np.asarray(0.5 * (there + back.T))


class _Plain:
    """Tubes of one transmitter, and their transfer to one receiver."""

    def __init__(
        self,
        bodies: Sequence[PlainBody],
        source: FloatArray,
        sink: FloatArray,
        frequency: float,
        tube: float,
        max_bounces: int,
    ) -> None:
        self.bodies, self.source, self.sink = bodies, source, sink
        self.frequency, self.tube, self.max_bounces = frequency, tube, max_bounces
        self.wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
        self.corners = np.concatenate([body.corners for body in bodies])
        self.owner: IntArray = np.repeat(
            np.arange(len(bodies)), [len(body.corners) for body in bodies]
        )

    def total(self) -> ComplexArray:
        """The sum over the windows of all bodies."""
        found = np.zeros((2, 2), dtype=np.complex128)
        for number, body in enumerate(self.bodies):
            if not body.is_plate:
                low, high = body.corners.min(axis=(0, 1)), body.corners.max(axis=(0, 1))
                found += self._through_windows(number, low, high)
        return found

    def _through_windows(self, body: int, low: FloatArray, high: FloatArray) -> ComplexArray:
        found = np.zeros((2, 2), dtype=np.complex128)
        for window in box_windows(self.source, low, high, self.tube):
            for index in np.ndindex(window.shape):
                share = window.start + np.array(index) * window.step
                way = window.axes[0] + share @ window.axes[1:]
                size = np.linalg.norm(way)
                d = way / size
                moves = [sign * STEP * axis for axis in np.eye(2) for sign in (-1.0, 1.0)]
                ways = [way + (move * window.step) @ window.axes[1:] for move in moves]
                beside = tuple(_Line(self.source, _unit(one)) for one in ways)
                edge = _slopes([line.direction for line in beside])
                solid = float(abs(np.cross(*edge) @ d))
                field = polarisation_basis(d).astype(np.complex128)
                found += self._follow(_Wave(self.source, d, beside, solid, 0.0, field), body)
        return found

    def _follow(self, wave: _Wave, first: int) -> ComplexArray:
        """Transfer of a ray and its branches to the receiver."""
        found = np.zeros((2, 2), dtype=np.complex128)
        start = RADAR_CLEARANCE if wave.length == 0 else 1e-6
        ahead, face = closest_by_trying_all(
            self.corners, (wave.point + start * wave.direction)[None], wave.direction[None]
        )
        if not np.isfinite(ahead[0]):
            return found
        body, facet = self.bodies[self.owner[face[0]]], self._facet(face[0])
        point, normal = facet.at(_Line(wave.point, wave.direction))
        here = wave._replace(point=point, length=wave.length + np.linalg.norm(point - wave.point))
        if body.material.is_sheet:
            if normal @ wave.direction > 0 and not body.is_filled:
                normal = -normal
            field = self._behind(wave.field, wave.direction, normal, body.material)
            found += self._follow(here._replace(field=field), first)
        is_first = not body.is_plate and self.owner[face[0]] == first
        if normal @ wave.direction >= 0 or not (wave.num_bodies > 0 or is_first):
            return found
        after = self._reflected(here, normal, body, facet)
        if wave.num_bodies > 0 and not body.is_plate:
            found += self._radiated(here, after, normal, facet)
        front = facet.plane * np.sign(facet.plane @ normal)
        if after.turns < self.max_bounces and after.direction @ front > 0:
            found += self._follow(after, first)
        return found

    def _facet(self, number: int) -> _Facet:
        owner = self.owner[number]
        normals = self.bodies[owner].normals
        first = np.searchsorted(self.owner, owner)
        return _Facet(self.corners[number], None if normals is None else normals[number - first])

    def _reflected(self, wave: _Wave, normal: FloatArray, body: PlainBody, facet: _Facet) -> _Wave:
        d = wave.direction
        gamma_s, gamma_p = reflection(body.material, -normal @ d, self.frequency)
        mirror = np.eye(3) - 2 * np.outer(normal, normal)
        r, s = mirror @ d, _across(d, normal)
        along_s, along_p = wave.field @ s, wave.field @ np.cross(d, s)
        field = np.outer(gamma_s * along_s, s) + np.outer(gamma_p * along_p, np.cross(r, s))
        return wave._replace(
            direction=r,
            beside=tuple(_mirrored(line, facet) for line in wave.beside),
            is_curved=wave.is_curved or facet.normals is not None,
            field=field,
            num_bodies=wave.num_bodies + (not body.is_plate),
            turns=wave.turns + 1,
        )

    def _behind(
        self, field: ComplexArray, d: FloatArray, normal: FloatArray, material: Material
    ) -> ComplexArray:
        """Fields ``(…, xyz)`` behind a sheet, whose thickness is still counted as air."""
        cosine = abs(normal @ d)
        _, _, ts, tp = sheet(
            material.permittivity(self.frequency), material.thickness, cosine, self.frequency
        )
        undo = np.exp(1j * self.wavenumber * material.thickness * cosine)
        s = _across(d, normal)
        p = np.cross(d, s)
        return np.asarray(undo * (np.outer(ts * (field @ s), s) + np.outer(tp * (field @ p), p)))

    def _radiated(
        self, wave: _Wave, after: _Wave, normal: FloatArray, facet: _Facet
    ) -> ComplexArray:
        """Transfer of the currents of a footprint to the receiver."""
        d, k = wave.direction, self.wavenumber
        leg = self.sink - wave.point
        r2 = float(np.linalg.norm(leg))
        q = leg / r2
        received = self._received(wave.point + SHADOW_RAY_LIFT * normal, polarisation_basis(-q))
        if normal @ q <= 0 or received is None:
            return np.zeros((2, 2), dtype=np.complex128)
        total = wave.field + after.field
        j = np.cross(normal, np.cross(d, wave.field) + np.cross(after.direction, after.field))
        m = -np.cross(normal, total)
        f = received @ (j + 0j).T + received @ np.cross(m, q).T
        met = [facet.at(line) for line in wave.beside]
        side, turn = (_slopes([one[part] for one in met]) for part in (0, 1))
        # the footprint lies in the plane that touches the surface
        side = side - np.outer(side @ normal / (d @ normal), d)
        turn = turn - np.outer(turn @ normal, normal)
        area = np.cross(side[0], side[1])
        linear = k * side @ (d - q)
        if after.is_curved:
            front = _slopes([line.direction for line in wave.beside]) @ side.T
            bend = turn @ side.T
            second = front - (d - q) @ normal * bend
            second = k * (second + (side @ side.T - np.outer(side @ q, side @ q)) / r2)
            share = _beam(linear, 0.5 * (second + second.T))
        else:
            share = complex(np.prod(np.sinc(0.5 * linear / np.pi)))
        spread = np.sqrt(wave.solid / abs(area @ d)) / (8 * np.pi * r2)
        phase = np.exp(-1j * k * (wave.length + r2))
        return np.asarray(-1j * np.linalg.norm(area) * share * spread * phase * f)

    def _received(self, point: FloatArray, field: FloatArray) -> ComplexArray | None:
        """Fields at a point of waves from the receiver; None if something opaque is between."""
        way = point - self.sink
        length = float(np.linalg.norm(way))
        d = way / length
        found = field.astype(np.complex128)
        for number, body in enumerate(self.bodies):
            mine = self.corners[self.owner == number]
            ahead, face = closest_by_trying_all(
                mine, (self.sink + RADAR_CLEARANCE * d)[None], d[None]
            )
            if RADAR_CLEARANCE + ahead[0] < length:
                if not body.material.is_sheet:
                    return None
                corner = mine[face[0]]
                normal = _unit(np.cross(corner[1] - corner[0], corner[2] - corner[0]))
                found = self._behind(found, d, normal, body.material)
        return found


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))


def _across(d: FloatArray, normal: FloatArray) -> FloatArray:
    """Unit vector across the plane of incidence; any that is across n where d is along it."""
    side = np.cross(d, normal)
    if np.linalg.norm(side) < 1e-9:
        side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    return _unit(side)


def _slopes(values: list[FloatArray]) -> FloatArray:
    """Derivatives along both sides of a window, ``(2, xyz)``, from values at `_Wave.beside`."""
    return np.array([values[1] - values[0], values[3] - values[2]]) / (2 * STEP)


def _mirrored(line: _Line, facet: _Facet) -> _Line:
    point, normal = facet.at(line)
    return _Line(point, line.direction - 2 * (line.direction @ normal) * normal)


def _beam(linear: FloatArray, second: FloatArray) -> complex:
    """Mean of e^{−j(g·x + ½x·Hx)} over x with a normal distribution.

    Along each eigenvector of H it is the mean over one number.
    """
    bend, axes = np.linalg.eigh(second)
    v, g = BEAM_WIDTH**2, linear @ axes
    divisor = 1 + 1j * v * bend
    return complex(np.prod(np.exp(-0.5 * v * g**2 / divisor) / np.sqrt(divisor)))
