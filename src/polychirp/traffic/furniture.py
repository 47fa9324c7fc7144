"""Street furniture: `GuardRail`, `TrafficSign`, `Bollard`, `Kerb` and `ManholeCover`."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Final, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.mesh import Mesh, Plate
from polychirp.model.scene import Actor
from polychirp.spec import ByKind, Spec
from polychirp.traffic.manhole import ManholeCover
from polychirp.traffic.roadside import FURNITURE_EDGE, turned, upright
from polychirp.traffic.surface import Fineness, SurfaceBuilder
from polychirp.traffic.vehicle_parts import sheet
from polychirp.units import Metres, Radians, Unit

BACK_COARSENESS: Final = 4.0
"""Factor on the edges of facets on the back of a guard rail; chosen: radars see its front."""

BEAM: Final = (0.31, 0.083)
"""Height and depth of the beam of a guard rail, m: the two-wave beam of AASHTO M 180 (312 mm by
83 mm), as a cosine of two periods."""

RAIL_TOP: Final = 0.75
"""Height of the upper edge of a guard rail, m; usual in Europe and the United States."""

POST: Final = (0.10, 0.055)
"""Depth and breadth of a guard rail's posts, m; chosen: a C 100 by 55 profile, as a box."""

RailLength = Annotated[float, Unit("m", least="0.5 m", greatest="60 m")]
"""Length of a guard rail, m."""

Size = Annotated[float, Unit("m", least="0.01 m", greatest="10 m")]
"""Size of a piece of street furniture, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardRail(Spec):
    """A steel guard rail along ``heading`` with its middle at (x, y); its face is on the left.

    Parameters
    ----------
    post_spacing : distance of the posts behind the beam, m

    Examples
    --------
    >>> rail = GuardRail(name="rail", x=10.0, y=-5.0, length=4.0).actor().mesh
    >>> sorted(set(rail.parts)), float(rail.vertex[:, 2].max())
    (['beam', 'post'], 0.75)
    """

    kind: Literal["guard-rail"] = "guard-rail"
    name: str
    x: Metres
    y: Metres
    heading: Radians = 0.0
    length: RailLength = 12.0
    post_spacing: RailLength = 2.0

    def __post_init__(self) -> None:
        if self.post_spacing > self.length:
            raise InputError(
                f"guard rail '{self.name}' has posts every {self.post_spacing:g} m, but is only "
                f"{self.length:g} m long; lower post_spacing"
            )

    def actor(self) -> Actor:
        """The rail as a body of metal."""
        return Actor(
            name=self.name,
            kind="furniture",
            pose=Pose(x=self.x, y=self.y, yaw=self.heading),
            mesh=_rail_mesh(self.length, self.post_spacing),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficSign(Spec):
    """A flat rectangular sign of metal on a post at (x, y); its face looks along ``heading``.

    Parameters
    ----------
    width, height : of the plate, m
    bottom : height of the plate's lower edge above the ground, m

    Examples
    --------
    >>> sign = TrafficSign(name="sign", x=20.0, y=4.0, heading=math.pi).actor()
    >>> float(sign.mesh.vertex[:, 2].max())
    2.6
    """

    kind: Literal["sign"] = "sign"
    name: str
    x: Metres
    y: Metres
    heading: Radians = 0.0
    width: Size = 0.6
    height: Size = 0.6
    bottom: Size = 2.0

    def actor(self) -> Actor:
        """The sign with its post."""
        return Actor(
            name=self.name,
            kind="furniture",
            pose=Pose(x=self.x, y=self.y, yaw=self.heading),
            mesh=_sign_mesh(self.width, self.height, self.bottom),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Bollard(Spec):
    """An upright round bollard at (x, y).

    Examples
    --------
    >>> Bollard(name="b", x=9.0, y=3.0).actor().mesh.parts
    ('bollard',)
    """

    kind: Literal["bollard"] = "bollard"
    name: str
    x: Metres
    y: Metres
    height: Size = 0.9
    radius: Annotated[float, Unit("m", least="0.02 m", greatest="0.5 m")] = 0.06
    material: str = "metal"

    def actor(self) -> Actor:
        """The bollard as a closed body."""
        return Actor(
            name=self.name,
            kind="furniture",
            pose=Pose(x=self.x, y=self.y),
            mesh=_bollard_mesh(self.radius, self.height, self.material),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Kerb(Spec):
    """A straight kerb along ``heading`` with its middle at (x, y); its face is on the left.

    It mirrors and blocks as a plate; it scatters only with `Composite.diffuse`.

    Examples
    --------
    >>> Kerb(name="kerb", x=0.0, y=-3.5, length=80.0).actor().plates[0].normal.round(6).tolist()
    [0.0, 1.0, 0.0]
    """

    kind: Literal["kerb"] = "kerb"
    name: str
    x: Metres
    y: Metres
    heading: Radians = 0.0
    length: Annotated[float, Unit("m", least="0.5 m", greatest="10 km")] = 20.0
    height: Annotated[float, Unit("m", least="0.01 m", greatest="0.5 m")] = 0.12
    width: Size = 0.15
    material: str = "concrete"

    def actor(self) -> Actor:
        """The kerb's face and top."""
        face = upright(
            np.zeros(3),
            np.array([-1.0, 0.0, 0.0]),
            self.length / 2,
            0.0,
            self.height,
            self.material,
            "face",
        )
        top = Plate(
            centre=(0.0, -self.width / 2, self.height),
            half_u=(self.length / 2, 0.0, 0.0),
            half_v=(0.0, self.width / 2, 0.0),
            material=self.material,
            part="top",
        )
        return Actor(
            name=self.name,
            kind="furniture",
            pose=Pose(x=self.x, y=self.y, yaw=self.heading),
            plates=(face, top),
        )


Furniture = GuardRail | TrafficSign | Bollard | Kerb | ManholeCover
AnyFurniture = Annotated[Furniture, ByKind(method="actor")]
"""A piece of street furniture, of the ``kind`` that a study file names."""


@cache
def _rail_mesh(length: float, post_spacing: float) -> Mesh:
    """Beam with its face to +y, and posts behind it."""
    builder, fine = SurfaceBuilder(), Fineness(max_edge=FURNITURE_EDGE)
    back = Fineness(max_edge=FURNITURE_EDGE, coarseness=BACK_COARSENESS)
    for side, fineness in ((-1, fine), (1, back)):
        lines = [builder.line(place) for place in _beam_lines(length, fineness)]
        builder.net(lines[::side], part="beam", material="metal")
    posts = round(length / post_spacing)
    for x in np.linspace(-length / 2, length / 2, posts + 1):
        _post(builder, fine, float(x))
    return builder.mesh()


def _beam_lines(length: float, fine: Fineness) -> list[FloatArray]:
    """Lines along the beam, from its lower to its upper edge, m, ``(point, xyz)`` each."""
    height, depth = BEAM
    bend = height**2 / (8 * math.pi**2 * depth)  # least radius of curvature
    along = np.linspace(-length / 2, length / 2, fine.steps(length) + 1)
    shares = np.linspace(0.0, 1.0, fine.steps(height + 2 * depth, bend) + 1)
    return [
        np.column_stack(
            [
                along,
                np.full_like(along, 0.5 * depth * (1 - math.cos(4 * math.pi * share))),
                np.full_like(along, RAIL_TOP - height * (1 - share)),
            ]
        )
        for share in shares.tolist()
    ]


def _post(builder: SurfaceBuilder, fine: Fineness, x: float) -> None:
    """Add the four sides of an upright box behind the beam."""
    deep, broad = POST
    corners = [(x + broad / 2, -deep), (x + broad / 2, 0.0), (x - broad / 2, 0.0)]
    corners += [(x - broad / 2, -deep)]
    for first, second in zip(corners, [*corners[1:], corners[0]], strict=True):
        wall = [(*first, 0.0), (*second, 0.0), (*second, RAIL_TOP), (*first, RAIL_TOP)]
        sheet(builder, fine, np.array(wall), part="post", material="metal")


@cache
def _sign_mesh(width: float, height: float, bottom: float) -> Mesh:
    """Plate with its face to +x before a round post."""
    builder, fine = SurfaceBuilder(), Fineness(max_edge=FURNITURE_EDGE)
    front, back, radius = 0.035, 0.032, 0.03
    y, top = width / 2, bottom + height
    face = np.array([[front, -y, bottom], [front, y, bottom], [front, y, top], [front, -y, top]])
    sheet(builder, fine, face, part="sign", material="metal")
    face[:, 0] = back
    sheet(builder, fine, face[::-1], part="sign", material="metal")
    profile = _round_profile(fine, radius, top)
    turned(builder, fine, profile, curvature=radius, part="post", material="metal")
    return builder.mesh()


@cache
def _bollard_mesh(radius: float, height: float, material: str) -> Mesh:
    builder, fine = SurfaceBuilder(), Fineness(max_edge=FURNITURE_EDGE)
    profile = _round_profile(fine, radius, height)
    turned(builder, fine, profile, curvature=radius, part="bollard", material=material)
    return builder.mesh()


def _round_profile(fine: Fineness, radius: float, height: float) -> list[tuple[float, float]]:
    """Profile (radius, z), m, of a closed upright cylinder."""
    levels = np.linspace(0.0, height, fine.steps(height) + 1)
    return [(0.0, 0.0), *((radius, float(z)) for z in levels), (0.0, height)]
