"""Range-rate maps of the parts of a frame, from a study of a template."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.cli.init import template
from polychirp.config.load import load_study
from polychirp.receiver.mitigation import StftExcision
from polychirp.report.figures.range_rate_parts import range_rate_parts
from polychirp.study.part_views import part_maps
from polychirp.study.trial import run_trial


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "pedestrian.toml"
    path.write_text(template("pedestrian"), encoding="utf-8")
    return load_study(path, overrides=("num_sweeps=16",))


@pytest.fixture(scope="module")
def victim(study):
    return run_trial(study).victim("front")


def test_the_pedestrian_is_the_peak_of_the_echo_and_the_other_radar_a_line_of_one_speed(
    study, victim
):
    maps = part_maps(study.receiver, victim.frame, victim.parts)
    assert list(maps) == ["echo", "direct", "indirect", "noise", "all"]
    echo = maps["echo"]
    row, column = np.unravel_index(np.argmax(echo.power), echo.power.shape)
    cell = echo.range_rate[1] - echo.range_rate[0]
    assert echo.range[column] == pytest.approx(victim.truth.range[0], abs=0.2)
    assert echo.range_rate[row] == pytest.approx(victim.truth.range_rate[0], abs=cell)
    # equal intervals: each crossing at the same place of its chirp, so one speed at every range
    by_speed = np.sort(maps["direct"].power.sum(axis=1))
    assert by_speed[-5:].sum() > 0.99 * by_speed.sum()


def test_the_maps_of_the_parts_have_the_power_of_the_whole_in_the_mean(study, victim):
    """Parts add up in amplitude; their products vanish in the mean over cells."""
    maps = part_maps(study.receiver, victim.frame, victim.parts)
    parts = sum(maps[name].power.sum() for name in maps if name != "all")
    assert maps["all"].power.sum() == pytest.approx(parts, rel=0.05)


def test_the_last_map_is_mitigated_if_the_receiver_mitigates(study, victim):
    receiver = replace(study.receiver, mitigation=StftExcision())
    maps = part_maps(receiver, victim.frame, victim.parts)
    assert list(maps)[-1] == "all, mitigated"
    assert maps["all, mitigated"].power.max() < 0.1 * maps["all"].power.max()
    drawing = range_rate_parts(maps, victim.detections, victim.truth, title="parts")
    assert len(drawing.data) == 2 + len(maps)
    assert drawing.data["all_w"].max() == maps["all"].power.max()
    assert drawing.png().startswith(b"\x89PNG")
