"""Figures 12 and 13, drawn and as a table."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import get_args

from polychirp.report.figures.detection_statistics import detection_statistics
from polychirp.report.statistics import (
    STATISTICS_HEAD,
    findings,
    origin,
    shown_statistics,
    statistics_rows,
    traced_findings,
)
from polychirp.study.paper.results import StatisticsRow, StoredStatistics, WaveformKind


def row(waveform: str, count: int) -> StatisticsRow:
    return StatisticsRow(
        waveform=waveform,
        situation="interfered",
        num_targets=count,
        num_trials=20,
        detection=(0.95, 0.8, 0.99),
        ghosts=(1.5, 1.0, 2.0),
        unexplained=(0.0, 0.0, 0.1),
        range_rmse_m=(1e-4, 5e-5, 2e-4),
        azimuth_rmse_deg=(0.01, 0.005, 0.02),
        speed_rmse_kmh=(0.002, 0.001, 0.004),
        range_median_m=1e-5,
        azimuth_median_deg=0.002,
        speed_median_kmh=0.0003,
        floor_rise_db=51.26,
    )


ROWS = [row(waveform, count) for waveform in ("conventional", "diverse") for count in (1, 10)]


def test_every_line_has_a_cell_for_every_heading() -> None:
    lines = list(statistics_rows(ROWS))
    assert {len(line) for line in lines} == {len(STATISTICS_HEAD)}
    assert lines[1][2:5] == ("10", "20", "0.950 (0.800…0.990)")
    assert lines[0][7] == "0.0001 (5e-05…0.0002)"
    assert lines[0][-1] == "51.3"


def test_the_figure_has_a_curve_for_every_situation_and_the_papers_points() -> None:
    drawing = detection_statistics(ROWS)
    panels = drawing.figure.axes
    labels = [text.get_text() for text in panels[-1].get_legend().get_texts()]
    assert labels == [
        "conventional, two interferers",
        "diverse, two interferers",
        "medians",
        "the paper",
    ]
    stars = [line for axes in panels for line in axes.lines if line.get_marker() == "*"]
    assert [(float(s.get_xdata()[0]), float(s.get_ydata()[0])) for s in stars] == [
        (10.0, 0.13),
        (10.0, 0.12),
        (10.0, 0.1),
    ]
    assert drawing.data["detection low"] == [0.8] * 4
    assert drawing.png() == detection_statistics(ROWS).png()


def test_every_waveform_has_a_curve() -> None:
    rows = [row(waveform, count) for waveform in get_args(WaveformKind) for count in (1, 10)]
    labels = {line.get_label() for line in detection_statistics(rows).figure.axes[0].containers}
    assert labels == {f"{kind}, two interferers" for kind in get_args(WaveformKind)}


def test_findings_compare_as_far_as_the_intervals_tell() -> None:
    accuracy, detection, floor = findings(ROWS)
    assert "range 0.0001 m rms (median 1e-05), below the paper's 0.13 m" in accuracy
    wide = [replace(one, azimuth_rmse_deg=(0.2, 0.1, 0.3)) for one in ROWS]
    assert "(median 0.002), not significantly different from the paper's 0.12" in findings(wide)[0]
    assert "0.950 (0.800…0.990)" in detection
    assert "51 dB" in floor
    assert findings(ROWS[:1]) == []


def test_stored_points_are_shown_with_those_that_only_the_run_has() -> None:
    stored = StoredStatistics(
        measured="2026-11-23",
        version="0.1.0",
        seed=1,
        rows=tuple(replace(one, num_trials=100) for one in ROWS),
    )
    blanked = replace(ROWS[1], situation="blanked")
    results = SimpleNamespace(statistics=(ROWS[1], blanked), stored=stored)
    assert shown_statistics(results) == (*stored.rows, blanked)
    assert shown_statistics(SimpleNamespace(statistics=(blanked,), stored=None)) == (blanked,)
    assert "100 trials are stored results: polychirp 0.1.0" in origin(stored)
    assert "100 trials" in detection_statistics(stored.rows).figure.get_suptitle()


def test_the_paired_difference_decides() -> None:
    """The intervals of both curves are the same; those of their differences are not."""
    words = {
        (0.1, 0.05, 0.15): "diverse slopes detect more targets",
        (-0.1, -0.15, -0.05): "diverse slopes detect fewer targets",
        (0.1, -0.05, 0.25): "the trials do not decide which waveform detects more targets",
    }
    for gain, meaning in words.items():
        some = [
            replace(one, detection_gain=gain, ghosts_gain=(-6.0, -7.0, -5.0))
            if one.waveform == "diverse"
            else one
            for one in ROWS
        ]
        assert meaning in findings(some)[3]
    drawing = detection_statistics(some)
    panels = {axes.get_ylabel(): axes for axes in drawing.figure.axes}
    (bars,) = panels["Ghosts in a frame,\nminus conventional"].containers
    assert list(bars.lines[0].get_ydata()) == [-6.0, -6.0]
    assert drawing.data["ghosts_gain high"] == ["", "", -5.0, -5.0]


def test_findings_on_traced_vehicles_are_those_of_most_targets() -> None:
    """Every situation has its probability, and ghosts are those without interferers."""
    alone = [replace(one, situation="alone", ghosts=(30.0, 28.0, 32.0)) for one in ROWS]
    found, errors, ghosts = traced_findings([*ROWS, *alone])
    assert found.startswith("Of 10 vehicles in sight")
    assert "0.950 (0.800…0.990) without interferers" in found
    assert "0.950 (0.800…0.990) beside two that start together" in found
    assert "0.0001 (5e-05…0.0002) m rms in range" in errors
    assert "30 (28…32) ghosts" in ghosts


def test_the_figure_says_what_its_targets_are() -> None:
    drawing = detection_statistics(ROWS, targets="ray-traced vehicles")
    assert "ray-traced vehicles in random traffic" in drawing.figure.get_suptitle()
