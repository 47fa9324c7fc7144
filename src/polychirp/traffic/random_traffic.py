"""Random traffic for statistics: every seed gives another street, without overlapping vehicles."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.field_types import need_field_types
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.traffic.placing import (
    MIN_DISTANCE,
    RANDOM_BODIES,
    SIGHT_MARGIN,
    Eye,
    Place,
    Rectangle,
    are_apart,
    are_apart_across,
    hides_none,
    is_ahead,
    is_seen,
    nearest_point,
)
from polychirp.traffic.road_users import RoadUser
from polychirp.traffic.street import Coarseness, FacetEdge, Point, Street, Vehicle, overlap
from polychirp.traffic.vehicle import vehicle_size
from polychirp.units import Between, Metres, MetresPerSecond, SquareMetres, from_db

LEAST_DRAWN: Final = 10
"""Least number of targets that are drawn. If fewer are asked for, the first ones drawn are taken,
so that streets of one seed share them. Chosen."""

POINT_HEIGHT: Final = 0.5
"""Height of targets that are points, m: the default height of radars in `traffic.mounting`."""

WALL_DISTANCE: Final = 0.3
"""Least distance of a vehicle from buildings, m; chosen: side mirrors reach 0.2 m."""

_PLACES_TRIED: Final = 100
"""Number of random places tried for one vehicle before the whole street is drawn again. Chosen."""

_STREETS_TRIED: Final = 300
"""Number of streets drawn before the best of them is taken or, if too few vehicles are on it, an
error reports the lack of room. Chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lane(Spec):
    """A lane along x with its middle at ``y``, m.

    Vehicles head along +x, or along −x if the lane is ``oncoming``. Their speeds are uniformly
    distributed between the two of ``speed``, m/s (the default is chosen: urban traffic).

    `RandomTraffic` fills lanes with vehicles.
    """

    y: Metres
    oncoming: bool = False
    speed: tuple[MetresPerSecond, MetresPerSecond] = (8.0, 14.0)

    def __post_init__(self) -> None:
        if not 0 <= self.speed[0] <= self.speed[1]:
            raise InputError(
                f"the lane at y = {self.y:g} m needs two speeds, from low to high, 0 or more"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossingLane(Spec):
    """A lane along y with its middle at ``x``, m, of a street that crosses.

    Vehicles are between −``reach`` and ``reach``, m, along y and head along +y, or along −y if the
    lane is ``oncoming``. Their speeds are as those of a `Lane`.
    """

    x: Metres
    reach: Metres = 40.0
    oncoming: bool = False
    speed: tuple[MetresPerSecond, MetresPerSecond] = (8.0, 14.0)

    def __post_init__(self) -> None:
        if not 0 <= self.speed[0] <= self.speed[1]:
            raise InputError(
                f"the crossing lane at x = {self.x:g} m needs two speeds, from low to high, 0 or "
                "more"
            )
        if not self.reach > 0:
            raise InputError(
                f"the crossing lane at x = {self.x:g} m has a reach of {self.reach:g} m; use more "
                "than 0 m"
            )


URBAN_LANES: Final = (
    Lane(y=-1.75),
    Lane(y=1.75, oncoming=True),
    Lane(y=-5.0, speed=(0.0, 0.0)),
    Lane(y=5.0, oncoming=True, speed=(0.0, 0.0)),
)
"""Default lanes: one in each direction, 3.5 m apart, and one of parked vehicles beside each.
Positions are chosen."""


@dataclass(frozen=True, kw_only=True)
class RandomTraffic(Spec):
    """Vehicles at random places in front of a viewing vehicle that heads along +x.

    They are clear of the street's own vehicles, motorcycles, bicycles and pedestrians, and of
    its buildings. Targets are visible: none of these and no other random vehicle hides a
    target's nearest point from the middle of the viewing vehicle's front. Streets of one seed
    that differ only in the number of targets share their carriers and the targets of the
    smaller street, up to `LEAST_DRAWN` targets. So a street of fewer targets is one in which
    that many would be visible, as far as they fit: its targets hide others more rarely. The
    mean range of a lone target is 17.5 m instead of 16 m, and 13 % instead of 17 % of them are
    nearer than 8 m.

    Parameters
    ----------
    seen_from : name of the viewing vehicle
    num_targets : number of vehicles to be detected, called target-1, target-2, …
    num_carriers : number of further vehicles, carrier-1, …, within twice the ``reach``, on which
        a study may mount radars; they need not be visible
    reach : greatest distance from the viewer's front to the nearest point of a target, m
    gap : least distance between vehicles of one lane, m; vehicles on crossing lanes keep it, along
        x or y, also from those on lanes along x
    shape : with ``points``, an isotropic scatterer stands for every target, at the nearest point
        of the place that the vehicle would cover
    rcs : radar cross section of such a scatterer, m²
    lanes : lanes on which vehicles stand and drive
    crossing : lanes of a street that crosses, on which they do as well
    max_edge, coarseness : those of every random `Vehicle`

    Raises
    ------
    InputError
        A parameter is out of its limits, or there is no lane.

    Examples
    --------
    >>> street = Street(vehicles=(Vehicle(name="ego", x=0.0, y=-1.75),))
    >>> traffic = RandomTraffic(seen_from="ego", num_targets=3)
    >>> [vehicle.name for vehicle in traffic.on(street, Streams(seed=1)).vehicles]
    ['ego', 'target-1', 'target-2', 'target-3']
    """

    seen_from: str
    num_targets: Annotated[int, Between(greatest=1000)] = 5
    num_carriers: Annotated[int, Between(greatest=1000)] = 0
    reach: Metres = 28.0
    gap: Metres = 1.5
    shape: Literal["vehicles", "points"] = "vehicles"
    rcs: SquareMetres = from_db(10.0)
    lanes: tuple[Lane, ...] = URBAN_LANES
    crossing: tuple[CrossingLane, ...] = ()
    max_edge: FacetEdge = 0.05
    coarseness: Coarseness = 1.0

    def __post_init__(self) -> None:
        need_field_types(self)
        if self.num_targets < 0 or self.num_carriers < 0:
            raise InputError("num_targets and num_carriers of random traffic must be 0 or more")
        if not self.reach > MIN_DISTANCE:
            raise InputError(f"the reach of random traffic must exceed {MIN_DISTANCE:g} m")
        if not (self.gap >= 0 and self.rcs >= 0):
            raise InputError("random traffic needs a gap and a radar cross section of 0 or more")
        if not (self.lanes or self.crossing):
            raise InputError("random traffic needs a lane; leave 'lanes' out for a plain street")

    @property
    def target_names(self) -> tuple[str, ...]:
        """Names of the targets."""
        return tuple(f"target-{n + 1}" for n in range(self.num_targets))

    @property
    def carrier_names(self) -> tuple[str, ...]:
        """Names of the carriers."""
        return tuple(f"carrier-{n + 1}" for n in range(self.num_carriers))

    def on(self, street: Street, streams: Streams) -> Street:
        """The street with this traffic.

        `InputError` is raised if the viewing vehicle is missing or does not head along +x, or there
        is no room.
        """
        viewer = self._viewer(street)
        eye = (viewer.x + vehicle_size(viewer.body)[0] / 2, viewer.y)
        places = self._places(street, eye, streams)
        carriers = places[: self.num_carriers]
        targets = places[self.num_carriers :][: self.num_targets]
        vehicles = [
            self._vehicle(*entry) for entry in zip(self.carrier_names, carriers, strict=True)
        ]
        named = list(zip(self.target_names, targets, strict=True))
        if self.shape == "points":
            points = tuple(self._point(name, place, eye) for name, place in named)
            return replace(
                street, vehicles=(*street.vehicles, *vehicles), points=(*street.points, *points)
            )
        vehicles += [self._vehicle(name, place) for name, place in named]
        return replace(street, vehicles=(*street.vehicles, *vehicles))

    def _viewer(self, street: Street) -> Vehicle:
        for vehicle in street.vehicles:
            if vehicle.name == self.seen_from:
                if abs(math.sin(vehicle.heading)) > 1e-6 or math.cos(vehicle.heading) < 0:
                    raise InputError(f"'{vehicle.name}' must head along +x to see random traffic")
                return vehicle
        known = ", ".join(vehicle.name for vehicle in street.vehicles) or "no vehicle"
        raise InputError(
            f"random traffic is seen from '{self.seen_from}', which is not on the street; it has "
            f"{known}"
        )

    def _places(self, street: Street, eye: Eye, streams: Streams) -> list[Place]:
        """Places of all carriers, then of at least `LEAST_DRAWN` targets if they fit."""
        taken = {body.name: _bounds(body) for body in (*street.vehicles, *street.road_users)}
        walls = [building.footprint()[1] for building in street.buildings]
        wanted = max(self.num_targets, LEAST_DRAWN)
        shortest = min(vehicle_size(body)[0] for body in RANDOM_BODIES)
        # bound on the vehicles that fit on all lanes within the carriers' reach, twice the targets'
        room = len(self.lanes) * (2 + 2 * self.reach / (shortest + self.gap))
        room += sum(2 + 2 * lane.reach / (shortest + self.gap) for lane in self.crossing)
        if self.num_carriers + self.num_targets > room:
            raise InputError(
                f"there is no room for {self.num_targets} targets within {self.reach:g} m and "
                f"{self.num_carriers} carriers on {len(self.lanes)} lanes; use fewer of them, "
                "more lanes, a longer reach or smaller gaps"
            )
        best: list[Place] = []
        for number in range(_STREETS_TRIED):
            places = self._street_of(streams["traffic", number], taken, walls, eye, wanted)
            if len(places) == self.num_carriers + wanted:
                return places
            best = max(best, places, key=len)
        if len(best) < self.num_carriers + self.num_targets:
            raise InputError(
                f"there is no room for {self.num_targets} targets in sight within "
                f"{self.reach:g} m and {self.num_carriers} carriers, in {_STREETS_TRIED} streets; "
                "use fewer of them, more lanes, a longer reach or smaller gaps"
            )
        return best

    def _street_of(
        self,
        draw: np.random.Generator,
        taken: Mapping[str, Rectangle],
        walls: Sequence[FloatArray],
        eye: Eye,
        wanted: int,
    ) -> list[Place]:
        """Places of carriers, then of targets, until no place is found for the next vehicle.

        ``walls`` are corners of buildings, m, each ``(4, xy)``.
        """
        hiding = [box for name, box in taken.items() if name != self.seen_from]
        places: list[Place] = []
        boxes: list[Rectangle] = []
        points: list[Eye] = []
        for number in range(self.num_carriers + wanted):
            is_target = number >= self.num_carriers
            reach = self.reach if is_target else 2 * self.reach
            for _ in range(_PLACES_TRIED):
                place = self._place(draw, eye, reach)
                box = place.rectangle
                if (
                    is_ahead(eye, nearest_point(eye, box), reach)
                    and all(are_apart(box, other, self.gap) for other in (*taken.values(), *boxes))
                    and not self._is_close(place, taken.values(), places)
                    and hides_none(eye, box, points)
                    and not (is_target and not is_seen(eye, box, [*hiding, *boxes]))
                    and not _meets(_corners(_widened(box, WALL_DISTANCE)), walls)
                    and not (is_target and _meets(_line_of_sight(eye, box), walls))
                ):
                    break
            else:
                return places
            places.append(place)
            boxes.append(box)
            points += [nearest_point(eye, box)] if is_target else []
        return places

    def _is_close(self, place: Place, taken: Iterable[Rectangle], places: Sequence[Place]) -> bool:
        """True if a vehicle is closer than the gap to one whose way it crosses.

        Vehicles of crossing lanes keep the gap along their lane from each other, and along x or y
        from all others.
        """
        box = place.rectangle
        for other in places:
            if place.is_crossing and other.is_crossing:
                if not are_apart_across(box, other.rectangle, self.gap):
                    return True
            elif (place.is_crossing or other.is_crossing) and not are_apart(
                box, _widened(other.rectangle, self.gap), 0.0
            ):
                return True
        return place.is_crossing and not all(
            are_apart(box, _widened(other, self.gap), 0.0) for other in taken
        )

    def _place(self, draw: np.random.Generator, eye: Eye, reach: float) -> Place:
        lanes: tuple[Lane | CrossingLane, ...] = (*self.lanes, *self.crossing)
        lane = lanes[int(draw.integers(len(lanes)))]
        body = RANDOM_BODIES[int(draw.integers(len(RANDOM_BODIES)))]
        if isinstance(lane, CrossingLane):
            return Place(
                body=body,
                x=lane.x,
                y=float(draw.uniform(-lane.reach, lane.reach)),
                oncoming=lane.oncoming,
                speed=float(draw.uniform(*lane.speed)),
                is_crossing=True,
            )
        return Place(
            body=body,
            x=float(draw.uniform(eye[0], eye[0] + reach + vehicle_size(body)[0])),
            y=lane.y,
            oncoming=lane.oncoming,
            speed=float(draw.uniform(*lane.speed)),
        )

    def _vehicle(self, name: str, place: Place) -> Vehicle:
        return Vehicle(
            name=name,
            body=place.body,
            x=place.x,
            y=place.y,
            heading=place.heading,
            speed=place.speed,
            max_edge=self.max_edge,
            coarseness=self.coarseness,
        )

    def _point(self, name: str, place: Place, eye: Eye) -> Point:
        x, y = nearest_point(eye, place.rectangle)
        speed = -place.speed if place.oncoming else place.speed
        velocity = (0.0, speed, 0.0) if place.is_crossing else (speed, 0.0, 0.0)
        return Point(name=name, x=x, y=y, z=POINT_HEIGHT, rcs=self.rcs, velocity=velocity)


def _widened(box: Rectangle, gap: float) -> Rectangle:
    """A rectangle with ``gap`` (m) more on each side."""
    return box[0] - gap, box[1] + gap, box[2] - gap, box[3] + gap


def _corners(box: Rectangle) -> FloatArray:
    """Corners of a rectangle in their order, m, ``(4, xy)``."""
    left, right, low, high = box
    return np.array([[left, low], [right, low], [right, high], [left, high]])


def _line_of_sight(eye: Eye, box: Rectangle) -> FloatArray:
    """Corners of the line to the nearest point of ``box``, `SIGHT_MARGIN` wide on each side, m."""
    start, end = np.array(eye), np.array(nearest_point(eye, box))
    along = (end - start) / math.dist(start, end)
    aside = SIGHT_MARGIN * np.array([-along[1], along[0]])
    return np.array([start - aside, end - aside, end + aside, start + aside])


def _meets(corners: FloatArray, others: Iterable[FloatArray]) -> bool:
    """True if a rectangle ``(4, xy)`` overlaps one of the others."""
    return any(overlap(corners, other) for other in others)


def _bounds(body: Vehicle | RoadUser) -> Rectangle:
    _, corners = body.footprint()
    low, high = corners.min(axis=0), corners.max(axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])
