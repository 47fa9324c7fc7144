r"""Ray tubes: what meets two bodies and more between transmitter and receiver.

A window of narrow tubes covers each body as a transmitter sees it. A tube is a ray that knows
its neighbours: with the direction D and what a step to the next tube changes of it, ∂D, its
footprint on a plane of normal n, after a path length L, has the sides

.. math:: A = L\,(\partial D + g D), \qquad g = -(\partial D\cdot n)/(D\cdot n)

At every surface the fields of a wave that left V- and H-polarised are reflected as Fresnel says,
and ∂D like D. Flat facets spread a wave like mirrors, with 1/L. At a body that is not the first
the currents on the footprint radiate to every receiver before it that nothing hides, by the
formula of `facets`, with d and q the directions of arrival and of departure:

.. math:: a = -\frac{j}{8\pi}\,\frac{F\,|A_a\times A_b|}{L\,r_2}\,e^{-jk(L+r_2)}\,
    \mathrm{sinc}\frac{k(d-q)\cdot A_a}{2}\,\mathrm{sinc}\frac{k(d-q)\cdot A_b}{2}

with sinc x = sin x / x (Ling, Chou and Lee 1989, shooting and bouncing rays; ray differentials:
Igehy 1999).

**Which journeys.** The first surface that reflects is a body, and so is the last; plates (road,
walls) and bodies reflect in between; bodies reflect at least twice. One body alone, seen directly
or in a plate, is for `facets`. A radar's own carrier is neither first nor last, for the reason
given there. Only vehicles and objects reflect; all other meshes swallow, crowns weaken.

**Width.** All tubes start wide; by default they stay so. What a receiver may get from a hit is
estimated with 1/√(1 + x²) for \|sinc x\|; hits that it does not see promise nothing. Tubes are cut
in four, with their eight neighbours, unless all that is left to them promises less than `WORTH` of
what is seen of the pair, or `FLOOR` of the strongest known path; and again, until they are narrow.
From the second time on, a tube that is cut is followed up to as many bounces as were worth it; its
other hits stay. So weak journeys of a pair, and pairs weak against their other paths, are seen by
wide tubes only.

**Sheets.** At a thin sheet a ray branches: one goes on as the sheet reflects, and one behind it,
with the sheet's transmission; both faces of a sheet are alike. The last leg loses what the sheets
on it take. Passing a sheet is no reflection: a body behind a pane is still the first. The panes of
vehicles only reflect outwards: within are seats and people that no mesh has (decision 9).

**Reciprocity.** Physical optics at the last surface only is not reciprocal. A journey from i to j
is half what tubes from i radiate to j, and half the reverse of what tubes from j radiate to i.

**What is left out.** Tubes with |E|² below 1e-8 of what they left with. Windows whose bound

.. math:: |a| \le 4\,\frac{\lambda}{4\pi(r_1 + r_2)}

(mirrors in the place of two bodies, each doubled; r₁ and r₂ the least distances of transmitter
and receiver from the body) is below the pair's dynamic range, gains of the elements included.
Contributions are looked at strongest first, until the power of all that remain is below the
dynamic range of those seen (that they are weak means that they are off every glint, where phases
run through), or would be below that of the strongest known path even if all were in step.

**Limits.** Between two surfaces a wave spreads like rays: a body's shadow on the next one is
sharp, which is right where its Fresnel zone towards that one, √(λx) over a distance x, is small
against it. The wave front must not bend within a footprint A: k A² (1/L + 1/r₂)/8 ≪ 1, and tubes
widen with L beyond the first body. Curved bodies focus only as well as facets are many per tube.
What lies between the widest tubes, and next to none that is worth it, is missed.

Between cars levels converge slowly. The ten pairs of four radars in the paper's street, powers of
all paths summed, at three times, against tubes that are all 2.5 mm wide, in dB:

=========================  ======  ====  =====
tubes                      median  rms   worst
=========================  ======  ====  =====
2 cm, all                  5.07    9.2   -23.9
1 cm, all                  2.41    5.8   -14.4
5 mm, all                  1.09    2.4   -6.6
2 cm, cut down to 2.5 mm   0.98    3.9   -10.6
=========================  ======  ====  =====

At single times the median of the last is 1.53, 1.27 and 0.97 dB; it costs 2.4 times as much as the
first.
Phases of single paths between cars are not converged: take them for one draw of many.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, strength, strongest_of_pair, without_weak
from polychirp.channel.direct.occluded import visible_line_of_sight
from polychirp.channel.physical_optics.paths import MAX_ECHO_OVER_MIRROR
from polychirp.channel.physical_optics.views import View
from polychirp.channel.ray_tubes.cell_paths import Contributions, cell_paths, joined
from polychirp.channel.ray_tubes.intersections import SCATTERS, Space, space_of
from polychirp.channel.ray_tubes.launch_grid import Window
from polychirp.channel.ray_tubes.propagation import PER_CHUNK, trace
from polychirp.channel.ray_tubes.radiation import (
    BODY,
    DEPARTURE,
    DIRECTION,
    FIRST,
    LENGTH,
    POINT,
    RATE,
    TUBE,
    TURNS,
    Between,
    Hits,
    empty_hits,
    last_legs,
    promises,
    radiate,
    unhidden,
)
from polychirp.channel.ray_tubes.refinement import Level, first_level
from polychirp.channel.scene.blockers import Blockers, in_frame_of
from polychirp.channel.scene.world import UPWARDS, World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.paths import PropagationPaths

BATCH: Final = 1 << 16
"""Tubes that are followed at a time: bounds the memory."""

AT_A_TIME: Final = 512
"""Contributions that are tried for shadow before the rest is weighed again."""

WORTH: Final = (0.005, 0.05, 0.1)
"""At the first look, the second, and later: of the power that tubes promise, the share that may
be left to tubes that are not halved."""

FLOOR: Final = 1e-4
"""Power, of the strongest known path of a pair, below which no tubes are halved for it."""

ROOM: Final = 2
"""Hits of a tube at every bounce but the first for which there is room: sheets make branches."""


def tube_paths(
    world: World,
    pairs: IntArray,
    strongest: FloatArray | None = None,
    *,
    tube: float = 0.02,
    coarsest: float = 0.02,
    max_bounces: int = 3,
    first: int | None = None,
) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` that meet two bodies or more.

    Parameters
    ----------
    strongest : power of the strongest path so far of every (transmitter, receiver), as
        `base.strength` counts it, ``(radar, radar)``
    tube : m, width of the narrowest tubes where they meet the first body, up to 10 m away; see
        `windows_over`
    coarsest : m, likewise of the widest; with that of ``tube`` all are as wide
    max_bounces : reflections, by bodies and plates together, that are followed; at least 2
    first : the body, as the world numbers them, that tubes meet first; None: any

    Raises
    ------
    InputError
        ``tube``, ``coarsest`` or ``max_bounces`` is out of range.

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
    if not tube > 0:
        raise InputError("ray tubes need a positive width")
    if not coarsest >= tube:
        raise InputError("the coarsest ray tubes must not be narrower than the narrowest")
    if max_bounces < 2:
        raise InputError("ray tubes answer for two bounces and more; set max_bounces to 2 or more")
    if not len(pairs) or not len(world.surfaces):
        return no_paths(world.scene, world.frequency)
    is_wanted = np.zeros((len(world.scene.radars),) * 2, dtype=np.bool_)
    is_wanted[pairs[:, 0], pairs[:, 1]] = True
    # tubes are for both ways round
    tracing = _Tracing(
        world, is_wanted | is_wanted.T, strongest, (tube, coarsest), max_bounces, first
    )
    paths = cell_paths(world, tracing.contributions())
    is_short = paths.delay * SPEED_OF_LIGHT <= world.max_length
    paths = paths.select(is_wanted[paths.transmitter, paths.receiver] & is_short)
    return without_weak(paths, world.scene, world.dynamic_range)


class _Tracing:
    """Tubes of all transmitters, and what they radiate to all receivers."""

    def __init__(
        self,
        world: World,
        is_wanted: BoolArray,
        strongest: FloatArray | None,
        widths: tuple[float, float],
        max_bounces: int,
        first: int | None,
    ) -> None:
        self.world, self.max_bounces = world, max_bounces
        self.firsts = range(len(world.surfaces)) if first is None else (first,)
        self.widths = widths
        self.is_wanted = is_wanted
        self.place = _place_of(world)
        self.position = world.scene.radar_position
        self.rotation = world.scene.radar_rotation
        num_radars = len(is_wanted)
        if strongest is None:
            strongest = np.zeros((num_radars, num_radars))
        direct = self.place.direct_power(is_wanted)
        # both ways round: half of every journey is the reverse of another
        self.known = np.maximum(direct, np.minimum(strongest, strongest.T))

    def contributions(self) -> Contributions:
        """All that is worth more than the dynamic range leaves."""
        found = [NO_CONTRIBUTIONS]
        for radar in np.flatnonzero(self.is_wanted.any(axis=1)):
            found += self._of_transmitter(int(radar))
        return joined(found)

    def _of_transmitter(self, radar: int) -> list[Contributions]:
        first, hits = self._leaves(radar)
        if not len(first):
            return []
        receivers = np.flatnonzero(self.is_wanted[radar])
        pattern = self.world.scene.radars[radar].array.pattern
        gain = pattern.gain(hits.vectors(DEPARTURE) @ self.rotation[radar])
        return [
            self._to_receiver(radar, int(receiver), first, hits, gain) for receiver in receivers
        ]

    def _leaves(self, radar: int) -> tuple[IntArray, Hits]:
        """First bodies and hits of the tubes that are halved no more."""
        bodies = self._first_bodies(radar)
        level = first_level(self.world, radar, bodies, self.widths, self.max_bounces)
        first, leaves = [np.zeros(0, dtype=np.int64)], [empty_hits(0)]
        while level.windows:
            hits = self._all_hits(radar, level)
            tube = hits.whole(TUBE)
            is_first = len(leaves) == 1
            worth = self._worth_halving(radar, level, hits, depth=len(leaves) - 1)
            # parts of a wide tube may turn more often than its middle
            turns = np.full(len(worth), self.max_bounces) if is_first else hits.whole(TURNS)[worth]
            halved = level.with_neighbours(tube[worth], turns)
            # hits after more reflections than are followed further stay
            kept = np.flatnonzero(hits.number[:, TURNS] > halved[tube])
            first.append(level.body[level.window_of(tube[kept])])
            leaves.append(hits.of(kept))
            level = level.halved(halved)
        return np.concatenate(first), _all_of(leaves)

    def _all_hits(self, radar: int, level: Level) -> Hits:
        """Where the tubes of a level meet a second body, and more."""
        found = [empty_hits(0)]
        for number, window in enumerate(level.windows):
            tubes, turns = level.tubes[number], level.turns[number]
            body = int(level.body[number])
            for begin in range(0, len(tubes), BATCH):
                some = slice(begin, begin + BATCH)
                hits = self._hits(radar, body, window, (tubes[some], turns[some]))
                hits.number[:, TUBE] += level.start[number]
                found.append(hits)
        return _all_of(found)

    def _worth_halving(self, radar: int, level: Level, hits: Hits, *, depth: int) -> IntArray:
        """Hits of a level's tubes that matter to a receiver, by number, with repeats."""
        world, scene = self.world, self.world.scene
        can = np.flatnonzero(level.left[level.window_of(hits.whole(TUBE))] > 0)
        found = [np.zeros(0, dtype=np.int64)]
        if not len(can):
            return found[0]
        share = WORTH[min(depth, len(WORTH) - 1)]
        departure = hits.vectors(DEPARTURE) @ self.rotation[radar]
        gain = scene.radars[radar].array.pattern.gain(departure)
        for receiver in np.flatnonzero(self.is_wanted[radar]):
            power, back = promises(
                hits, self.position[receiver], self._own(int(receiver)), world.wavenumber
            )
            heard = can[power[can] > 0]
            pattern = scene.radars[receiver].array.pattern
            power = power[heard] * gain[heard]
            power *= pattern.gain(-back[heard] @ self.rotation[receiver])
            some = self._seen(
                int(receiver), hits, heard, power, (share, self.known[radar, receiver] * FLOOR, 0.0)
            )
            rest = np.cumsum(power[some][::-1])[::-1]
            found.append(heard[some[rest > share * rest[:1].sum()]])
        return np.concatenate(found)

    def _own(self, radar: int) -> int:
        """The body that carries a radar; -1 for none."""
        own = self.world.bodies_of(self.world.scene.carriers[radar])
        return int(own[0]) if len(own) else -1

    def _first_bodies(self, radar: int) -> list[int]:
        """Bodies whose windows may be worth a look, near ones first."""
        world = self.world
        carrier = world.scene.carriers[radar]
        bodies = [
            body
            for body in self.firsts
            if self.place.space.body[body, SCATTERS]
            and world.body[body] != carrier
            and self.place.views[radar, body].distance <= world.max_length
            and any(
                self._bound(radar, body, int(receiver)) * world.dynamic_range
                >= self.known[radar, receiver]
                for receiver in np.flatnonzero(self.is_wanted[radar])
            )
        ]
        return sorted(bodies, key=lambda body: self.place.views[radar, body].distance)

    def _bound(self, radar: int, body: int, receiver: int) -> float:
        """Greatest power of a path with this first body, the elements' gains included."""
        out, back = self.place.views[radar, body], self.place.views[receiver, body]
        length = max(out.distance + back.distance, 1e-3)
        amplitude = MAX_ECHO_OVER_MIRROR**2 / (2 * self.world.wavenumber * length)
        peak = self.world.scene.radars[receiver].array.pattern.peak_gain
        return float(amplitude**2 * out.most_gain * peak)

    def _hits(
        self, radar: int, body: int, window: Window, tubes: tuple[IntArray, IntArray]
    ) -> Hits:
        """Where some of a window's tubes meet a second body, and more."""
        room = ROOM * PER_CHUNK * (self.max_bounces - 1)
        rows = window.rows(self.world.scene.radar_velocity[radar])
        num_chunks = -(-len(tubes[0]) // PER_CHUNK)
        while True:
            hits = empty_hits(num_chunks * room)
            counts = trace(
                rows,
                (window.shape[1], *tubes),
                self.place.space,
                self.place.faces,
                self.world.media,
                body,
                self.world.wavenumber,
                hits,
                room,
            )
            most = int(np.max(counts, initial=0))
            if most <= room:
                filled = np.arange(room) < counts[:, None]
                return hits.of(np.flatnonzero(filled.reshape(-1)))
            room = most

    def _to_receiver(
        self, radar: int, receiver: int, first: IntArray, hits: Hits, gain: FloatArray
    ) -> Contributions:
        world, scene = self.world, self.world.scene
        sink = self.position[receiver]
        transfer, back, last_leg, power = radiate(hits, sink, self._own(receiver), world.wavenumber)
        heard = np.flatnonzero(power)
        power = power[heard] * gain[heard]
        power *= scene.radars[receiver].array.pattern.gain(-back[heard] @ self.rotation[receiver])
        weak = 1.0 / world.dynamic_range
        limits = (weak, 0.0, self.known[radar, receiver] * weak)
        kept = heard[np.sort(self._seen(receiver, hits, heard, power, limits))]
        there = hits.of(kept)
        legs = self._last_legs(receiver, there)
        body = there.whole(BODY)
        velocity = world.velocity[body]
        turn = there.vectors(DIRECTION) - back[kept]
        return Contributions(
            pair=np.tile([radar, receiver], (len(kept), 1)),
            body=np.stack([first[kept], body], axis=1),
            transfer=np.swapaxes(legs, 1, 2) @ transfer[kept].reshape(-1, 2, 2),
            length=there.number[:, LENGTH] + last_leg[kept],
            rate=there.number[:, RATE]
            + np.sum(velocity * turn, axis=1)
            + back[kept] @ scene.radar_velocity[receiver],
            direction=np.stack([there.vectors(DEPARTURE), -back[kept]], axis=1),
            point=np.stack([there.vectors(FIRST), there.vectors(POINT)], axis=1),
        )

    def _last_legs(self, receiver: int, hits: Hits) -> ComplexArray:
        """What sheets and leaves leave on the way from a receiver to hits, ``(hit, 2, 2)``."""
        return last_legs(
            self.place.space,
            self.place.faces,
            self.world.media,
            self.place.between(receiver),
            hits,
            self.position[receiver],
            UPWARDS,
            self.world.wavenumber,
        )

    def _seen(
        self,
        receiver: int,
        hits: Hits,
        which: IntArray,
        power: FloatArray,
        limits: tuple[float, float, float],
    ) -> IntArray:
        """Places in ``which`` of the hits that a receiver sees, of those that are worth it.

        Strongest first, until the power of what remains, summed without phases, is less than a
        share ``limits[0]`` of what has been seen, or than ``limits[1]``; or, summed in step, less
        than ``limits[2]``.
        """
        share, floor, floor_in_step = limits
        order = np.argsort(-power, kind="stable")
        rest = np.cumsum(power[order][::-1])[::-1]
        reach = np.cumsum(np.sqrt(power[order])[::-1])[::-1] ** 2
        near = self.place.between(receiver)
        found, total = [np.zeros(0, dtype=np.int64)], 0.0
        sink = self.position[receiver]
        for begin in range(0, len(order), AT_A_TIME):
            if rest[begin] < max(share * total, floor) or reach[begin] < floor_in_step:
                break
            some = order[begin : begin + AT_A_TIME]
            free = some[unhidden(self.place.space, near, hits, sink, which[some])]
            total += float(np.sum(power[free]))
            found.append(free)
        return np.concatenate(found)


class _Place:
    """A world as tubes need it."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.faces: Blockers = in_frame_of(world, np.eye(3), np.zeros(3))
        self.space: Space = space_of(world, self.faces)
        self.views = {
            (radar, body): View(world=world, radar=radar, body=body)
            for radar in range(len(world.scene.radars))
            for body in range(len(world.surfaces))
        }
        self._between: dict[int, Between] = {}
        self._direct: dict[bytes, FloatArray] = {}

    def direct_power(self, is_wanted: BoolArray) -> FloatArray:
        """Power of the direct paths of wanted pairs, ``(transmitter, receiver)``."""
        key = is_wanted.tobytes()
        if key not in self._direct:
            scene, num_radars = self.world.scene, len(is_wanted)
            others = is_wanted & ~np.eye(num_radars, dtype=np.bool_)
            paths = visible_line_of_sight(self.world, np.argwhere(others))
            self._direct[key] = strongest_of_pair(paths, strength(paths, scene), num_radars)
        return self._direct[key]

    def between(self, receiver: int) -> Between:
        """What may come between a receiver and every body."""
        if receiver not in self._between:
            bodies = range(len(self.world.surfaces))
            near = [self.views[receiver, body].near for body in bodies]
            lists = [_joined(list(kind)) for kind in zip(*near, strict=True)]
            self._between[receiver] = Between(*[rows for kind in lists for rows in kind])
        return self._between[receiver]


@lru_cache(maxsize=40)
def _place_of(world: World) -> _Place:
    """A world as tubes need it, kept for its next part: a frame comes back to all its times."""
    return _Place(world)


def _all_of(parts: list[Hits]) -> Hits:
    """All hits of several tables, in their order."""
    return Hits(*[np.concatenate(fields) for fields in zip(*parts, strict=True)])


NO_CONTRIBUTIONS: Final = Contributions(
    pair=np.zeros((0, 2), dtype=np.int64),
    body=np.zeros((0, 2), dtype=np.int64),
    transfer=np.zeros((0, 2, 2), dtype=np.complex128),
    length=np.zeros(0),
    rate=np.zeros(0),
    direction=np.zeros((0, 2, 3)),
    point=np.zeros((0, 2, 3)),
)


def _joined(numbers: list[IntArray]) -> tuple[IntArray, IntArray]:
    """Lists behind one another, and where each begins."""
    return np.concatenate(numbers), np.concatenate([[0], np.cumsum([len(n) for n in numbers])])
