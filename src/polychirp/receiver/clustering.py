"""Objects: clusters of detections in place and range rate, with their extents."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.frames import direction_angles, direction_of
from polychirp.model.detection import Detections
from polychirp.model.extent import extent_of
from polychirp.spec import Spec
from polychirp.units import Metres, MetresPerSecond


@dataclass(frozen=True, slots=True, kw_only=True)
class Body(Spec):
    """Limits within which detections belong to one body.

    Parameters
    ----------
    gap : m, greatest distance between neighbouring detections: in space, or on the road's plane if
        the radar measures no elevations. All detections of the body are within ``extent`` of each
        other, so that a greater gap groups as one of ``extent`` does
    range_rate : m/s, greatest difference between neighbours: in different directions one motion
        has different range rates, and wheels and limbs move differently
    extent : m, greatest distance between any two detections of the body; a long car by default
    place : source of the body's range, range rate, azimuth and elevation: its "nearest" detection,
        its "strongest", or the "mean" of all, weighted by power
    """

    gap: Metres = 2.0
    range_rate: MetresPerSecond = 1.0
    extent: Metres = 5.5
    place: Literal["nearest", "strongest", "mean"] = "strongest"

    def __post_init__(self) -> None:
        if not (self.gap > 0 and self.range_rate > 0 and self.extent > 0):
            raise InputError("a body's gap, range rate and extent must be positive")
        if self.place not in ("nearest", "strongest", "mean"):
            raise InputError(
                f"a body's place '{self.place}' is not one of nearest, strongest, mean"
            )


def objects(detections: Detections, body: Body | None = None) -> IntArray:
    """Number of the object to which each detection belongs, from 0, ``(detection,)``.

    This is density clustering in which one detection suffices for an object (DBSCAN, Ester et al.
    1996): the strongest detection that is left starts the next object, and neighbours of its
    members are added unless its extent would exceed that of a body.

    Examples
    --------
    >>> found = Detections(
    ...     time=0.0, range=[10.0, 20.0, 11.5], range_rate=[-5.0, 3.0, -5.2],
    ...     azimuth=[0.0, 0.1, 0.05], power=[3.0, 2.0, 1.0], snr=[9.0, 8.0, 7.0])
    >>> objects(found)
    array([0, 1, 0])
    """
    body = body or Body()
    apart = _distances(detections)
    rates = np.abs(detections.range_rate[:, None] - detections.range_rate)
    is_neighbour = (apart <= body.gap) & (rates <= body.range_rate)
    number = np.zeros(detections.num_detections, dtype=np.int64)
    is_free = np.ones(detections.num_detections, dtype=bool)
    count = 0
    for strongest in np.argsort(-detections.power, kind="stable"):
        if is_free[strongest]:
            members = _grown(int(strongest), is_neighbour, apart, is_free, body.extent)
            number[members], is_free[members] = count, False
            count += 1
    return number


def merged(detections: Detections, body: Body | None = None) -> Detections:
    """One detection per object of `objects`, with the total power and the greatest SNR.

    Each has the extent of its points: their number, its length along range, its width across and
    the span of its range rates.

    Examples
    --------
    >>> found = Detections(
    ...     time=0.0, range=[10.0, 20.0, 11.5], range_rate=[-5.0, 3.0, -5.2],
    ...     azimuth=[0.0, 0.1, 0.05], power=[3.0, 2.0, 1.0], snr=[9.0, 8.0, 7.0])
    >>> one = merged(found)
    >>> one.range, one.power
    (array([10., 20.]), array([4., 2.]))
    >>> one.num_points, one.length
    (array([2, 1]), array([1.5, 0. ]))
    """
    body = body or Body()
    number = objects(detections, body)
    members = [np.flatnonzero(number == n) for n in range(int(number.max(initial=-1)) + 1)]
    power = np.array([detections.power[m].sum() for m in members], dtype=np.float64)
    order = np.argsort(-power, kind="stable")
    found = np.array([_detection(detections, members[n], body) for n in order]).reshape(-1, 4)
    extents = [
        extent_of(
            range=detections.range[members[n]],
            range_rate=detections.range_rate[members[n]],
            azimuth=detections.azimuth[members[n]],
        )
        for n in order
    ]
    return Detections(
        time=detections.time,
        range=found[:, 0],
        range_rate=found[:, 1],
        azimuth=found[:, 2],
        elevation=found[:, 3],
        power=power[order],
        snr=np.array([detections.snr[members[n]].max() for n in order], dtype=np.float64),
        num_points=np.array([one.num_points for one in extents], dtype=np.int64),
        length=np.array([one.length for one in extents]),
        width=np.array([one.width for one in extents]),
        range_rate_span=np.array([one.range_rate_span for one in extents]),
        num_unresolved=detections.num_unresolved,
    )


def _detection(detections: Detections, members: IntArray, body: Body) -> tuple[float, ...]:
    """Range, range rate, azimuth and elevation of one object."""
    distance, azimuth = detections.range[members], detections.azimuth[members]
    power, rate = detections.power[members], detections.range_rate[members]
    elevation = detections.elevation[members]
    if body.place == "mean":
        weight = power / power.sum()
        if np.any(np.isnan(azimuth)):  # a single channel measures no azimuth
            mean = (weight @ value for value in (distance, rate, azimuth, elevation))
            return tuple(float(value) for value in mean)
        place = weight @ _places(detections)[members]
        around, up = direction_angles(place)
        height = math.nan if np.any(np.isnan(elevation)) else float(up)
        return float(np.linalg.norm(place)), float(weight @ rate), float(around), height
    n = int(np.argmin(distance) if body.place == "nearest" else np.argmax(power))
    return float(distance[n]), float(rate[n]), float(azimuth[n]), float(elevation[n])


def _distances(detections: Detections) -> FloatArray:
    place = _places(detections)
    return np.asarray(np.linalg.norm(place[:, None] - place, axis=-1))


def _places(detections: Detections) -> FloatArray:
    """Places of detections, m ``(detection, xyz)``; an angle that is not measured counts as 0.

    So ranges alone decide if a single channel measures no angles.
    """
    azimuth, elevation = (
        np.nan_to_num(angle) for angle in (detections.azimuth, detections.elevation)
    )
    return detections.range[:, None] * direction_of(azimuth, elevation)


def _grown(
    first: int, is_neighbour: BoolArray, apart: FloatArray, is_free: BoolArray, extent: float
) -> list[int]:
    """Members of the object that starts with ``first``; those nearest to it are added first."""
    members = [first]
    while True:
        reach = np.any(is_neighbour[members], axis=0) & is_free
        reach[members] = False
        reach &= np.max(apart[members], axis=0) <= extent
        if not np.any(reach):
            return members
        candidates = np.flatnonzero(reach)
        members.append(int(candidates[np.argmin(apart[first, candidates])]))
