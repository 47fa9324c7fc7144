"""Articulated truck: a tractor of shells, and a semi-trailer that turns about its king pin.

Its greatest length, width and height, and the place of the king pin, are those that Directive
96/53/EC allows in international traffic: 16.50 m, 2.55 m and 4.00 m; at most 12.00 m from the king
pin to the trailer's rear, and 2.04 m to any point of its front. The guard at the rear is below
0.45 m and at least 0.10 m high, as UN Regulation 58 asks. All else is chosen as typical.
"""

import math
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.frames import Pose
from polychirp.model.mesh import Mesh
from polychirp.model.towing import Towing
from polychirp.traffic.fittings import PLATE_GAP, ROD, Fittings, lamp, lock_rod, number_plate
from polychirp.traffic.outline import End
from polychirp.traffic.shapes import TRUCK, Mirror, Tier, Wheels
from polychirp.traffic.shell import Window
from polychirp.traffic.surface import Fineness, SurfaceBuilder, mirrored
from polychirp.traffic.vehicle_parts import sheet, wheel, wheel_section

ARTICULATED_TRUCK: Final[Literal["articulated-truck"]] = "articulated-truck"
"""Name of the body."""

TRUCK_SIZE: Final = (16.5, 2.55, 4.0)
"""Length, width and height, m: the greatest of Directive 96/53/EC."""

TRACTOR_X: Final = 5.25
"""Middle of the tractor, m before the middle of the truck: its front is the truck's front."""

KING_PIN_X: Final = 3.75
"""King pin, m before the middle of the truck: 12.00 m before the trailer's rear."""

KING_PIN: Final = np.array([KING_PIN_X, 0.0, 0.0])
"""Place of the king pin in the frames of truck and trailer, m, ``(xyz,)``."""

BOX: Final = (5.35, -8.25, 1.2)
"""Front, rear and floor of the trailer's box, m: 13.6 m long, 0.7 m behind the cab."""

AXLES: Final = (-2.64, -3.95, -5.26)
"""X of the trailer's axles, m; chosen, 1.31 m apart."""

TYRE: Final = Wheels(front=AXLES[0], rear=AXLES[-1], radius=0.52, width=0.385)
"""The trailer's tyres: 385/65 R 22.5."""

TRACTOR_TAIL: Final = (
    "rear-bumper",
    "bumper-beam-rear",
    "number-plate-rear",
    "tail-lamp-left",
    "tail-lamp-right",
    "tail-lamp-left-cover",
    "tail-lamp-right-cover",
    "exhaust-left",
    "exhaust-right",
    "tow-bar",
)
"""Parts of a truck's rear end that a tractor does not have."""

GUARD: Final = (-8.15, 0.42, 0.57, 1.2)
"""Rear underrun guard, m: its back, lower and upper edge, and half its width."""

UNSEEN_COARSENESS: Final = 3.0
"""Factor on the edges of roof and floor, which radars near the road do not see; as the floor of
other bodies."""

TRACTOR: Final = replace(
    TRUCK,
    length=6.0,
    width=2.5,
    deck=((3.0, 1.02), (2.5, 1.07), (1.9, 1.12), (0.5, 1.14), (-2.8, 1.14)),
    metal_front=End(x=2.55, radius=3.4, corner=0.24),
    metal_rear=End(x=-2.85, radius=4.4, corner=0.2),
    skin_front=End(x=3.0, radius=3.2, corner=0.34),
    skin_rear=End(x=-3.0, radius=4.0, corner=0.28),
    front_bumper_stop=2.3,
    rear_bumper_start=-2.6,
    bonnet_stop=2.3,
    boot_start=-2.8,
    wheels=Wheels(front=1.6, rear=-2.1, radius=0.47, width=0.315, gap=0.045),
    mirror=Mirror(x=2.05, y=1.19, z=1.9, width=0.2, height=0.6),
    tiers=(
        Tier(
            base_front=End(x=2.45, radius=3.0, corner=0.14),
            base_rear=End(x=0.8, radius=20.0, corner=0.08),
            base_half_width=1.2,
            roof_front=End(x=2.1, radius=3.2, corner=0.14),
            roof_rear=End(x=0.84, radius=20.0, corner=0.08),
            roof_half_width=1.1,
            height=3.75,
            walls=(6.0, 12.0, 20.0),
            edge=0.06,
            crown=(10.0, 8.0),
            windows=(
                Window(part="windscreen", arc=0),
                Window(part="window-left", arc=2, start=2.07, stop=1.35),
            ),
            panes=(0.3, 0.7),
            side=40.0,
            part="cab",
            roof_part="cab",
        ),
    ),
)
"""The tractor in its own frame, with sills and bumpers of the truck; its metal deck takes the place
of the frame and the coupling."""


def pieces(tractor: Mesh, fine: Fineness, fittings: Fittings | None = None) -> tuple[Mesh, Mesh]:
    """A tractor's mesh without its tail, and the semi-trailer, in the frame of the straight truck.

    The frame of ``tractor`` is its own.
    """
    moved = replace(tractor, vertex=tractor.vertex + np.array([TRACTOR_X, 0.0, 0.0]))
    return _without(moved, *TRACTOR_TAIL), _trailer(fine, fittings)


def coupled(tractor: Mesh, trailer: Mesh, articulation: float) -> Mesh:
    """The mesh of both `pieces`.

    ``articulation`` is the angle, rad, by which the trailer's heading is to the left of the
    tractor's; the trailer turns about its king pin, and the tractor stays in its place.
    """
    turned = trailer_pose(Pose(), articulation).to_outer(trailer.vertex)
    return _joined(tractor, replace(trailer, vertex=turned))


def trailer_pose(truck: Pose, articulation: float) -> Pose:
    """Pose of the trailer's frame, which is that of the straight truck if it is not bent.

    >>> pose = trailer_pose(Pose(), math.pi / 2)
    >>> round(pose.x, 9), round(pose.y, 9)
    (3.75, -3.75)
    """
    heading = truck.yaw + articulation
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    x, y, z = (truck.to_outer(KING_PIN) - KING_PIN_X * along).tolist()
    return Pose(x=x, y=y, z=z, yaw=heading)


def is_on_trailer(mount: Pose) -> bool:
    """True if a place on the straight truck is on its trailer: not before it, nor on the tractor.

    >>> is_on_trailer(Pose(x=-8.2, z=0.5)), is_on_trailer(Pose(x=8.2, z=0.5))
    (True, False)
    """
    front, _, floor = BOX
    is_on_frame = mount.x > TRACTOR_X - 0.5 * TRACTOR.length and mount.z < floor
    return mount.x < front and not is_on_frame


TOWING: Final = Towing(pin_x=KING_PIN_X, axle_x=AXLES[1])
"""The trailer behind its king pin; its three axles move like the one in the middle."""


def _trailer(fine: Fineness, fittings: Fittings | None) -> Mesh:
    """The straight semi-trailer: box, girder, wheels, side guards, legs and rear guard."""
    front, rear, floor = BOX
    half, top = TRUCK_SIZE[1] / 2, TRUCK_SIZE[2]
    builder = SurfaceBuilder()
    unseen = replace(fine, max_edge=UNSEEN_COARSENESS * fine.max_edge)
    ends, sides = ("front", "rear"), ("left",)
    box = np.array([[rear, 0.0, floor], [front, half, top]])
    _box(builder, fine, box, part="trailer", faces=(*ends, *sides))
    _box(builder, unseen, box, part="trailer-roof", faces=("top",))
    _box(builder, unseen, box, part="trailer-floor", faces=("bottom",))
    girder = np.array([[rear + 0.4, 0.0, 0.95], [1.6, 0.45, floor]])
    _box(builder, unseen, girder, part="girder", faces=(*ends, *sides, "bottom"))
    for low in (0.55, 0.85):
        rail = np.array([[-1.95, half - 0.06, low], [0.6, half - 0.03, low + 0.1]])
        _box(builder, fine, rail, part="side-guard-left", faces=(*ends, *sides, "right", "top"))
    leg = np.array([[0.9, 0.6, 0.3], [1.02, 0.72, floor]])
    _box(builder, fine, leg, part="leg-left", faces=(*ends, *sides, "right", "bottom"))
    back, low, high, reach = GUARD
    guard = np.array([[back, 0.0, low], [back + 0.1, reach, high]])
    # it is the rear bumper as far as mounting places of radars are concerned
    _box(builder, fine, guard, part="rear-bumper", faces=(*ends, *sides, "top", "bottom"))
    tyre = replace(fine, coarseness=2.0 * fine.coarseness)
    for number, x in enumerate(AXLES):
        wheel(builder, tyre, x, wheel_section(TYRE, half - 0.03), f"trailer-{number + 1}")
    if fittings is not None:
        _fit_trailer(builder, fine, fittings)
    return mirrored(builder.mesh())


def _fit_trailer(builder: SurfaceBuilder, fine: Fineness, fittings: Fittings) -> None:
    """Add lock rods to the rear doors; number plate and lamps above the rear guard."""
    _, rear, floor = BOX
    if fittings.door_handles:
        for aside in ROD[1:]:
            lock_rod(
                builder, fine, x=rear - 0.02, y=2 * aside, limits=(floor + 0.1, TRUCK_SIZE[2] - 0.1)
            )
    height = 0.5 * (GUARD[2] + floor)
    if fittings.number_plates:
        number_plate(
            builder,
            fine,
            x=GUARD[0] - PLATE_GAP,
            z=height,
            tilt=fittings.plate_tilt,
            facing=-1,
            part="number-plate-rear",
        )
    if fittings.lamps:
        for y in (0.9, 1.05):
            lamp(
                builder,
                fine,
                x=GUARD[0],
                y=y,
                z=height,
                facing=-1,
                part="tail-lamp-left",
                has_cover=True,
            )


def _box(
    builder: SurfaceBuilder,
    fine: Fineness,
    limits: FloatArray,
    *,
    part: str,
    faces: tuple[str, ...],
) -> None:
    """Add some faces of a metal box between its least and its greatest corner, m ``(2, xyz)``."""
    (rear, right, low), (front, left, high) = limits.tolist()
    corners = {
        "front": [
            (front, right, low),
            (front, left, low),
            (front, left, high),
            (front, right, high),
        ],
        "rear": [(rear, left, low), (rear, right, low), (rear, right, high), (rear, left, high)],
        "left": [(front, left, low), (rear, left, low), (rear, left, high), (front, left, high)],
        "right": [
            (rear, right, low),
            (front, right, low),
            (front, right, high),
            (rear, right, high),
        ],
        "top": [(rear, right, high), (front, right, high), (front, left, high), (rear, left, high)],
        "bottom": [(rear, left, low), (front, left, low), (front, right, low), (rear, right, low)],
    }
    for face in faces:
        sheet(builder, fine, np.array(corners[face]), part=part, material="metal")


def _without(mesh: Mesh, *parts: str) -> Mesh:
    """A mesh without the faces of some parts: tractors have no plastic tail."""
    kept = ~np.isin(mesh.part, [number for number, part in enumerate(mesh.parts) if part in parts])
    return replace(mesh, face=mesh.face[kept], material=mesh.material[kept], part=mesh.part[kept])


def _joined(first: Mesh, second: Mesh) -> Mesh:
    """Two meshes as one."""
    parts = tuple(dict.fromkeys((*first.parts, *second.parts)))
    materials = tuple(dict.fromkeys((*first.materials, *second.materials)))
    meshes = (first, second)
    return Mesh(
        vertex=np.concatenate([first.vertex, second.vertex]),
        face=np.concatenate([first.face, second.face + len(first.vertex)]),
        material=np.concatenate(
            [
                np.array([materials.index(m) for m in mesh.materials])[mesh.material]
                for mesh in meshes
            ]
        ),
        part=np.concatenate(
            [np.array([parts.index(p) for p in mesh.parts])[mesh.part] for mesh in meshes]
        ),
        materials=materials,
        parts=parts,
    )
