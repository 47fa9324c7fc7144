r"""Diffraction of direct paths at the silhouettes of whatever stands in or near the way.

A radar at S lights another at distance d past obstacles. Kirchhoff's integral over what is free
between them is the geometric wave, where nothing is on the line of sight, and a wave from every
point E of the silhouette's edge (Maggi 1888, Rubinowicz 1917; Born & Wolf §8.9):

.. math::
    \frac{U}{U_0} = [\text{clear}] + \frac{1}{2\pi}\oint d\varphi \sum_{\text{edges}} \pm
    \frac{1+\cos\theta}{2}\,e^{-jk(r_1+r_2-d)}

where :math:`r_1, r_2` are the edge's distances from both ends, θ the angle by which the path bends
there, φ the azimuth about the line of sight, and + (−) stands for an edge beyond which, going
away from the line of sight, all is free (blocked). The boundary wave
:math:`\frac{1}{4\pi}\oint \frac{e^{-jk(r_1+r_2)}}{r_1 r_2}\frac{(\hat r_1\times\hat r_2)\cdot
dl}{1-\cos\theta}` takes this form because :math:`(\vec r_1\times\vec r_2)\cdot dl = \rho^2 d\,
d\varphi` and :math:`r_1^2 r_2^2\sin^2\theta = \rho^2d^2`: nothing is singular at grazing, where
half of all azimuths are blocked and U = ½U₀. A straight edge has Fresnel's
:math:`\frac{1+j}{2}[(\frac12-C(\nu)) - j(\frac12-S(\nu))]`,
:math:`\nu = h\sqrt{\frac2\lambda(\frac1{d_1}+\frac1{d_2})}`.

**The silhouette.** Every triangle that may be in the way is cut by half-planes about the line of
sight. In a half-plane it covers an interval of the excess :math:`r_1+r_2-d`: least where a mirror
would reflect, greatest at an end. What several surfaces cover is united, and the ends of what is
then blocked are the edges, each with its own depth. Between two half-planes an edge is straight.

**What counts.** Surfaces that block, unless both radars are in front of them: those mirror, which
facets and planes answer for; of plates, only those whose plane is between the two. Nothing within
`RADAR_CLEARANCE` of either end, along the line of sight, blocks.

**Limits.** One edge in every half-plane and direction: of several obstacles behind one another,
and of both ends of a flat top, the one that reaches farthest into the way counts alone. That is
right if the others stay clear of the path over it by a Fresnel zone; two equal edges at grazing
have ½ instead of ⅓ (3.5 dB too much), and a long body's roof in deep shadow more. Obstacles are
absorbing: no polarisation at the edge, no creeping waves, no fringe currents of edges; angles
of some 20° and less. Edges are sought up to `CLEAR` zones of Fresnel where the line of sight is
clear, and to `SHADOW` where not, from half of that on with less and less weight. A straight edge
n zones away makes :math:`1/2\pi\sqrt n` of the unobstructed field, so what is left out is below
−33 dB and −38 dB of it.

**From edges to paths.** As in `facets`: edge waves are gathered, for every actor, in smooth cells
of excess length with complex moments, exact to first order in frequency, aperture and time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths, path_table
from polychirp.channel.diffraction.edge_waves import CELL, Pair, Waves, edge_waves
from polychirp.channel.diffraction.silhouette import Obstacles
from polychirp.channel.direct.line_of_sight import line_of_sight, straight_path_polarisation
from polychirp.channel.direct.occluded import points_before, visible_line_of_sight
from polychirp.channel.geometry.retarded_delay import range_acceleration
from polychirp.channel.scene.transmission import transmission_matrices
from polychirp.channel.scene.world import RADAR_CLEARANCE, ROLES, World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths

CLEAR: Final = 100.0
"""Fresnel zones about a clear line of sight within which edges are sought."""

SHADOW: Final = 300.0
"""Fresnel zones about a blocked line of sight within which edges are sought."""


def diffracted_paths(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths of ``pairs`` over the edges of what stands in or near their line of sight.

    They and `visible_line_of_sight` together are the field that arrives directly: continuous
    where an obstacle comes into the way. Both ways of a pair are each other's transposes.
    Equation, limits and what is left out: at the head of this module.

    Examples
    --------
    A wall whose edge is on the line of sight takes half of the field:

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
    # edges are so near the line that what weakens it weakens them
    place = world.scene.radar_position
    start, end = place[direct.transmitter], place[direct.receiver]
    losses = transmission_matrices(world, start, points_before(start, end, RADAR_CLEARANCE))
    found: dict[tuple[int, int, bool], _Fan] = {}
    bodies, plates = _in_the_way(world, direct, is_clear)
    for number in np.flatnonzero(np.any(bodies, axis=-1) | np.any(plates, axis=-1)):
        a, b = int(direct.transmitter[number]), int(direct.receiver[number])
        key = (min(a, b), max(a, b), bool(is_clear[number]))
        if key not in found:
            found[key] = _fan(
                world, key, _sorted(world, key, bodies[number]), np.flatnonzero(plates[number])
            )
        table = _table(world, direct, int(number), found[key])
        tables.append(replace(table, transfer=table.transfer @ losses[number]))
    return gather(tables)


def _farthest(world: World, is_clear: bool) -> float:
    """M, the greatest excess of an edge."""
    return (CLEAR if is_clear else SHADOW) * float(np.pi / world.wavenumber)


def _in_the_way(
    world: World, direct: PropagationPaths, is_clear: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Bodies and plates whose spheres meet the zones searched, ``(path, body or plate)``."""
    place, plates = world.scene.radar_position, world.plates
    ends = place[direct.transmitter], place[direct.receiver]
    length = np.linalg.norm(ends[1] - ends[0], axis=-1)
    reach = length + np.where(is_clear, _farthest(world, True), _farthest(world, False))

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


def _sorted(world: World, key: tuple[int, int, bool], chosen: BoolArray) -> IntArray:
    """Numbers of bodies, those first that hide most: on the line of sight, and near its ends."""
    start, end = world.scene.radar_position[list(key[:2])]
    centre = world.centre[chosen]
    legs = [np.linalg.norm(centre - place, axis=-1) for place in (start, end)]
    is_on = legs[0] + legs[1] < np.linalg.norm(end - start) + world.radius[chosen]
    return np.flatnonzero(chosen)[np.lexsort([np.minimum(*legs), ~is_on])]


class _Fan(NamedTuple):
    """Paths from the first radar of a pair to the second, in units of the unobstructed field.

    ``field`` ``(path,)`` complex; ``excess`` m, ``rate`` m/s of it, ``bend`` m/s²,
    ``coherence_time`` s ``(path,)``; ``out``, ``back`` and ``point`` in the world ``(path, xyz)``;
    ``actor``.
    """

    first: int
    field: ComplexArray
    excess: FloatArray
    rate: FloatArray
    bend: FloatArray
    coherence_time: FloatArray
    out: FloatArray
    back: FloatArray
    point: FloatArray
    actor: IntArray


def _fan(world: World, key: tuple[int, int, bool], bodies: IntArray, plates: IntArray) -> _Fan:
    """Edge waves from radar ``key[0]`` to radar ``key[1]``."""
    first, second, is_clear = key
    place, speed = world.scene.radar_position, world.scene.radar_velocity
    way = place[second] - place[first]
    length = float(np.linalg.norm(way))
    frame = _frame(way / length)
    owners = np.concatenate([world.body[bodies], np.repeat(world.plates.actor[plates], 2)])
    actors, slots = np.unique(owners, return_inverse=True)
    moving = np.array([world.scene.actors[actor].velocity for actor in actors])
    pair = Pair(
        length=length,
        farthest=_farthest(world, is_clear),
        wavenumber=world.wavenumber,
        there=np.ascontiguousarray((moving - speed[first]) @ frame.T),
        home=np.ascontiguousarray((moving - speed[second]) @ frame.T),
    )
    obstacles = _obstacles(world, frame, place[first], bodies, plates)
    waves = edge_waves(obstacles, slots.astype(np.int64), is_clear, pair)
    return _gathered(world, waves, pair, (first, actors, frame, place[first], is_clear))


def _frame(axis: FloatArray) -> FloatArray:
    """Rotation into a frame whose first axis is ``axis``: its rows."""
    spare = np.eye(3)[np.argmin(np.abs(axis))]
    side = np.cross(axis, spare)
    side = side / np.linalg.norm(side)
    return np.stack([axis, side, np.cross(axis, side)])


def _obstacles(
    world: World, frame: FloatArray, origin: FloatArray, bodies: IntArray, plates: IntArray
) -> Obstacles:
    """Bodies and plates as the kernel needs them."""
    forest = world.forest
    opaque = forest.root[ROLES.index("opaque")]
    some = world.plates.of(plates)
    across = some.half_across[:, None] * some.across
    along = some.half_along[:, None] * some.along
    corner = [
        (some.centre + u * across + v * along - origin) @ frame.T
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
        turn=np.ascontiguousarray(frame @ world.rotation[bodies]),
        shift=np.ascontiguousarray((world.position[bodies] - origin) @ frame.T),
        sheet=np.stack(halves, axis=1).reshape(-1, 9),
    )


def _gathered(
    world: World,
    waves: Waves,
    pair: Pair,
    about: tuple[int, IntArray, FloatArray, FloatArray, bool],
) -> _Fan:
    """Paths from the moments of cells; those far below the strongest are left out."""
    first, actors, frame, origin, is_clear = about
    power = np.abs(waves.moments[..., 0]) ** 2
    strongest = max(float(np.max(power, initial=0.0)), float(is_clear))
    slot, cell = np.nonzero((power > 0) & (power * world.dynamic_range >= strongest))
    moments, spreads = waves.moments[slot, cell], waves.spreads[slot, cell]
    field = moments[:, 0]
    means = (moments[:, 1:] / field[:, None]).real
    # where a cell's waves all but cancel, ratios of moments mean nothing
    excess = np.clip(means[:, 0], np.maximum(cell - 1.0, 0.0) * CELL, (cell + 1.0) * CELL)
    point = spreads[:, 1:4] / spreads[:, :1]
    out = _or_towards(means[:, 1:4], point)
    end = np.array([pair.length, 0.0, 0.0])
    back = _or_towards(means[:, 4:7], point - end)
    rate = np.sum(out * pair.there[slot] + back * pair.home[slot], axis=-1)
    typical, square = (spreads[:, 4:] / spreads[:, :1]).T
    spread = np.sqrt(np.maximum(square - typical**2, 0.0))
    # rounding leaves some µm/s to a single edge point
    coherence = 1.0 / (world.wavenumber * np.maximum(spread, 1e-12))
    return _Fan(
        first=first,
        field=field * np.exp(1j * world.wavenumber * excess),
        excess=excess,
        rate=rate,
        bend=range_acceleration(point, pair.there[slot])
        + range_acceleration(point - end, pair.home[slot]),
        coherence_time=np.where(spread > 1e-5, coherence, np.inf),
        out=out @ frame,
        back=back @ frame,
        point=point @ frame + origin,
        actor=actors[slot],
    )


def _or_towards(mean: FloatArray, way: FloatArray) -> FloatArray:
    """Mean directions, or those of ``way`` where a mean is none."""
    straight = way / np.linalg.norm(way, axis=-1, keepdims=True)
    is_direction = np.abs(np.linalg.norm(mean, axis=-1, keepdims=True) - 1.0) < 0.2
    return np.where(is_direction, mean, straight)


def _table(world: World, direct: PropagationPaths, number: int, fan: _Fan) -> PropagationPaths:
    """Paths of the pair of a direct path, whichever way round it is."""
    a, b = int(direct.transmitter[number]), int(direct.receiver[number])
    out, back = (fan.out, fan.back) if a == fan.first else (fan.back, fan.out)
    speed = world.scene.radar_velocity
    # the direct path's delay is exact for moving ends: edges add their excess to it
    axis = direct.departure[number]
    opening = axis @ (speed[b] - speed[a])
    amplitude = 1.0 / (4 * np.pi * world.frequency * direct.delay[number])
    transfer = (
        straight_path_polarisation(_unit(out), _unit(back)) * (amplitude * fan.field)[:, None, None]
    )
    return path_table(
        scene=world.scene,
        frequency=world.frequency,
        pair=np.tile([a, b], (len(fan.field), 1)),
        delay=direct.delay[number] + fan.excess / SPEED_OF_LIGHT,
        delay_rate=direct.delay_rate[number] + (fan.rate - opening) / SPEED_OF_LIGHT,
        transfer=transfer,
        departure=out,
        arrival=back,
        bounces=[(Bounce.DIFFRACTION, fan.actor, fan.point)],
        coherence_time=fan.coherence_time,
        delay_acceleration=fan.bend / SPEED_OF_LIGHT,
    )


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
