"""Curves of studies: places, styles and limits that can be read."""

import json
import math
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest

from polychirp.axes import axes_of
from polychirp.report.figures.grid_axis import grid_axis, numbers_of
from polychirp.report.figures.study_curves import (
    study_curves,
    study_differences,
    styles_of,
    y_limits,
)
from polychirp.study.monte_carlo.records import NATURES
from polychirp.study.monte_carlo.results import Results
from polychirp.study.monte_carlo.summary import differences, summaries
from polychirp.study.monte_carlo.tables import flat_row
from polychirp.study.provenance import Provenance

METHODS = (
    *("blanking", "interpolation", "burg", "autoregression", "matrix-pencil"),
    *("imat", "nulling", "stft-excision", "wavelet", "ramp-minimum"),
)
TRIALS = 4


def results_of(*axes, ghosts=None, trials=TRIALS):
    """Results of one radar and target over a grid; ``ghosts`` are their numbers, (point, trial)."""
    points = int(np.prod([len(labels) for _, labels in axes]))
    sizes = {"point": points, "trial": trials, "victim": 1, "target": 1, "frame": 0}
    sizes["nature"] = len(NATURES)
    arrays = {
        name: np.ones([sizes[axis] for axis in names]) for name, names in axes_of(Results).items()
    }
    arrays |= {name: arrays[name].astype(np.int64) for name in ("num_trials", "seed")}
    errors = 0.1 + 0.01 * (np.arange(trials)[:, None, None] % 2)
    arrays |= {name: errors * arrays[name] for name in arrays if name.endswith("_error")}
    arrays["num_detections"] = np.zeros_like(arrays["num_detections"])
    if ghosts is not None:
        arrays["num_detections"][:, :, 0, NATURES.index("direct")] = ghosts
    others = {field.name for field in fields(Results)} - arrays.keys()
    assert others == {"axes", "study_hash", "victim", "target", "origin"}
    return Results(
        axes=axes,
        study_hash=tuple(str(n) for n in range(points)),
        victim=("front",),
        target=("car",),
        origin=Provenance(
            study=json.dumps({"name": "made up"}),
            study_hash="",
            seed=1,
            versions={},
            platform="",
        ),
        **arrays,
    )


def lines_of(axes):
    """First line of each curve of a panel: its markers."""
    return [container.lines[0] for container in axes.containers]


# ── places ────────────────────────────────────────────────────────────────────


def test_quantities_are_drawn_to_scale():
    """297 MHz is a third of the way from 240 to 411 MHz."""
    results = results_of(("bandwidth", ("240 MHz", "297 MHz", "411 MHz")))
    axes = study_curves(results, over="bandwidth", title="").figure.axes[0]
    low, middle, high = axes.get_xticks()
    assert (middle - low) / (high - low) == pytest.approx(1 / 3)
    (line,) = lines_of(axes)
    assert np.asarray(line.get_xdata()) == pytest.approx([low, middle, high])


def test_differences_of_quantities_are_drawn_to_scale():
    results = results_of(("bandwidth", ("100 MHz", "240 MHz", "297 MHz", "411 MHz")))
    axes = study_differences(results, over="bandwidth", title="").figure.axes[0]
    low, middle, high = axes.get_xticks()
    assert (middle - low) / (high - low) == pytest.approx(1 / 3)


def test_differences_are_drawn_beside_zero():
    """Ghosts of two starts that differ by 40 in every trial, with an interval of no width."""
    ghosts = np.array([[0] * TRIALS, [40] * TRIALS, [41] * TRIALS])
    results = results_of(("start", ("0 s", "1 ms", "2 ms")), ghosts=ghosts)
    axes = study_differences(results, over="start", title="").figure.axes[1]
    low, high = axes.get_ylim()
    assert low < 0.0
    assert high > 41.0


@pytest.mark.parametrize("draw", [study_curves, study_differences])
def test_elevations_have_a_panel_if_an_array_measures_them(draw):
    results = results_of(("gap", (1, 2)))
    none = replace(results, elevation_error=np.full_like(results.elevation_error, np.nan))
    for some, is_shown in ((results, True), (none, False)):
        drawing = draw(some, over="gap", title="")
        labels = [axes.get_ylabel() for axes in drawing.figure.axes]
        assert any("levation error" in label for label in labels) == is_shown
        assert ("elevation_rmse_rad" in drawing.data) == is_shown


@pytest.mark.parametrize(
    ("draw", "estimates"), [(study_curves, summaries), (study_differences, differences)]
)
def test_columns_of_curves_have_the_names_and_units_of_the_tables_of_the_study(draw, estimates):
    """A figure has degrees and km/h, its table SI: the name of each column says so."""
    results = results_of(("gap", (1, 2)))
    data = draw(results, over="gap", title="").data
    rows = [flat_row(row, results) for row in estimates(results)]
    shared = set(data)
    assert {"range_rate_rmse_m_per_s", "azimuth_rmse_rad_low"} <= shared <= set(rows[0])
    for name in shared:
        if name == "victim":
            assert data[name] == [row[name] for row in rows]
            continue
        known = [math.nan if row[name] is None else row[name] for row in rows]
        assert data[name] == pytest.approx(known, nan_ok=True)


def test_values_in_several_units_are_compared_in_si():
    assert numbers_of(["0 s", "20 us", "1 ms"]) == pytest.approx([0.0, 2e-5, 1e-3])
    assert numbers_of(["0 dBsm", "10 dBsm", "20 dBsm"]) == [0.0, 10.0, 20.0]
    assert numbers_of(["1 ms", "1 MHz"]) is None
    assert numbers_of(["none", "1 ms"]) is None


def test_numbers_in_any_order_have_a_line_from_the_least_to_the_greatest():
    results = results_of(("num_sweeps", (64, 16, 32)), ghosts=np.array([[64], [16], [32]]))
    axes = study_curves(results, over="num_sweeps", title="").figure.axes[1]
    (line,) = lines_of(axes)
    assert np.asarray(line.get_xdata()).tolist() == [16, 32, 64]
    assert np.asarray(line.get_ydata()).tolist() == [16, 32, 64]


@pytest.mark.parametrize(
    ("labels", "name"),
    [
        (["1 MHz", "10 MHz", "1 GHz"], "bandwidth (logarithmic)"),
        (["0 MHz", "1 MHz", "1 GHz"], "bandwidth (not to scale)"),
        (["300 MHz", "440 MHz", "450 MHz"], "bandwidth (not to scale)"),
        (["300 MHz", "400 MHz", "450 MHz"], "bandwidth"),
        ([*range(40)], "bandwidth"),
    ],
)
def test_numbers_that_would_overlap_to_scale_have_another_scale_that_is_named(labels, name):
    results = results_of(("bandwidth", tuple(labels)))
    figure = study_curves(results, over="bandwidth", title="").figure
    assert {axes.get_xlabel() for axes in figure.axes} == {name}
    places = np.sort(grid_axis(labels).places)
    assert np.diff(places).min() > 0.0


def test_curves_beside_each_other_do_not_reach_the_next_label():
    results = results_of(("speed", tuple(range(1, 11))), ("mitigation", METHODS))
    axes = study_curves(results, over="speed", title="").figure.axes[0]
    x = np.array([line.get_xdata() for line in lines_of(axes)])
    assert np.all(x[:, :-1].max(axis=0) < x[:, 1:].min(axis=0))


# ── labels and styles ─────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    ("draw", "labels"),
    [
        (study_curves, METHODS),
        (study_differences, METHODS),
        (study_curves, METHODS[:2]),
        (study_curves, tuple(f"a long label {n}" for n in range(25))),
        (study_curves, tuple(range(60))),
    ],
)
def test_tick_labels_do_not_overlap(draw, labels):
    """Neighbours are apart along the line that is at right angles to their letters."""
    figure = draw(results_of(("axis", labels)), over="axis", title="").figure
    figure.draw_without_rendering()
    axes = figure.axes[0]
    texts = axes.get_xticklabels()
    places = axes.transData.transform([(place, 0.0) for place in axes.get_xticks()])[:, 0]
    angle = np.radians(texts[0].get_rotation())
    if angle == 0.0:
        boxes = [text.get_window_extent() for text in texts]
        assert not any(one.overlaps(other) for one, other in pairwise(boxes))
    else:
        assert {text.get_horizontalalignment() for text in texts} == {"right"}
        height = texts[0].get_fontsize() * figure.dpi / 72.0
        assert np.min(np.diff(places)) * np.sin(angle) > 0.9 * height


def test_no_two_of_49_curves_look_alike_even_without_lines():
    curves = [("front", (n,)) for n in range(49)]
    styles = styles_of(curves, with_lines=False)
    assert len({(style.colour, style.marker) for style in styles.values()}) == 49
    assert {style.line for style in styles.values()} == {""}
    with_lines = styles_of(curves, with_lines=True).values()
    assert all(style.line for style in with_lines)


def test_ten_curves_differ_in_colour_or_marker():
    results = results_of(("bandwidth", ("240 MHz", "297 MHz")), ("mitigation", METHODS))
    axes = study_curves(results, over="bandwidth", title="").figure.axes[0]
    looks = {(line.get_color(), line.get_marker()) for line in lines_of(axes)}
    assert len(looks) == len(METHODS)


def test_no_line_joins_names():
    results = results_of(("bandwidth", ("240 MHz", "297 MHz")), ("mitigation", METHODS))
    lines = {
        over: {line.get_linestyle() for line in lines_of(figure.axes[0])}
        for over in ("bandwidth", "mitigation")
        for figure in [study_curves(results, over=over, title="").figure]
    }
    assert lines["mitigation"] == {"None"}
    assert "None" not in lines["bandwidth"]


# ── limits ────────────────────────────────────────────────────────────────────


def test_the_axis_follows_values_and_not_intervals_that_are_far_wider():
    """Of two trials with 0 and 10 ghosts, the 95 % interval goes to more than 100."""
    ghosts = np.array([[2, 2], [0, 10]])
    results = results_of(("mitigation", ("none", "blanking")), ghosts=ghosts, trials=2)
    figure = study_curves(results, over="mitigation", title="").figure
    low, high = figure.axes[1].get_ylim()
    assert low < 2.0
    assert 5.0 < high < 10.0
    assert "go on beyond it" in figure.legends[0].get_title().get_text()


def test_intervals_that_are_near_the_values_are_shown_whole():
    values = np.array([1.0, 2.0, np.nan])
    low, high = values - 0.3, values + 0.2
    assert y_limits(values, low, high, least_span=0.0) == pytest.approx((0.7, 2.2))


def test_equal_values_have_the_limits_of_their_intervals_or_the_least_span():
    values = np.array([4.0, 4.0])
    assert y_limits(values, values - 1, values + 99, least_span=2.0) == (3.0, 6.0)
    assert y_limits(0 * values, 0 * values, 0 * values, least_span=0.0) is None
    assert y_limits(np.full(2, np.nan), values, values, least_span=1.0) is None


def test_a_legend_does_not_speak_of_cut_intervals_where_there_are_none():
    results = results_of(
        ("mitigation", ("none", "blanking")), ghosts=np.full((2, 50), 3), trials=50
    )
    figure = study_curves(results, over="mitigation", title="").figure
    assert figure.legends[0].get_title().get_text() == "Bars are 95 % intervals"


def test_names_have_their_order_and_no_note():
    axis = grid_axis(METHODS)
    assert axis.places == tuple(range(10))
    assert (axis.are_numbers, axis.note) == (False, "")
