import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from polychirp.frames import Pose
from polychirp.model.scene import Actor, PointScatterer
from polychirp.report.figures.surfaces import radar_paint
from polychirp.report.page_data import LEVEL_STEP_DB, causes, row_key, rows_data
from polychirp.report.street_model import street_model
from polychirp.study.paper.scenarios import MAP_CELLS


@pytest.fixture
def row(make_row):
    return make_row("C", "radar 2", ghosts=(("direct", 6.6, 22.5),), hidden=("far <car>",))


def test_cells_of_a_map_have_their_levels_to_half_a_step(row):
    """Rows of cells grow with closing speed, that is against the range rate."""
    (data,) = rows_data([row])
    map_ = data["map"]
    cells = np.frombuffer(base64.b64decode(map_["cells"]), dtype=np.uint8).reshape(map_["shape"])
    level = map_["low"] + map_["step"] * cells
    assert level == pytest.approx(row.map.power_db[::-1], abs=0.5 * LEVEL_STEP_DB)
    assert map_["speed"] == [-32.0, 32.0]
    assert map_["range"] == [0.0, 30.0]
    assert map_["floor"] == row.noise_floor_db


def test_levels_far_below_the_strongest_are_the_lowest(row):
    power = row.map.power_db.copy()
    power[0, 0] = -300.0
    (data,) = rows_data([replace(row, map=replace(row.map, power_db=power))])
    assert base64.b64decode(data["map"]["cells"])[-data["map"]["shape"][1]] == 0


def test_marks_say_range_speed_power_and_cause(row):
    (data,) = rows_data([row])
    marks = data["marks"]
    assert [mark["cause"] for mark in marks] == ["target", "target", "direct"]
    assert marks[-1] == {
        "range": 6.6,
        "speed": 2.0,
        "power": -8.5,
        "cause": "direct",
        "origin": "",
    }
    assert {mark["cause"] for mark in marks} <= causes().keys()
    assert [target["found"] for target in data["targets"]] == [True, True, False]


def test_marks_and_targets_are_in_the_profile_at_their_ranges_at_the_start_of_the_frame(row):
    """Tables and profiles are of the start, maps of the middle, in which a car at 13.65 m that
    closes at 19.7 m/s has come nearer by 0.47 m."""
    later = replace(
        row.map,
        target_range=row.map.target_range - 0.47,
        detection_range=row.map.detection_range - 0.47,
    )
    (data,) = rows_data([replace(row, map=later)])
    for one, start in zip(data["targets"], row.targets, strict=True):
        assert one["profile_range"] == pytest.approx(start.range_m, abs=0.005)
        assert one["range"] == pytest.approx(start.range_m - 0.47, abs=0.005)
    assert [mark["profile_range"] for mark in data["marks"]] == row.detection_range.tolist()
    (still,) = rows_data([row])
    assert not any("profile_range" in one for one in (*still["targets"], *still["marks"]))


def test_a_profile_ends_where_the_figures_end(row):
    (data,) = rows_data([row])
    assert max(data["profile"]["range"]) == 30.0
    assert len(data["profile"]["power"]) == len(data["profile"]["range"])


def test_rows_without_a_map_are_left_out(row):
    assert rows_data([replace(row, map=None)]) == []


def test_rows_without_interference_are_there_once(make_row):
    rows = [make_row(synchronous=True), make_row(synchronous=False)]
    assert [data["key"] for data in rows_data(rows)] == [row_key(rows[0])]
    assert row_key(rows[0]) == "A|radar 1|conventional|none"


def test_the_street_has_a_box_for_every_body(scene):
    model = street_model(scene)
    json.dumps(model, allow_nan=False)
    bodies = {body["name"]: body for body in model["bodies"]}
    assert bodies.keys() == {actor.name for actor in scene.actors}
    car = bodies["vehicle 2"]
    assert car["low"] == [-2.25, -0.9, 0.2]
    assert car["high"] == [2.25, 0.9, 1.6]
    assert car["place"] == [8.0, 1.75, 0.0]
    assert car["speed"] == "43"
    assert bodies["house"]["high"] == [20.0, 9.0, 6.0]


def test_the_street_has_a_small_box_for_a_point(scene):
    point = Actor(
        name="corner reflector",
        kind="object",
        pose=Pose(x=12.0, z=1.0),
        points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=1.0),),
    )
    model = street_model(replace(scene, actors=(*scene.actors, point)))
    box = model["bodies"][-1]
    assert (box["name"], box["place"]) == ("corner reflector", [12.0, 0.0, 1.0])
    assert (box["low"], box["high"]) == ([-0.25] * 3, [0.25] * 3)


def test_a_car_has_the_colour_of_its_radars_beam(scene):
    model = street_model(scene)
    (beam,) = model["beams"]
    car = next(body for body in model["bodies"] if body["name"] == "vehicle 2")
    paint = "#" + "".join(f"{round(255 * part):02x}" for part in radar_paint(0))
    assert beam["colour"] == car["colour"] == paint
    assert abs(beam["azimuth"]) == pytest.approx(np.pi, abs=1e-4)
    assert 2.0 * beam["half_width"] == pytest.approx(np.radians(160.0), abs=1e-4)


def test_maps_of_all_rows_leave_half_of_5_mb_for_pictures(row):
    """The paper has 36 different rows; noise in all cells is the longest JSON."""
    rates, ranges = MAP_CELLS
    noise = np.random.default_rng(1).normal(-100.0, 20.0, (rates, ranges))
    whole = replace(
        row.map,
        range=np.linspace(0.0, 30.0, ranges),
        range_rate=np.linspace(-32.0, 32.0, rates),
        power_db=noise,
    )
    assert 36 * len(json.dumps(rows_data([replace(row, map=whole)]))) < 2.5e6
