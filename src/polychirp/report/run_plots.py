"""Figures of a run, by name and as matplotlib axes."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from matplotlib.axes import Axes

from polychirp.errors import InputError, no_such
from polychirp.receiver.overview.range_azimuth import range_azimuth_map
from polychirp.receiver.overview.range_rate import range_profile, range_rate_map
from polychirp.receiver.overview.spectrogram import spectrogram
from polychirp.receiver.selection import AnyReceiver
from polychirp.report.figures.detections_plan import detections_plan
from polychirp.report.figures.drawing import Drawing
from polychirp.report.figures.range_azimuth_parts import range_azimuth_parts
from polychirp.report.figures.range_power_parts import range_power_parts
from polychirp.report.figures.range_rate_parts import range_rate_parts
from polychirp.report.figures.spectrogram import spectrogram as spectrogram_of_ramps
from polychirp.report.figures.spectrogram_parts import spectrogram_parts
from polychirp.study.part_views import part_views


def _range_profile(victim: Any, receiver: AnyReceiver, title: str) -> Drawing:
    views = part_views(range_profile, receiver, victim.frame, victim.parts)
    return range_power_parts(views, victim.detections, victim.truth, title=title)


def _range_rate(victim: Any, receiver: AnyReceiver, title: str) -> Drawing:
    views = part_views(range_rate_map, receiver, victim.frame, victim.parts)
    return range_rate_parts(views, victim.detections, victim.truth, title=title)


def _range_azimuth(victim: Any, receiver: AnyReceiver, title: str) -> Drawing:
    views = part_views(range_azimuth_map, receiver, victim.frame, victim.parts)
    return range_azimuth_parts(views, victim.detections, victim.truth, title=title)


def _spectrogram(victim: Any, receiver: AnyReceiver, title: str, *, channel: int = 0) -> Drawing:
    channels = victim.frame.samples.shape[0]
    if not 0 <= channel < channels:
        raise InputError(f"there is no channel {channel}; there are 0 to {channels - 1}")
    view = partial(spectrogram, channel=channel)
    views = part_views(view, receiver, victim.frame, victim.parts)
    return spectrogram_parts(views, title=f"{title}, channel {channel}")


def _ramps(victim: Any, receiver: AnyReceiver, title: str) -> Drawing:
    del receiver
    return spectrogram_of_ramps(victim.frame.schedule, title=title)


def _detections(victim: Any, receiver: AnyReceiver, title: str) -> Drawing:
    del receiver
    return detections_plan(victim.detections, victim.truth, victim.score, title=title)


FIGURES: Final[Mapping[str, Callable[..., Drawing]]] = {
    "range-profile": _range_profile,
    "range-rate": _range_rate,
    "range-azimuth": _range_azimuth,
    "spectrogram": _spectrogram,
    "ramps": _ramps,
    "detections": _detections,
}
"""Figures of one radar in a run, by name."""


def figures_of(victim: Any) -> tuple[str, ...]:
    """Names of the figures that a `VictimResult` or a `StoredVictim` has.

    The figure of the ramps shows no chips, and is not there if the ramps carry a code.
    """
    has_code = victim.frame.schedule.code is not None
    return tuple(name for name in FIGURES if not (has_code and name == "ramps"))


def draw(
    name: str, victim: Any, receiver: AnyReceiver, *, title: str = "", **options: Any
) -> Drawing:
    """One of the `FIGURES` of a victim, with its data.

    `RunPlots` draws a stored run; `VictimResult` is the result of `run_trial`.

    Parameters
    ----------
    name : one of `FIGURES`
    victim : a `VictimResult` or a `StoredVictim`
    receiver : of the study: its limits and its mitigation
    title : above the figure; the name of the radar by default
    options : ``channel`` of the spectrogram, 0 by default

    Raises
    ------
    InputError
        There is no such figure or channel.
    """
    if name not in FIGURES:
        raise InputError(no_such("figure", name, FIGURES))
    return FIGURES[name](victim, receiver, title or f"radar '{victim.name}'", **options)


class RunPlots:
    """Figures of a run as matplotlib axes: ``run.plot.range_profile()``.

    Each method draws the radar of the given name, or the only one, and returns the axes of the
    figure that have data; ``axes[0].figure`` is the figure. The figures do not belong to pyplot.

    `StoredRun.plot` is such an object.
    """

    def __init__(self, run: Any) -> None:
        self._run = run

    def range_profile(self, radar: str | None = None) -> list[Axes]:
        """Power over range of every part of the samples, with targets and detections."""
        return self._axes("range-profile", radar)

    def range_rate(self, radar: str | None = None) -> list[Axes]:
        """Maps of every part over range and range rate."""
        return self._axes("range-rate", radar)

    def range_azimuth(self, radar: str | None = None) -> list[Axes]:
        """Plans of the power of every part, seen from above."""
        return self._axes("range-azimuth", radar)

    def spectrogram(self, radar: str | None = None, *, channel: int = 0) -> list[Axes]:
        """Spectrograms of the IF samples of every part, ramp by ramp."""
        return self._axes("spectrogram", radar, channel=channel)

    def ramps(self, radar: str | None = None) -> list[Axes]:
        """Spectrogram of the signal that the radar transmits."""
        return self._axes("ramps", radar)

    def detections(self, radar: str | None = None) -> list[Axes]:
        """Detections with their causes over the visible metal of the targets."""
        return self._axes("detections", radar)

    def _axes(self, name: str, radar: str | None, **options: Any) -> list[Axes]:
        drawing = draw(name, self._victim(radar), self._run.study.receiver, **options)
        return [axes for axes in drawing.figure.axes if axes.has_data()]

    def _victim(self, radar: str | None) -> Any:
        if radar is not None:
            return self._run.victim(radar)
        names = [victim.name for victim in self._run.victims]
        if len(names) != 1:
            listed = ", ".join(f"'{name}'" for name in names)
            raise InputError(f"the run has {len(names)} radars: {listed}; name one of them")
        return self._run.victims[0]
