"""Laws that every waveform keeps, for tests of polychirp and of its plug-ins."""

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.waveform.base import Waveform

FIELDS = ("start_time", "duration", "start_frequency", "slope", "start_phase", "sweep")
"""Columns of a schedule that are compared."""


def check_waveform(waveform: Waveform, *, num_sweeps: int = 16) -> None:
    """Refuse a waveform that breaks a law on which the rest of polychirp rests.

    - The first ramp starts at 0 s, and sweeps are counted from 0 without a hole.
    - Equal streams give equal ramps: nothing is drawn from elsewhere, and nothing is remembered.
    - A longer schedule begins with the ramps of a shorter one.
    - A schedule without sweeps is refused with an `InputError`.

    Raises
    ------
    InputError
        A law is broken; the message has one sentence for each.

    Examples
    --------
    >>> from polychirp.waveform import Triangular
    >>> check_waveform(Triangular())
    """
    if not isinstance(waveform, Waveform):
        raise InputError(f"{waveform!r} has no method 'schedule'; add it")
    faults = _faults(waveform, num_sweeps)
    if faults:
        lines = "\n".join(f"  {fault}" for fault in faults)
        raise InputError(f"{type(waveform).__name__} is no waveform for polychirp:\n{lines}")


def _faults(waveform: Waveform, num_sweeps: int) -> list[str]:
    def schedule(number: int) -> RampSchedule:
        return waveform.schedule(num_sweeps=number, streams=Streams(seed=1).of("front"))

    faults = []
    ramps = schedule(num_sweeps)
    if ramps.start_time[0] != 0.0:
        faults.append(
            f"its first ramp starts at {ramps.start_time[0]:g} s; start at 0 s, since a study adds "
            "the start of the radar"
        )
    if not np.array_equal(np.unique(ramps.sweep), np.arange(num_sweeps)):
        faults.append(f"{num_sweeps} sweeps are not numbered from 0 to {num_sweeps - 1}")
    if np.any(np.diff(ramps.sweep) < 0):
        faults.append("the numbers of its sweeps fall from one ramp to the next")
    again, short = schedule(num_sweeps), schedule(max(1, num_sweeps // 3))
    for name in FIELDS:
        column = getattr(ramps, name)
        if not np.array_equal(column, getattr(again, name)):
            faults.append(f"equal streams give another {name}; draw from the streams alone")
        begin = getattr(short, name)
        if not np.array_equal(column[: begin.size], begin):
            faults.append(
                f"a longer schedule has another {name} on its first ramps; draw from one stream "
                "for each quantity, one value for each sweep in order"
            )
    try:
        schedule(0)
    except InputError:
        pass
    except Exception as error:  # any other error is the fault that is reported
        faults.append(f"num_sweeps = 0 raises {type(error).__name__}; raise an InputError")
    else:
        faults.append("num_sweeps = 0 is accepted; raise an InputError")
    return faults
