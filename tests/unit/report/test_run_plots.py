"""Figures of runs and studies show what is stored."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes

from polychirp.errors import CapabilityError, InputError
from polychirp.model.ramp_code import RampCode
from polychirp.receiver.overview.pooling import pooled
from polychirp.report.run_plots import FIGURES, draw, figures_of
from polychirp.study.store.load import load_run
from polychirp.study.store.save import save_run
from tests.support.runs import BOTH, ORIGIN, STUDY


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.zarr"
    save_run(path, BOTH, provenance=ORIGIN)
    return load_run(path)


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_has_data_and_files(run, name):
    drawing = draw(name, run.victim("front"), STUDY.receiver)
    assert len({len(column) for column in drawing.data.values()}) == 1
    assert drawing.png().startswith(b"\x89PNG")


def test_equal_figures_are_equal_files(run):
    for form in ("png", "svg", "pdf"):
        one, other = (draw("detections", run.victim("front"), STUDY.receiver) for _ in range(2))
        assert one.picture(form) == other.picture(form)


@pytest.mark.parametrize("name", [name.replace("-", "_") for name in FIGURES])
def test_a_run_draws_itself(run, name):
    axes = getattr(run.plot, name)("front")
    assert axes
    assert all(isinstance(one, Axes) for one in axes)


def test_a_part_that_is_zero_has_no_panel(run):
    names = {axes.get_title(loc="left") for axes in run.plot.range_rate("front")}
    assert {"echo", "direct", "noise", "all"} <= names


def test_what_cannot_be_drawn_is_told(run):
    with pytest.raises(InputError, match=r"no figure 'range-rat'; .*did you mean 'range-rate'"):
        draw("range-rat", run.victim("front"), STUDY.receiver)
    with pytest.raises(InputError, match="the run has 2 radars: 'front', 'rear'; name one"):
        run.plot.detections()
    with pytest.raises(InputError, match="no channel 7; there are 0 to 1"):
        run.plot.spectrogram("front", channel=7)


def test_pooling_keeps_maxima():
    values = np.random.default_rng(1).normal(size=(700, 30))
    few = pooled(values, most=100, axis=0)
    assert few.shape == (100, 30)
    np.testing.assert_array_equal(few.max(axis=0), values.max(axis=0))
    np.testing.assert_array_equal(pooled(values, most=1000, axis=0), values)


def test_a_radar_with_a_code_has_all_figures_but_its_ramps(run):
    victim = run.victim("front")
    ramps = victim.frame.schedule
    zero = np.zeros(ramps.num_ramps, dtype=int)
    code = RampCode(value=[[1, -1]], row=zero, chip_duration=0.5 * ramps.duration)
    coded = replace(victim, frame=replace(victim.frame, schedule=replace(ramps, code=code)))
    assert set(FIGURES) - set(figures_of(coded)) == {"ramps"}
    assert figures_of(victim) == tuple(FIGURES)
    with pytest.raises(CapabilityError, match="shows no chips"):
        draw("ramps", coded, STUDY.receiver)
