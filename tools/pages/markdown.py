"""Markdown, as far as generated pages need it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    r"""A Markdown table; a column of numbers only is right-aligned.

    >>> print(table(["case", "dB"], [["disc", "20.5"], ["a|b", "-0.8"]]))
    | case | dB |
    |---|---:|
    | disc | 20.5 |
    | a\|b | -0.8 |
    """
    columns = list(zip(*rows, strict=True)) or [()] * len(head)
    marks = ["---:" if all(_is_number(cell) for cell in column) else "---" for column in columns]
    lines = [f"|{'|'.join(marks)}|"]
    for row in (head, *rows):
        cells = (cell.replace("|", "\\|") for cell in row)
        lines.append(f"| {' | '.join(cells)} |")
    lines[0], lines[1] = lines[1], lines[0]
    return "\n".join(lines)


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"[-+−]?[\d.]+(e[-+]?\d+)?", cell) is not None


def three_digits(value: float) -> str:
    """A number with three digits, or as an integer from 1000 on.

    >>> [three_digits(value) for value in (88.71, 1163.2, 1e-6)]
    ['88.7', '1163', '1e-06']
    """
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"


def within(estimate: Mapping[str, float], digits: int) -> str:
    """A stored estimate with its interval, as a cell of a table.

    >>> within({"value": 0.5, "low": 0.25, "high": 0.75}, 2)
    '0.50 (0.25…0.75)'
    """
    value, low, high = (f"{estimate[name]:.{digits}f}" for name in ("value", "low", "high"))
    return f"{value} ({low}…{high})"
