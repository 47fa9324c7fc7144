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
from polychirp.channel.scene.world import RADAR_CLEARANCE
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import polarisation_basis
from polychirp.model.material import Material
from tests.support.references.geometry import closest_by_trying_all


@dataclass(frozen=True, kw_only=True, eq=False)
class PlainBody:
    """Triangles of one smooth material, m ``(face, corner, xyz)``, of a plate or of a body.

    The sheets of a body that ``is_filled`` reflect only outwards.
    """

    corners: FloatArray
    material: Material
    is_plate: bool = False
    is_filled: bool = False


class _Wave(NamedTuple):
    """A ray as in `fields`, with ``edge`` ``(2, xyz)`` and ``field`` ``(polarisation, xyz)``."""

    point: FloatArray
    direction: FloatArray
    edge: FloatArray
    length: float
    field: ComplexArray
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
                across = window.axes[1:] - (window.axes[1:] @ d)[:, None] * d
                edge = across * window.step[:, None] / size
                field = polarisation_basis(d).astype(np.complex128)
                found += self._follow(_Wave(self.source, d, edge, 0.0, field), body)
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
        corner, body = self.corners[face[0]], self.bodies[self.owner[face[0]]]
        normal = _unit(np.cross(corner[1] - corner[0], corner[2] - corner[0]))
        distance = start + float(ahead[0])
        point = wave.point + distance * wave.direction
        here = wave._replace(point=point, length=wave.length + distance)
        if body.material.is_sheet:
            if normal @ wave.direction > 0 and not body.is_filled:
                normal = -normal
            field = self._behind(wave.field, wave.direction, normal, body.material)
            found += self._follow(here._replace(field=field), first)
        is_first = not body.is_plate and self.owner[face[0]] == first
        if normal @ wave.direction >= 0 or not (wave.num_bodies > 0 or is_first):
            return found
        after = self._reflected(here, normal, body)
        if wave.num_bodies > 0 and not body.is_plate:
            found += self._radiated(here, after, normal)
        if after.turns < self.max_bounces:
            found += self._follow(after, first)
        return found

    def _reflected(self, wave: _Wave, normal: FloatArray, body: PlainBody) -> _Wave:
        d = wave.direction
        gamma_s, gamma_p = reflection(body.material, -normal @ d, self.frequency)
        mirror = np.eye(3) - 2 * np.outer(normal, normal)
        r, s = mirror @ d, _across(d, normal)
        along_s, along_p = wave.field @ s, wave.field @ np.cross(d, s)
        field = np.outer(gamma_s * along_s, s) + np.outer(gamma_p * along_p, np.cross(r, s))
        return wave._replace(
            direction=r,
            edge=wave.edge @ mirror,
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

    def _radiated(self, wave: _Wave, after: _Wave, normal: FloatArray) -> ComplexArray:
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
        side = wave.length * (wave.edge - np.outer(wave.edge @ normal / (d @ normal), d))
        area = np.linalg.norm(np.cross(side[0], side[1]))
        phase = 0.5 * k * side @ (d - q)
        share = area * np.prod(np.sinc(phase / np.pi))
        spread = 8 * np.pi * wave.length * r2
        return np.asarray(-1j * share / spread * np.exp(-1j * k * (wave.length + r2)) * f)

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
