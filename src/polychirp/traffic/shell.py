"""Curved shells of a vehicle's left half: lower body, bumper skins, cabin; and their covers.

A shell is made of ribs. A rib is a line in a vertical plane that rises in tangent arcs: long
ones (nose, flank, window) and then a short one (shoulder or roof edge), which joins the deck or
roof without a kink. Each arc is divided into edges that suit its own radius, so facets are short
only where, and in the direction in which, the surface is strongly curved.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, Self

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.traffic.outline import Outline, unit
from polychirp.traffic.surface import Fineness, SurfaceBuilder

Height = Callable[[FloatArray, FloatArray], FloatArray]
"""Function that gives the height z (m) of a deck or roof at x and y (m)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Vertical section of a front, side or rear, m.

    ``sill`` is the height of its lower end, ``radius`` the radius of its arc up to the waist,
    ``waist`` the height of its widest place, ``inset`` the distance from there inwards to the deck.
    """

    sill: float
    radius: float
    waist: float
    inset: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Arch:
    """Opening for a wheel: upper half of an ellipse on the sill; all values in m."""

    x: float
    half_width: float
    sill: float
    height: float

    def edge(self, x: FloatArray) -> FloatArray:
        """Z of the opening's edge at ``x``, m; −inf where ``x`` is outside the opening."""
        inside = 1 - ((x - self.x) / self.half_width) ** 2
        return np.where(inside >= 0, self.sill + self.height * np.sqrt(np.abs(inside)), -np.inf)

    def places(self, fine: Fineness) -> FloatArray:
        """X of ribs, m, at equal steps of the ellipse's parameter, from front to rear.

        Chords may be twice as long as edges on a curved surface, and so up to λ/16 off the arc:
        the error affects only a narrow strip along the opening.
        """
        radius = min(self.half_width, self.height)
        count = fine.steps(math.pi / 2 * radius, radius)
        return self.x + self.half_width * np.cos(np.linspace(0, math.pi, count + 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Stations:
    """Places of ribs on an outline: number of the arc and angle of its normal (rad), ``(rib,)``."""

    arc: IntArray
    angle: FloatArray

    def points(self, outline: Outline) -> FloatArray:
        """Points of the ribs, ``(rib, xy)``, m."""
        found = np.empty((len(self.arc), 2))
        for arc in np.unique(self.arc):
            found[self.arc == arc] = outline.point(int(arc), self.angle[self.arc == arc])
        return found

    def fractions(self, outline: Outline) -> FloatArray:
        """Fraction of its arc's angle at which each rib stands, 0 … 1."""
        start, stop = np.array([outline.angles(arc) for arc in range(5)])[self.arc].T
        return np.asarray((self.angle - start) / (stop - start))

    def on(self, outline: Outline, other: Outline) -> Self:
        """The ribs' places on another outline: the same fractions of the same arcs."""
        start, stop = np.array([other.angles(arc) for arc in range(5)])[self.arc].T
        return replace(self, angle=start + self.fractions(outline) * (stop - start))

    def weights(self, outline: Outline) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weights of front, side and rear at each rib: 0 or 1 on faces, smooth at corners."""
        at = self.fractions(outline)
        rise = at * at * (3 - 2 * at)
        front = np.select([self.arc == 0, self.arc == 1], [1.0, 1 - rise], 0.0)
        rear = np.select([self.arc == 4, self.arc == 3], [1.0, rise], 0.0)
        return front, 1 - front - rear, rear


def join(pieces: list[tuple[int, FloatArray]]) -> Stations:
    """Stations from pieces (arc number, normal angles); each piece begins where one before ends."""
    runs = [angle if k == 0 else angle[1:] for k, (_, angle) in enumerate(pieces)]
    arc = np.repeat([arc for arc, _ in pieces], [len(run) for run in runs])
    return Stations(arc=arc, angle=np.concatenate(runs))


@dataclass(frozen=True, slots=True, kw_only=True)
class Rim:
    """Border of a cover: point numbers ``(rib,)`` and places ``(rib, xyz)``, m, from nose to tail.

    ``corners`` are the numbers of the ribs at which the front face ends and the rear face begins.
    """

    line: IntArray
    points: FloatArray
    corners: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ribs:
    """Ribs: point numbers by arc and rib (arcs share their ends), and places of both ends, m."""

    stations: Stations
    segments: list[list[IntArray]]
    bottom: FloatArray
    top: FloatArray

    @property
    def corners(self) -> tuple[int, int]:
        """Numbers of the ribs at which the front face ends and the rear face begins."""
        arc = self.stations.arc
        return int((arc == 0).sum()) - 1, int((arc < 4).sum()) - 1

    @property
    def bottom_line(self) -> IntArray:
        """Point numbers of the lower ends, ``(rib,)``."""
        return np.array([rib[0] for rib in self.segments[0]])

    @property
    def top_line(self) -> IntArray:
        """Point numbers of the upper ends, ``(rib,)``."""
        return np.array([rib[-1] for rib in self.segments[-1]])

    @property
    def upper_rim(self) -> Rim:
        """Upper ends of the ribs, the border of a deck or roof."""
        return Rim(line=self.top_line, points=self.top, corners=self.corners)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shell:
    """A lower body or a bumper's skin: an outline with profiles at front, side and rear.

    ``deck`` is the surface on which the ribs end, ``shoulder`` the radius (m) of their last arc.
    """

    outline: Outline
    front: Profile
    side: Profile
    rear: Profile
    shoulder: float
    deck: Height
    arches: tuple[Arch, ...] = ()

    def stations(
        self, fine: Fineness, *, start: float = math.inf, stop: float = -math.inf
    ) -> Stations:
        """Ribs' places from ``start`` back to ``stop`` (x on the flank, m; ±inf: to the end)."""
        outline = self.outline
        limits = outline.point(2, np.array(outline.angles(2)))[:, 0]
        places = self._side_places(fine, min(start, limits[0]), max(stop, limits[1]))
        pieces = [(2, outline.angle_at(places))]
        if math.isinf(start):
            pieces = [(arc, self._end_angles(fine, arc)) for arc in (0, 1)] + pieces
        if math.isinf(stop):
            pieces = pieces + [(arc, self._end_angles(fine, arc)) for arc in (3, 4)]
        return join(pieces)

    def _end_angles(self, fine: Fineness, arc: int) -> FloatArray:
        outline = self.outline
        count = fine.steps(outline.length(arc), outline.radius(arc))
        return np.linspace(*outline.angles(arc), count + 1)

    def _side_places(self, fine: Fineness, start: float, stop: float) -> FloatArray:
        """X of ribs, m, from ``start`` back to ``stop``; closer where a wheel arch is steep."""
        arched = [arch.places(fine) for arch in self.arches]
        fixed = np.concatenate([[start], *arched, [stop]])
        fixed = np.sort(fixed[(fixed <= start) & (fixed >= stop)])[::-1]
        gaps = [
            np.linspace(a, b, fine.steps(a - b, self.outline.side) + 1)[1:]
            for a, b in pairwise(fixed)
            if a - b > 1e-6
        ]
        return np.concatenate([[start], *gaps])

    def blend(self, stations: Stations, quantity: str) -> FloatArray:
        """Weighted mean of one quantity of the three profiles at every rib, ``(rib,)``."""
        weights = stations.weights(self.outline)
        profiles = (self.front, self.side, self.rear)
        parts = [w * getattr(p, quantity) for w, p in zip(weights, profiles, strict=True)]
        return np.asarray(np.sum(parts, axis=0))

    def planes(self, stations: Stations) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Waist points ``(rib, xy)``, outward directions of the ribs, and their horizontal depth.

        A rib leads from the outline to the point of the same arc and fraction on `_rim`, a smaller
        outline.
        """
        plan = stations.points(self.outline)
        run = plan - stations.on(self.outline, self._rim).points(self._rim)
        depth = np.linalg.norm(run, axis=1)
        return plan, run / depth[:, None], depth

    @property
    def _rim(self) -> Outline:
        outline = self.outline
        front, rear = (
            replace(
                end,
                x=end.x - math.copysign(profile.inset, end.x),
                corner=max(end.corner - profile.inset, 0.25 * end.corner),
            )
            for end, profile in ((outline.front, self.front), (outline.rear, self.rear))
        )
        width = outline.half_width - self.side.inset
        return replace(outline, front=front, rear=rear, half_width=width)

    def ribs(self, builder: SurfaceBuilder, fine: Fineness, stations: Stations) -> Ribs:
        """Add ribs at the stations: arcs below and above the waist, and the shoulder."""
        plan, normal, _ = self.planes(stations)
        waist, lower = self.blend(stations, "waist"), self.blend(stations, "radius")
        upper, turn, rim = self._upper(stations)
        sill = self.blend(stations, "sill")
        start = np.max([sill, *(arch.edge(plan[:, 0]) for arch in self.arches)], axis=0) - waist
        level = np.zeros_like(waist)
        edge = np.column_stack([plan, waist])

        def origin(radius: FloatArray) -> FloatArray:
            return edge - _lift(np.stack([radius, level], -1), normal)

        inner = (upper - self.shoulder)[:, None] * unit(turn)
        arcs = [
            Arcs(
                origin=origin(lower),
                normal=normal,
                radius=lower,
                start=np.arcsin(np.minimum(start / lower, 0.0)),
                stop=level,
            ),
            Arcs(
                origin=origin(upper),
                normal=normal,
                radius=upper,
                start=np.arcsin(np.maximum(start / upper, 0.0)),
                stop=turn,
            ),
            Arcs(
                origin=origin(upper) + _lift(inner, normal),
                normal=normal,
                radius=np.full_like(upper, self.shoulder),
                start=turn,
                stop=rim,
            ),
        ]
        return draw(builder, fine, stations, arcs)

    def undercut(
        self,
        builder: SurfaceBuilder,
        fine: Fineness,
        ribs: Ribs,
        inset: float,
        *,
        part: str,
        material: str,
    ) -> Rim:
        """Add straight lines from the ribs' lower ends to a flat floor; return the floor's rim.

        The floor is at the height of the flank's sill and begins ``inset`` (m) inside the outline.
        Above the wheels, where ribs end at an arch, the lines form the wheel houses.
        """
        stations, inner = ribs.stations, self._within(inset)
        level = np.full(len(ribs.bottom), self.side.sill)
        ends = np.column_stack([stations.on(self.outline, inner).points(inner), level])
        lines = []
        for point, outer, end in zip(ribs.bottom_line, ribs.bottom, ends, strict=True):
            count = fine.steps(float(np.linalg.norm(end - outer)))
            way = outer + np.linspace(0, 1, count + 1)[1:, None] * (end - outer)
            lines.append(np.append([point], builder.line(way)))
        builder.net(lines, part=part, material=material)
        return Rim(line=np.array([way[-1] for way in lines]), points=ends, corners=ribs.corners)

    def _within(self, inset: float) -> Outline:
        """The outline moved ``inset`` (m) inwards, with corners of the same radius."""
        outline = self.outline
        front, rear = (
            replace(end, x=end.x - math.copysign(inset, end.x))
            for end in (outline.front, outline.rear)
        )
        return replace(outline, front=front, rear=rear, half_width=outline.half_width - inset)

    def _upper(self, stations: Stations) -> tuple[FloatArray, FloatArray, FloatArray]:
        r"""Radius above the waist, m, and elevations of the shoulder's begin and end, ``(rib,)``.

        An arc of radius :math:`R`, vertical at the waist, turns by :math:`\theta` up to the
        shoulder of radius :math:`r`. It rises by :math:`h = (R - r)\sin\theta` and recedes by
        :math:`d = (R - r)(1 - \cos\theta)`, so :math:`\tan(\theta/2) = d/h`.
        """
        plan, normal, inset = self.planes(stations)
        end = plan - inset[:, None] * normal
        rim = rim_elevation(self.deck, end, normal)
        rise = self.deck(*end.T) - self.blend(stations, "waist") - self.shoulder * np.sin(rim)
        depth = inset - self.shoulder * (1 - np.cos(rim))
        turn = 2 * np.arctan2(depth, rise)
        return self.shoulder + rise / np.sin(turn), turn, rim


@dataclass(frozen=True, slots=True, kw_only=True)
class Arcs:
    """One arc per rib, in a vertical plane along ``normal``: centre, radius (m), angles (rad)."""

    origin: FloatArray
    normal: FloatArray
    radius: FloatArray
    start: FloatArray
    stop: FloatArray

    def cut(self, number: int, elevation: FloatArray) -> FloatArray:
        """Points ``(point, xyz)``, m, of rib ``number`` at these elevations."""
        offset = self.radius[number] * np.stack([np.cos(elevation), np.sin(elevation)], axis=-1)
        return np.asarray(self.origin[number] + _lift(offset, self.normal[number]))


def _lift(offset: FloatArray, normal: FloatArray) -> FloatArray:
    """Convert vectors (outward, up) in the vertical planes along ``normal`` to ``(…, xyz)``."""
    return np.concatenate([offset[..., :1] * normal, offset[..., 1:]], axis=-1)


def draw(builder: SurfaceBuilder, fine: Fineness, stations: Stations, arcs: list[Arcs]) -> Ribs:
    """Add ribs of consecutive arcs; each arc gets as many edges as its radius needs."""
    segments: list[list[IntArray]] = [[] for _ in arcs]
    bottoms, tops = [], []
    for number in range(len(arcs[0].radius)):
        pieces: list[FloatArray] = []
        counts = []
        for arc in arcs:
            start, stop, radius = arc.start[number], arc.stop[number], arc.radius[number]
            is_empty = stop - start < 1e-9  # such as a flank below an arch that reaches the waist
            count = 0 if is_empty else fine.steps(radius * (stop - start), radius)
            counts.append(count)
            if count:
                elevation = np.linspace(start, stop, count + 1)[1 if pieces else 0 :]
                pieces.append(arc.cut(number, elevation))
        points = np.concatenate(pieces)
        line = builder.line(points)
        ends = np.cumsum([0, *counts])
        for segment, first, last in zip(segments, ends, ends[1:], strict=False):
            segment.append(line[first : last + 1])
        bottoms.append(points[0])
        tops.append(points[-1])
    return Ribs(stations=stations, segments=segments, bottom=np.array(bottoms), top=np.array(tops))


def rim_elevation(surface: Height, end: FloatArray, normal: FloatArray) -> FloatArray:
    """Elevation (rad) of the normal of a deck or roof at its rim, in the ribs' planes."""
    step = 1e-4
    outer, inner = end + step * normal, end - step * normal
    fall = (surface(*inner.T) - surface(*outer.T)) / (2 * step)
    return np.asarray(np.pi / 2 - np.arctan(fall))


@dataclass(frozen=True, slots=True, kw_only=True)
class Cover:
    """A deck, roof or floor between the ends of ribs, by lines across the vehicle.

    In plan, the lines are curved like the nose in front, like the tail at the rear, and straight in
    the middle.
    They end slightly inside the rim, and a ring of triangles joins them to all points of the rim:
    lines up to the rim would give very thin triangles between points that are nearly in line.

    Parameters
    ----------
    height : z over x and y, m
    across, along : radii of curvature across and along the vehicle, m
    part : function that gives the name of the part that begins with the line at x (m)
    rim_part : name of the ring's part
    turn : 1 for a surface that faces up, −1 for a floor
    """

    height: Height
    part: Callable[[float], str]
    rim_part: str
    across: float = math.inf
    along: float = math.inf
    turn: Literal[1, -1] = 1

    def fill(self, builder: SurfaceBuilder, fine: Fineness, border: Rim) -> None:
        """Add triangles that close a rim at the cover's height."""
        loop, rim, turn = border.line, border.points, self.turn
        nose, tail = border.corners
        chosen = nose + _sparse(rim[nose : tail + 1], fine.edge(self.along))
        bow = Bow(rim=rim, nose=nose, tail=tail)
        lines, inner, inner_at = [], [], []
        for number in chosen:
            width = rim[number, 1] - min(0.5 * rim[number, 1], 0.6 * fine.edge(self.along))
            y = np.linspace(0.0, width, fine.steps(width, self.across) + 1)
            x = bow.places(int(number), y)
            lines.append(builder.line(np.column_stack([x, y, self.height(x, y)])))
            # inner border of the ring: first line, outer ends of the others, last line reversed
            ends = slice(0, None) if number in (chosen[0], chosen[-1]) else slice(-1, None)
            order = slice(None, None, -1 if number == chosen[-1] else 1)
            inner.append(lines[-1][ends][order])
            inner_at.append(_matching(y[ends][order], rim[:, 1], int(number)))
        for number, pair in zip(chosen, pairwise(lines), strict=False):
            part = self.part(float(rim[number, 0]))
            builder.strip(*pair[::turn], part=part, material="metal")
        outside = (loop, np.arange(float(len(loop))))
        inside = (np.concatenate(inner), np.concatenate(inner_at))
        (first, first_at), (second, second_at) = (outside, inside)[::turn]
        builder.strip(
            first,
            second,
            first_at=first_at,
            second_at=second_at,
            part=self.rim_part,
            material="metal",
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Bow:
    """Plan of lines across a vehicle: like nose or tail near these, straight half-way between."""

    rim: FloatArray
    nose: int
    tail: int

    def places(self, number: int, y: FloatArray) -> FloatArray:
        """X at ``y`` (m) of the line that ends beside rim point ``number``."""
        rim, nose, tail = self.rim, self.nose, self.tail
        x, width, _ = rim[number]
        half = (rim[nose, 0] - rim[tail, 0]) / 2
        ahead = max(0.0, 1 - (rim[nose, 0] - x) / half)
        behind = max(0.0, 1 - (x - rim[tail, 0]) / half)
        front = np.interp(y / width * rim[nose, 1], rim[: nose + 1, 1], rim[: nose + 1, 0])
        rear = np.interp(y / width * rim[tail, 1], rim[tail:, 1][::-1], rim[tail:, 0][::-1])
        return np.asarray(x + ahead * (front - rim[nose, 0]) + behind * (rear - rim[tail, 0]))


def _matching(y: FloatArray, rim_y: FloatArray, number: int) -> FloatArray:
    """Rim places (fractional numbers) that match ``y`` of a line that ends beside ``number``."""
    if len(y) == 1:
        return np.array([float(number)])
    scaled = y / y.max() * rim_y[number]
    if y[0] < y[-1]:  # the first line: the rim before it
        return np.asarray(np.interp(scaled, rim_y[: number + 1], np.arange(number + 1.0)))
    after = np.arange(number, len(rim_y), dtype=float)
    return np.asarray(np.interp(-scaled, -rim_y[number:], after))


def _sparse(path: FloatArray, spacing: float) -> IntArray:
    """Numbers of points along a path that are about ``spacing`` apart, without its ends."""
    travelled = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    chosen: list[int] = []
    last = 0.0
    for number in range(1, len(path) - 1):
        # take this point if the next one is too far
        is_due = travelled[number + 1] - last > spacing
        if is_due and travelled[-1] - travelled[number] > spacing / 3:
            chosen.append(number)
            last = travelled[number]
    return np.array(chosen)


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """A pane: name of its part, number of its arc, and its ends in x (m) if it is on the side."""

    part: str
    arc: int
    start: float = math.inf
    stop: float = -math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Cabin:
    """A cabin or box on a lower body: walls with panes from a base outline up to a roof.

    ``front``, ``side`` and ``rear`` are vertical radii of the walls (m), ``edge`` that of the
    roof's edge; the panes fill the fractions ``pane_low`` to ``pane_high`` of the walls' height.
    """

    base: Outline
    roof: Outline
    deck: Height
    top: Height
    front: float
    side: float
    rear: float
    edge: float
    windows: tuple[Window, ...]
    pane_low: float
    pane_high: float
    part: str

    def build(self, builder: SurfaceBuilder, fine: Fineness) -> Ribs:
        """Add walls, panes and pillars; the tops of the ribs are the border of the roof."""
        stations, panes = self._stations(fine)
        ribs = draw(builder, fine, stations, self._arcs(stations))
        for number, pane in enumerate(panes):
            for level, segment in enumerate(ribs.segments):
                is_pane = pane is not None and level == 1
                builder.strip(
                    segment[number + 1],
                    segment[number],
                    part=pane if is_pane and pane is not None else self.part,
                    material="glass" if is_pane else "metal",
                )
        return ribs

    def _stations(self, fine: Fineness) -> tuple[Stations, list[str | None]]:
        """Ribs, and the part of the pane between each two neighbours (None: no pane, a pillar)."""
        pieces: list[tuple[int, FloatArray]] = []
        panes: list[str | None] = []
        for arc in range(5):
            start, stop = self.base.angles(arc)
            here = [w for w in self.windows if w.arc == arc]
            edges = [start, stop]
            if arc == 2:
                edges += [
                    float(self.base.angle_at(np.array(x)))
                    for w in here
                    for x in (w.start, w.stop)
                    if math.isfinite(x)
                ]
            edges = sorted(set(edges))
            for a, b in pairwise(edges):
                count = max(
                    fine.steps(radius * (b - a), radius)
                    for radius in (self.base.radius(arc), self.roof.radius(arc))
                )
                pieces.append((arc, np.linspace(a, b, count + 1)))
                panes += [self._pane(here, arc, (a + b) / 2)] * count
        return join(pieces), panes

    def _pane(self, windows: list[Window], arc: int, angle: float) -> str | None:
        x = float(self.base.point(arc, np.array(angle))[0])
        return next((w.part for w in windows if arc != 2 or w.stop < x < w.start), None)

    def _arcs(self, stations: Stations) -> list[Arcs]:
        """Arcs of every rib on two tangent circles: frame, pane, frame (large), roof edge (small).

        The small circle ends on the roof with the roof's slope. The large one passes through the
        base and encloses the small one, which it touches. Its centre is thus at the distance
        ``radius`` from the base, and ``radius - edge`` from the small circle's centre.
        """
        low = stations.points(self.base)
        high = stations.on(self.base, self.roof).points(self.roof)
        foot, head = self.deck(*low.T), self.top(*high.T)
        run = np.linalg.norm(low - high, axis=1)
        normal = (low - high) / run[:, None]
        front, side, rear = stations.weights(self.base)
        radius = np.exp(
            front * math.log(self.front) + side * math.log(self.side) + rear * math.log(self.rear)
        )
        rim = rim_elevation(self.top, high, normal)
        # centres of both circles in the rib's plane: (outward, up), m, from the base
        small = np.stack([-run, head - foot], -1) - self.edge * unit(rim)
        reach = np.linalg.norm(small, axis=1)
        along = (reach**2 + radius**2 - (radius - self.edge) ** 2) / (2 * reach)
        aside = np.sqrt(radius**2 - along**2)
        chord = small / reach[:, None]
        inward = np.stack([-chord[:, 1], chord[:, 0]], -1)
        large = along[:, None] * chord + aside[:, None] * inward
        start = np.arctan2(-large[:, 1], -large[:, 0])
        turn = np.arctan2(small[:, 1] - large[:, 1], small[:, 0] - large[:, 0])
        base = np.column_stack([low, foot])
        cuts = [start]
        for fraction in (self.pane_low, self.pane_high):
            cuts.append(np.arcsin((fraction * small[:, 1] - large[:, 1]) / radius))
        cuts.append(turn)
        walls = [
            Arcs(origin=base + _lift(large, normal), normal=normal, radius=radius, start=a, stop=b)
            for a, b in pairwise(cuts)
        ]
        edge = np.full_like(radius, self.edge)
        rounded = Arcs(
            origin=base + _lift(small, normal), normal=normal, radius=edge, start=turn, stop=rim
        )
        return [*walls, rounded]


def flank(builder: SurfaceBuilder, ribs: Ribs, *, part: str, material: str) -> None:
    """Add strips of triangles between neighbouring ribs, for every arc of the ribs."""
    for segment in ribs.segments:
        builder.net(segment[::-1], part=part, material=material)
