"""The polar plot of cross sections: what it shows, and where."""

import numpy as np
import pytest

from polychirp.channel.rcs import CrossSections
from polychirp.report.figures.rcs import DRAWN_SPAN_DB, rcs_picture, statistics
from tools.figures.convergence import MeshError, convergence_picture


def found():
    """10 m² everywhere, 1000 m² at the left, nothing at the rear."""
    azimuth = np.radians(np.arange(-180.0, 180.0, 5.0))
    rcs = np.zeros((azimuth.size, 2, 2))
    rcs[:, 0, 0], rcs[:, 1, 1] = 10.0, 20.0
    rcs[np.isclose(azimuth, np.pi / 2)] = 1000.0
    rcs[0] = 0.0
    return CrossSections(
        azimuth=azimuth, rcs=rcs, distance=10.0, elevation=0.0, centre=(0.0, 0.0, 0.0)
    )


def picture(polarisation="VV"):
    return rcs_picture(
        found(), polarisation=polarisation, window=np.radians(10), title="car", note="note"
    )


def test_the_data_hold_all_polarisations_and_the_median_of_the_chosen_one():
    data = picture("HH").data
    assert list(data) == [
        "azimuth_deg", "vv_dbsm", "vh_dbsm", "hv_dbsm", "hh_dbsm", "hh_median_dbsm",
    ]  # fmt: skip
    assert data["vv_dbsm"][36] == pytest.approx(10.0)
    assert data["hh_dbsm"][36] == pytest.approx(13.01, abs=0.01)
    assert data["vv_dbsm"][0] == -400.0
    assert data["hh_median_dbsm"][0] == pytest.approx(13.01, abs=0.01)


def test_the_front_is_up_and_the_left_is_left():
    """Angles turn counter-clockwise from the top, seen from above."""
    (axes,) = picture().figure.axes
    assert axes.get_theta_offset() == pytest.approx(np.pi / 2)
    assert axes.get_theta_direction() == 1


def test_both_curves_close_and_none_leaves_the_circle():
    (axes,) = picture().figure.axes
    low, high = axes.get_ylim()
    assert (low, high) == (40 - DRAWN_SPAN_DB, 40)
    for line in axes.lines:
        level = np.asarray(line.get_ydata())
        assert level[0] == level[-1]
        assert low <= level.min() <= level.max() <= high


def test_the_medians_of_the_sides_are_of_their_sectors():
    values = statistics(found().rcs[:, 0, 0], found().azimuth)
    assert list(values) == ["mean", "median", "front median", "side median", "rear median"]
    assert values["front median"] == pytest.approx(10.0)
    assert values["mean"] == pytest.approx(10 * np.log10((70 * 10 + 1000) / 72))


def test_a_convergence_curve_falls_to_the_right_and_leaves_its_reference_out():
    rows = [
        MeshError(max_edge=0.05, coarseness=1.0, facets=60_000, median=1.0, ninth_decile=4.0),
        MeshError(max_edge=0.02, coarseness=0.5, facets=300_000, median=0.5, ninth_decile=2.0),
    ]
    drawing = convergence_picture(rows, note="note")
    assert list(drawing.data["facets"]) == [60_000, 300_000]
    (axes,) = drawing.figure.axes
    assert axes.get_xscale() == "log"
    assert axes.get_xlabel() == "Facets"
