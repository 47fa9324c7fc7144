"""Radar cross section over aspect, as a polar plot seen from above, the front upwards."""

import math
from typing import Final

import numpy as np
from matplotlib.projections.polar import PolarAxes

from polychirp.axes import FloatArray
from polychirp.channel.rcs import CrossSections, is_within_window, running_median
from polychirp.report.figures.drawing import BLUE, GREY, INK, Drawing, new_figure, styled
from polychirp.units import to_db

POLARISATIONS: Final = ("VV", "VH", "HV", "HH")
"""Received, then transmitted polarisation, in the order of the entries of a transfer matrix."""

SIDE_HALF_WIDTH: Final = math.radians(10.0)
"""Half the width of the sectors about front, sides and rear in `statistics`, rad; chosen."""

DRAWN_SPAN_DB: Final = 50.0
"""Span of the radial axis, dB; chosen."""

NO_ECHO: Final = -200.0
"""Level, dBsm, that stands for no echo at all; chosen: far below any that can be computed."""


def of_polarisation(found: CrossSections, polarisation: str) -> FloatArray:
    """Cross sections of one of `POLARISATIONS`, m², ``(aspect,)``."""
    return found.rcs.reshape(-1, 4)[:, POLARISATIONS.index(polarisation)]


def level_text(level: float) -> str:
    """A level in dBsm as it is shown, "none" for no echo.

    >>> level_text(3.14159), level_text(-400.0)
    ('3.1', 'none')
    """
    return f"{level + 0.0:.1f}" if level > NO_ECHO else "none"


def statistics(rcs: FloatArray, azimuth: FloatArray) -> dict[str, float]:
    """Mean and median over all aspects, and medians about front, sides and rear, dBsm.

    ``rcs`` is in m², ``azimuth`` in rad. A sector (`SIDE_HALF_WIDTH`) without aspects is left out.

    >>> around = np.radians(np.arange(0.0, 360.0))
    >>> statistics(np.full(360, 10.0), around)["front median"]
    10.0
    """
    level = {"mean": np.mean(rcs), "median": np.median(rcs)}
    turns = {"front": (0.0,), "side": (math.pi / 2, -math.pi / 2), "rear": (math.pi,)}
    for side, middles in turns.items():
        inside = np.any(
            [is_within_window(azimuth, middle, SIDE_HALF_WIDTH) for middle in middles], axis=0
        )
        if np.any(inside):
            level[f"{side} median"] = np.median(rcs[inside])
    return {name: float(to_db(value)) for name, value in level.items()}


@styled
def rcs_picture(
    found: CrossSections, *, polarisation: str, window: float, title: str, note: str
) -> Drawing:
    """Cross section at every aspect (thin), its running median (thick) and a box of statistics.

    The data are all polarisations and the drawn median, dBsm; −400 dBsm stands for zero.

    Parameters
    ----------
    polarisation : which of `POLARISATIONS` is drawn
    window : half the width of the median's window, rad
    """
    shown = of_polarisation(found, polarisation)
    level = to_db(shown)
    smooth = to_db(running_median(shown, found.azimuth, window))
    top = 10.0 * math.ceil((float(np.max(level)) + 1.0) / 10.0)
    figure = new_figure(7.0, 7.4)
    axes = figure.add_subplot(projection="polar")
    assert isinstance(axes, PolarAxes)
    axes.set_theta_zero_location("N")
    closed = np.append(np.arange(found.azimuth.size), 0)
    for values, colour, width, label in (
        (level, GREY, 0.5, "every aspect"),
        (smooth, BLUE, 2.2, f"median over ±{math.degrees(window):g}°"),
    ):
        radius = np.maximum(values, top - DRAWN_SPAN_DB)
        axes.plot(found.azimuth[closed], radius[closed], color=colour, linewidth=width, label=label)
    axes.set(
        ylim=(top - DRAWN_SPAN_DB, top), yticks=np.arange(top - DRAWN_SPAN_DB, top + 1.0, 10.0)
    )
    axes.yaxis.set_major_formatter("{x:.0f}")
    axes.set_rlabel_position(28.0)
    axes.set_xticks(
        np.radians(np.arange(0, 360, 45)),
        ["front", "45°", "left", "135°", "rear", "−135°", "right", "−45°"],
    )
    box = "\n".join(
        f"{name} {level_text(value)}" for name, value in statistics(shown, found.azimuth).items()
    )
    figure.text(0.01, 0.05, f"{polarisation}, dBsm\n{box}", color=INK, size=8.5, va="bottom")
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    figure.text(0.01, 0.01, note, color=GREY, size=8, va="bottom")
    columns = {
        f"{name.lower()}_dbsm": to_db(of_polarisation(found, name)) for name in POLARISATIONS
    }
    return Drawing(
        figure=figure,
        data={
            "azimuth_deg": np.degrees(found.azimuth),
            **columns,
            f"{polarisation.lower()}_median_dbsm": smooth,
        },
    )
