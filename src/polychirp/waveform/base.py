"""Interface of waveform families: every waveform becomes a `RampSchedule`."""

import math
from typing import Final, Protocol, runtime_checkable

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.units import need_number

MOST_CHIPS: Final = 1 << 25
"""Greatest number of drawn chips of a schedule; chosen: they take half a GiB."""


@runtime_checkable
class Waveform(Protocol):
    """A rule that gives the schedule of one radar.

    `Sawtooth` and `Triangular` are examples. A class of your own needs this method alone.
    """

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` sweeps, the first starting at 0 s of the radar's own clock.

        All random numbers come from ``streams``, which belong to one radar. Equal streams give
        equal ramps, and a longer schedule begins with the ramps of a shorter one. `InputError` is
        raised if ``num_sweeps`` is less than one.
        """


def need_sweeps(num_sweeps: int) -> None:
    """Refuse a schedule without a sweep."""
    if num_sweeps < 1:
        raise InputError(f"num_sweeps is {num_sweeps}; a schedule needs 1 or more")


def need_few_chips(num_chips: int, num_sweeps: int) -> None:
    """Refuse, with an `InputError`, more than `MOST_CHIPS` chips, before they are drawn."""
    if num_chips * num_sweeps > MOST_CHIPS:
        raise InputError(
            f"a code of {num_chips} chips that is drawn for each of {num_sweeps} sweeps has more "
            f"than {MOST_CHIPS} chips; use fewer chips or sweeps"
        )


def _need_finite(owner: str, name: str, value: float) -> None:
    """Refuse a quantity with its unit, and an infinite number."""
    need_number(owner, name, value)
    if math.isinf(value):
        raise InputError(f"{owner} needs a finite {name}, not {value!r}")


def need_positive(owner: str, **values: float) -> None:
    """Refuse values that are not positive; the message names ``owner``, without a bare number."""
    for name, value in values.items():
        _need_finite(owner, name, value)
        if not value > 0:
            raise InputError(f"{owner} needs a positive {name}, not {_zero_or_negative(value)}")


def need_not_negative(owner: str, **values: float) -> None:
    """Refuse negative values; the message names ``owner`` and the value."""
    for name, value in values.items():
        _need_finite(owner, name, value)
        if not value >= 0:
            raise InputError(f"{owner} cannot have a negative {name}; use 0 or more")


def need_limits(owner: str, **limits: tuple[float, float]) -> None:
    """Refuse limits that are inverted or not positive; the message names ``owner``."""
    for name, (lowest, highest) in limits.items():
        _need_finite(owner, f"lower limit of {name}", lowest)
        _need_finite(owner, f"upper limit of {name}", highest)
        if not lowest > 0:
            raise InputError(
                f"{owner} needs a positive lower limit of {name}, not {_zero_or_negative(lowest)}"
            )
        if not lowest <= highest:
            raise InputError(
                f"{owner} has limits of {name} in the wrong order; write the smaller one first"
            )


def _zero_or_negative(value: float) -> str:
    """Words for a value that is not positive."""
    return "0" if value == 0 else "a negative one"
