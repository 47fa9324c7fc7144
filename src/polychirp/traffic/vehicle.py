"""Parametric vehicles: curved shells of metal, glass, plastic and rubber, meshed for 79 GHz."""

from dataclasses import replace
from functools import cache

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.model.mesh import Mesh
from polychirp.traffic.fittings import (
    BEAM_GAP,
    BEAM_SHARE,
    FRONT_PLATE_HEIGHT,
    HANDLE,
    LAMP,
    PIPE,
    PLATE_GAP,
    RADIATOR_GAP,
    REAR_PLATE_RISE,
    Fittings,
    bumper_beam,
    door_handle,
    lamp,
    number_plate,
    pipe,
    radiator,
    tow_ball,
    x_at,
)
from polychirp.traffic.outline import End, Outline
from polychirp.traffic.semi_trailer import (
    ARTICULATED_TRUCK,
    TRACTOR,
    TRACTOR_X,
    TRUCK_SIZE,
    coupled,
    pieces,
)
from polychirp.traffic.shapes import SHAPES, Body, Shape, Tier
from polychirp.traffic.shell import Arch, Cabin, Cover, Shell, flank
from polychirp.traffic.surface import Fineness, SurfaceBuilder, mirrored
from polychirp.traffic.vehicle_parts import (
    open_wheel_section,
    sheet,
    spokes,
    wheel,
    wheel_section,
)

LOWER_BODY_COARSENESS = 0.8
"""Factor on `edge_limit` for curves of the lower body (chosen: it gives a car's strongest echo)."""

BUMPER_COARSENESS = 1.28
"""Factor on `edge_limit` for bumpers (chosen: 3 mm of polypropylene reflect less than −8 dB)."""

WHEEL_COARSENESS = 2.0
"""Factor on `edge_limit` for wheels (chosen: 2-cm edges, whose middles are λ/16 off the circle)."""

FLOOR_INSET = 0.3
"""Distance from the body's outline inwards to the flat floor, m (chosen: room for a wheel)."""

HEADLAMPS = (0.285, 0.37)
"""Middles of the chambers of the left headlamp, as shares of the vehicle's width; chosen."""

TAIL_LAMPS = (0.34, 0.41)
"""Middles of the chambers of the left tail lamp, as shares of the vehicle's width; chosen."""

REAR_BEAM_GAP = 0.06
"""Distance from the rear bumper's plastic in to the beam, m; chosen: between plastic and metal."""

BUMPER_GAP = 0.008
"""Distance of the bumpers' plastic from the metal beside it, m (chosen)."""


def vehicle_mesh(
    body: Body,
    *,
    max_edge: float = 0.05,
    coarseness: float = 1.0,
    articulation: float = 0.0,
    fittings: Fittings | None = None,
) -> Mesh:
    """Surface of a ``body`` in the vehicle's frame; equal calls share one `Mesh`.

    The origin is on the ground below the middle of the length, x forward, y left, z up. Body,
    bonnet, boot lid and rims are metal; windows, mirrors (glass) and bumpers (plastic) are single
    sheets; tyres are rubber: table 1 of the paper. The metal begins about 0.45 m behind the
    plastic nose and ends 0.15 m before the plastic tail. The metal is convex and smooth at both
    ends, so that one specular point is visible from a radar at bumper height, and nothing opaque
    hides it.

    Parameters
    ----------
    body : one of ``"sedan"``, ``"hatchback"``, ``"van"``, ``"truck"``, ``"articulated-truck"``
    max_edge : longest edge on flats, m
    coarseness : factor on the edges that `surface.edge_limit` allows on curves: 1 for echoes,
        about 4 for shadows and pictures
    articulation : rad, of the semi-trailer of an articulated truck, see `coupled`
    fittings : number plates, bumper beams, lamps and other parts that echo; None: the smooth shell
        with closed rims alone

    Raises
    ------
    InputError
        The body is unknown, an edge is not positive, or a body without a trailer is articulated.

    Examples
    --------
    >>> mesh = vehicle_mesh("sedan", max_edge=0.2, coarseness=4.0)
    >>> sorted(mesh.materials)
    ['glass', 'metal', 'plastic', 'rubber']
    >>> mesh is vehicle_mesh("sedan", max_edge=0.2, coarseness=4.0)
    True
    """
    return _mesh(body, max_edge, coarseness, articulation, fittings)


@cache
def _mesh(
    body: Body,
    max_edge: float,
    coarseness: float,
    articulation: float,
    fittings: Fittings | None,
) -> Mesh:
    known = (*SHAPES, ARTICULATED_TRUCK)
    if body not in known:
        raise InputError(f"there is no body '{body}'; choose among {', '.join(known)}")
    fine = Fineness(max_edge=max_edge, coarseness=coarseness)
    if body == ARTICULATED_TRUCK:
        return coupled(*truck_pieces(max_edge, coarseness, fittings), articulation)
    if articulation:
        raise InputError(f"a {body} has no trailer; leave its articulation at 0")
    return _one_piece(fine, SHAPES[body], fittings)


@cache
def truck_pieces(
    max_edge: float, coarseness: float, fittings: Fittings | None
) -> tuple[Mesh, Mesh]:
    """Surfaces of the articulated truck's tractor and of its trailer, each in its own frame.

    Both frames are that of the straight truck; the parameters are those of `vehicle_mesh`.
    """
    fine = Fineness(max_edge=max_edge, coarseness=coarseness)
    return pieces(_one_piece(fine, TRACTOR, fittings), fine, fittings)


def _one_piece(fine: Fineness, shape: Shape, fittings: Fittings | None) -> Mesh:
    """Surface of a vehicle of one piece."""
    lower, weak, round_edges = (
        replace(fine, coarseness=factor * fine.coarseness)
        for factor in (LOWER_BODY_COARSENESS, BUMPER_COARSENESS, WHEEL_COARSENESS)
    )
    builder = SurfaceBuilder()
    metal = _metal_shell(shape)
    _lower_body(builder, lower, shape, metal)
    _front_bumper(builder, weak, shape)
    _rear_bumper(builder, weak, shape, metal)
    for tier in shape.tiers:
        _cabin(builder, fine, shape, tier)
    has_open_rims = fittings is not None and fittings.open_rims
    section = open_wheel_section if has_open_rims else wheel_section
    for axle, x in (("front", shape.wheels.front), ("rear", shape.wheels.rear)):
        outer = float(metal.outline.point(2, metal.outline.angle_at(np.array(x)))[1]) - 0.015
        wheel(builder, round_edges, x, section(shape.wheels, outer), axle)
        if has_open_rims:
            spokes(builder, fine, shape.wheels, x, outer, axle)
    _mirror(builder, fine, shape)
    if fittings is not None:
        _fit_out(builder, fine, shape, metal, fittings)
    return mirrored(builder.mesh())


def _fit_out(
    builder: SurfaceBuilder, fine: Fineness, shape: Shape, metal: Shell, fittings: Fittings
) -> None:
    """Add the fittings of both ends and of the side, in the places that the shape has for them."""
    nose = _outline(shape, shape.skin_front, shape.skin_rear, BUMPER_GAP)
    _fit_front(builder, fine, shape, nose, fittings)
    _fit_rear(builder, fine, shape, metal, fittings)
    if fittings.door_handles:
        for window in (w for tier in shape.tiers for w in tier.windows if w.arc == 2):
            x = window.stop + HANDLE[0]
            side = float(metal.outline.point(2, metal.outline.angle_at(np.array(x)))[1])
            z = float(shape.deck_height(np.array(x), np.array(side))) - 0.08
            door_handle(builder, fine, x=x, y=side, z=z, part="door-handle-left")


def _fit_front(
    builder: SurfaceBuilder, fine: Fineness, shape: Shape, nose: Outline, fittings: Fittings
) -> None:
    """Add the number plate before the plastic; beam, radiator and lamps behind it."""
    tip = shape.skin_front.x
    if fittings.number_plates:
        number_plate(
            builder,
            fine,
            x=tip + PLATE_GAP,
            z=FRONT_PLATE_HEIGHT,
            tilt=fittings.plate_tilt,
            facing=1,
            part="number-plate-front",
        )
    if fittings.bumper_beams:
        bumper_beam(
            builder,
            fine,
            x=tip - BEAM_GAP,
            radius=shape.skin_front.radius,
            length=BEAM_SHARE * shape.width,
            facing=1,
            part="bumper-beam-front",
        )
    if fittings.radiator:
        radiator(builder, fine, x=tip - BEAM_GAP - RADIATOR_GAP)
    if fittings.lamps:
        top = shape.skin_front_profile
        for share in HEADLAMPS:
            y = share * shape.width
            lamp(
                builder,
                fine,
                x=x_at(nose, y, 1) - top.inset - 0.01,
                y=y,
                z=top.waist + 0.14,
                facing=1,
                part="headlamp-left",
                has_cover=False,
            )


def _fit_rear(
    builder: SurfaceBuilder, fine: Fineness, shape: Shape, metal: Shell, fittings: Fittings
) -> None:
    """Add number plate, lamps, beam, exhaust and tow bar."""
    tail = shape.skin_rear.x
    if fittings.number_plates:
        number_plate(
            builder,
            fine,
            x=shape.metal_rear.x - PLATE_GAP,
            z=shape.rear_bumper_top + REAR_PLATE_RISE,
            tilt=fittings.plate_tilt,
            facing=-1,
            part="number-plate-rear",
        )
    if fittings.bumper_beams:
        bumper_beam(
            builder,
            fine,
            x=tail + REAR_BEAM_GAP,
            radius=shape.skin_rear.radius,
            length=BEAM_SHARE * shape.width,
            facing=-1,
            part="bumper-beam-rear",
        )
    if fittings.lamps:
        for share in TAIL_LAMPS:
            y = share * shape.width
            lamp(
                builder,
                fine,
                x=x_at(metal.outline, y, -1) - LAMP[2] - 0.005,
                y=y,
                z=shape.rear_bumper_top + REAR_PLATE_RISE,
                facing=-1,
                part="tail-lamp-left",
                has_cover=True,
            )
    if fittings.exhaust:
        low = shape.skin_rear_profile.sill - PIPE[0] - 0.005
        pipe(builder, x=tail + 0.06, y=0.25 * shape.width, z=low, part="exhaust-left")
    if fittings.tow_bar:
        tow_ball(builder, fine, x=tail)


def vehicle_size(body: Body) -> tuple[float, float]:
    """Length and width of a body without its mirrors, m."""
    if body == ARTICULATED_TRUCK:
        return TRUCK_SIZE[:2]
    return SHAPES[body].length, SHAPES[body].width


def rear_axle_x(body: Body) -> float:
    """X of a body's rear axle in the vehicle's frame, m; of an articulated truck, its tractor's.

    >>> rear_axle_x("sedan")
    -1.34
    """
    if body == ARTICULATED_TRUCK:
        return TRACTOR_X + TRACTOR.wheels.rear
    return SHAPES[body].wheels.rear


def rear_axle(body: Body) -> tuple[float, float, float]:
    """Middle of a body's rear axle in the vehicle's frame, m; its height is the wheels' radius.

    >>> rear_axle("sedan")
    (-1.34, 0.0, 0.32)
    """
    shape = TRACTOR if body == ARTICULATED_TRUCK else SHAPES[body]
    return rear_axle_x(body), 0.0, shape.wheels.radius


def _outline(shape: Shape, front: End, rear: End, margin: float = 0.0) -> Outline:
    return Outline(
        front=front,
        rear=rear,
        half_width=shape.width / 2 - BUMPER_GAP + margin,
        widest=shape.widest,
        side=shape.side + margin,
    )


def _arches(shape: Shape) -> tuple[Arch, ...]:
    wheels, sill = shape.wheels, shape.flank.sill
    reach = wheels.radius + wheels.gap
    return tuple(
        Arch(x=x, half_width=reach, sill=sill, height=wheels.radius + reach - sill)
        for x in (wheels.front, wheels.rear)
    )


def _metal_shell(shape: Shape) -> Shell:
    return Shell(
        outline=_outline(shape, shape.metal_front, shape.metal_rear),
        front=shape.front,
        side=shape.flank,
        rear=shape.rear,
        shoulder=shape.shoulder,
        deck=shape.deck_height,
        arches=_arches(shape),
    )


def _lower_body(builder: SurfaceBuilder, fine: Fineness, shape: Shape, metal: Shell) -> None:
    """Add a closed metal tub: flanks with wheel openings, bonnet, belt, boot lid, underbody."""
    ribs = metal.ribs(builder, fine, metal.stations(fine))
    flank(builder, ribs, part="body", material="metal")

    def part_at(x: float) -> str:
        if x > shape.bonnet_stop:
            return "bonnet"
        return "boot-lid" if x < shape.boot_start else "body"

    deck = Cover(
        height=shape.deck_height,
        part=part_at,
        rim_part="body",
        across=shape.deck_crown,
        along=shape.deck_radius,
    )
    deck.fill(builder, fine, ribs.upper_rim)
    bottom = metal.undercut(builder, fine, ribs, FLOOR_INSET, part="underbody", material="metal")
    # the floor is not visible from a radar above it, so its facets may be three times as long
    rough = replace(fine, max_edge=3 * fine.max_edge)
    floor = Cover(
        height=lambda x, _: np.full_like(x, shape.flank.sill),
        part=lambda _: "underbody",
        rim_part="underbody",
        turn=-1,
    )
    floor.fill(builder, rough, bottom)


def _front_bumper(builder: SurfaceBuilder, fine: Fineness, shape: Shape) -> None:
    """Add the plastic nose: a skin before the metal that continues over the edge of the bonnet."""

    def deck(x: FloatArray, y: FloatArray) -> FloatArray:
        return shape.deck_height(x, y) + BUMPER_GAP

    skin = Shell(
        outline=_outline(shape, shape.skin_front, shape.skin_rear, BUMPER_GAP),
        front=shape.skin_front_profile,
        side=shape.flank,
        rear=shape.rear,
        shoulder=shape.shoulder,
        deck=deck,
        arches=_arches(shape),
    )
    stop = shape.front_bumper_stop
    ribs = skin.ribs(builder, fine, skin.stations(fine, stop=stop))
    flank(builder, ribs, part="front-bumper", material="plastic")
    runs = []
    for point, (x, y, _) in zip(ribs.top_line, ribs.top, strict=True):
        back = np.linspace(x, stop, fine.steps(max(x - stop, 0.0), shape.deck_radius) + 1)[1:]
        level = np.column_stack([back, np.full_like(back, y), deck(back, y + 0 * back)])
        runs.append(np.append([point], builder.line(level)) if x - stop > 0.01 else point[None])
    builder.net(runs[::-1], part="front-bumper", material="plastic")


def _rear_bumper(builder: SurfaceBuilder, fine: Fineness, shape: Shape, metal: Shell) -> None:
    """Add the plastic tail: a skin behind the metal, with a ledge above that ends in the metal."""

    def ledge_height(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.full(np.broadcast_shapes(x.shape, y.shape), shape.rear_bumper_top)

    skin = Shell(
        outline=_outline(shape, shape.skin_front, shape.skin_rear, BUMPER_GAP),
        front=shape.front,
        side=shape.flank,
        rear=shape.skin_rear_profile,
        shoulder=0.02,
        deck=ledge_height,
        arches=_arches(shape),
    )
    stations = skin.stations(fine, start=shape.rear_bumper_start)
    ribs = skin.ribs(builder, fine, stations)
    flank(builder, ribs, part="rear-bumper", material="plastic")
    ledges = []
    _, sides, rear = stations.weights(skin.outline)
    depth = 0.05 * sides + (metal.outline.rear.x - skin.outline.rear.x + 0.04) * rear
    _, normal, _ = skin.planes(stations)
    hidden = ribs.top - np.column_stack([depth[:, None] * normal, 0 * depth])
    for point, outer, inner in zip(ribs.top_line, ribs.top, hidden, strict=True):
        count = fine.steps(float(np.linalg.norm(inner - outer)))
        line = outer + np.linspace(0, 1, count + 1)[1:, None] * (inner - outer)
        ledges.append(np.append([point], builder.line(line)))
    builder.net(ledges[::-1], part="rear-bumper", material="plastic")


def _cabin(builder: SurfaceBuilder, fine: Fineness, shape: Shape, tier: Tier) -> None:
    """Add walls, panes and roof of one tier."""
    middle = (tier.roof_front.x + tier.roof_rear.x) / 2

    def foot(x: FloatArray, y: FloatArray) -> FloatArray:
        return shape.deck_height(x, y) - 0.01

    def roof(x: FloatArray, y: FloatArray) -> FloatArray:
        along, across = tier.crown
        return tier.height - (x - middle) ** 2 / (2 * along) - y * y / (2 * across)

    def outline(front: End, rear: End, half_width: float) -> Outline:
        widest = (front.x + rear.x) / 2
        return Outline(front=front, rear=rear, half_width=half_width, widest=widest, side=tier.side)

    cabin = Cabin(
        base=outline(tier.base_front, tier.base_rear, tier.base_half_width),
        roof=outline(tier.roof_front, tier.roof_rear, tier.roof_half_width),
        deck=foot,
        top=roof,
        front=tier.walls[0],
        side=tier.walls[1],
        rear=tier.walls[2],
        edge=tier.edge,
        windows=tier.windows,
        pane_low=tier.panes[0],
        pane_high=tier.panes[1],
        part=tier.part,
    )
    ribs = cabin.build(builder, fine)
    cover = Cover(
        height=roof,
        part=lambda _: tier.roof_part,
        rim_part=tier.roof_part,
        across=tier.crown[1],
        along=tier.crown[0],
    )
    cover.fill(builder, fine, ribs.upper_rim)


def _mirror(builder: SurfaceBuilder, fine: Fineness, shape: Shape) -> None:
    """Add a mirror: a slightly convex sheet of glass in a faceted plastic housing."""
    mirror = shape.mirror
    y, z = mirror.y, mirror.z
    rear = _frame(mirror.x, y, y + mirror.width, z, z + mirror.height)
    shrink = 0.035
    front = _frame(
        mirror.x + 0.1, y, y + mirror.width - shrink, z + shrink, z + mirror.height - shrink
    )
    for k in range(4):
        corners = np.array([rear[k], rear[(k + 1) % 4], front[(k + 1) % 4], front[k]])
        sheet(builder, fine, corners, part="mirror-left", material="plastic")
    sheet(builder, fine, front, part="mirror-left", material="plastic")
    sheet(builder, fine, rear[::-1], part="mirror-left", material="glass", bulge=0.004, radius=1.3)


def _frame(x: float, right: float, left: float, low: float, high: float) -> FloatArray:
    """Corners of an upright rectangle, counter-clockwise seen from the front, m, ``(4, xyz)``."""
    return np.array([[x, right, low], [x, left, low], [x, left, high], [x, right, high]])
