"""The picture of errors against their bound."""

import csv
import io

from tools.figures.estimation_bound import estimation_bound

CURVES = {
    "conventional": [
        (-10.0, [2e-3, 2e-3, 5e-3], [1e-3, 1e-3, 4e-3]),
        (0.0, [1e-3] * 3, [9e-4] * 3),
    ],
    "diverse": [(-10.0, [1e-3, 2e-3, 5e-3], [1e-3, 1e-3, 4e-3]), (0.0, [1e-3] * 3, [9e-4] * 3)],
}

SHARES = {name: [(-12.0, 0.3, 0.1), (-10.0, 0.9, 0.0), (0.0, 1.0, 0.0)] for name in CURVES}


def test_every_quantity_has_a_panel_with_errors_and_bounds_of_every_waveform():
    drawing = estimation_bound(CURVES, shares=SHARES, note="a note")
    *axes, _ = drawing.figure.axes
    assert [a.get_ylabel().split(" of ")[1] for a in axes] == [
        "range (m)",
        "range rate (m/s)",
        "azimuth (rad)",
    ]
    for column, panel in enumerate(axes):
        for name, (bound, measured) in zip(
            CURVES, zip(panel.lines[::2], panel.lines[1::2], strict=True), strict=True
        ):
            assert list(measured.get_ydata()) == [p[1][column] for p in CURVES[name]]
            assert list(bound.get_ydata()) == [p[2][column] for p in CURVES[name]]


def test_its_table_has_a_line_per_snr():
    drawing = estimation_bound(CURVES, shares=SHARES, note="")
    lines = list(csv.DictReader(io.StringIO(drawing.csv())))
    assert [line["SNR (dB), diverse"] for line in lines] == ["-10", "0"]
    assert lines[0]["rms error of range (m), conventional"] == "0.002"
    assert [line["share found, diverse"] for line in lines] == ["0.9", "1"]


def test_the_last_panel_says_how_many_are_found_and_how_many_of_those_are_far_off():
    panel = estimation_bound(CURVES, shares=SHARES, note="").figure.axes[-1]
    found, outliers = panel.lines[:2]
    assert list(found.get_ydata()) == [0.3, 0.9, 1.0]
    assert list(outliers.get_ydata()) == [0.1, 0.0, 0.0]
