"""Places and cross sections of the few points that represent a vehicle.

There are two models: the lobes of 3GPP TR 38.901 (clause 7.9.2.1, RCS model 2), and tables that
physical optics computed from the built-in bodies (`tools/point_tables.py`).
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final, Literal, Protocol

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.units import Unit, from_db

VehicleModel = Literal["tables", "3gpp-one", "3gpp-five"]
"""Names of the models of a vehicle's points, of which a study chooses one."""

MAX_ROOF_ZENITH: Final = np.radians(30.0)
"""Zenith angle, rad, below which a vehicle of one point echoes with its roof's lobe (3GPP)."""

LOBE_SIDES: Final = ("front", "left", "rear", "right", "roof")
"""Sides of the vehicle in the order of the lobes: from ahead in steps of 90°, then the roof."""

FACE_CENTRES: Final = np.array(
    [(1, 0.5, 0.5), (0.5, 1, 0.5), (0, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 1)]
)
"""Places of 3GPP's five points, in the order of `LOBE_SIDES`, as shares of the bounding box: the
middles of its faces. Chosen, since 3GPP leaves the places open."""


class PointModel(Protocol):
    """Model of the points that represent a vehicle."""

    def __hash__(self) -> int:
        """Hash by identity."""

    @property
    def place(self) -> FloatArray:
        """Places as shares of the bounding box, from its low corner, ``(point, xyz)``."""

    def cross_section(
        self, point: IntArray, towards: FloatArray, back: FloatArray, /
    ) -> FloatArray:
        """Cross sections, m² ``(path,)``, of the points with the numbers ``point`` ``(path,)``.

        ``towards`` and ``back`` are unit vectors to transmitter and receiver, ``(path, xyz)`` in
        the vehicle's frame. Exchanging them does not change the result.
        """

    def scale(self, size: FloatArray, /) -> float:
        """Factor on the cross sections for a vehicle with a box of ``size``, m ``(xyz,)``."""

    def matrix(self, rng: np.random.Generator, /) -> ComplexArray:
        """Random scattering matrix of one point: phases, spread, cross polarisation, ``(2, 2)``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LobePoints:
    r"""Scattering points of 3GPP TR 38.901, RCS model 2 (equations 7.9.2-2 and 7.9.2-3).

    .. math:: 10\lg\sigma = \max\{G - \min(12x_\theta^2 + 12x_\varphi^2, \sigma_{max})
        - k_1\sin(k_2\beta/2) + 5\lg\cos(\beta/2),\; G - \sigma_{max}\}

    :math:`x_\theta` and :math:`x_\varphi` are the differences in zenith angle and azimuth between
    the lobe's middle and the bisector of the directions to transmitter and receiver, each over the
    lobe's width; β is the angle between these directions. Fields are linear, not in decibels.

    3GPP defines this equation and its values, the spread (lognormal with mean 1), and the
    cross-polarisation ratio XPR (normal in decibels). Our choices are the places of the points; one
    spread and one XPR for a point in all directions; one phase for both cross-polar terms
    (reciprocity); and a spread that is not truncated.

    Parameters
    ----------
    place : shares of the bounding box, ``(point, xyz)``
    azimuth, azimuth_width, zenith, zenith_width : middle and −3 dB width, rad ``(lobe,)``
    peak, depth : G in m², and :math:`\sigma_{max}` as a ratio, ``(lobe,)``
    spread, cross_ratio, cross_ratio_spread : deviation of the spread, mean and deviation of the XPR
    bistatic_depth, bistatic_rate : :math:`k_1` as a ratio, and :math:`k_2`
    """

    place: FloatArray
    azimuth: FloatArray
    azimuth_width: FloatArray
    zenith: FloatArray
    zenith_width: FloatArray
    peak: FloatArray
    depth: FloatArray
    spread: float
    cross_ratio: float
    cross_ratio_spread: float
    bistatic_depth: float
    bistatic_rate: float

    def cross_section(self, point: IntArray, towards: FloatArray, back: FloatArray) -> FloatArray:
        """Cross sections, m² ``(path,)``; one point alone has the lobe of the bisector's sector."""
        middle, half = bisector(towards, back)
        azimuth = np.arctan2(middle[:, 1], middle[:, 0])
        zenith = np.arccos(np.clip(middle[:, 2], -1.0, 1.0))
        lobe = point if len(self.place) == len(self.peak) else _lobe_of_sector(azimuth, zenith)
        turn = (azimuth - self.azimuth[lobe] + np.pi) % (2 * np.pi) - np.pi
        off = (turn / self.azimuth_width[lobe]) ** 2
        off += ((zenith - self.zenith[lobe]) / self.zenith_width[lobe]) ** 2
        shape = np.maximum(10 ** (-1.2 * off), 1 / self.depth[lobe])
        loss = self.bistatic_depth ** -np.sin(self.bistatic_rate * half)
        between = loss * np.sqrt(np.cos(half))
        return np.asarray(self.peak[lobe] * np.maximum(shape * between, 1 / self.depth[lobe]))

    def scale(self, _: FloatArray) -> float:
        """Factor 1, because 3GPP's vehicle has one size."""
        return 1.0

    def matrix(self, rng: np.random.Generator) -> ComplexArray:
        """Matrix of random phases times √spread (mean power 1); times √(1/XPR) off the diagonal."""
        wide, cross = np.log(self.spread), np.log(self.cross_ratio_spread)
        power = np.exp(wide * rng.standard_normal() - 0.5 * wide**2)
        ratio = self.cross_ratio * np.exp(cross * rng.standard_normal())
        vertical, mixed, horizontal = np.exp(2j * np.pi * rng.random(3))
        off = mixed / np.sqrt(ratio)
        return np.asarray(np.sqrt(power) * np.array([[vertical, off], [off, horizontal]]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TablePoints:
    r"""Points whose cross sections over azimuth were computed once by physical optics.

    Cross sections are interpolated linearly in azimuth. A bistatic cross section is the monostatic
    one along the bisector, which is right while the points of reflection stay the same (Kell,
    1965). Compared with the facets of the tracer `Composite`, its mean over azimuth is within 3 dB
    for directions up to 60° apart, within 5 dB at 90°, and up to 8 dB too strong beyond.

    The tables were traced from 20 m. A flat side in its near field echoes the less the nearer it
    is: a sedan's echo is right to 2 dB from 8 to 40 m, but a truck's at 10 m is 5 dB too strong.
    Elevation and cross polarisation are neglected. Another size of the same shape has an echo
    :math:`(V/V_0)^{2/3}` times as strong (V: volume of the box), as for curved surfaces in
    geometric optics.

    Parameters
    ----------
    size : m, of the bounding box that was traced, ``(xyz,)``
    place : shares of that box, ``(point, xyz)``
    echo : cross section, m² ``(point, azimuth)``, in equal steps counter-clockwise from ahead
    """

    size: FloatArray
    place: FloatArray
    echo: FloatArray

    def cross_section(self, point: IntArray, towards: FloatArray, back: FloatArray) -> FloatArray:
        """Cross sections, m² ``(path,)``, along the bisectors of both directions."""
        middle, _ = bisector(towards, back)
        count = self.echo.shape[1]
        column = np.arctan2(middle[:, 1], middle[:, 0]) / (2 * np.pi) * count
        left = np.floor(column).astype(np.int64)
        share = column - left
        before, after = self.echo[point, left % count], self.echo[point, (left + 1) % count]
        return np.asarray((1 - share) * before + share * after)

    def scale(self, size: FloatArray) -> float:
        """Factor (V/V₀)^⅔ from the volumes of the bounding boxes."""
        return float(np.prod(size / self.size) ** (2 / 3))

    def matrix(self, rng: np.random.Generator) -> ComplexArray:
        """Unit matrix times a random phase."""
        return np.asarray(np.exp(2j * np.pi * rng.random()) * np.eye(2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class IsotropicPoint:
    """One point with a cross section of 1 m² in all directions."""

    place: FloatArray

    def cross_section(self, point: IntArray, towards: FloatArray, back: FloatArray) -> FloatArray:
        """Cross sections of 1 m², ``(path,)``."""
        del towards, back
        return np.ones(len(point))

    def scale(self, _: FloatArray) -> float:
        """Factor 1 for every size."""
        return 1.0

    def matrix(self, _: np.random.Generator) -> ComplexArray:
        """The unit matrix."""
        return np.eye(2, dtype=np.complex128)


def bisector(towards: FloatArray, back: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors between two directions ``(path, xyz)``, and half their angle, rad ``(path,)``.

    >>> middle, half = bisector(np.array([[1.0, 0, 0]]), np.array([[0, 1.0, 0]]))
    >>> bool(np.isclose(half[0], np.pi / 4)), middle.round(3)
    (True, array([[0.707, 0.707, 0.   ]]))
    """
    total = towards + back
    length = np.linalg.norm(total, axis=-1)
    half = np.arctan2(np.linalg.norm(towards - back, axis=-1), length)
    return np.asarray(total / np.maximum(length, 1e-12)[:, None]), np.asarray(half)


def _lobe_of_sector(azimuth: FloatArray, zenith: FloatArray) -> IntArray:
    """Number of the lobe, in the order of `LOBE_SIDES`, in whose sector these directions are."""
    side = np.round(azimuth / (np.pi / 2)).astype(np.int64) % 4
    return np.where(zenith < MAX_ROOF_ZENITH, 4, side)


def _read(name: str) -> dict[str, Any]:
    text = files("polychirp.channel.point_vehicles").joinpath(name).read_text(encoding="utf-8")
    return tomllib.loads(text)


@cache
def lobe_points(points: Literal["one", "five"]) -> LobePoints:
    """The vehicle of TR 38.901 as one point in its middle, or as five points on its faces.

    >>> ahead, level = np.array([0]), np.radians(71.75)
    >>> towards = np.array([[np.sin(level), 0.0, np.cos(level)]])
    >>> peak = lobe_points("one").cross_section(ahead, towards, towards)[0]
    >>> round(float(10 * np.log10(peak)), 2)
    15.52
    """
    data = _read("vehicle_lobes.toml")
    ratio, angle, area = Unit("dB").read, Unit("rad").read, Unit("m^2").read
    rows = [data[points][side] for side in LOBE_SIDES]
    everywhere = {"azimuth": "0 deg", "azimuth_width": None}
    rows = [{**everywhere, **row} for row in rows]
    widths = [row["azimuth_width"] for row in rows]
    return LobePoints(
        place=FACE_CENTRES if points == "five" else np.array([[0.5, 0.5, 0.5]]),
        azimuth=np.array([angle(row["azimuth"]) for row in rows]),
        azimuth_width=np.array([np.inf if w is None else angle(w) for w in widths]),
        zenith=np.array([angle(row["zenith"]) for row in rows]),
        zenith_width=np.array([angle(row["zenith_width"]) for row in rows]),
        peak=np.array([area(row["peak"]) for row in rows]),
        depth=np.array([ratio(row["depth"]) for row in rows]),
        spread=ratio(data["spread"]),
        cross_ratio=ratio(data["cross_ratio"]),
        cross_ratio_spread=ratio(data["cross_ratio_spread"]),
        bistatic_depth=ratio(data["bistatic_depth"]),
        bistatic_rate=data["bistatic_rate"],
    )


@cache
def table_points() -> dict[str, TablePoints]:
    """The tables of ``vehicle_points.toml``, by the name of the built-in body.

    >>> list(table_points())
    ['sedan', 'hatchback', 'van', 'truck']
    """
    return {
        body: TablePoints(
            size=np.array(row["size"]),
            place=np.array([point["place"] for point in row["point"]]),
            echo=np.vectorize(from_db)(0.1 * np.array([p["echo"] for p in row["point"]])),
        )
        for body, row in _read("vehicle_points.toml").items()
    }


def most_similar_table(size: FloatArray) -> TablePoints:
    """The table of the body whose box is most similar to one of ``size``, m ``(xyz,)``.

    This box has the least sum of squared logarithms of the ratios of corresponding sides.

    >>> most_similar_table(np.array([7.0, 2.4, 3.0])) is table_points()["truck"]
    True
    """
    return min(table_points().values(), key=lambda row: float(np.sum(np.log(size / row.size) ** 2)))
