"""How near a receiver comes to the Cramér–Rao bound."""

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

COLOURS = (BLUE, VERMILION, GREEN)

QUANTITIES = ("range (m)", "range rate (m/s)", "azimuth (rad)")


@styled
def estimation_bound(
    curves: Mapping[str, Sequence[tuple[float, Sequence[float], Sequence[float]]]], *, note: str
) -> Drawing:
    """Rms errors over SNR, one panel for each of range, range rate and azimuth, the bound a line.

    Parameters
    ----------
    curves : name of the waveform, then (SNR in dB, rms errors, bounds), both in `QUANTITIES`
    """
    figure = new_figure(9.6, 3.3)
    data: dict[str, list[float]] = {}
    for column, (axes, quantity) in enumerate(zip(figure.subplots(1, 3), QUANTITIES, strict=True)):
        for colour, (name, points) in zip(COLOURS, curves.items(), strict=False):
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
    figure.axes[0].legend(loc="best", fontsize=7)
    figure.suptitle(note, size=8.5)
    return Drawing(figure=figure, data=data)
