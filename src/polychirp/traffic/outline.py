"""`Outline`: the shape of a car from above, with five tangent arcs on each side."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from polychirp.axes import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """One end of an outline: its x, and the radii of its face and of its corners (m)."""

    x: float
    radius: float
    corner: float


@dataclass(frozen=True, kw_only=True)
class Outline:
    """Left half of a convex outline: front face, corner, side, corner, rear face; no kinks.

    A point is given by its arc (0…4) and by the angle of its outward normal, from 0 (forward)
    over π/2 (left) to π (backward).

    Parameters
    ----------
    front, rear : `End`
    half_width : half of the width at ``widest``, m
    widest : x of the widest place, m
    side : radius of the side, m
    """

    front: End
    rear: End
    half_width: float
    widest: float
    side: float

    @cached_property
    def _turns(self) -> tuple[float, float, float, float]:
        """Normal angles, rad, at the four joints between arcs, from front to rear."""
        front_face, front_side = self._joints(self.front, self.front.x - self.widest)
        rear_face, rear_side = self._joints(self.rear, self.widest - self.rear.x)
        half = np.pi / 2
        return front_face, half - front_side, half + rear_side, np.pi - rear_face

    def _joints(self, end: End, length: float) -> tuple[float, float]:
        """Angles, rad, of half the face and half the side, from the width and length they span."""
        face = side = 0.0
        for _ in range(60):  # converges: the side's angle changes the face's by a few per cent
            across = self.half_width - end.corner * np.cos(side) - self.side * (1 - np.cos(side))
            face = float(np.arcsin(across / (end.radius - end.corner)))
            along = length - end.radius * (1 - np.cos(face)) - end.corner * np.cos(face)
            side = float(np.arcsin(along / (self.side - end.corner)))
        return face, side

    def angles(self, arc: int) -> tuple[float, float]:
        """Normal angles, rad, at the start and the end of an arc."""
        turns = (0.0, *self._turns, np.pi)
        return turns[arc], turns[arc + 1]

    def radius(self, arc: int) -> float:
        """Radius of an arc, m."""
        front, rear = self.front, self.rear
        return (front.radius, front.corner, self.side, rear.corner, rear.radius)[arc]

    def length(self, arc: int) -> float:
        """Length of an arc, m."""
        start, stop = self.angles(arc)
        return self.radius(arc) * (stop - start)

    def point(self, arc: int, angle: FloatArray) -> FloatArray:
        """Points ``(point, xy)``, m, where the outward normal has ``angle`` (rad)."""
        return self._centre(arc) + self.radius(arc) * unit(angle)

    def angle_at(self, x: FloatArray) -> FloatArray:
        """Normal angle, rad, of the side arc at ``x`` (m)."""
        return np.asarray(np.arccos((np.asarray(x) - self.widest) / self.side))

    def _centre(self, arc: int) -> FloatArray:
        if arc == 2:
            return np.array([self.widest, self.half_width - self.side])
        end, sign = (self.front, 1.0) if arc < 2 else (self.rear, -1.0)
        face = np.array([end.x - sign * end.radius, 0.0])
        if arc in (0, 4):
            return face
        joint = self._turns[0] if arc == 1 else self._turns[3]
        return face + (end.radius - end.corner) * unit(np.array(joint))


def unit(angle: FloatArray) -> FloatArray:
    """Unit vectors ``(…, xy)`` with the direction ``angle``, rad."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
