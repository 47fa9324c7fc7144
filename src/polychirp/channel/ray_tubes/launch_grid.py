"""Launch grids: windows of narrow tubes from a radar that cover a body's box without gaps."""

from functools import lru_cache
from typing import Final, NamedTuple, Self

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.scene.world import Surface, World

FULL_WIDTH_DISTANCE: Final = 10.0
"""Distance of a body, m, beyond which tubes widen with distance (chosen); see `windows_over`."""


class Launch(NamedTuple):
    """A `Window` as the kernels take it: flat, with the radar's velocity and the window's body.

    ``velocity`` is in m/s; ``columns`` is the second number of the window's ``shape``.
    """

    origin: FloatArray
    velocity: FloatArray
    axes: FloatArray
    start: FloatArray
    step: FloatArray
    columns: int
    body: int


class Window(NamedTuple):
    r"""Tubes side by side on a rectangle at right angles to ``axes[0]``.

    The tube in row i and column j starts along

    .. math:: D = (c + a u + b v)/s, \quad s = |c + a u + b v|

    with c, u, v the three ``axes`` ``(axis, xyz)``, unit vectors at right angles, and (a, b) =
    ``start + (i, j)·step``. ``shape`` are the numbers of rows and columns.
    """

    origin: FloatArray
    axes: FloatArray
    start: FloatArray
    step: FloatArray
    shape: tuple[int, int]

    @property
    def num_tubes(self) -> int:
        """Number of tubes."""
        return self.shape[0] * self.shape[1]

    @property
    def finer(self) -> Self:
        """The same window with twice as many rows and columns."""
        return self._replace(
            start=self.start - 0.25 * self.step,
            step=0.5 * self.step,
            shape=(2 * self.shape[0], 2 * self.shape[1]),
        )

    def launch(self, velocity: FloatArray, body: int) -> Launch:
        """The window over a body, from a radar with a velocity (m/s)."""
        axes = np.ascontiguousarray(self.axes)
        return Launch(self.origin, velocity, axes, self.start, self.step, self.shape[1], body)


@lru_cache(maxsize=256)
def box_of(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Low and high corner of a surface's box in its own frame, m ``(xyz,)``."""
    corners = surface.centroid[:, None] + surface.corner
    return corners.min(axis=(0, 1)), corners.max(axis=(0, 1))


def _place(world: World, radar: int, body: int) -> FloatArray:
    """Place of a radar in a body's frame, m ``(xyz,)``."""
    away = world.scene.radar_position[radar] - world.position[body]
    return np.asarray(away @ world.rotation[body])


def distance_to(world: World, radar: int, body: int) -> float:
    """Distance of the box about a body from a radar, m; 0 within the box."""
    place = _place(world, radar, body)
    return float(np.linalg.norm(np.clip(place, *box_of(world.surfaces[body])) - place))


def windows_over(
    world: World, radar: int, body: int, tube: float, *, across: int = 1
) -> list[Window]:
    """Windows of a radar over a body, whose tubes are ``tube`` m wide where the body is nearest.

    Beyond `FULL_WIDTH_DISTANCE` the width grows with the square root of the distance, so that the
    sagitta of the wave front across a tube stays the same. The width is never more than the
    diagonal of the body's box divided by ``across``.
    """
    low, high = box_of(world.surfaces[body])
    rotation, position = world.rotation[body], world.position[body]
    place = _place(world, radar, body)
    width = tube * max(1.0, distance_to(world, radar, body) / FULL_WIDTH_DISTANCE) ** 0.5
    width = min(width, float(np.linalg.norm(high - low)) / across)
    return [
        window._replace(origin=window.origin @ rotation.T + position, axes=window.axes @ rotation.T)
        for window in box_windows(place, low, high, width)
    ]


def box_windows(place: FloatArray, low: FloatArray, high: FloatArray, tube: float) -> list[Window]:
    """Windows over the box between two corners, seen from a place outside or inside of it.

    From outside one window is enough: its middle direction goes to the nearest point of the box,
    so that all of the box lies ahead. The window ends at the outline of the box, and has even
    numbers of rows and columns, so that the edge of a symmetric corner lies between two tubes.

    >>> window, = box_windows(
    ...     np.array([10.0, 0, 0]), np.array([-1, -0.5, -0.5]), np.array([0, 0.5, 0.5]), 0.1)
    >>> window.shape
    (10, 10)
    """
    nearest = np.clip(place, low, high)
    away = nearest - place
    distance = float(np.linalg.norm(away))
    if distance < 1e-6 * float(np.linalg.norm(high - low)):
        return _all_around(place, low, high, tube)
    middle = away / distance
    # the axis of the box that is most nearly perpendicular to the middle direction
    side = np.eye(3)[np.argmin(np.abs(middle))]
    along = side - (side @ middle) * middle
    along /= np.linalg.norm(along)
    axes = np.stack([middle, np.cross(along, middle), along])
    corner = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), -1).reshape(-1, 3)
    depth, across, upright = axes @ (corner - place).T
    seen = np.stack([across / depth, upright / depth])
    first, last = seen.min(axis=1), seen.max(axis=1)
    half = np.maximum(1, np.ceil((last - first) * distance / (2 * tube) - 1e-6))
    step = (last - first) / (2 * half)
    rows, columns = (2 * half).astype(int)
    return [Window(place, axes, first + 0.5 * step, step, (int(rows), int(columns)))]


def _all_around(place: FloatArray, low: FloatArray, high: FloatArray, tube: float) -> list[Window]:
    """Six windows for all directions; tubes are ``tube`` m wide at half the box's shortest side."""
    count = 2 * int(np.ceil(0.5 * np.min(high - low) / tube - 1e-6) + 1)
    step = np.full(2, 2.0 / count)
    return [
        Window(
            place, np.roll(sign * np.eye(3), turn, axis=0), -1 + 0.5 * step, step, (count, count)
        )
        for turn in range(3)
        for sign in (1.0, -1.0)
    ]
