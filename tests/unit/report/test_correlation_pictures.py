"""Pictures and tables of correlations, on made-up results."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.correlation.ambiguity import Ambiguity
from polychirp.correlation.base import Correlation
from polychirp.correlation.lobes import lobes
from polychirp.correlation.theory import crossing_peak, opposite_peak
from polychirp.model.transceiver import Transceiver
from polychirp.report.correlation import correlation_csv, correlation_json, correlation_table
from polychirp.report.figures.correlation import (
    NUM_CURVE_BINS,
    ambiguity_picture,
    correlation_picture,
    curve,
    pair_picture,
    slope_law,
    slope_product,
)
from polychirp.study.section_v.cases import (
    CorrelationResults,
    CorrelationRow,
    Interval,
    ModelledLobes,
    correlation_cases,
)

LAG = np.linspace(-50e-6, 50e-6, 20_001)


def sinc(height=1.0):
    return Correlation(amplitude=height * np.sinc(LAG * 10e6), lag=LAG)


def some(mean, half_width=0.1):
    return Interval(mean=mean, half_width=half_width)


def results():
    model = [
        ModelledLobes(
            snr_db=snr,
            level_db=some(-20.0),
            peak_db=some(-20.1),
            width_ns=some(88.6),
            peak_side_lobe_db=some(-13.3),
            integrated_side_lobe_db=some(-9.7),
        )
        for snr in (30.0, 10.0, 0.0)
    ]
    rows = [
        CorrelationRow(
            case=case,
            ideal=lobes(sinc()),
            modelled=tuple(model),
            looped=lobes(sinc(0.9)),
            looped_level_db=-0.9,
            curves=(sinc(), sinc(0.95), sinc(0.9)),
        )
        for case in correlation_cases()
    ]
    return CorrelationResults(
        seed=1, num_seeds=3, radio=Transceiver(), rows=tuple(rows), notes=("note",)
    )


def test_a_curve_keeps_its_highest_points():
    """This holds for any number of lags in a column of the picture."""
    lag, height = curve(sinc(), (LAG[0], LAG[-1]))
    assert lag.size <= NUM_CURVE_BINS
    assert height.max() == pytest.approx(1.0)
    assert abs(lag[np.argmax(height)]) < LAG[-1] / NUM_CURVE_BINS * 4


def test_theory_and_radios_have_one_scale():
    drawing = correlation_picture(results().rows[0], heading="Fig. 6")
    upper_left, upper_right, lower_left, lower_right = drawing.figure.axes
    for one, other in ((upper_left, upper_right), (lower_left, lower_right)):
        assert one.get_ylim() == other.get_ylim()
        assert one.get_xlim() == other.get_xlim()
    assert lower_left.get_xlabel() == "Lag (µs)"
    assert max(drawing.data["theory_db"]) == pytest.approx(0.0, abs=1e-6)
    assert max(drawing.data["loop_back_db"]) == pytest.approx(20 * np.log10(0.9), abs=0.1)


def test_like_signals_are_shown_near_their_peak_and_unlike_ones_whole():
    rows = {row.case.kind: row for row in results().rows}
    spans = {
        kind: correlation_picture(row, heading="x").figure.axes[0].lines[0].get_xdata()
        for kind, row in rows.items()
    }
    assert abs(spans["auto"]).max() == pytest.approx(20 * 0.0886, rel=0.02)
    assert abs(spans["cross"]).max() == pytest.approx(50.0, rel=0.01)


def test_any_pair_is_drawn_with_or_without_theory():
    with_theory = pair_picture(sinc(), sinc(), title="pair")
    alone = pair_picture(sinc(), None, title="pair")
    assert "closed_form_db" in with_theory.data
    assert "closed_form_db" not in alone.data
    assert with_theory.csv().startswith("lag_us,correlation_db,closed_form_db\n")


def test_the_law_is_drawn_for_single_ramps_in_one_band():
    drawing = slope_law(results())
    assert "auto" not in drawing.data["case"]
    assert "cross, receiver stays" not in drawing.data["case"]
    by_name = dict(
        zip(drawing.data["case"], drawing.data["slope_difference_times_durations"], strict=True)
    )
    assert by_name["10 MHz less"] == pytest.approx(1000.0)
    assert by_name["ramp of 120 µs"] == pytest.approx(2000.0)
    assert by_name["falling"] == pytest.approx(20_000.0)
    assert slope_product(results().row("diverse")) == 0.0


def test_each_case_of_the_law_has_the_line_of_its_slopes():
    """Cases with the closed form on the line of the law are there, to the rounding of the label."""
    axes = slope_law(results()).figure.axes[0]
    lines = {line.get_label(): line for line in axes.lines if "log" in str(line.get_label())}
    assert len(lines) == 2
    for label, line in lines.items():
        x, level = line.get_xdata()[0], line.get_ydata()[0]
        is_opposite = "opposite" in label
        duration = np.sqrt(x / (2e12 if is_opposite else 0.1e12))
        peak = (
            opposite_peak(1e12, duration, duration)
            if is_opposite
            else crossing_peak(1e12, 0.9e12, duration, duration)
        )
        expected = 10 * np.log10(peak)
        assert level == pytest.approx(expected, abs=1e-9)


def test_pictures_name_the_snr_of_their_data():
    made = results()
    rows = [replace(row, modelled=row.modelled[1:]) for row in made.rows]
    titles = [
        axes.get_title(loc="left") for axes in correlation_picture(rows[0], heading="x").figure.axes
    ]
    assert "With transceivers, SNR 10 dB" in titles
    legend = slope_law(replace(made, rows=tuple(rows))).figure.axes[0].get_legend()
    assert "model, 10 dB SNR" in [text.get_text() for text in legend.get_texts()]


def test_tables_have_every_case():
    made = results()
    assert correlation_table(made).row_count == len(made.rows)
    assert len(correlation_csv(made).splitlines()) == 1 + 3 * len(made.rows)
    record = correlation_json(made)
    assert record["cases"][0]["theory"]["peak"] == pytest.approx(1.0)
    assert record["cases"][3]["paper"] is None


def test_cells_of_an_ambiguity_are_drawn_about_their_lag_and_doppler_shift():
    found = Ambiguity(
        amplitude=np.ones((3, 5), dtype=np.complex128),
        doppler=np.array([-1e3, 0.0, 1e3]),
        lag=1e-6 * np.arange(-2.0, 3.0),
    )
    (image,) = ambiguity_picture(found, title="x").figure.axes[0].images
    assert image.get_extent() == pytest.approx([-2.5, 2.5, -1.5, 1.5])
