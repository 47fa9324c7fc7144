"""Convergence of a car's echo with its mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from polychirp.report.figures.drawing import BLUE, GREY, VERMILION, Drawing, new_figure, styled


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshError:
    """Difference of one mesh's echo from that of a much finer mesh of the same body.

    Parameters
    ----------
    max_edge : m, on flats
    coarseness : factor of the curvature rule
    facets : number of facets
    median, ninth_decile : of the |error| over all aspects, dB
    """

    max_edge: float
    coarseness: float
    facets: int
    median: float
    ninth_decile: float


@styled
def convergence_picture(rows: Sequence[MeshError], *, note: str) -> Drawing:
    """Median and ninth decile of the error over the number of facets, one mark per mesh."""
    rows = sorted(rows, key=lambda row: row.facets)
    figure = new_figure(7.0, 4.4)
    axes = figure.add_subplot()
    facets = [row.facets for row in rows]
    for values, colour, label in (
        ([row.median for row in rows], BLUE, "median"),
        ([row.ninth_decile for row in rows], VERMILION, "ninth decile"),
    ):
        axes.plot(facets, values, color=colour, marker="o", linestyle="none", label=label)
    for row in rows:
        axes.annotate(
            f"{row.coarseness:g}, {100 * row.max_edge:g} cm",
            xy=(row.facets, row.median),
            xytext=(0, -6),
            textcoords="offset points",
            rotation=-55,
            rotation_mode="anchor",
            va="top",
            size=7,
            color=GREY,
        )
    axes.axhline(1.0, color=GREY, linestyle=":")
    axes.set(xscale="log", yscale="log", xlabel="Facets", ylabel="|Error| of the RCS (dB)")
    axes.set_ylim(bottom=0.5 * min(row.median for row in rows))
    for axis, ticks in (
        (axes.xaxis, (25_000, 50_000, 100_000, 200_000, 400_000)),
        (axes.yaxis, (0.2, 0.5, 1, 2, 5, 10)),
    ):
        low, high = axis.get_view_interval()
        axis.set_ticks([tick for tick in ticks if low <= tick <= high])
        axis.set_major_formatter("{x:,g}")
    axes.minorticks_off()
    axes.set_title(note, size=8.5, weight="normal")
    axes.legend(loc="upper right")
    columns = [asdict(row) for row in rows]
    return Drawing(figure=figure, data={key: [row[key] for row in columns] for key in columns[0]})
