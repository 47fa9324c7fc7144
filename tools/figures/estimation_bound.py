"""Errors of a receiver beside the Cramér–Rao bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)

CURVE_COLOURS = (BLUE, VERMILION, GREEN)

QUANTITIES = ("range (m)", "range rate (m/s)", "azimuth (rad)")


@styled
def estimation_bound(
    curves: Mapping[str, Sequence[tuple[float, Sequence[float], Sequence[float]]]],
    *,
    shares: Mapping[str, Sequence[tuple[float, float, float]]],
    note: str,
) -> Drawing:
    """Rms errors (marks) and bounds (lines) over SNR, a panel for each of `QUANTITIES`.

    A fourth panel shows where the bound no longer applies: the share of points that are found, and
    of outliers among them.

    Parameters
    ----------
    curves : name of the waveform, then (SNR in dB, rms errors, bounds), both in `QUANTITIES`
    shares : name of the waveform, then (SNR in dB, share found, share of outliers among them), at
        the SNRs of ``curves`` and at further ones, where too few are found for an error
    """
    figure = new_figure(12.4, 3.3)
    *panels, last = figure.subplots(1, 4)
    data: dict[str, list[float]] = {}
    for column, (axes, quantity) in enumerate(zip(panels, QUANTITIES, strict=True)):
        for colour, (name, points) in zip(CURVE_COLOURS, curves.items(), strict=False):
            snr = [point[0] for point in points]
            errors = [float(point[1][column]) for point in points]
            bounds = [float(point[2][column]) for point in points]
            axes.plot(snr, bounds, color=colour, linewidth=1.0, label=f"{name}, bound")
            axes.plot(snr, errors, color=colour, marker="o", markersize=3.5, linestyle="none",
                      label=f"{name}, measured")  # fmt: skip
            data[f"SNR (dB), {name}"] = snr
            data[f"rms error of {quantity}, {name}"] = errors
            data[f"bound of {quantity}, {name}"] = bounds
        axes.set(yscale="log", xlabel="SNR per sample (dB)")
        axes.set_ylabel(f"Rms error of {quantity}")
        axes.grid(visible=True, color=GREY, alpha=0.2)
    for colour, (name, rows) in zip(CURVE_COLOURS, shares.items(), strict=False):
        snr, found, outliers = (list(column) for column in zip(*rows, strict=True))
        last.plot(snr, found, color=colour, marker="o", markersize=3.5, label=f"{name}, found")
        last.plot(snr, outliers, color=colour, marker="x", linestyle=":",
                  label=f"{name}, outliers")  # fmt: skip
        drawn = [snr.index(value) for value in data[f"SNR (dB), {name}"]]
        data[f"share found, {name}"] = [found[n] for n in drawn]
        data[f"share of outliers, {name}"] = [outliers[n] for n in drawn]
    last.set(xlabel="SNR per sample (dB)", ylabel="Share of trials", ylim=(-0.04, 1.04))
    last.grid(visible=True, color=GREY, alpha=0.2)
    for axes in (figure.axes[0], last):
        axes.legend(loc="best", fontsize=7)
    figure.suptitle(note, size=8.5)
    return Drawing(figure=figure, data=data)
