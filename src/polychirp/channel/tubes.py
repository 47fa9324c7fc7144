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

**Sheets.** At a thin sheet a ray branches: one goes on as the sheet reflects, and one behind it,
with the sheet's transmission; both faces of a sheet are alike. The last leg loses what the sheets
on it take. Passing a sheet is no reflection: a body behind a pane is still the first.

**Reciprocity.** Physical optics at the last surface only is not reciprocal. A journey from i to j
is half what tubes from i radiate to j, and half the reverse of what tubes from j radiate to i.

**What is left out.** Tubes with |E|² below 1e-8 of what they left with. Windows whose bound

.. math:: |a| \le 4\,\frac{\lambda}{4\pi(r_1 + r_2)}

(mirrors in the place of two bodies, each doubled; r₁ and r₂ the least distances of transmitter
and receiver from the body) is below the pair's dynamic range, gains of the elements included.
Contributions are looked at strongest first, until the power of all that remain is below the
dynamic range: that they are weak means that they are off every glint, where phases run through.

**Limits.** Between two surfaces a wave spreads like rays: a body's shadow on the next one is
sharp, which is right where its Fresnel zone towards that one, √(λx) over a distance x, is small
against it. The wave front must not bend within a footprint A: k A² (1/L + 1/r₂)/8 ≪ 1, and tubes
widen with L beyond the first body. Curved bodies focus only as well as facets are many per tube.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, strength, strongest_of_pair, without_weak
from polychirp.channel.blockers import Blockers, in_frame_of
from polychirp.channel.facets import OVERSHOOT, scatters
from polychirp.channel.legs import through
from polychirp.channel.optics import LIFT
from polychirp.channel.sight import visible_line_of_sight
from polychirp.channel.tube_cells import Contributions, cell_paths, joined
from polychirp.channel.tube_currents import Hits, empty_hits, radiate, unhidden
from polychirp.channel.tube_meetings import Bodies
from polychirp.channel.tube_optics import PER_CHUNK, trace
from polychirp.channel.tube_windows import Window, windows_over
from polychirp.channel.views import View
from polychirp.channel.world import Role, World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.paths import PropagationPaths

BATCH: Final = 1 << 16
"""Tubes that are followed at a time: bounds the memory."""

AT_A_TIME: Final = 2048
"""Contributions that are tried for shadow before the rest is weighed again."""

ROOM: Final = 4
"""Hits of a tube at every bounce but the first for which there is room: sheets make branches."""


def tube_paths(
    world: World, pairs: IntArray, *, tube: float = 0.02, max_bounces: int = 3
) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` that meet two bodies or more.

    Parameters
    ----------
    tube : m, width of the tubes where they meet the first body, up to 10 m away; see `windows_over`
    max_bounces : reflections, by bodies and plates together, that are followed; at least 2

    Raises
    ------
    InputError
        ``tube`` or ``max_bounces`` is out of range.

    Examples
    --------
    >>> from polychirp.channel.composite import Composite
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
    if max_bounces < 2:
        raise InputError("ray tubes answer for two bounces and more; set max_bounces to 2 or more")
    if not len(pairs) or not len(world.surfaces):
        return no_paths(world.scene, world.frequency)
    is_wanted = np.zeros((len(world.scene.radars),) * 2, dtype=np.bool_)
    is_wanted[pairs[:, 0], pairs[:, 1]] = True
    # tubes are for both ways round
    tracing = _Tracing(world, is_wanted | is_wanted.T, tube, max_bounces)
    paths = cell_paths(world, tracing.contributions())
    is_short = paths.delay * SPEED_OF_LIGHT <= world.max_length
    paths = paths.select(is_wanted[paths.transmitter, paths.receiver] & is_short)
    return without_weak(paths, world.scene, world.dynamic_range)


class _Place(NamedTuple):
    """A world as the kernels need it."""

    faces: Blockers
    bodies: Bodies


def _place_of(world: World) -> _Place:
    actors = world.scene.actors
    speeds = [actors[actor].velocity for actor in world.plates.actor]

    gap = world.scene.radar_position[:, None] - world.centre
    away = np.min(np.linalg.norm(gap, axis=-1), axis=0) - world.radius
    is_near = away <= world.max_length

    def having(*roles: Role) -> IntArray:
        has = [any(s.trees[role].face.size for role in roles) for s in world.surfaces]
        return np.flatnonzero(np.array(has) & is_near)

    return _Place(
        faces=in_frame_of(world, np.eye(3), np.zeros(3)),
        bodies=Bodies(
            centre=world.centre,
            radius=world.radius,
            velocity=world.velocity,
            plate_velocity=np.array(speeds).reshape(-1, 3),
            scatters=np.array([scatters(world, body) for body in range(len(world.body))]),
            is_pane=world.plate_is_pane,
            solid=having("opaque", "pane"),
            cloudy=having("cloud"),
        ),
    )


class _Tracing:
    """Tubes of all transmitters, and what they radiate to all receivers."""

    def __init__(self, world: World, is_wanted: BoolArray, tube: float, max_bounces: int) -> None:
        self.world, self.tube, self.max_bounces = world, tube, max_bounces
        self.is_wanted = is_wanted
        self.place = _place_of(world)
        num_radars = len(is_wanted)
        self.views = {
            (radar, body): View(world=world, radar=radar, body=body)
            for radar in range(num_radars)
            for body in range(len(world.surfaces))
        }
        direct = visible_line_of_sight(
            world, np.argwhere(is_wanted & ~np.eye(num_radars, dtype=np.bool_))
        )
        self.known = strongest_of_pair(direct, strength(direct, world.scene), num_radars)

    def contributions(self) -> Contributions:
        """All that is worth more than the dynamic range leaves."""
        found = [NO_CONTRIBUTIONS]
        for radar in np.flatnonzero(self.is_wanted.any(axis=1)):
            found += self._of_transmitter(int(radar))
        return joined(found)

    def _of_transmitter(self, radar: int) -> list[Contributions]:
        found = []
        waiting: list[tuple[int, Hits]] = []
        for body in self._first_bodies(radar):
            for window in windows_over(self.world, radar, body, self.tube):
                for begin in range(0, window.num_tubes, BATCH):
                    end = min(begin + BATCH, window.num_tubes)
                    waiting.append((body, self._hits(radar, body, window, (begin, end))))
                    if sum(len(hits.length) for _, hits in waiting) > BATCH:
                        found += self._to_receivers(radar, waiting)
                        waiting = []
        return found + self._to_receivers(radar, waiting)

    def _first_bodies(self, radar: int) -> list[int]:
        """Bodies whose windows may be worth a look, near ones first."""
        world = self.world
        carrier = world.scene.carriers[radar]
        bodies = [
            body
            for body in range(len(world.surfaces))
            if self.place.bodies.scatters[body]
            and world.body[body] != carrier
            and self.views[radar, body].distance <= world.max_length
            and any(
                self._bound(radar, body, int(receiver)) * world.dynamic_range
                >= self.known[radar, receiver]
                for receiver in np.flatnonzero(self.is_wanted[radar])
            )
        ]
        return sorted(bodies, key=lambda body: self.views[radar, body].distance)

    def _bound(self, radar: int, body: int, receiver: int) -> float:
        """Greatest power of a path with this first body, the elements' gains included."""
        out, back = self.views[radar, body], self.views[receiver, body]
        length = max(out.distance + back.distance, 1e-3)
        amplitude = OVERSHOOT**2 / (2 * self.world.wavenumber * length)
        peak = self.world.scene.radars[receiver].array.pattern.peak_gain
        return float(amplitude**2 * out.most_gain * peak)

    def _hits(self, radar: int, body: int, window: Window, tubes: tuple[int, int]) -> Hits:
        """Where some of a window's tubes meet a second body, and more."""
        room = ROOM * PER_CHUNK * (self.max_bounces - 1)
        rows = window.rows(self.world.scene.radar_velocity[radar])
        num_chunks = -(-(tubes[1] - tubes[0]) // PER_CHUNK)
        while True:
            hits = empty_hits(num_chunks * room)
            counts = trace(
                rows,
                (*tubes, window.shape[1]),
                self.place.faces,
                self.world.media,
                self.place.bodies,
                body,
                (self.max_bounces, self.world.wavenumber),
                hits,
                room,
            )
            most = int(np.max(counts, initial=0))
            if most <= room:
                filled = np.arange(room) < counts[:, None]
                return hits.of(np.flatnonzero(filled.reshape(-1)))
            room = most

    def _to_receivers(self, radar: int, waiting: list[tuple[int, Hits]]) -> list[Contributions]:
        """What the hits radiate to every receiver that is wanted."""
        if not any(len(hits.length) for _, hits in waiting):
            return []
        first = np.concatenate([np.full(len(hits.length), body) for body, hits in waiting])
        hits = Hits(*[np.concatenate(f) for f in zip(*[h for _, h in waiting], strict=True)])
        scene = self.world.scene
        gain = scene.radars[radar].array.pattern.gain(hits.departure @ scene.radar_rotation[radar])
        return [
            self._to_receiver(radar, int(receiver), first, hits, gain)
            for receiver in np.flatnonzero(self.is_wanted[radar])
        ]

    def _to_receiver(
        self, radar: int, receiver: int, first: IntArray, hits: Hits, gain: FloatArray
    ) -> Contributions:
        world, scene = self.world, self.world.scene
        sink = scene.radar_position[receiver]
        own = world.bodies_of(scene.carriers[receiver])
        transfer, back, last_leg = radiate(
            hits, sink, int(own[0]) if len(own) else -1, world.wavenumber
        )
        heard = np.flatnonzero(np.any(transfer != 0, axis=1))
        power = np.max(np.abs(transfer[heard]) ** 2, axis=1) * gain[heard]
        power *= scene.radars[receiver].array.pattern.gain(
            -back[heard] @ scene.radar_rotation[receiver]
        )
        kept = heard[self._seen(receiver, hits, heard, power, self.known[radar, receiver])]
        legs = self._last_legs(sink, hits.of(kept))
        body = hits.body[kept]
        velocity = world.velocity[body]
        turn = hits.direction[kept] - back[kept]
        return Contributions(
            pair=np.tile([radar, receiver], (len(kept), 1)),
            body=np.stack([first[kept], body], axis=1),
            transfer=np.swapaxes(legs, 1, 2) @ transfer[kept].reshape(-1, 2, 2),
            length=hits.length[kept] + last_leg[kept],
            rate=hits.rate[kept]
            + np.sum(velocity * turn, axis=1)
            + back[kept] @ scene.radar_velocity[receiver],
            direction=np.stack([hits.departure[kept], -back[kept]], axis=1),
            point=np.stack([hits.first[kept], hits.point[kept]], axis=1),
        )

    def _last_legs(self, sink: FloatArray, hits: Hits) -> ComplexArray:
        """What sheets and leaves leave on the way from a receiver to hits, ``(hit, 2, 2)``."""
        return through(self.world, sink, hits.point + LIFT * hits.normal)

    def _seen(
        self, receiver: int, hits: Hits, which: IntArray, power: FloatArray, known: float
    ) -> IntArray:
        """Places in ``which`` of the hits that a receiver sees, of those that are worth it."""
        world = self.world
        order = np.argsort(-power, kind="stable")
        rest = np.cumsum(power[order][::-1])[::-1]
        reach = np.cumsum(np.sqrt(power[order])[::-1])[::-1] ** 2
        between = [self.views[receiver, body].between for body in range(len(world.surfaces))]
        is_opaque = ~world.plate_is_pane
        near = (
            *_joined([bodies for bodies, _ in between]),
            *_joined([plates[is_opaque[plates]] for _, plates in between]),
        )
        found, total = [np.zeros(0, dtype=np.int64)], 0.0
        sink = world.scene.radar_position[receiver]
        for begin in range(0, len(order), AT_A_TIME):
            if (
                rest[begin] * world.dynamic_range < total
                or reach[begin] * world.dynamic_range < known
            ):
                break
            some = order[begin : begin + AT_A_TIME]
            free = some[unhidden(self.place.faces, near, hits, sink, which[some])]
            total += float(np.sum(power[free]))
            found.append(free)
        return np.sort(np.concatenate(found))


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
