"""Detections of one body made one claim: clusters in place and range rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.model.detection import Detections
from polychirp.spec import Spec
from polychirp.units import Metres, MetresPerSecond


@dataclass(frozen=True, slots=True, kw_only=True)
class Body(Spec):
    """What detections of one body have in common.

    Parameters
    ----------
    gap : m, between neighbouring detections on the road's plane
    range_rate : m/s, between neighbours: of one motion, seen under a few degrees' difference,
        and as wheels and gestures vary
    extent : m, between any two of its detections; a long car by default
    place : where the body is said to be, and how fast: at its nearest detection, at its strongest
        or at the mean of all, weighted by power
    """

    gap: Metres = 2.0
    range_rate: MetresPerSecond = 1.0
    extent: Metres = 5.5
    place: Literal["nearest", "strongest", "mean"] = "strongest"

    def __post_init__(self) -> None:
        if not (self.gap > 0 and self.range_rate > 0 and self.extent > 0):
            raise InputError("a body's gap, range rate and extent must be positive")
        if self.place not in ("nearest", "strongest", "mean"):
            raise InputError(f"a body's place '{self.place}' is none of nearest, strongest, mean")


def objects(detections: Detections, body: Body | None = None) -> IntArray:
    """Number of the object that each detection belongs to, ``(detection,)``, strongest first.

    Density clustering with single members allowed (DBSCAN, Ester et al. 1996, of one point and
    more): the strongest detection left starts an object, which grows by neighbours of its members
    as long as it stays no longer than a body.

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
    number = np.full(detections.num_detections, -1, dtype=np.int64)
    for strongest in _by_strength(detections):
        if number[strongest] < 0:
            members = _grown(strongest, is_neighbour, apart, number, body.extent)
            number[members] = number.max(initial=-1) + 1
    return number


def merged(detections: Detections, body: Body | None = None) -> Detections:
    """One claim per object of `objects`: its place and rate, its total power, its greatest SNR.

    Examples
    --------
    >>> found = Detections(
    ...     time=0.0, range=[10.0, 20.0, 11.5], range_rate=[-5.0, 3.0, -5.2],
    ...     azimuth=[0.0, 0.1, 0.05], power=[3.0, 2.0, 1.0], snr=[9.0, 8.0, 7.0])
    >>> one = merged(found)
    >>> one.range, one.power
    (array([10., 20.]), array([4., 2.]))
    """
    body = body or Body()
    number = objects(detections, body)
    members = [np.flatnonzero(number == n) for n in range(int(number.max(initial=-1)) + 1)]
    power = np.array([detections.power[m].sum() for m in members], dtype=np.float64)
    order = np.argsort(-power, kind="stable")
    claims = np.array([_claim(detections, members[n], body) for n in order]).reshape(-1, 3)
    return Detections(
        time=detections.time,
        range=claims[:, 0],
        range_rate=claims[:, 1],
        azimuth=claims[:, 2],
        power=power[order],
        snr=np.array([detections.snr[members[n]].max() for n in order], dtype=np.float64),
    )


def _claim(detections: Detections, members: IntArray, body: Body) -> tuple[float, float, float]:
    """Range, range rate and azimuth of one object."""
    distance, azimuth = detections.range[members], detections.azimuth[members]
    power, rate = detections.power[members], detections.range_rate[members]
    if body.place == "mean":
        weight = power / power.sum()
        if np.any(np.isnan(azimuth)):  # a single channel tells no azimuth
            return float(weight @ distance), float(weight @ rate), float("nan")
        place = weight @ (distance * np.exp(1j * azimuth))
        return float(np.abs(place)), float(weight @ rate), float(np.angle(place))
    n = int(np.argmin(distance) if body.place == "nearest" else np.argmax(power))
    return float(distance[n]), float(rate[n]), float(azimuth[n])


def _distances(detections: Detections) -> FloatArray:
    # a single channel tells no azimuth: ranges alone then decide
    place = detections.range * np.exp(1j * np.nan_to_num(detections.azimuth))
    return np.asarray(np.abs(place[:, None] - place))


def _by_strength(detections: Detections) -> list[int]:
    return [int(n) for n in np.argsort(-detections.power, kind="stable")]


def _grown(
    first: int, is_neighbour: BoolArray, apart: FloatArray, number: IntArray, extent: float
) -> list[int]:
    """Members of the object that starts with ``first``, nearest added first."""
    members = [first]
    while True:
        reach = np.any(is_neighbour[members], axis=0) & (number < 0)
        reach[members] = False
        reach &= np.max(apart[members], axis=0) <= extent
        if not np.any(reach):
            return members
        candidates = np.flatnonzero(reach)
        members.append(int(candidates[np.argmin(apart[first, candidates])]))
