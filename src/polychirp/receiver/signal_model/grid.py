"""`Grid`: the axes of a map of range and range rate."""

from dataclasses import dataclass

from polychirp.axes import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """Evenly spaced axes of a map: range (m) at the instant ``time`` (s), and range rate (m/s)."""

    range: FloatArray
    range_rate: FloatArray
    time: float

    @property
    def range_step(self) -> float:
        """Spacing of the range axis, m."""
        return float(self.range[1] - self.range[0])

    @property
    def range_rate_step(self) -> float:
        """Spacing of the range-rate axis, m/s."""
        return float(self.range_rate[1] - self.range_rate[0])
