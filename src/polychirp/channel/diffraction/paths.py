r"""Diffraction of direct paths at the silhouettes of obstacles in or near the line of sight.

A radar illuminates another at distance d past obstacles. Kirchhoff's integral U over the free
aperture between them is the sum of the geometric wave, if the line of sight is clear, and a wave
from every point of the silhouette's edge (Maggi 1888, Rubinowicz 1917; Born & Wolf §8.9). With the
unobstructed field U₀,

.. math::
    \frac{U}{U_0} = [\text{clear}] + \frac{1}{2\pi}\oint d\varphi \sum_{\text{edges}} \pm
    \frac{1+\cos\theta}{2}\,e^{-jk(r_1+r_2-d)}

where [clear] is 1 or 0, k is the wavenumber, :math:`r_1, r_2` are the edge's distances from both
radars, θ is the angle by which the path bends there, and φ the azimuth about the line of sight. The
sign is + (−) for an edge beyond which, away from the line of sight, the aperture is free (blocked).
With the edge's element dl and its distance ρ from the line of sight, the boundary wave
:math:`\frac{1}{4\pi}\oint \frac{e^{-jk(r_1+r_2)}}{r_1 r_2}\frac{(\hat r_1\times\hat r_2)\cdot
dl}{1-\cos\theta}` takes this form because :math:`(\vec r_1\times\vec r_2)\cdot dl = \rho^2 d\,
d\varphi` and :math:`r_1^2 r_2^2\sin^2\theta = \rho^2d^2`. Nothing is singular at grazing
incidence, where half of all azimuths are blocked and U = ½U₀. For a straight edge at the height h
over the line of sight, :math:`d_1` and :math:`d_2` along it from the radars, U/U₀ is Fresnel's
:math:`\frac{1+j}{2}[(\frac12-C(\nu)) - j(\frac12-S(\nu))]`,
:math:`\nu = h\sqrt{\frac2\lambda(\frac1{d_1}+\frac1{d_2})}`.

**The silhouette.** Every triangle that may be in the way is cut by half-planes about the line of
sight. In a half-plane it covers an interval of the excess :math:`r_1+r_2-d`, which is least where
a mirror would reflect and greatest at an end of the cut. The intervals of all surfaces are united,
and the ends of the united intervals are the edges, each with its own depth. Between two half-planes
an edge is straight.

**Obstacles** are the surfaces that block, except those that both radars are in front of: these
reflect, which other mechanisms compute. A plate is an obstacle only if its plane lies between the
radars. Nothing within `RADAR_CLEARANCE` of either radar, along the line of sight, is an obstacle.

**Limits.** Each end of a united interval is one edge: of several obstacles behind one another, and
of both ends of a flat top, only the edge that reaches farthest into the aperture counts. That is
right if the path over it clears the others by a Fresnel zone. Two equal edges at grazing incidence
give ½ instead of ⅓ (3.5 dB too much); for a long body's roof in deep shadow, the error is greater.
Obstacles absorb: edges have no influence on polarisation, and there are no creeping waves and no
fringe currents. θ should not exceed some 20°. Edges are sought up to `MAX_ZONES_CLEAR` Fresnel
zones from a clear line of sight, and up to `MAX_ZONES_BLOCKED` from a blocked one; from half of
that on, their weight falls. A straight edge n zones away makes :math:`1/2\pi\sqrt n` of the
unobstructed field, so the waves that are weakened or left out are below −33 dB and −38 dB of it.

**From edges to paths.** As in `physical_optics.paths`, the edge waves of every actor are summed in
smooth cells of excess length, with complex moments that are exact to first order in frequency,
aperture and time.
"""

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths, path_table
from polychirp.channel.diffraction.edge_waves import (
    EXCESS_CELL_LENGTH,
    FIELD,
    MEAN_EXCESS,
    OUTWARD,
    PLACE,
    RATE,
    RETURN,
    SQUARED_RATE,
    WEIGHT,
    EdgeWaves,
    LinkFrame,
    edge_waves,
)
from polychirp.channel.diffraction.silhouette import Obstacles
from polychirp.channel.direct.line_of_sight import line_of_sight, straight_path_polarisation
from polychirp.channel.direct.occluded import points_before, visible_line_of_sight
from polychirp.channel.geometry.retarded_delay import range_acceleration
from polychirp.channel.scene.transmission import transmission_matrices
from polychirp.channel.scene.world import RADAR_CLEARANCE, ROLES, World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths

MAX_ZONES_CLEAR: Final = 100.0
"""Number of Fresnel zones about a clear line of sight within which edges are sought. Chosen: from
half of it on, a straight edge makes less than −33 dB of the unobstructed field."""

MAX_ZONES_BLOCKED: Final = 300.0
"""The same number for a blocked line of sight. Chosen likewise, for −38 dB."""

LONGEST_INTERVAL: Final = 4e-3
"""Greatest time between two traces of edges whose waves matter, s.

Waves over a silhouette change as it goes from triangle to triangle, of which coherence times know
nothing. The line of sight is traced as often: it ends where the waves over an edge begin. Chosen:
decision 7 compares 2 to 24 ms."""


def diffracted_paths(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths of ``pairs`` over the edges of obstacles in or near their line of sight.

    Together with `visible_line_of_sight` they are the field that arrives directly, which is
    continuous while an obstacle moves into the way. The transfer matrices of the two directions
    between two radars are transposes of each other. The module's docstring has the equation.

    A wall whose edge is on the line of sight halves the field:

    >>> from polychirp.channel.base import all_pairs
    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.mesh import Plate
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor, Scene
    >>> plate = Plate(centre=(5, -9, 0), half_u=(0, 9, 0), half_v=(0, 0, 9), material="brick",
    ...     part="wall")
    >>> scene = Scene(time=0.0, actors=(Actor(name="a", kind="object"),
    ...     Actor(name="b", kind="object", pose=Pose(x=10)),
    ...     Actor(name="wall", kind="building", plates=(plate,))),
    ...     radars=(Radar(name="1"), Radar(name="2")), carriers=(0, 1))
    >>> world = Composite().prepare(scene)
    >>> paths = [mechanism(world, all_pairs(scene))
    ...     for mechanism in (visible_line_of_sight, diffracted_paths)]
    >>> field = sum(np.sum(table.transfer[table.receiver == 1, 0, 0]) for table in paths)
    >>> unobstructed = SPEED_OF_LIGHT / 79e9 / (4 * np.pi * 10)
    >>> float(round(abs(field) / unobstructed, 2))
    0.5
    """
    direct = line_of_sight(world.scene, frequency=world.frequency, pairs=pairs)
    tables = [no_paths(world.scene, world.frequency)]
    if not direct.num_paths:
        return tables[0]
    seen = visible_line_of_sight(world, pairs)
    num_radars = len(world.scene.radars)
    clear = np.zeros((num_radars, num_radars), dtype=np.bool_)
    clear[seen.transmitter, seen.receiver] = True
    is_clear = clear[direct.transmitter, direct.receiver]
    # edges are near the line of sight, so sheets attenuate their waves as they attenuate it
    place = world.scene.radar_position
    start, end = place[direct.transmitter], place[direct.receiver]
    losses = transmission_matrices(world, start, points_before(start, end, RADAR_CLEARANCE))
    found: dict[_Link, _EdgePaths] = {}
    bodies, plates = _obstructing(world, direct, is_clear)
    for number in np.flatnonzero(np.any(bodies, axis=-1) | np.any(plates, axis=-1)):
        a, b = int(direct.transmitter[number]), int(direct.receiver[number])
        link = _Link(min(a, b), max(a, b), bool(is_clear[number]))
        if link not in found:
            hiding = _hiding_most_first(world, link, bodies[number])
            found[link] = _edge_paths(world, link, hiding, np.flatnonzero(plates[number]))
        table = _path_table(world, direct, int(number), found[link])
        tables.append(replace(table, transfer=table.transfer @ losses[number]))
    return gather(tables)


class _Link(NamedTuple):
    """Two radars, the lower number first; ``is_clear`` if their line of sight is free."""

    first: int
    second: int
    is_clear: bool


def _max_excess(world: World, is_clear: bool) -> float:
    """Excess up to which edges are sought, m."""
    zones = MAX_ZONES_CLEAR if is_clear else MAX_ZONES_BLOCKED
    return zones * float(np.pi / world.wavenumber)


def _obstructing(
    world: World, direct: PropagationPaths, is_clear: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Masks of possible obstacles in the zones searched: ``(path, body)`` and ``(path, plate)``."""
    place, plates = world.scene.radar_position, world.plates
    ends = place[direct.transmitter], place[direct.receiver]
    length = np.linalg.norm(ends[1] - ends[0], axis=-1)
    reach = length + np.where(is_clear, _max_excess(world, True), _max_excess(world, False))

    def meets(centre: FloatArray, radius: FloatArray) -> BoolArray:
        way = sum(np.linalg.norm(end[:, None] - centre, axis=-1) for end in ends)
        return np.asarray(
            (way - 2 * radius <= reach[:, None]) & (length > 2 * RADAR_CLEARANCE)[:, None]
        )

    heights = [np.einsum("epx,px->ep", end[:, None] - plates.centre, plates.normal) for end in ends]
    between = heights[0] * heights[1] < 0
    size = np.hypot(plates.half_across, plates.half_along)
    between &= ~world.plate_is_pane
    return meets(world.centre, world.radius), meets(plates.centre, size) & between


def _hiding_most_first(world: World, link: _Link, chosen: BoolArray) -> IntArray:
    """Numbers of the chosen bodies: on the line of sight first, then nearest to a radar first."""
    start, end = world.scene.radar_position[[link.first, link.second]]
    centre = world.centre[chosen]
    legs = [np.linalg.norm(centre - place, axis=-1) for place in (start, end)]
    is_on = legs[0] + legs[1] < np.linalg.norm(end - start) + world.radius[chosen]
    return np.flatnonzero(chosen)[np.lexsort([np.minimum(*legs), ~is_on])]


class _EdgePaths(NamedTuple):
    """Paths from a link's first radar, of number ``first``, to its second.

    ``field`` complex, relative to the unobstructed one; ``excess`` m; ``rate`` m/s and
    ``acceleration`` m/s² of the path's length; ``coherence_time`` s; ``drift`` 1/s, relative rate
    of the field; ``actor`` number of the edge's actor; all ``(path,)``. ``out`` and ``back`` are
    mean directions from the first and from the second radar, ``point`` m is a mean edge point;
    these are in the world, ``(path, xyz)``.
    """

    first: int
    field: ComplexArray
    excess: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    coherence_time: FloatArray
    drift: ComplexArray
    out: FloatArray
    back: FloatArray
    point: FloatArray
    actor: IntArray


def _edge_paths(world: World, link: _Link, bodies: IntArray, plates: IntArray) -> _EdgePaths:
    """Paths from the link's first radar to its second over edges of the given obstacles."""
    place, speed = world.scene.radar_position, world.scene.radar_velocity
    way = place[link.second] - place[link.first]
    length = float(np.linalg.norm(way))
    rotation = rotation_to(way / length)
    owners = np.concatenate([world.body[bodies], np.repeat(world.plates.actor[plates], 2)])
    actors, slots = np.unique(owners, return_inverse=True)
    moving = [
        np.array([world.scene.actors[actor].velocity_at(place[end]) for actor in actors])
        for end in (link.first, link.second)
    ]
    frame = LinkFrame(
        length=length,
        farthest=_max_excess(world, link.is_clear),
        wavenumber=world.wavenumber,
        from_sender=np.ascontiguousarray((moving[0] - speed[link.first]) @ rotation.T),
        from_receiver=np.ascontiguousarray((moving[1] - speed[link.second]) @ rotation.T),
    )
    obstacles = obstacles_of(world, rotation, place[link.first], bodies, plates)
    waves = edge_waves(obstacles, slots.astype(np.int64), link.is_clear, frame)
    return _from_moments(world, link, waves, frame, rotation, actors)


def rotation_to(axis: FloatArray) -> FloatArray:
    """Rotation matrix into a frame whose first axis is ``axis``; its rows are the axes."""
    spare = np.eye(3)[np.argmin(np.abs(axis))]
    side = np.cross(axis, spare)
    side = side / np.linalg.norm(side)
    return np.stack([axis, side, np.cross(axis, side)])


def obstacles_of(
    world: World, rotation: FloatArray, origin: FloatArray, bodies: IntArray, plates: IntArray
) -> Obstacles:
    """Bodies and plates of these numbers in the frame at ``origin`` (m) with axes ``rotation``."""
    forest = world.forest
    opaque = forest.root[ROLES.index("opaque")]
    some = world.plates.of(plates)
    across = some.half_across[:, None] * some.across
    along = some.half_along[:, None] * some.along
    corner = [
        (some.centre + u * across + v * along - origin) @ rotation.T
        for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    halves = [
        np.concatenate([corner[i] for i in three], axis=-1) for three in ((0, 1, 2), (0, 2, 3))
    ]
    return Obstacles(
        box=forest.tree.box,
        skip=forest.tree.skip,
        first=forest.tree.first,
        size=forest.tree.size,
        triangle=forest.tree.triangle,
        nodes=opaque[bodies],
        turn=np.ascontiguousarray(rotation @ world.rotation[bodies]),
        shift=np.ascontiguousarray((world.position[bodies] - origin) @ rotation.T),
        sheet=np.stack(halves, axis=1).reshape(-1, 9),
    )


def _from_moments(
    world: World,
    link: _Link,
    waves: EdgeWaves,
    frame: LinkFrame,
    rotation: FloatArray,
    actors: IntArray,
) -> _EdgePaths:
    """Paths from cells' moments, without those weaker than the strongest by the dynamic range."""
    power = np.abs(waves.moments[..., FIELD]) ** 2
    strongest = max(float(np.max(power, initial=0.0)), float(link.is_clear))
    slot, cell = np.nonzero((power > 0) & (power * world.dynamic_range >= strongest))
    moments, spreads = waves.moments[slot, cell], waves.spreads[slot, cell]
    field = moments[:, FIELD]
    ratios = moments / field[:, None]
    means = ratios.real
    # where a cell's waves nearly cancel, ratios of moments have no meaning
    excess = np.clip(
        means[:, MEAN_EXCESS],
        np.maximum(cell - 1.0, 0.0) * EXCESS_CELL_LENGTH,
        (cell + 1.0) * EXCESS_CELL_LENGTH,
    )
    weight, end = spreads[:, WEIGHT], np.array([frame.length, 0.0, 0.0])
    point = spreads[:, PLACE : PLACE + 3] / weight[:, None]
    out = _or_towards(means[:, OUTWARD : OUTWARD + 3], point)
    back = _or_towards(means[:, RETURN : RETURN + 3], point - end)
    legs = point @ rotation, (point - end) @ rotation
    velocity = frame.from_sender[slot], frame.from_receiver[slot]
    rate = np.sum(out * velocity[0] + back * velocity[1], axis=-1)
    mean_rate = np.sum(
        ratios[:, OUTWARD : OUTWARD + 3] * velocity[0]
        + ratios[:, RETURN : RETURN + 3] * velocity[1],
        axis=-1,
    )
    typical, square = spreads[:, RATE] / weight, spreads[:, SQUARED_RATE] / weight
    spread = np.sqrt(np.maximum(square - typical**2, 0.0))
    # by rounding, even a single edge point has a spread of some µm/s
    coherence = 1.0 / (world.wavenumber * np.maximum(spread, 1e-12))
    return _EdgePaths(
        first=link.first,
        field=field * np.exp(1j * world.wavenumber * excess),
        excess=excess,
        rate=rate,
        acceleration=_acceleration(
            world, link, actors[slot], legs, (out @ rotation, back @ rotation)
        ),
        coherence_time=np.where(spread > 1e-5, coherence, np.inf),
        drift=-1j * world.wavenumber * (mean_rate - rate),
        out=out @ rotation,
        back=back @ rotation,
        point=point @ rotation + world.scene.radar_position[link.first],
        actor=actors[slot],
    )


def _acceleration(
    world: World,
    link: _Link,
    actor: IntArray,
    legs: tuple[FloatArray, FloatArray],
    ways: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Second derivatives of the lengths of paths over edges, m/s² ``(path,)``.

    ``legs`` m ``(path, xyz)`` go from both radars to the edges of the actors with these numbers,
    and ``ways`` are their mean directions, all in the world.
    """
    scene = world.scene
    total = np.zeros(len(actor))
    for radar, leg, way in zip((link.first, link.second), legs, ways, strict=True):
        point = scene.radar_position[radar] + leg
        moving, moved = scene.motion_at(actor, point)
        total += range_acceleration(leg, moving - scene.radar_velocity[radar])
        total += np.sum(way * (moved - scene.radar_acceleration[radar]), axis=-1)
    return total


def _or_towards(mean: FloatArray, way: FloatArray) -> FloatArray:
    """Mean directions; that of ``way`` where a mean's length differs from 1 by 0.2 or more."""
    straight = way / np.linalg.norm(way, axis=-1, keepdims=True)
    is_direction = np.abs(np.linalg.norm(mean, axis=-1, keepdims=True) - 1.0) < 0.2
    return np.where(is_direction, mean, straight)


def _path_table(
    world: World, direct: PropagationPaths, number: int, edges: _EdgePaths
) -> PropagationPaths:
    """Edge paths of the pair of radars of direct path ``number``, in the direction of that path."""
    a, b = int(direct.transmitter[number]), int(direct.receiver[number])
    out, back = (edges.out, edges.back) if a == edges.first else (edges.back, edges.out)
    speed = world.scene.radar_velocity
    # the direct path's delay is exact for moving radars; the excess is added to it
    axis = direct.departure[number]
    opening = axis @ (speed[b] - speed[a])
    amplitude = 1.0 / (4 * np.pi * world.frequency * direct.delay[number])
    transfer = (
        straight_path_polarisation(_unit(out), _unit(back))
        * (amplitude * edges.field)[:, None, None]
    )
    return path_table(
        scene=world.scene,
        frequency=world.frequency,
        pair=np.tile([a, b], (len(edges.field), 1)),
        delay=direct.delay[number] + edges.excess / SPEED_OF_LIGHT,
        delay_rate=direct.delay_rate[number] + (edges.rate - opening) / SPEED_OF_LIGHT,
        transfer=transfer,
        departure=out,
        arrival=back,
        bounces=[(Bounce.DIFFRACTION, edges.actor, edges.point)],
        coherence_time=edges.coherence_time,
        delay_acceleration=edges.acceleration / SPEED_OF_LIGHT,
        transfer_drift=direct.transfer_drift[number] + edges.drift,
    )


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
