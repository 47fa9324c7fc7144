r"""Ray tubes: paths with reflections at bodies twice or more between transmitter and receiver.

A window of narrow tubes covers each body as seen from a transmitter. A tube is a ray with
differentials: ∂P and ∂D are the changes of its point P and its direction D from one row (a) or
column (b) of tubes to the next. Where it meets a surface of normal n after a distance t, its
footprint has the sides A, and a mirror turns ∂D (Igehy 1999):

.. math:: A = \partial P + t\,\partial D + gD,\quad \partial n = \mathrm{II}(A),\quad
    \partial D' = \partial D - 2\,[(\partial D\cdot n + D\cdot\partial n)\,n
    + (D\cdot n)\,\partial n]

with g such that A is along the surface, which bends by the tensor II. Facets of a mesh stand for a
curved surface (`curved_facets`, decision 24, ``docs/adr``).

A tube carries the fields F of two waves, transmitted with V and with H polarisation. Every surface
reflects F by Fresnel's formulas. With the tube's solid angle Ω, the amplitude is
:math:`s = \sqrt{\Omega/|(A_a\times A_b)\cdot D|}` times that at launch, 1/L behind flat surfaces,
and each focal line advances the phase by π/2. At every body after the first, the currents on the
footprint radiate to each receiver that is before the surface and not hidden, by the formula of
`physical_optics.paths`, with the directions d of arrival and q of departure and the distance
:math:`r_2` to the receiver:

.. math:: a = -\frac{j}{8\pi}\,\frac{s F\,|A_a\times A_b|}{r_2}\,e^{-jk(L+r_2)}\,w

(Ling, Chou and Lee 1989, shooting and bouncing rays). The weight w is the mean of the phase over
the footprint. If all surfaces are flat, it is
:math:`\mathrm{sinc}\frac{k(d-q)\cdot A_a}{2}\,\mathrm{sinc}\frac{k(d-q)\cdot A_b}{2}` with
sinc x = sin x / x, so that edges of plates are sharp. If one is curved, tubes overlap as Gaussian
windows with a standard deviation σ of 0.7 tubes, whose sum is 1, and with the phase's first and
second derivatives g and H by the numbers of tubes

.. math:: w = \frac{e^{-\frac12\sigma^2\,g\cdot(1 + j\sigma^2H)^{-1}g}}
    {\sqrt{\det(1 + j\sigma^2H)}}

So what is far from every stationary point of the phase cancels within each tube.

**Which paths.** The first reflection and the last are at bodies; plates (road, walls) and bodies
reflect in between. `physical_optics` has the echoes of one body alone, seen directly or in a plate.
The body that carries a radar is neither first nor last of its paths, for the reason given in
`physical_optics.paths`. Only vehicles and objects reflect; all other opaque meshes absorb,
and clouds of leaves weaken.

**Width.** All tubes start with a width of ``coarsest`` at most, less over near bodies, and a small
body has `refinement.TUBES_ACROSS` tubes across, however far it is. If ``tube`` is less, some are
cut in quarters, repeatedly, down to the width ``tube``. The power that a hit may bring to a
receiver is estimated with 1/√(1 + x²) for \|sinc x\|, or with w for a stationary point that is one
tube nearer; a hit that is hidden from the receiver brings none. The tubes of the strongest hits are
cut, together with their eight neighbours, until the hits that remain have less than
`UNHALVED_SHARE` of the visible power of the pair, or less than `HALVING_FLOOR` of the power of its
strongest known path. From the second level on, the quarters of a tube are followed only up to the
number of reflections of its strong hits; the wide tube's hits after more reflections are kept. So
weak contributions to a pair come from wide tubes only.

**Sheets.** At a thin sheet a ray branches: one branch is reflected, and one goes on behind the
sheet with its transmission; both faces of a sheet are alike. On the way to the receiver, the
transmission of all sheets there multiplies the wave. Transmission is not counted as a reflection: a
body behind a pane can be the first. The panes of vehicles reflect only outside: seats and people
inside would stop the wave, and no mesh contains them (decision 9, ``docs/adr``).

**Reciprocity.** Physical optics at the last surface only is not reciprocal. So a path from i to j
is half of what tubes from i radiate to j, and half of the reverse of what tubes from j radiate to
i.

**What is left out.** Tubes are left out with \|E\|² below 1e-8 of that at launch, and first bodies
if the bound

.. math:: |a| \le 4\,\frac{\lambda}{4\pi(r_1 + r_2)}

(two mirrors in the place of two bodies, each with twice the amplitude; r₁ and r₂ are the least
distances of transmitter and receiver from the body), with the gains of the elements, is below that
of the pair's strongest known path by more than the dynamic range. Contributions are tested for
shadow strongest first, until the sum of the powers of those that remain is below that of the
visible ones by the dynamic range (weak ones are off every specular point, so that their phases
cancel), or until even their sum in phase would be below the strongest known path by the dynamic
range.

**Flat parts.** Between two surfaces a tube follows rays, so the shadow of a body on the next body
is sharp. Where both are flat parts with sharp edges, of two bodies that do not touch, `flat_pairs`
replaces the tubes of two reflections by a wave that is diffracted at the first part's border
(decision 15, ``docs/adr``).

**Limits.** Everywhere else a sharp shadow is right where the Fresnel zone of the first body towards
the next, √(λx) over a distance x, is small against the body. Footprints are curved to second order;
tubes of 1.25 mm at 3 m are right to 1 dB and 10° behind a sphere of 0.2 to 0.4 m, and tubes of
2.5 mm lose 1 to 2 dB there. A body that is smaller than some wide tubes, such as a groove in a
bumper, is missed unless a tube that is cut lies beside it; so are all paths that pass between the
widest tubes. Where bodies turn, the acceleration of paths is that of a steady turn.

Between cars the power converges with the width as the table says. It gives the error of the summed
power of all paths of a pair, in dB, against tubes that are all 2.5 mm wide, in the median of the
ten pairs of four radars in the paper's street at three times, and of those whose bounces are within
30 dB of the strongest; and for these the power of the field's error over that of the field.

=========================  ======  ===========  =================
tubes                      median  strong ones  their field
=========================  ======  ===========  =================
2 cm, all                  5.7     5.4          -2.4
5 mm, all                  1.5     1.3          -8.4
2 cm, cut down to 5 mm     2.8     1.8          -9.6
2 cm, cut down to 2.5 mm   0.99    0.29         -15.6
=========================  ======  ===========  =================

The last row is the default (``python -m bench.tube_widths``).
"""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, strength, strongest_of_pair, without_weak
from polychirp.channel.direct.occluded import visible_line_of_sight
from polychirp.channel.geometry.retarded_delay import range_acceleration
from polychirp.channel.physical_optics.paths import MAX_ECHO_OVER_MIRROR
from polychirp.channel.physical_optics.views import View
from polychirp.channel.ray_tubes.cell_paths import (
    NO_ACTOR,
    NO_CONTRIBUTIONS,
    Contributions,
    cell_paths,
    joined,
)
from polychirp.channel.ray_tubes.fields import NO_DETOUR
from polychirp.channel.ray_tubes.flat_pairs import (
    LEAST_SHARE,
    Outlines,
    PlacedPart,
    Surroundings,
    Transmitter,
    lit_hits,
    may_be_joined,
    may_light,
    outlines_of,
    seen_parts,
    without_pairs,
)
from polychirp.channel.ray_tubes.flat_parts import are_joined, parts_in_world
from polychirp.channel.ray_tubes.intersections import Space, space_of
from polychirp.channel.ray_tubes.propagation import Tubes, hits_of
from polychirp.channel.ray_tubes.radiation import HIT, Hits, estimated_power, radiate
from polychirp.channel.ray_tubes.refinement import TUBES_ACROSS, Level, Widths, first_level
from polychirp.channel.ray_tubes.visibility import (
    HitPowers,
    Obstacles,
    StopRule,
    last_legs,
    obstacles_of,
    visible_hits,
)
from polychirp.channel.scene.blockers import Blockers, in_frame_of
from polychirp.channel.scene.world import POLARISATION_AXES, World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.paths import PropagationPaths

TUBES_PER_BATCH: Final = 1 << 16
"""Largest number of tubes that are followed at a time. Chosen to limit the memory."""

UNHALVED_SHARE: Final = (0.001, 0.02, 0.05)
"""Share of the estimated power of the visible hits whose tubes need not be cut in quarters: at the
first level, at the second, and at later ones. Chosen: the last row of the table above shows the
error with these; smaller shares take longer."""

HALVING_FLOOR: Final = 1e-4
"""Summed power of hits, over the power of the strongest known path of the pair, below which their
tubes are not cut in quarters. Chosen: such hits hardly change the power of the pair."""


LEAST_POWER: Final = 1e-60
"""Power of a hit at a receiver, below which it is left out: its square would be rounded to zero."""


def tube_paths(
    world: World,
    pairs: IntArray,
    strongest: FloatArray | None = None,
    *,
    tube: float = 0.02,
    coarsest: float = 0.02,
    across: int = TUBES_ACROSS,
    max_bounces: int = 3,
    first: int | None = None,
) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` with two reflections at bodies or more.

    Parameters
    ----------
    strongest : power of the strongest path known so far of every (transmitter, receiver), as
        `base.strength` gives it, ``(radar, radar)``
    tube : m, width of the narrowest tubes where they meet the first body, up to 10 m away; see
        `launch_grid.windows_over`
    coarsest : m, width of the widest tubes; if it equals ``tube``, all have this width
    across : least number of the narrowest tubes along the diagonal of the first body's box; on a
        body that is too small for it they are narrower than ``tube``
    max_bounces : largest number of reflections, at bodies and plates together; at least 2
    first : number of the body that tubes meet first; None: every body in turn

    Raises
    ------
    InputError
        ``tube``, ``coarsest``, ``across`` or ``max_bounces`` is out of range.

    Examples
    --------
    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.model.scene import Actor
    >>> from polychirp.testing.shapes import around, dihedral, mesh_of
    >>> corner = Actor(name="corner", kind="object", mesh=mesh_of(dihedral(0.1, 0.1)))
    >>> world = Composite().prepare(around([corner], [(20.0, 0.0, 0.0)]))
    >>> paths = tube_paths(world, np.array([[0, 0]]), tube=5e-3)
    >>> bool(paths.num_paths > 0)
    True
    """
    widths = Widths(tube, coarsest, across)
    _check(widths, max_bounces)
    if not len(pairs) or not len(world.surfaces):
        return no_paths(world.scene, world.frequency)
    is_wanted = np.zeros((len(world.scene.radars),) * 2, dtype=np.bool_)
    is_wanted[pairs[:, 0], pairs[:, 1]] = True
    request = _request(world, is_wanted, strongest, widths, max_bounces, first)
    paths = cell_paths(world, _contributions(request))
    is_short = paths.delay * SPEED_OF_LIGHT <= world.max_length
    paths = paths.select(is_wanted[paths.transmitter, paths.receiver] & is_short)
    return without_weak(paths, world.scene, world.dynamic_range)


def _check(widths: Widths, max_bounces: int) -> None:
    if not widths.narrowest > 0:
        raise InputError("the width of ray tubes is not positive; set it to 0.02 m, for example")
    if not widths.widest >= widths.narrowest:
        raise InputError("the widest ray tubes are narrower than the narrowest; widen them")
    if not widths.across >= 1:
        raise InputError("ray tubes across a body are less than 1; set across to 120, for example")
    if max_bounces < 2:
        raise InputError("ray tubes need two bounces or more; set max_bounces to 2 or more")


@dataclass(frozen=True, eq=False)
class _Surroundings:
    """Tables of a world for ray tubes; those of a receiver are made at its first use."""

    world: World
    faces: Blockers
    space: Space
    views: dict[tuple[int, int], View]
    _obstacles: dict[int, Obstacles] = field(default_factory=dict)
    _direct: dict[bytes, FloatArray] = field(default_factory=dict)
    _seen: dict[int, BoolArray] = field(default_factory=dict)

    def obstacles(self, receiver: int) -> Obstacles:
        """Obstacles between a receiver and every body."""
        if receiver not in self._obstacles:
            views = [self.views[receiver, body] for body in range(len(self.world.surfaces))]
            self._obstacles[receiver] = obstacles_of(views)
        return self._obstacles[receiver]

    @cached_property
    def parts(self) -> tuple[PlacedPart, ...]:
        """Flat parts of all bodies that scatter, body by body in the order of their numbers."""
        world = self.world
        return tuple(
            PlacedPart(
                part,
                world.velocity_at(body, np.zeros(3)),
                float(world.yaw_rate[body]),
                float(world.media.roughness[part.medium]),
                body,
                number,
            )
            for body, parts in enumerate(parts_in_world(world))
            if self.space.body[body]["scatters"]
            for number, part in enumerate(parts)
        )

    @cached_property
    def outlines(self) -> Outlines:
        """Outlines of `parts`."""
        return outlines_of(self.parts)

    def parts_of(self, body: int) -> list[PlacedPart]:
        """Flat parts of one body."""
        return [part for part in self.parts if part.body == body]

    def sees_parts(self, radar: int) -> BoolArray:
        """Mask of the flat parts ``(part,)`` that a radar sees."""
        if radar not in self._seen:
            place = self.world.scene.radar_position[radar]
            self._seen[radar] = seen_parts(self.world, place, self.parts)
        return self._seen[radar]

    def direct_power(self, is_wanted: BoolArray) -> FloatArray:
        """Power of the direct paths of wanted pairs, ``(transmitter, receiver)``."""
        key = is_wanted.tobytes()
        if key not in self._direct:
            scene, num_radars = self.world.scene, len(is_wanted)
            others = is_wanted & ~np.eye(num_radars, dtype=np.bool_)
            paths = visible_line_of_sight(self.world, np.argwhere(others))
            self._direct[key] = strongest_of_pair(paths, strength(paths, scene), num_radars)
        return self._direct[key]


@lru_cache(maxsize=40)
def _surroundings_of(world: World) -> _Surroundings:
    """Tables of a world, kept because a frame requests paths of the same world several times."""
    faces = in_frame_of(world, np.eye(3), np.zeros(3))
    views = {
        (radar, body): View(world=world, radar=radar, body=body)
        for radar in range(len(world.scene.radars))
        for body in range(len(world.surfaces))
    }
    return _Surroundings(world, faces, space_of(world, faces), views)


@dataclass(frozen=True, eq=False)
class _Request:
    """The request of `tube_paths`, with all that is known before the first tube is followed.

    ``is_wanted`` and ``known_power``, that of the strongest known path, are ``(transmitter,
    receiver)`` and symmetric; ``may_be_last`` ``(receiver, body)`` is false for the body that
    carries the receiver.
    """

    world: World
    surroundings: _Surroundings
    position: FloatArray
    velocity: FloatArray
    rotation: FloatArray
    is_wanted: BoolArray
    known_power: FloatArray
    may_be_last: BoolArray
    widths: Widths
    max_bounces: int
    first_bodies: tuple[int, ...]

    def receivers(self, radar: int) -> list[int]:
        """Numbers of the receivers whose paths from this transmitter are wanted."""
        return [int(receiver) for receiver in np.flatnonzero(self.is_wanted[radar])]

    def gain(self, radar: int, direction: FloatArray) -> FloatArray:
        """Power gain of a radar's element in directions of the world ``(…, xyz)``."""
        pattern = self.world.scene.radars[radar].array.pattern
        return pattern.gain(direction @ self.rotation[radar])


def _request(
    world: World,
    is_wanted: BoolArray,
    strongest: FloatArray | None,
    widths: Widths,
    max_bounces: int,
    first: int | None,
) -> _Request:
    """The request for the wanted pairs and their reverse."""
    surroundings, scene = _surroundings_of(world), world.scene
    # tubes of both directions contribute half of every path each (see Reciprocity)
    is_wanted = is_wanted | is_wanted.T
    known_power = surroundings.direct_power(is_wanted)
    if strongest is not None:
        known_power = np.maximum(known_power, np.minimum(strongest, strongest.T))
    return _Request(
        world=world,
        surroundings=surroundings,
        position=scene.radar_position,
        velocity=scene.radar_velocity,
        rotation=scene.radar_rotation,
        is_wanted=is_wanted,
        known_power=known_power,
        may_be_last=np.asarray(world.body != np.asarray(scene.carriers)[:, None]),
        widths=widths,
        max_bounces=max_bounces,
        first_bodies=tuple(range(len(world.surfaces))) if first is None else (first,),
    )


def _contributions(request: _Request) -> Contributions:
    """Contributions of all transmitters to their receivers."""
    found = [NO_CONTRIBUTIONS]
    for radar in range(len(request.is_wanted)):
        hits = _final_hits(request, radar)
        if len(hits):
            gain = request.gain(radar, hits["departure"])
            found += [_to_receiver(request, radar, r, hits, gain) for r in request.receivers(radar)]
    return joined(found)


def _final_hits(request: _Request, radar: int) -> Hits:
    """Hits of tubes that are not cut in quarters further, and those over two flat parts."""
    bodies = _first_bodies(request, radar)
    pairs = _flat_pairs(request, radar, bodies)
    by_window = {(a.body, a.number, b.body, b.number) for a, b, _ in pairs}
    level = first_level(request.world, radar, bodies, request.widths, request.max_bounces)
    kept: list[Hits] = []
    depth = 0
    while level.windows:
        hits = without_pairs(by_window, _hits_of_level(request, radar, level))
        wanted = _hits_to_halve(request, radar, level, hits, depth)
        # at the first level: quarters of a wide tube may be reflected more often than its ray
        turns = hits["turns"][wanted] if depth else np.full(len(wanted), request.max_bounces)
        halved = level.with_neighbours(hits["tube"][wanted], turns)
        # hits after more reflections than the quarters are followed for are kept
        kept.append(hits.take(np.flatnonzero(hits["turns"] > halved[hits["tube"]])))
        level, depth = level.halved(halved), depth + 1
    near, world = request.surroundings, request.world
    source = Transmitter(request.position[radar], request.velocity[radar])
    around = Surroundings(near.space, near.faces, world.media, world.wavenumber)
    lit = (lit_hits(source, first, last, around, least) for first, last, least in pairs)
    return _all_hits([*kept, *lit])


def _flat_pairs(
    request: _Request, radar: int, bodies: list[int]
) -> list[tuple[PlacedPart, PlacedPart, float]]:
    """Pairs of flat parts over which a transmitter's wave may go, with the least |W| that counts.

    The parts are of different bodies, and do not touch.
    """
    near, place = request.surroundings, request.position[radar]
    lasts = near.parts
    least = {
        (first, last): _least_share(request, radar, first, last)
        for first in bodies
        if near.parts_of(first)
        for last in {part.body for part in lasts} - {first}
    }
    is_seen, is_heard = near.sees_parts(radar), _heard_parts(request, radar)
    found = []
    for first in bodies:
        floor = np.array([least.get((first, last.body), np.inf) for last in lasts])
        floor[~is_heard] = np.inf
        some = [n for n, part in enumerate(lasts) if part.body == first and is_seen[n]]
        for one in (lasts[number] for number in some):
            outline = outlines_of([one])
            is_lit = may_light(place, outline, near.outlines, request.world.wavenumber, floor)
            is_near = may_be_joined(outline, near.outlines)
            found += [
                (one, lasts[number], float(floor[number]))
                for number in np.flatnonzero(is_lit & (floor < 1.0))
                if not (is_near[number] and are_joined(one.shape, lasts[number].shape))
            ]
    return found


def _heard_parts(request: _Request, radar: int) -> BoolArray:
    """Mask of the flat parts ``(part,)`` that a wanted receiver of the transmitter sees."""
    near = request.surroundings
    body = np.array([part.body for part in near.parts], dtype=np.int64)
    found = np.zeros(len(body), dtype=np.bool_)
    for receiver in request.receivers(radar):
        found |= near.sees_parts(receiver) & request.may_be_last[receiver, body]
    return found


def _least_share(request: _Request, radar: int, first: int, last: int) -> float:
    """Least |W| with which two bodies' flat parts may give a path that is strong enough.

    Infinite if no wanted receiver may receive from the last body.
    """
    world, views = request.world, request.surroundings.views
    out, found = views[radar, first], np.inf
    gap = float(np.linalg.norm(world.centre[first] - world.centre[last]))
    gap = max(gap - world.radius[first] - world.radius[last], 0.0)
    for receiver in request.receivers(radar):
        if request.may_be_last[receiver, last]:
            back = views[receiver, last]
            length = max(out.distance + gap + back.distance, 1e-3)
            peak = request.world.scene.radars[receiver].array.pattern.peak_gain
            mirrors = out.most_gain * peak / (2 * world.wavenumber * length) ** 2
            weak = request.known_power[radar, receiver] / world.dynamic_range
            found = min(found, max(LEAST_SHARE, float(np.sqrt(weak / mirrors))))
    return found


def _first_bodies(request: _Request, radar: int) -> list[int]:
    """Numbers of first bodies over which a path may be strong enough, near ones first."""
    world, views = request.world, request.surroundings.views
    bodies = [
        body
        for body in request.first_bodies
        if request.surroundings.space.body[body]["scatters"]
        and world.body[body] != world.scene.carriers[radar]
        and views[radar, body].distance <= world.max_length
        and any(
            _power_bound(request, radar, body, receiver) * world.dynamic_range
            >= request.known_power[radar, receiver]
            for receiver in request.receivers(radar)
        )
    ]
    return sorted(bodies, key=lambda body: views[radar, body].distance)


def _power_bound(request: _Request, radar: int, body: int, receiver: int) -> float:
    """Greatest power of a path with this first body, the elements' gains included."""
    views = request.surroundings.views
    out, back = views[radar, body], views[receiver, body]
    length = max(out.distance + back.distance, 1e-3)
    amplitude = MAX_ECHO_OVER_MIRROR**2 / (2 * request.world.wavenumber * length)
    peak = request.world.scene.radars[receiver].array.pattern.peak_gain
    return float(amplitude**2 * out.most_gain * peak)


def _hits_of_level(request: _Request, radar: int, level: Level) -> Hits:
    """Hits of a level's tubes, whose numbers count through all its windows."""
    near, found = request.surroundings, []
    media, k = request.world.media, request.world.wavenumber
    for window, body, start, number, max_turns in zip(
        level.windows, level.body, level.start, level.tubes, level.max_turns, strict=False
    ):
        launch = window.launch(request.velocity[radar], int(body))
        for begin in range(0, len(number), TUBES_PER_BATCH):
            some = slice(begin, begin + TUBES_PER_BATCH)
            tubes = Tubes(number[some], max_turns[some])
            hits = hits_of(launch, tubes, near.space, near.faces, media, k)
            hits["tube"] += start
            found.append(hits)
    return _all_hits(found)


def _all_hits(tables: list[Hits]) -> Hits:
    """The hits of several tables; a single table with hits is not copied."""
    some = [hits for hits in tables if len(hits)]
    if len(some) == 1:
        return some[0]
    # as plain bytes: numpy copies records field by field
    plain = np.dtype((np.void, HIT.itemsize))
    joint = np.concatenate([np.empty(0, dtype=plain), *(hits.view(plain) for hits in some)])
    return joint.view(HIT)


def _hits_to_halve(request: _Request, radar: int, level: Level, hits: Hits, depth: int) -> IntArray:
    """Numbers of hits whose tubes are to be cut for some receiver; a hit may occur repeatedly."""
    found = [np.zeros(0, dtype=np.int64)]
    can = np.flatnonzero(level.left[level.window_of(hits["tube"])] > 0)
    if not len(can):
        return found[0]
    share = UNHALVED_SHARE[min(depth, len(UNHALVED_SHARE) - 1)]
    gain = request.gain(radar, hits["departure"])
    for receiver in request.receivers(radar):
        sink, allowed = request.position[receiver], request.may_be_last[receiver]
        power, back = estimated_power(hits, sink, allowed, request.world.wavenumber)
        some = can[power[can] > 0]
        power = power[some] * gain[some]
        power *= request.gain(receiver, -back[some])
        floor = request.known_power[radar, receiver] * HALVING_FLOOR
        stop = StopRule(share, floor=floor)
        seen = _visible(request, receiver, hits, HitPowers(some, power), stop)
        rest = np.cumsum(seen.power[::-1])[::-1]
        found.append(seen.number[rest > share * rest[:1].sum()])
    return np.concatenate(found)


def _visible(
    request: _Request, receiver: int, hits: Hits, some: HitPowers, stop: StopRule
) -> HitPowers:
    """The hits among ``some`` that are visible from a receiver, strongest first, until ``stop``."""
    near, sink = request.surroundings.obstacles(receiver), request.position[receiver]
    return visible_hits(request.surroundings.space, near, hits, sink, some, stop)


def _to_receiver(
    request: _Request, radar: int, receiver: int, hits: Hits, gain: FloatArray
) -> Contributions:
    """Contributions of hits to one receiver; ``gain`` is the transmitter's towards them."""
    world, sink = request.world, request.position[receiver]
    out = radiate(hits, sink, request.may_be_last[receiver], world.wavenumber)
    some = np.flatnonzero(out.power > LEAST_POWER)
    power = out.power[some] * gain[some] * request.gain(receiver, -out.direction[some])
    weak = 1.0 / world.dynamic_range
    stop = StopRule(weak, floor_in_phase=request.known_power[radar, receiver] * weak)
    kept = np.sort(_visible(request, receiver, hits, HitPowers(some, power), stop).number)
    there, back = hits.take(kept), out.direction[kept]
    last = out.distance[kept, None] * back
    near, k = request.surroundings, world.wavenumber
    obstacles = near.obstacles(receiver)
    legs = last_legs(
        near.space, near.faces, world.media, obstacles, there, sink, POLARISATION_AXES, k
    )
    turn = there["direction"] - back
    matter = world.velocity_at(there["body"], there["point"])
    return Contributions(
        pair=np.tile([radar, receiver], (len(kept), 1)),
        body=np.stack([there["first_body"], there["body"]], axis=1),
        transfer=np.swapaxes(legs, 1, 2) @ out.transfer[kept].reshape(-1, 2, 2),
        length=there["length"] + out.distance[kept],
        rate=there["rate"] + np.sum(matter * turn, axis=1) + back @ request.velocity[receiver],
        acceleration=_acceleration(request, (radar, receiver), there, last, matter),
        direction=np.stack([there["departure"], -back], axis=1),
        point=np.stack([there["first_point"], there["point"]], axis=1),
        detour=_detour_actors(world, there),
        detour_point=there["detour_point"],
    )


def _detour_actors(world: World, hits: Hits) -> IntArray:
    """Actors of the surfaces between two reflections by one actor; `NO_ACTOR` without any."""
    number = hits["detour"]
    plate = np.maximum(NO_DETOUR - 1 - number, 0)
    of_plate = world.plates.actor[plate] if len(world.plates.actor) else plate
    actor = np.where(number > NO_DETOUR, world.body[np.maximum(number, 0)], of_plate)
    first, last = world.body[hits["first_body"]], world.body[hits["body"]]
    is_between = (number != NO_DETOUR) & (first == last) & (actor != first)
    return np.asarray(np.where(is_between, actor, NO_ACTOR))


def _acceleration(
    request: _Request,
    pair: tuple[int, int],
    hits: Hits,
    last: FloatArray,
    matter: FloatArray,
) -> FloatArray:
    """Second derivatives of the lengths of paths over hits, m/s² ``(hit,)``.

    A path goes to a fixed point of the last body's matter, which moves at ``matter`` m/s, and from
    there along ``last``, m, to the receiver.
    """
    world, scene = request.world, request.world.scene
    back = last / np.linalg.norm(last, axis=-1, keepdims=True)
    bend = hits["acceleration"] + range_acceleration(last, request.velocity[pair[1]] - matter)
    swerve = world.acceleration_at(hits["body"], hits["point"])
    bend += np.sum(swerve * (hits["direction"] - back), axis=-1)
    bend -= hits["departure"] @ scene.radar_acceleration[pair[0]]
    return np.asarray(bend + back @ scene.radar_acceleration[pair[1]])
