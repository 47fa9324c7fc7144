"""Radars that cannot disturb a victim, since they transmit at other times or in another band."""

from collections.abc import Iterator, Sequence
from typing import Final

from polychirp.model.ramp import RampSchedule
from polychirp.study.spec import Study, victim_indices

LONGEST_WAY: Final = 2e-6
"""Longest delay of a wave from one radar to another, s, that counts; chosen: 600 m."""


def silent_radars(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """A sentence for each radar of which a victim receives nothing, whatever the paths are.

    Frames as a whole are compared: radars that transmit between the ramps of a victim are not
    found. Nothing is said of studies with a rule of access, which keeps radars apart.
    """
    if study.access is not None:
        return
    for victim in victim_indices(study):
        name, own = study.radars[victim].name, schedules[victim]
        stopband = study.radars[victim].if_filter.stopband
        for number, (radar, other) in enumerate(zip(study.radars, schedules, strict=True)):
            if number == victim:
                continue
            why = _other_time(own, other) or _other_band(own, other, stopband=stopband)
            if why:
                yield f"'{radar.name}' does not disturb '{name}': it {why}"


def _other_time(own: RampSchedule, other: RampSchedule) -> str:
    """The times of a radar whose frame ends before a victim's begins, or begins after its end."""
    begin, end = float(own.start_time[0]), float(own.end_time[-1])
    if float(other.start_time[0]) > end:
        return (
            f"begins to transmit at {_in_words(float(other.start_time[0]))}, and the frame has "
            f"ended at {_in_words(end)}; check its start_time"
        )
    if float(other.end_time[-1]) + LONGEST_WAY < begin:
        return (
            f"has transmitted at {_in_words(float(other.end_time[-1]))}, and the frame begins "
            f"at {_in_words(begin)}; check its start_time"
        )
    return ""


def _in_words(time: float) -> str:
    return f"{time:.4g} s" if abs(time) >= 1.0 else f"{1e3 * time:.4g} ms"


def _other_band(own: RampSchedule, other: RampSchedule, *, stopband: float) -> str:
    """The frequencies of a radar all of which the victim's IF filter stops."""
    low, high = (float(edge) for edge in (own.occupied[0].min(), own.occupied[1].max()))
    below, above = (float(edge) for edge in (other.occupied[0].min(), other.occupied[1].max()))
    if below > high + stopband or above < low - stopband:
        return (
            f"transmits at {1e-9 * below:.5g} to {1e-9 * above:.5g} GHz, and the frame is at "
            f"{1e-9 * low:.5g} to {1e-9 * high:.5g} GHz, with an IF filter that stops "
            f"beats above {1e-6 * stopband:.3g} MHz; check its start_frequency"
        )
    return ""
