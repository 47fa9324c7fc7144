"""The picture of errors against their bound."""

import csv
import io

from polychirp.report.figures.estimation_bound import estimation_bound

CURVES = {
    "conventional": [
        (-10.0, [2e-3, 2e-3, 5e-3], [1e-3, 1e-3, 4e-3]),
        (0.0, [1e-3] * 3, [9e-4] * 3),
    ],
    "diverse": [(-10.0, [1e-3, 2e-3, 5e-3], [1e-3, 1e-3, 4e-3]), (0.0, [1e-3] * 3, [9e-4] * 3)],
}


def test_every_quantity_has_a_panel_with_errors_and_bounds_of_every_waveform():
    drawing = estimation_bound(CURVES, note="a note")
    axes = drawing.figure.axes
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
    lines = list(csv.DictReader(io.StringIO(estimation_bound(CURVES, note="").csv())))
    assert [line["SNR (dB), diverse"] for line in lines] == ["-10", "0"]
    assert lines[0]["rms error of range (m), conventional"] == "0.002"
