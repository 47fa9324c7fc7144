"""Maps over range and azimuth: every mark lies where the map shows its echo."""

import numpy as np
import pytest

from polychirp.model.detection import Detections
from polychirp.model.spectra import RangeAzimuthMap
from polychirp.model.truth import Truth
from polychirp.report.figures.range_azimuth_parts import mapped, range_azimuth_parts

SINE, RANGE = np.linspace(-1.0, 1.0, 181), np.arange(0.5, 40.5)


def marks_of(*, distance, azimuth, elevation, measured):
    """Marks over a map with one bright cell, and the place of this cell, m."""
    beam = int(np.argmin(np.abs(SINE - np.cos(elevation) * np.sin(azimuth))))
    power = np.full((SINE.size, RANGE.size), 1e-12)
    power[beam, int(np.argmin(np.abs(RANGE - distance)))] = 1e-6
    found = Detections(
        time=0.0,
        range=[distance],
        range_rate=[0.0],
        azimuth=[measured[0]],
        elevation=[measured[1]],
        power=[1.0],
        snr=[1.0],
    )
    truth = Truth(
        time=0.0,
        name=("sign",),
        range=[distance],
        range_rate=[0.0],
        azimuth=[azimuth],
        elevation=[elevation],
        point=np.zeros((1, 3)),
        is_visible=[True],
    )
    maps = {"all": RangeAzimuthMap(power=power, sine=SINE, range=RANGE)}
    drawing = range_azimuth_parts(maps, found, truth, title="")
    marks = {line.get_label(): line.get_xydata()[0] for line in drawing.figure.axes[0].lines}
    brightest = int(np.argmax(drawing.data["all_w"]))
    return marks, np.array([drawing.data[key][brightest] for key in ("right_m", "ahead_m")])


@pytest.mark.parametrize("has_heights", [True, False])
def test_targets_and_detections_lie_on_their_bright_cell_at_any_elevation(has_heights):
    """A horizontal line reports no elevation, and arcsin(cos ε sin φ) as the azimuth."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        distance = rng.uniform(5.0, 39.0)
        azimuth, elevation = np.radians(rng.uniform(-50.0, 50.0, 2))
        sine = np.cos(elevation) * np.sin(azimuth)
        measured = (azimuth, elevation) if has_heights else (np.arcsin(sine), np.nan)
        marks, bright = marks_of(
            distance=distance, azimuth=azimuth, elevation=elevation, measured=measured
        )
        # half a cell of range, and half a step of the beams
        cell = 0.5 + 0.5 * distance * 2.0 / 180.0 / np.sqrt(1.0 - sine**2)
        for mark in (marks["target"], marks["detection"]):
            assert np.linalg.norm(mark - bright) < 1.1 * cell
            assert mark[0] == pytest.approx(-distance * sine)


def test_what_is_behind_the_radar_is_drawn_behind_it():
    right, ahead = mapped(np.array([10.0]), np.radians([150.0]), np.array([np.nan]))
    assert right == pytest.approx(-5.0)
    assert ahead == pytest.approx(-10.0 * np.cos(np.radians(30.0)))


def test_detections_without_an_azimuth_have_no_mark():
    marks, _ = marks_of(distance=20.0, azimuth=0.1, elevation=0.2, measured=(np.nan, 0.2))
    assert np.all(np.isnan(marks["detection"]))
