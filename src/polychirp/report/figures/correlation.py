"""Figures 6 and 7: auto- and cross-correlation, in theory and with transceivers."""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.axes import FloatArray
from polychirp.correlation.ambiguity import Ambiguity
from polychirp.correlation.base import Correlation
from polychirp.correlation.lobes import lobes
from polychirp.correlation.theory import BOTH_ENDS_OVERSHOOT, OVERSHOOT, are_opposite
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LABEL_BOX,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.study.section_v.cases import CorrelationResults, CorrelationRow
from polychirp.units import to_db

NUM_CURVE_BINS: Final = 1500
"""Greatest number of bins of a curve; the greatest magnitude in each bin is drawn. Chosen."""

LOWEST_LEVEL_DB: Final = -120.0
"""Lower end of the axes, dB relative to a peak of 1; chosen: below the noise of the recordings."""

NEAR_PEAK_WIDTHS: Final = 20.0
"""Number of half-power widths that panels of a peak's amplitude show on each side of it; chosen."""


LEAST_OF_FULL_SCALE: Final = 0.05
"""Greatest amplitude from which on the axis ends at 1.05; chosen: lower curves are flat there."""


def curve(correlation: Correlation, span: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Mean lag, s, and greatest |R| of each bin of the lags within ``span``, ``(bin,)`` each."""
    inside = (correlation.lag >= span[0]) & (correlation.lag <= span[1])
    lag, height = correlation.lag[inside], np.abs(correlation.amplitude[inside])
    width = -(-lag.size // NUM_CURVE_BINS)
    whole = lag.size // width
    heights = height[: whole * width].reshape(whole, width)
    lags = lag[: whole * width].reshape(whole, width)
    return np.asarray(lags.mean(axis=1)), np.asarray(heights.max(axis=1))


@styled
def correlation_picture(row: CorrelationRow, *, heading: str) -> Drawing:
    """One case: theory on the left, transceivers on the right; amplitude above, dB below.

    Both columns have the same scales. The data are the curves of the lower panels. The title begins
    with ``heading``, as in ``"Fig. 6"``.
    """
    theory, model, loop = row.curves
    whole = (float(theory.lag[0]), float(theory.lag[-1]))
    near = _near(row, whole)
    figure = new_figure(10.0, 6.4)
    panels = figure.subplots(2, 2, sharey="row", sharex="row")
    for column, curves in enumerate(
        (
            [(theory, BLUE, "closed form")],
            [
                (model, VERMILION, "transceiver model"),
                (loop, GREEN, "loop-back recording, aligned"),
            ],
        )
    ):
        for correlation, colour, label in curves:
            # the model's curve is wider, so that it is seen below that of the recording
            width = 2.6 if correlation is model else 1.0
            lag, height = curve(correlation, near)
            panels[0, column].plot(lag * 1e6, height, color=colour, label=label, linewidth=width)
            lag, height = curve(correlation, whole)
            panels[1, column].plot(
                lag * 1e6, to_db(height**2), color=colour, label=label, linewidth=width
            )
    _dress(panels, row, near)
    figure.suptitle(f"{heading} · {row.case.says}", x=0.01, ha="left", weight="bold", size=11)
    return Drawing(figure=figure, data=_columns(row, whole))


def _near(row: CorrelationRow, whole: tuple[float, float]) -> tuple[float, float]:
    if row.case.kind == "cross":
        return whole
    reach = NEAR_PEAK_WIDTHS * row.ideal.width
    return -reach, reach


def _dress(panels: np.ndarray, row: CorrelationRow, near: tuple[float, float]) -> None:
    """Titles, scales and labels; amplitudes that are far below 1 have a scale of their own."""
    titles = ("Theory", f"With transceivers, SNR {row.modelled[0].snr_db:g} dB")
    highest = max(float(curve(one, near)[1].max()) for one in row.curves)
    is_auto = row.case.kind != "cross"
    level = 20.0 * math.log10(row.ideal.peak)
    for column, title in enumerate(titles):
        upper, lower = panels[0, column], panels[1, column]
        assert isinstance(upper, Axes)
        assert isinstance(lower, Axes)
        upper.set(title=title, ylim=(0.0, 1.05 if highest > LEAST_OF_FULL_SCALE else 1.3 * highest))
        upper.ticklabel_format(axis="y", scilimits=(-2, 3))
        if is_auto:
            upper.set(xlabel=f"Lag (µs), within {near[1] * 1e6:.2f} µs of the peak")
        lower.set(ylim=(LOWEST_LEVEL_DB, 5.0), xlabel="Lag (µs)")
        lower.axhline(level, color=GREY, linewidth=0.8, linestyle="--")
        lower.annotate(
            f"peak in theory {level:.1f} dB".replace("-", "−"),
            (0.98 if is_auto else 0.5, level),
            xycoords=("axes fraction", "data"),
            xytext=(0, -11 if is_auto else 3),
            textcoords="offset points",
            ha="right" if is_auto else "center",
            color=INK,
            size=8.5,
            bbox=LABEL_BOX,
        )
        upper.legend(loc="upper right")
    panels[0, 0].set(ylabel="Correlation amplitude")
    panels[1, 0].set(ylabel="Correlation (dB)")


def _columns(row: CorrelationRow, whole: tuple[float, float]) -> dict[str, FloatArray]:
    lag, theory = curve(row.curves[0], whole)
    columns = {"lag_us": lag * 1e6, "theory_db": to_db(theory**2)}
    for name, correlation in zip(("model_db", "loop_back_db"), row.curves[1:], strict=True):
        at, height = curve(correlation, whole)
        columns[name] = to_db(np.interp(lag, at, height) ** 2)
    return columns


@styled
def pair_picture(measured: Correlation, theory: Correlation | None, *, title: str) -> Drawing:
    """Correlation of any two signals: amplitude near its highest lobe, and decibels at all lags."""
    found = lobes(measured)
    whole = (float(measured.lag[0]), float(measured.lag[-1]))
    reach = NEAR_PEAK_WIDTHS * found.width if math.isfinite(found.width) else whole[1]
    near = (max(whole[0], found.lag - reach), min(whole[1], found.lag + reach))
    figure = new_figure(10.0, 3.8)
    left, right = figure.subplots(1, 2)
    curves = [(measured, VERMILION, "measured" if theory is None else "samples")]
    if theory is not None:
        curves.append((theory, BLUE, "closed form"))
    for (correlation, colour, label), style in zip(curves, ("-", "--"), strict=False):
        lag, height = curve(correlation, near)
        left.plot(lag * 1e6, height, color=colour, linestyle=style, label=label)
        lag, height = curve(correlation, whole)
        right.plot(lag * 1e6, to_db(height**2), color=colour, linestyle=style, label=label)
    left.set(xlabel="Lag (µs)", ylabel="Correlation amplitude", ylim=(0.0, None))
    right.set(xlabel="Lag (µs)", ylabel="Correlation (dB)", ylim=(LOWEST_LEVEL_DB, 5.0))
    left.legend(loc="upper right")
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    lag, height = curve(measured, whole)
    data = {"lag_us": lag * 1e6, "correlation_db": to_db(height**2)}
    if theory is not None:
        data["closed_form_db"] = to_db(curve(theory, whole)[1] ** 2)
    return Drawing(figure=figure, data=data)


@styled
def ambiguity_picture(found: Ambiguity, *, title: str) -> Drawing:
    """The ambiguity function down to −60 dB; its data are the cut at zero Doppler shift."""
    level = to_db(np.abs(found.amplitude) ** 2)
    lag, doppler = found.lag * 1e6, found.doppler / 1e3
    figure = new_figure(8.0, 5.0)
    axes = figure.add_subplot()
    axes.grid(visible=False)
    image = axes.imshow(
        level,
        extent=(*_cell_edges(lag), *_cell_edges(doppler)),
        origin="lower",
        aspect="auto",
        vmin=-60.0,
        vmax=0.0,
        interpolation="nearest",
    )
    axes.set(title=title, xlabel="Lag (µs)", ylabel="Doppler shift (kHz)")
    figure.colorbar(image, ax=axes, label="Ambiguity (dB)", pad=0.01)
    middle = int(np.argmin(np.abs(found.doppler)))
    return Drawing(figure=figure, data={"lag_us": lag, "no_doppler_db": level[middle]})


def _cell_edges(middles: FloatArray) -> tuple[float, float]:
    """Outer edges of the first and of the last cell, of which ``middles`` are evenly spaced."""
    half = 0.5 * float(middles[-1] - middles[0]) / max(middles.size - 1, 1)
    return float(middles[0]) - half, float(middles[-1]) + half


@styled
def slope_law(results: CorrelationResults) -> Drawing:
    """Highest peak of crossing ramps over the difference of slopes; lines: `crossing_peak`'s law.

    The law's line for opposite slopes is drawn if a case has them.
    """
    rows = [row for row in results.rows if slope_product(row) > 0.0]
    product = np.array([slope_product(row) for row in rows])
    theory = np.array([20.0 * math.log10(row.ideal.peak) for row in rows])
    model = [row.modelled[0].level_db for row in rows]
    mean = np.array([one.mean for one in model])
    half = np.array([one.half_width for one in model])
    label = f"model, {rows[0].modelled[0].snr_db:g} dB SNR"
    figure = new_figure(7.0, 4.6)
    axes = figure.add_subplot()
    line = np.geomspace(0.5 * product.min(), 2.0 * product.max(), 100)
    law = r"$-10\,\log_{10}(|\Delta\beta|\,T_aT_b)"
    axes.plot(line, to_db(OVERSHOOT / line), color=GREY, label=rf"{law} + 1.4$ dB")
    if any(are_opposite(*_slopes(row)) for row in rows):
        higher = to_db(BOTH_ENDS_OVERSHOOT / line)
        axes.plot(line, higher, "--", color=GREY, label=rf"{law} + 2.6$ dB, opposite slopes")
    axes.plot(product, theory, "o", color=BLUE, label="closed form")
    axes.errorbar(product, mean, yerr=half, fmt="x", color=VERMILION, capsize=3, label=label)
    for n, (row, x, y) in enumerate(zip(rows, product, theory, strict=True)):
        above = not np.any(np.isclose(product[:n], x, rtol=0.05))
        axes.annotate(
            row.case.name,
            (x, y),
            xytext=(7, 5) if above else (-7, -10),
            textcoords="offset points",
            ha="left" if above else "right",
            size=8,
        )
    axes.set(
        xscale="log",
        xlabel=r"$|\Delta\beta|\,T_aT_b$, for equal times $|\Delta B|\,T$",
        ylabel="Highest peak (dB)",
        title="Slope diversity follows the time-bandwidth law",
    )
    axes.legend(loc="lower left")
    return Drawing(
        figure=figure,
        data={
            "case": [row.case.name for row in rows],
            "slope_difference_times_durations": product,
            "theory_db": theory,
            "model_db": mean,
            "model_half_width_db": half,
        },
    )


def slope_product(row: CorrelationRow) -> float:
    """|Δβ| T_a T_b of two sawtooth ramps about one carrier; 0 for all other cases."""
    sent, reference = row.case.sent, row.case.reference
    if sent.kind != "sawtooth" or reference.kind != "sawtooth":
        return 0.0
    if row.case.carrier != row.case.tuned:
        return 0.0
    slopes = _slopes(row)
    return abs(slopes[0] - slopes[1]) * sent.ramp_duration * reference.ramp_duration


def _slopes(row: CorrelationRow) -> tuple[float, float]:
    """Slopes of two sawtooth ramps, Hz/s."""
    sent, reference = (
        (1.0 if one.direction == "up" else -1.0) * one.bandwidth / one.ramp_duration
        for one in (row.case.sent, row.case.reference)
        if one.kind == "sawtooth"
    )
    return sent, reference


def correlation_drawings(
    results: CorrelationResults,
) -> Iterator[tuple[str, Callable[[], Drawing]]]:
    """Names of the figures (6, 7 in both interpretations, the law) and functions that draw them."""
    for name, case, heading in (
        ("fig06", "auto", "Fig. 6"),
        ("fig07-as-printed", "cross, receiver stays", "Fig. 7 as printed"),
        ("fig07-baseband", "cross, receiver follows", "Fig. 7 at baseband, 120 against 100 MHz"),
    ):
        yield name, partial(correlation_picture, results.row(case), heading=heading)
    yield "slope-law", partial(slope_law, results)
