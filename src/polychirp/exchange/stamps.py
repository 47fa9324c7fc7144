"""Times of a run as stamps of whole seconds and nanoseconds."""

from typing import Final

NANOSECONDS: Final = 1_000_000_000
"""Nanoseconds in a second."""


def since_start(time: float) -> tuple[int, int]:
    """Seconds and nanoseconds of a time, s; those before the start count as the start.

    >>> since_start(1.25)
    (1, 250000000)
    """
    return divmod(max(0, round(time * NANOSECONDS)), NANOSECONDS)
