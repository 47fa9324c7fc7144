"""Expected beside measured: what a validating test compares, for the pages of docs/validation."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One number that polychirp gives, beside what an independent route says.

    Parameters
    ----------
    page : of docs/validation, such as "canonical-bodies"
    case : what is measured, such as "plate 0.1 m at 10 m, normal incidence"
    quantity : with its unit, such as "RCS, dBsm"
    expected, measured : in that unit
    tolerance : greatest difference allowed
    source : where the expected value comes from

    Examples
    --------
    >>> Comparison(page="p", case="disc", quantity="RCS, dBsm", expected=20.48, measured=20.5,
    ...     tolerance=0.3, source="4πA²/λ²").is_met
    True
    """

    page: str
    case: str
    quantity: str
    expected: float
    measured: float
    tolerance: float
    source: str

    @property
    def is_met(self) -> bool:
        """True if the difference is within the tolerance; false for a measured NaN."""
        return abs(self.measured - self.expected) <= self.tolerance

    def __str__(self) -> str:
        return (
            f"{self.case}: {self.quantity} is {self.measured:.4g}, but {self.source} says "
            f"{self.expected:.4g} ± {self.tolerance:g}"
        )


def write_comparisons(rows: Sequence[Comparison], path: Path) -> None:
    """Store comparisons as JSON, in the order of page and test, to six digits."""
    table = [
        {key: float(f"{v:.6g}") if isinstance(v, float) else v for key, v in asdict(row).items()}
        for row in sorted(rows, key=lambda row: row.page)
    ]
    path.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read_comparisons(path: Path) -> tuple[Comparison, ...]:
    """Comparisons that `write_comparisons` stored."""
    return tuple(Comparison(**row) for row in json.loads(path.read_text(encoding="utf-8")))
