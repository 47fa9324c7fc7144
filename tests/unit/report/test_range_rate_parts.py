"""Maps of parts over range rate: every mark lies on its cell."""

import numpy as np
import pytest

from polychirp.model.detection import Detections
from polychirp.model.spectra import RangeRateMap
from polychirp.model.truth import Truth
from polychirp.report.figures.range_rate_parts import folded_rates, range_rate_parts

FIRST, STEP, CELLS = -8.0, 1.0, 16
"""The map tells range rates of -8.5 to 7.5 m/s apart, a span of 16 m/s."""


def drawn(*, rates, is_periodic=True):
    """Maps of noise and of a target at 20 m and -30 m/s, in the cell of 2 m/s, and detections."""
    range_rate, range_ = FIRST + STEP * np.arange(CELLS), np.arange(40.0)
    power = np.full((CELLS, range_.size), 1e-12)
    bright = power.copy()
    bright[10, 20] = 1e-6
    maps = {
        name: RangeRateMap(
            power=cells, range_rate=range_rate, range=range_, is_periodic=is_periodic
        )
        for name, cells in (("noise", power), ("all", bright))
    }
    ones = np.ones(len(rates))
    found = Detections(
        time=0.0, range=20.0 * ones, range_rate=rates, azimuth=0.0 * ones, power=ones, snr=ones
    )
    truth = Truth(
        time=0.0,
        name=("car",),
        range=[20.0],
        range_rate=[-30.0],
        azimuth=[0.0],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
    )
    return maps["all"], range_rate_parts(maps, found, truth, title="").figure


def marks_of(figure, panel):
    return {line.get_label(): line for line in figure.axes[panel].lines}


@pytest.mark.parametrize("spans", [-2, 1, 3])
def test_a_detection_beyond_the_map_lies_on_its_bright_cell_and_is_marked(spans):
    map_, figure = drawn(rates=[2.0 + 16.0 * spans])
    marks = marks_of(figure, 1)
    rate, range_ = np.unravel_index(np.argmax(map_.power), map_.power.shape)
    folded = marks["detection at another range rate, folded"]
    assert folded.get_xydata() == pytest.approx(
        np.array([[map_.range_rate[rate], map_.range[range_]]])
    )
    assert "detection" not in marks
    assert marks["target"].get_xdata() == pytest.approx([2.0])


def test_a_detection_within_the_map_stays_where_it_is():
    _, figure = drawn(rates=[2.0, -8.4])
    marks = marks_of(figure, 1)
    assert marks["detection"].get_xdata().tolist() == [2.0, -8.4]
    assert marks["detection"].get_marker() == "o"
    assert not any("folded" in name for name in marks)


def test_maps_fill_their_panels():
    _, figure = drawn(rates=[27.0])
    for axes in figure.axes[:2]:
        assert axes.get_xlim() == (-8.0, 7.0)


def test_folded_range_rates_are_within_half_a_cell_of_the_map():
    map_, _ = drawn(rates=[0.0])
    rates = np.linspace(-100.0, 100.0, 997)
    folded = folded_rates(rates, map_)
    assert folded.min() >= -8.5
    assert folded.max() < 7.5
    turns = (rates - folded) / 16.0
    assert turns == pytest.approx(np.round(turns), abs=1e-12)


def test_a_map_that_is_not_periodic_has_no_mark_for_range_rates_beyond_it():
    """Ramps that differ tell all range rates apart: no echo of -30 m/s is at 2 m/s."""
    _, figure = drawn(rates=[18.0], is_periodic=False)
    marks = marks_of(figure, 1)
    assert marks["target"].get_xdata().tolist() == [-30.0]
    assert marks["detection"].get_xdata().tolist() == [18.0]
    assert figure.axes[1].get_xlim() == (-8.0, 7.0)
