"""Figures 11a and 11b on one scale: what diverse slopes do to one radar's range profile."""

import numpy as np

from polychirp.axes import FloatArray
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    LABEL_BOX,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.report.figures.range_profile import MAX_RANGE, common_limits, mark_floor
from polychirp.report.verdict import interference_ghosts
from polychirp.study.paper.results import PaperRow


@styled
def profile_pair(conventional: PaperRow, diverse: PaperRow, *, heading: str) -> Drawing:
    """Range profiles of one radar with equal and with diverse slopes; its data are both.

    The strongest ghost of interference with equal slopes is labelled, and the height of the floor
    with diverse slopes.
    """
    figure = new_figure(11.0, 4.9)
    axes = figure.add_subplot()
    columns: dict[str, FloatArray] = {}
    for row, colour, label, width in (
        (conventional, VERMILION, "equal slopes", 1.3),
        (diverse, BLUE, "diverse slopes", 1.8),
    ):
        shown = (row.profile_range >= 0.0) & (row.profile_range <= MAX_RANGE)
        range_, power = row.profile_range[shown], row.profile_power_db[shown]
        axes.plot(range_, power, color=colour, linewidth=width, label=label)
        columns.setdefault("range_m", range_)
        name = label.replace(" ", "_") + "_dbm"
        columns[name] = np.interp(columns["range_m"], range_, power)
    axes.axhline(diverse.noise_floor_db, color=GREY, linestyle=":", label="thermal noise floor")
    for number, target in enumerate(diverse.targets):
        label = "" if number else "true target"
        axes.axvline(target.range_m, color=GREEN, linewidth=0.9, zorder=1, label=label)
    ghosts = interference_ghosts(conventional)
    if ghosts:
        strongest = max(ghosts, key=lambda ghost: ghost.power_over_strongest_target_db)
        place = strongest.range_m
        top = float(np.interp(place, columns["range_m"], columns["equal_slopes_dbm"]))
        over = strongest.power_over_strongest_target_db
        axes.annotate(
            f"ghost at {place:.2f} m, {over:+.0f} dB over the targets".replace("-", "−"),
            (place, top),
            (8, 2),
            textcoords="offset points",
            color=VERMILION,
            weight="bold",
            bbox=LABEL_BOX,
        )
    mark_floor(axes, diverse, columns["range_m"], columns["diverse_slopes_dbm"])
    axes.set(
        xlim=(0.0, MAX_RANGE),
        ylim=common_limits((conventional, diverse)),
        xlabel="Range (m)",
        ylabel="Power at the converter (dBm)",
    )
    figure.suptitle(f"{heading} · {diverse.radar}", x=0.01, ha="left", weight="bold", size=11)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return Drawing(figure=figure, data=columns)
