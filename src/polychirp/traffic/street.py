"""`Street` — vehicles, buildings, trees, a road and points, as in a study file."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import combinations
from typing import Annotated, Final, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.field_types import need_field_types
from polychirp.frames import Pose
from polychirp.model.mesh import Mesh, Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.spec import Spec
from polychirp.traffic.fittings import Fittings
from polychirp.traffic.furniture import AnyFurniture, Furniture
from polychirp.traffic.mesh_file import Axis, load_mesh
from polychirp.traffic.road_users import Bicycle, Motorcycle, Pedestrian, RoadUser
from polychirp.traffic.roadside import WINDOW_SIZE, tree_mesh, upright
from polychirp.traffic.semi_trailer import (
    ARTICULATED_TRUCK,
    KING_PIN,
    TOWING,
    is_on_trailer,
    trailer_pose,
)
from polychirp.traffic.shapes import Body
from polychirp.traffic.vehicle import (
    rear_axle,
    rear_axle_x,
    truck_pieces,
    vehicle_mesh,
    vehicle_size,
)
from polychirp.units import (
    Between,
    Metres,
    MetresPerSecond,
    Radians,
    RadiansPerSecond,
    SquareMetres,
    Unit,
)

GREATEST_FACET_EDGE: Final = 0.5
"""Greatest edge of facets on flats of built-in bodies, m: beyond it they lose their arches."""

BEHIND_PLATE: Final = 0.3
"""Depth behind a number plate, m, within which a radar has its view blocked. Chosen: the depth of
bumpers."""

FacetEdge = Annotated[float, Unit("m", least="0 m", greatest="1 km")]
"""Longest edge of a facet, m."""

Coarseness = Annotated[float, Between(least=0.0, greatest=1000.0)]
"""Factor on the edge lengths of facets on curved parts."""

Articulation = Annotated[float, Unit("rad", least="-90 deg", greatest="90 deg")]
"""Angle between a tractor and its semi-trailer, rad: the trailer's front clears the cab."""

Extent = Annotated[float, Unit("m", least="0 m", greatest="10 km")]
"""Length, width or height of a road or a building, m."""

Footprint = tuple[str, FloatArray]
"""A name for error messages, and the corners of a rectangle in the world, ``(4, xy)``, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle(Spec):
    r"""A vehicle that drives along ``heading``, with its middle at (x, y) at time 0.

    With a yaw rate :math:`\dot\psi` it goes round a circle. Its rear wheels do not slip, so that
    its rear axle moves along the heading with the speed v, on a circle of the radius
    :math:`v/\dot\psi`; the middle, which is b before the axle, also moves to the side with
    :math:`\dot\psi b` (Rajamani, Vehicle Dynamics and Control, 2012, section 2.2).

    Parameters
    ----------
    speed : of the rear axle along the heading, m/s; a vehicle from a file has its axle at its
        origin
    yaw_rate : rad/s to the left; 0 while the vehicle drives straight
    body : built-in body, used unless ``mesh`` is given
    mesh : path of a GLB or OBJ file with the origin on the ground below the middle
    materials : pairs (material name in the file, material here), not needed for
        `mesh_file.TABLE_MATERIALS`
    scale : metres per unit of the file
    up_axis : vertical axis of the file
    front_axis : axis of the file that points to the front, "z" by the convention of glTF
    max_edge : greatest edge of facets on flat parts, m
    coarseness : factor on edges on curved parts, see `vehicle_mesh`
    articulation : angle, rad, by which the semi-trailer of an "articulated-truck" is turned to the
        left of the tractor, about its king pin, at time 0; `trailer` says how it goes on
    fittings : number plates, bumper beams, lamps, open rims and more on a built-in body; None: its
        smooth shell alone

    Examples
    --------
    >>> Vehicle(name="car", x=10.0, y=0.0, heading=math.pi / 2, speed=5.0).velocity[1]
    5.0

    The middle of a sedan is 1.34 m before its rear axle:

    >>> turning = Vehicle(name="car", x=10.0, y=0.0, speed=5.0, yaw_rate=0.5)
    >>> [round(v, 2) for v in turning.velocity]
    [5.0, 0.67, 0.0]
    """

    name: str
    body: Body = "sedan"
    mesh: str | None = None
    materials: tuple[tuple[str, str], ...] = ()
    scale: float = 1.0
    up_axis: Literal["y", "z"] = "y"
    front_axis: Axis = "x"
    x: Metres
    y: Metres
    heading: Radians = 0.0
    speed: MetresPerSecond = 0.0
    yaw_rate: RadiansPerSecond = 0.0
    max_edge: FacetEdge = 0.05
    coarseness: Coarseness = 1.0
    articulation: Articulation = 0.0
    fittings: Fittings | None = None

    def __post_init__(self) -> None:
        need_field_types(self)
        if self.fittings is not None and self.mesh is not None:
            raise InputError(
                f"vehicle '{self.name}' has fittings and a mesh from a file; fittings are made for "
                "built-in bodies, so leave out one of them"
            )
        if self.articulation and (self.mesh is not None or self.body != ARTICULATED_TRUCK):
            raise InputError(
                f"vehicle '{self.name}' has an articulation, but no trailer; leave it at 0 or use "
                f"body = '{ARTICULATED_TRUCK}'"
            )
        if not (self.max_edge > 0 and self.coarseness > 0 and self.scale > 0):
            raise InputError(
                f"vehicle '{self.name}' needs a positive max_edge, coarseness and scale"
            )
        if self.mesh is None and self.max_edge > GREATEST_FACET_EDGE:
            raise InputError(
                f"vehicle '{self.name}' has facets of up to {self.max_edge:g} m, too large for the "
                f"wheel arches of a body; use {GREATEST_FACET_EDGE:g} m or less"
            )

    @property
    def pose(self) -> Pose:
        """Pose of the vehicle's frame in the world."""
        return Pose(x=self.x, y=self.y, yaw=self.heading)

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Velocity of the vehicle's middle at time 0 in the world, m/s, ``(x, y, z)``."""
        along, across = math.cos(self.heading), math.sin(self.heading)
        aside = 0.0 if self.mesh is not None else -self.yaw_rate * rear_axle_x(self.body)
        return self.speed * along - aside * across, self.speed * across + aside * along, 0.0

    @property
    def rear_axle(self) -> tuple[float, float, float]:
        """Middle of the rear axle in the vehicle's frame, m; a file's is at its origin."""
        return (0.0, 0.0, 0.0) if self.mesh is not None else rear_axle(self.body)

    def surface(self) -> Mesh:
        """The vehicle's mesh in its own frame."""
        if self.mesh is None:
            return vehicle_mesh(
                self.body,
                max_edge=self.max_edge,
                coarseness=self.coarseness,
                articulation=self.articulation,
                fittings=self.fittings,
            )
        return _loaded(
            self.mesh, self.materials, self.scale, self.up_axis, self.front_axis, self.max_edge
        )

    @property
    def is_in_pieces(self) -> bool:
        """True for an articulated truck that is bent or turns: its trailer moves on its own."""
        is_truck = self.mesh is None and self.body == ARTICULATED_TRUCK
        return is_truck and bool(self.articulation or self.yaw_rate)

    def actor(self) -> Actor:
        """The vehicle with its mesh and velocity; without its `trailer` if it has one."""
        return Actor(
            name=self.name,
            kind="vehicle",
            pose=self.pose,
            velocity=self.velocity,
            yaw_rate=self.yaw_rate,
            mesh=self._pieces[0] if self.is_in_pieces else self.surface(),
            rear_axle=self.rear_axle,
        )

    def trailer(self) -> Actor | None:
        """The semi-trailer of an articulated truck that is bent or turns, or else None.

        It is drawn by its king pin, which moves with the tractor, and its middle axle does not
        slip: behind a tractor that goes straight on it swings into line, and in a steady bend it
        takes the angle at which both turn alike (`Towing`).

        >>> truck = Vehicle(name="t", body="articulated-truck", x=0.0, y=0.0, speed=10.0,
        ...     articulation=0.2, coarseness=4.0)
        >>> trailer = truck.trailer()
        >>> round(trailer.yaw_rate, 3), trailer.part_of
        (-0.258, 't')
        """
        if not self.is_in_pieces:
            return None
        pulled = self.actor().velocity_at(self.pose.to_outer(KING_PIN))
        towing = replace(TOWING, pin_yaw_rate=self.yaw_rate)
        pose, velocity, yaw_rate = towing.drawn(trailer_pose(self.pose, self.articulation), pulled)
        vx, vy, vz = velocity.tolist()
        return Actor(
            name=f"{self.name} semi-trailer",
            kind="vehicle",
            pose=pose,
            velocity=(vx, vy, vz),
            yaw_rate=yaw_rate,
            mesh=self._pieces[1],
            towing=towing,
            part_of=self.name,
        )

    @property
    def _pieces(self) -> tuple[Mesh, Mesh]:
        return truck_pieces(self.max_edge, self.coarseness, self.fittings)

    def footprint(self) -> Footprint:
        """Rectangle around the vehicle, without mirrors if its body is built in and straight."""
        label = f"vehicle '{self.name}'"
        if self.mesh is None and not self.articulation:
            length, width = vehicle_size(self.body)
            return label, _rectangle(self.pose, -length / 2, length / 2, -width / 2, width / 2)
        low, high = self.surface().vertex.min(axis=0), self.surface().vertex.max(axis=0)
        return label, _rectangle(self.pose, low[0], high[0], low[1], high[1])


@cache
def _loaded(
    path: str,
    materials: tuple[tuple[str, str], ...],
    scale: float,
    up_axis: Literal["y", "z"],
    front_axis: Axis,
    max_edge: float,
) -> Mesh:
    return load_mesh(
        path,
        materials=dict(materials),
        scale=scale,
        up_axis=up_axis,
        front_axis=front_axis,
        max_edge=max_edge,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Building(Spec):
    """A box of ``length`` along ``heading`` and ``width`` across, its middle at (x, y).

    A `Street` has a tuple of them.
    """

    name: str
    x: Metres
    y: Metres
    length: Extent
    width: Extent
    height: Extent
    material: str = "brick"
    heading: Radians = 0.0
    num_windows: Annotated[int, Between(greatest=1000)] = 0

    @property
    def pose(self) -> Pose:
        """Pose of the building's frame in the world."""
        return Pose(x=self.x, y=self.y, yaw=self.heading)

    def actor(self) -> Actor:
        """The building's walls and roof, and windows 1 cm before each wall along its length."""
        if not (self.length > 0 and self.width > 0 and self.height > 0):
            raise InputError(f"building '{self.name}' needs a positive length, width and height")
        if (
            self.num_windows < 0
            or self.num_windows * WINDOW_SIZE[0] > self.length
            or (self.num_windows and self.height < 3)
        ):
            raise InputError(
                f"{self.num_windows} windows do not fit into building '{self.name}'; allow "
                f"{WINDOW_SIZE[0]} m of length for each and a height of 3 m"
            )
        half = (self.length / 2, self.width / 2, self.height / 2)
        walls = []
        for part, turn in (("front", 0), ("left", 1), ("rear", 2), ("right", 3)):
            outward = np.array([math.cos(turn * math.pi / 2), math.sin(turn * math.pi / 2), 0.0])
            along = np.array([-outward[1], outward[0], 0.0])
            reach, breadth = half[turn % 2], half[1 - turn % 2]
            foot = reach * outward
            walls.append(
                upright(foot, along, breadth, 0.0, self.height, self.material, f"wall-{part}")
            )
            if turn % 2 == 1:
                for number in range(self.num_windows):
                    aside = (2 * (number + 0.5) / self.num_windows - 1) * breadth
                    walls.append(
                        upright(
                            foot + 0.01 * outward + aside * along,
                            along,
                            WINDOW_SIZE[0] / 2,
                            0.9,
                            0.9 + WINDOW_SIZE[1],
                            "glass",
                            f"window-{part}-{number + 1}",
                        )
                    )
        roof = Plate(
            centre=(0.0, 0.0, self.height),
            half_u=(half[0], 0.0, 0.0),
            half_v=(0.0, half[1], 0.0),
            material=self.material,
            part="roof",
        )
        return Actor(name=self.name, kind="building", pose=self.pose, plates=(*walls, roof))

    def footprint(self) -> Footprint:
        """Rectangle that the building covers."""
        length, width = self.length / 2, self.width / 2
        return f"building '{self.name}'", _rectangle(self.pose, -length, length, -width, width)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tree(Spec):
    """A tree at (x, y).

    A `Street` has a tuple of them.
    """

    name: str
    x: Metres
    y: Metres
    height: Annotated[float, Unit("m", least="0 m", greatest="100 m")]
    crown_radius: Annotated[float, Unit("m", least="0 m", greatest="50 m")]

    def actor(self) -> Actor:
        """A wooden trunk below an ellipsoidal crown of leaves."""
        if not 0 < 2 * self.crown_radius < self.height:
            raise InputError(
                f"tree '{self.name}' needs a positive crown radius, and a crown that is less wide "
                f"({2 * self.crown_radius:g} m) than the tree is high ({self.height:g} m)"
            )
        return Actor(
            name=self.name,
            kind="tree",
            pose=Pose(x=self.x, y=self.y),
            mesh=tree_mesh(self.height, self.crown_radius),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Road(Spec):
    """A level road along x, its middle at (x, y).

    A `Street` has one or none.
    """

    length: Extent
    width: Extent
    material: str = "asphalt"
    x: Metres = 0.0
    y: Metres = 0.0

    def actor(self) -> Actor:
        """The road's surface, one `Plate`.

        >>> Road(length=60.0, width=8.0).actor().plates[0].normal.tolist()
        [0.0, 0.0, 1.0]
        """
        if not (self.length > 0 and self.width > 0):
            raise InputError("a road needs a positive length and width")
        plate = Plate(
            centre=(0.0, 0.0, 0.0),
            half_u=(self.length / 2, 0.0, 0.0),
            half_v=(0.0, self.width / 2, 0.0),
            material=self.material,
            part="road",
        )
        return Actor(name="road", kind="road", pose=Pose(x=self.x, y=self.y), plates=(plate,))


Fluctuation = Literal["steady", "swerling-1", "swerling-3"]
"""Change of a point's cross section from trial to trial."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Point(Spec):
    r"""An isolated isotropic scatterer of radar cross section ``rcs`` that moves at ``velocity``.

    A fluctuating point has another cross section in every trial, drawn from the seed and its name,
    whose mean is ``rcs``; it stays the same for a frame, and for all radars. With the mean
    :math:`\bar\sigma`, the densities are those of Swerling 1954,

    .. math:: p_1 = \frac{1}{\bar\sigma} e^{-\sigma/\bar\sigma}, \qquad
              p_3 = \frac{4\sigma}{\bar\sigma^2} e^{-2\sigma/\bar\sigma}

    Case 1 stands for many equal scatterers, case 3 for a strong one among weak ones. His cases 2
    and 4 change from pulse to pulse; the ramps of a frame are coherent, and have no such cases.

    Parameters
    ----------
    fluctuation : "steady", "swerling-1" or "swerling-3"

    Examples
    --------
    >>> Point(name="post", x=12.0, y=0.0, z=0.5, rcs=1.0).actor().points[0].rcs
    1.0
    """

    name: str
    x: Metres
    y: Metres
    z: Metres
    rcs: SquareMetres
    velocity: tuple[MetresPerSecond, MetresPerSecond, MetresPerSecond] = (0.0, 0.0, 0.0)
    fluctuation: Fluctuation = "steady"

    def __post_init__(self) -> None:
        need_field_types(self)
        if self.rcs < 0:
            raise InputError(f"point '{self.name}' cannot have a negative radar cross section")

    def drawn(self, rng: np.random.Generator) -> "Point":
        """The point with a drawn cross section, which is steady from then on."""
        if self.fluctuation == "steady":
            return self
        shape = {"swerling-1": 1.0, "swerling-3": 2.0}[self.fluctuation]
        ratio = float(rng.gamma(shape)) / shape
        own = {one.name: getattr(self, one.name) for one in fields(Point)}
        return DrawnPoint(**{**own, "rcs": self.rcs * ratio, "fluctuation": "steady"}, ratio=ratio)

    def actor(self) -> Actor:
        """The point as a body of its own."""
        return Actor(
            name=self.name,
            kind="object",
            pose=Pose(x=self.x, y=self.y, z=self.z),
            velocity=self.velocity,
            points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=self.rcs),),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnPoint(Point):
    """A point of which one trial has drawn the cross section: ``ratio`` times the mean."""

    ratio: float

    def actor(self) -> Actor:
        """The point as a body, which tells how its echo differs from the mean."""
        return replace(super(DrawnPoint, self).actor(), fluctuation=self.ratio)


@dataclass(frozen=True, slots=True, kw_only=True)
class Street(Spec):
    """Everything on and beside a road at time 0.

    Raises
    ------
    InputError
        Two bodies have the same name, or a vehicle overlaps another or a building. Vehicles from
        files are checked when the scene is made.

    Examples
    --------
    >>> street = Street(vehicles=(
    ...     Vehicle(name="a", x=0.0, y=0.0, coarseness=4.0),
    ...     Vehicle(name="b", x=10.0, y=0.0, coarseness=4.0)))
    >>> scene = street.scene([(Radar(name="r"), "a")])
    >>> scene.carriers, [actor.name for actor in scene.actors]
    ((0,), ['a', 'b'])
    """

    road: Road | None = None
    vehicles: tuple[Vehicle, ...] = ()
    buildings: tuple[Building, ...] = ()
    trees: tuple[Tree, ...] = ()
    points: tuple[Point, ...] = ()
    pedestrians: tuple[Pedestrian, ...] = ()
    bicycles: tuple[Bicycle, ...] = ()
    motorcycles: tuple[Motorcycle, ...] = ()
    furniture: tuple[AnyFurniture, ...] = ()

    def __post_init__(self) -> None:
        need_field_types(self)
        bodies: tuple[Vehicle | Building | Tree | Point | RoadUser | Furniture, ...] = (
            *self.vehicles,
            *self.buildings,
            *self.trees,
            *self.points,
            *self.road_users,
            *self.furniture,
        )
        names = [body.name for body in bodies] + (["road"] if self.road else [])
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError(
                f"two things on the street are called '{twice[0]}'; give each its own name"
            )
        _check_room([v for v in self.vehicles if v.mesh is None], self.buildings)

    @property
    def road_users(self) -> tuple[RoadUser, ...]:
        """Pedestrians, bicycles and motorcycles."""
        return (*self.pedestrians, *self.bicycles, *self.motorcycles)

    def scene(self, radars: Sequence[tuple[Radar, str]] = ()) -> Scene:
        """The street at time 0 with radars, each with the name of the vehicle that carries it.

        The mount of a radar on an articulated truck is a place on the straight truck: a radar at
        the rear goes with the trailer.

        `InputError` is raised if a carrier is not among the vehicles, or a vehicle from a file does
        not fit.
        """
        names = [vehicle.name for vehicle in self.vehicles]
        for radar, carrier in radars:
            if carrier not in names:
                raise InputError(
                    f"radar '{radar.name}' rides on '{carrier}', which is no vehicle of this "
                    f"street; choose among {', '.join(names) or 'none: add a vehicle'}"
                )
            _check_view(self.vehicles[names.index(carrier)], radar)
        if any(vehicle.mesh is not None for vehicle in self.vehicles):
            _check_room(self.vehicles, self.buildings)
        road = () if self.road is None else (self.road,)
        moving = (*self.vehicles, *self.points, *self.road_users)
        bodies = (*moving, *road, *self.buildings, *self.trees, *self.furniture)
        actors = [body.actor() for body in bodies]
        trailer_of = {}
        for number, vehicle in enumerate(self.vehicles):
            if (trailer := vehicle.trailer()) is not None:
                trailer_of[number] = len(actors)
                actors.append(trailer)
        carriers = [
            trailer_of.get(number, number) if is_on_trailer(radar.mount) else number
            for radar, number in ((radar, names.index(carrier)) for radar, carrier in radars)
        ]
        return Scene(
            time=0.0,
            actors=tuple(actors),
            radars=tuple(radar for radar, _ in radars),
            carriers=tuple(carriers),
        )


def _check_view(vehicle: Vehicle, radar: Radar) -> None:
    """Raise if a radar is mounted behind a number plate of its vehicle."""
    if vehicle.fittings is None or not vehicle.fittings.number_plates:
        return
    # mounts are places on the straight truck
    mesh, (x, y, z) = replace(vehicle, articulation=0.0).surface(), radar.mount.position
    for end, sign in (("front", 1), ("rear", -1)):
        plate = mesh.corners[mesh.part == mesh.parts.index(f"number-plate-{end}")].reshape(-1, 3)
        low, high = plate.min(axis=0), plate.max(axis=0)
        gap = sign * (x - (high[0] if sign > 0 else low[0]))
        if low[1] < y < high[1] and low[2] < z < high[2] and -BEHIND_PLATE < gap < 0:
            raise InputError(
                f"radar '{radar.name}' is behind the {end} number plate of '{vehicle.name}'; mount "
                f"it below {low[2]:.2f} m, above {high[2]:.2f} m or {high[1]:.2f} m aside, or set "
                "fittings.number_plates = false"
            )


def _rectangle(pose: Pose, rear: float, front: float, right: float, left: float) -> FloatArray:
    corners = np.array([[rear, right, 0], [front, right, 0], [front, left, 0], [rear, left, 0]])
    return pose.to_outer(corners)[:, :2]


def _check_room(vehicles: Sequence[Vehicle], buildings: Sequence[Building]) -> None:
    """Raise if vehicles overlap each other or a building."""
    cars = [vehicle.footprint() for vehicle in vehicles]
    houses = [building.footprint() for building in buildings]
    pairs = [*combinations(cars, 2), *((car, house) for car in cars for house in houses)]
    for (name, corners), (other, others) in pairs:
        if overlap(corners, others):
            raise InputError(f"{name} and {other} overlap; move one of them")


def overlap(first: FloatArray, second: FloatArray) -> bool:
    """True if two rectangles ``(4, xy)`` share area: no side of either separates them.

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> overlap(square, square + 0.9), overlap(square, square + 1.1)
    (True, False)
    """
    for rectangle in (first, second):
        for side in (rectangle[1] - rectangle[0], rectangle[3] - rectangle[0]):
            a, b = first @ side, second @ side
            if a.max() <= b.min() or b.max() <= a.min():
                return False
    return True
