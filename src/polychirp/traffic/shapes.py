"""Dimensions of four bodies of one piece, chosen as typical of their classes, not of a model."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.traffic.outline import End
from polychirp.traffic.shell import Profile, Window

Body = Literal["sedan", "hatchback", "van", "truck", "articulated-truck"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tier:
    """A cabin or box on the lower body: ends and half widths of its base and of its roof (m).

    ``height`` is z of the roof's middle. ``walls`` are the radii of the walls at front, side and
    rear in vertical section, ``side`` that of the sides from above, ``edge`` that of the roof's
    edge, and ``crown`` those of the roof along and across (m). ``panes`` are the windows' lower and
    upper ends as fractions of the walls' height.
    """

    base_front: End
    base_rear: End
    base_half_width: float
    roof_front: End
    roof_rear: End
    roof_half_width: float
    height: float
    walls: tuple[float, float, float]
    edge: float
    crown: tuple[float, float]
    windows: tuple[Window, ...] = ()
    panes: tuple[float, float] = (0.06, 0.9)
    side: float = 12.0
    part: str = "cabin"
    roof_part: str = "roof"


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheels:
    """Axles and tyres (m): x of both axles, radius and width of a tyre, gap from tyre to arch."""

    front: float
    rear: float
    radius: float
    width: float
    gap: float = 0.055


@dataclass(frozen=True, slots=True, kw_only=True)
class Mirror:
    """Inner, lower corner of the left outside mirror's glass, and the glass's size (m)."""

    x: float
    y: float
    z: float
    width: float = 0.2
    height: float = 0.14


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """All dimensions of one body (m); x is forward from the middle of its length, z is up.

    The bumpers' plastic skins reach ±length/2; the metal ends behind them, at ``metal_front`` and
    ``metal_rear``. ``side`` is the radius of the sides from above, ``widest`` x of the widest
    place, ``shoulder`` the radius between flank and deck. ``deck`` lists (x, z) of bonnet, belt and
    boot along the middle; ``deck_crown`` is the deck's radius across. Names with ``start`` or
    ``stop`` give x where a part begins or ends; ``rear_bumper_top`` is z of the rear bumper's
    ledge.
    """

    length: float
    width: float
    side: float
    widest: float
    shoulder: float
    deck: tuple[tuple[float, float], ...]
    deck_crown: float
    metal_front: End
    metal_rear: End
    skin_front: End
    skin_rear: End
    front: Profile
    flank: Profile
    rear: Profile
    skin_front_profile: Profile
    skin_rear_profile: Profile
    front_bumper_stop: float
    rear_bumper_start: float
    rear_bumper_top: float
    bonnet_stop: float
    boot_start: float
    wheels: Wheels
    mirror: Mirror
    tiers: tuple[Tier, ...]

    def deck_height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Z (m) of bonnet, belt and boot: a smooth line along the middle, a parabola across."""
        return line_through(self.deck, x) - y * y / (2 * self.deck_crown)

    @property
    def deck_radius(self) -> float:
        """The smallest radius of curvature of the deck's line along the middle, m."""
        x = np.linspace(-self.length / 2, self.length / 2, 1001)
        bend = np.diff(line_through(self.deck, x), 2) / (x[1] - x[0]) ** 2
        return float(1 / np.abs(bend).max())


def line_through(points: tuple[tuple[float, float], ...], x: FloatArray) -> FloatArray:
    """Z of a cubic Hermite spline through (x, z): central slopes inside, straight beyond the ends.

    >>> line_through(((0.0, 1.0), (1.0, 2.0), (3.0, 4.0)), np.array([0.5, 2.0, 4.0]))
    array([1.5, 3. , 5. ])
    """
    at, level = np.array(sorted(points)).T
    slope = np.gradient(level, at)
    number = np.clip(np.searchsorted(at, x) - 1, 0, len(at) - 2)
    gap = at[number + 1] - at[number]
    t = (x - at[number]) / gap
    inner = (
        level[number] * (1 + 2 * t) * (1 - t) ** 2
        + slope[number] * gap * t * (1 - t) ** 2
        + level[number + 1] * t * t * (3 - 2 * t)
        + slope[number + 1] * gap * t * t * (t - 1)
    )
    before, after = level[0] + slope[0] * (x - at[0]), level[-1] + slope[-1] * (x - at[-1])
    return np.asarray(np.select([x < at[0], x > at[-1]], [before, after], inner))


SEDAN: Final = Shape(
    length=4.6,
    width=1.82,
    side=30.0,
    widest=-0.1,
    shoulder=0.015,
    deck=((2.3, 0.685), (1.8, 0.79), (1.0, 0.93), (0.0, 0.96), (-1.4, 0.985), (-2.1, 0.97)),
    deck_crown=3.6,
    metal_front=End(x=1.85, radius=2.3, corner=0.12),
    metal_rear=End(x=-2.15, radius=2.8, corner=0.13),
    skin_front=End(x=2.3, radius=2.4, corner=0.34),
    skin_rear=End(x=-2.3, radius=2.6, corner=0.28),
    front=Profile(sill=0.35, radius=0.26, waist=0.53, inset=0.13),
    flank=Profile(sill=0.2, radius=2.4, waist=0.58, inset=0.035),
    rear=Profile(sill=0.37, radius=0.36, waist=0.62, inset=0.13),
    skin_front_profile=Profile(sill=0.19, radius=0.36, waist=0.46, inset=0.1),
    skin_rear_profile=Profile(sill=0.25, radius=0.36, waist=0.5, inset=0.06),
    front_bumper_stop=1.58,
    rear_bumper_start=-1.77,
    rear_bumper_top=0.66,
    bonnet_stop=1.05,
    boot_start=-1.5,
    wheels=Wheels(front=1.36, rear=-1.34, radius=0.32, width=0.21),
    mirror=Mirror(x=0.66, y=0.72, z=0.94),
    tiers=(
        Tier(
            base_front=End(x=1.1, radius=1.8, corner=0.06),
            base_rear=End(x=-1.68, radius=2.2, corner=0.08),
            base_half_width=0.8,
            roof_front=End(x=0.3, radius=2.0, corner=0.06),
            roof_rear=End(x=-0.92, radius=2.4, corner=0.08),
            roof_half_width=0.585,
            height=1.45,
            walls=(4.5, 2.6, 4.5),
            edge=0.025,
            crown=(4.5, 2.6),
            windows=(
                Window(part="windscreen", arc=0),
                Window(part="window-front-left", arc=2, start=0.82, stop=-0.22),
                Window(part="window-rear-left", arc=2, start=-0.3, stop=-1.2),
                Window(part="rear-window", arc=4),
            ),
        ),
    ),
)

HATCHBACK: Final = Shape(
    length=4.1,
    width=1.76,
    side=28.0,
    widest=-0.1,
    shoulder=0.015,
    deck=((2.05, 0.7), (1.5, 0.815), (0.85, 0.92), (0.0, 0.965), (-1.2, 0.97), (-1.9, 0.95)),
    deck_crown=3.4,
    metal_front=End(x=1.6, radius=2.5, corner=0.12),
    metal_rear=End(x=-1.91, radius=2.4, corner=0.13),
    skin_front=End(x=2.05, radius=2.2, corner=0.34),
    skin_rear=End(x=-2.05, radius=2.3, corner=0.28),
    front=Profile(sill=0.35, radius=0.26, waist=0.54, inset=0.13),
    flank=Profile(sill=0.2, radius=2.2, waist=0.58, inset=0.035),
    rear=Profile(sill=0.37, radius=0.36, waist=0.62, inset=0.12),
    skin_front_profile=Profile(sill=0.2, radius=0.36, waist=0.47, inset=0.1),
    skin_rear_profile=Profile(sill=0.25, radius=0.36, waist=0.5, inset=0.06),
    front_bumper_stop=1.33,
    rear_bumper_start=-1.54,
    rear_bumper_top=0.66,
    bonnet_stop=1.0,
    boot_start=-1.72,
    wheels=Wheels(front=1.22, rear=-1.28, radius=0.31, width=0.2),
    mirror=Mirror(x=0.6, y=0.7, z=0.94),
    tiers=(
        Tier(
            base_front=End(x=1.08, radius=1.7, corner=0.06),
            base_rear=End(x=-1.76, radius=2.0, corner=0.1),
            base_half_width=0.78,
            roof_front=End(x=0.32, radius=1.9, corner=0.06),
            roof_rear=End(x=-1.5, radius=2.2, corner=0.1),
            roof_half_width=0.58,
            height=1.48,
            walls=(4.5, 2.6, 3.0),
            edge=0.025,
            crown=(5.0, 2.6),
            windows=(
                Window(part="windscreen", arc=0),
                Window(part="window-front-left", arc=2, start=0.8, stop=-0.2),
                Window(part="window-rear-left", arc=2, start=-0.28, stop=-1.15),
                Window(part="rear-window", arc=4),
            ),
        ),
    ),
)

VAN: Final = Shape(
    length=5.2,
    width=1.98,
    side=40.0,
    widest=-0.3,
    shoulder=0.015,
    deck=((2.6, 0.76), (2.0, 0.93), (1.3, 1.08), (0.5, 1.13), (-1.0, 1.06), (-2.4, 0.88)),
    deck_crown=5.0,
    metal_front=End(x=2.15, radius=2.8, corner=0.16),
    metal_rear=End(x=-2.45, radius=3.4, corner=0.1),
    skin_front=End(x=2.6, radius=2.6, corner=0.34),
    skin_rear=End(x=-2.6, radius=3.2, corner=0.28),
    front=Profile(sill=0.36, radius=0.3, waist=0.58, inset=0.18),
    flank=Profile(sill=0.24, radius=4.0, waist=0.56, inset=0.035),
    rear=Profile(sill=0.36, radius=0.34, waist=0.58, inset=0.12),
    skin_front_profile=Profile(sill=0.21, radius=0.38, waist=0.5, inset=0.12),
    skin_rear_profile=Profile(sill=0.28, radius=0.26, waist=0.47, inset=0.06),
    front_bumper_stop=1.86,
    rear_bumper_start=-2.08,
    rear_bumper_top=0.64,
    bonnet_stop=1.6,
    boot_start=-2.38,
    wheels=Wheels(front=1.62, rear=-1.55, radius=0.34, width=0.22),
    mirror=Mirror(x=1.12, y=0.86, z=1.22, width=0.2, height=0.26),
    tiers=(
        Tier(
            base_front=End(x=1.72, radius=1.9, corner=0.1),
            base_rear=End(x=-2.3, radius=6.0, corner=0.08),
            base_half_width=0.93,
            roof_front=End(x=0.95, radius=2.4, corner=0.09),
            roof_rear=End(x=-2.22, radius=6.0, corner=0.1),
            roof_half_width=0.8,
            height=2.05,
            walls=(4.5, 4.5, 9.0),
            edge=0.05,
            crown=(14.0, 5.0),
            windows=(
                Window(part="windscreen", arc=0),
                Window(part="window-front-left", arc=2, start=1.42, stop=0.62),
                Window(part="rear-window", arc=4),
            ),
            panes=(0.08, 0.72),
            side=25.0,
        ),
    ),
)

TRUCK: Final = Shape(
    length=7.2,
    width=2.2,
    side=60.0,
    widest=0.0,
    shoulder=0.015,
    deck=((3.6, 0.98), (3.1, 1.03), (2.5, 1.08), (1.0, 1.1), (-3.4, 1.1)),
    deck_crown=12.0,
    metal_front=End(x=3.15, radius=3.0, corner=0.24),
    metal_rear=End(x=-3.45, radius=4.0, corner=0.2),
    skin_front=End(x=3.6, radius=2.8, corner=0.34),
    skin_rear=End(x=-3.6, radius=3.6, corner=0.28),
    front=Profile(sill=0.38, radius=0.4, waist=0.68, inset=0.2),
    flank=Profile(sill=0.36, radius=8.0, waist=0.64, inset=0.03),
    rear=Profile(sill=0.42, radius=0.4, waist=0.72, inset=0.2),
    skin_front_profile=Profile(sill=0.33, radius=0.55, waist=0.64, inset=0.14),
    skin_rear_profile=Profile(sill=0.38, radius=0.3, waist=0.55, inset=0.06),
    front_bumper_stop=2.85,
    rear_bumper_start=-3.2,
    rear_bumper_top=0.72,
    bonnet_stop=2.9,
    boot_start=-3.4,
    wheels=Wheels(front=2.32, rear=-2.1, radius=0.42, width=0.28),
    mirror=Mirror(x=2.6, y=1.03, z=1.62, width=0.2, height=0.42),
    tiers=(
        Tier(
            base_front=End(x=2.93, radius=2.6, corner=0.12),
            base_rear=End(x=1.3, radius=12.0, corner=0.1),
            base_half_width=1.05,
            roof_front=End(x=2.5, radius=3.0, corner=0.12),
            roof_rear=End(x=1.36, radius=12.0, corner=0.1),
            roof_half_width=0.93,
            height=2.6,
            walls=(4.0, 6.0, 12.0),
            edge=0.06,
            crown=(8.0, 5.0),
            windows=(
                Window(part="windscreen", arc=0),
                Window(part="window-left", arc=2, start=2.6, stop=1.8),
            ),
            panes=(0.32, 0.86),
            side=30.0,
            part="cab",
            roof_part="cab",
        ),
        Tier(
            base_front=End(x=1.15, radius=20.0, corner=0.03),
            base_rear=End(x=-3.22, radius=20.0, corner=0.03),
            base_half_width=1.05,
            roof_front=End(x=1.14, radius=20.0, corner=0.03),
            roof_rear=End(x=-3.21, radius=20.0, corner=0.03),
            roof_half_width=1.03,
            height=3.1,
            walls=(30.0, 30.0, 30.0),
            edge=0.03,
            crown=(60.0, 20.0),
            panes=(0.3, 0.7),
            side=60.0,
            part="box",
            roof_part="box",
        ),
    ),
)

SHAPES: Final[dict[Body, Shape]] = {
    "sedan": SEDAN,
    "hatchback": HATCHBACK,
    "van": VAN,
    "truck": TRUCK,
}
