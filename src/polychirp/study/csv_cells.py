"""Cells of tables that spreadsheets read."""

from typing import TypeVar

T = TypeVar("T")


def safe_cell(value: T) -> T | str:
    """Value of a cell; text that a spreadsheet takes for a formula gets an apostrophe before it.

    >>> safe_cell("=1+1"), safe_cell("front"), safe_cell(-1.5)
    ("'=1+1", 'front', -1.5)
    """
    is_formula = isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r"))
    return f"'{value}" if is_formula else value
