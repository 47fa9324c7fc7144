"""The live page computes what a run computes, and shows it."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from polychirp.bounded_text import toml_tables
from polychirp.channel.tracers.composite import Composite
from polychirp.config.load import study_of_tables
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import ModelWarning
from polychirp.live import plots
from polychirp.live.copies import script_text, study_text
from polychirp.live.look import Stop, Stopped, detections_in, look_at, notes_on, strongest_paths
from polychirp.live.presets import FIRST_PRESET, PRESETS
from polychirp.live.settings import RadarControls, study_of
from polychirp.study.check import check
from polychirp.study.spec import schedules_of
from polychirp.study.trial import run_trial


@pytest.fixture(scope="module")
def look():
    return look_at(study_of(PRESETS[FIRST_PRESET]))


@pytest.fixture(scope="module")
def seen(look):
    return detections_in(look)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_is_a_study_that_can_run(name):
    for waveform in ("triangular", "diverse-triangular", "sawtooth"):
        settings = PRESETS[name]
        settings = replace(settings, victim=replace(settings.victim, waveform=waveform))
        with warnings.catch_warnings():  # a car may be too fast for chirps as long as triangles
            warnings.simplefilter("ignore", ModelWarning)
            check(study_of(settings))


def test_limits_that_the_settings_exceed_are_noted():
    settings = PRESETS[FIRST_PRESET]
    assert notes_on(study_of(settings)) == ()
    settings = replace(settings, victim=replace(settings.victim, waveform="sawtooth"))
    notes = notes_on(study_of(settings))
    assert any("will appear with another speed" in note for note in notes)


def test_a_radar_that_starts_together_makes_a_ghost_at_half_its_distance(look, seen):
    scene = look.scene
    distance = float(np.linalg.norm(scene.radar_position[1] - scene.radar_position[0]))
    ghosts = seen.detections.range[np.array(seen.score.nature) == "direct"]
    assert ghosts.size
    assert np.min(np.abs(ghosts - 0.5 * distance)) < 0.3
    profile = look.profiles["interference"]
    assert profile.range[np.argmax(profile.power)] == pytest.approx(0.5 * distance, abs=0.3)


def test_the_look_has_the_detections_of_a_run(look, seen):
    (expected,) = run_trial(look.study).victims
    np.testing.assert_allclose(seen.detections.range, expected.detections.range, rtol=1e-9)
    assert seen.score.nature == expected.score.nature


def test_the_other_radar_can_be_silent_and_repaired():
    settings = PRESETS[FIRST_PRESET]
    quiet = look_at(study_of(replace(settings, other=replace(settings.other, is_on=False))))
    assert "interference" not in quiet.profiles
    hit = replace(settings, other=RadarControls(ramp_duration=0.7e-3))
    before = look_at(study_of(hit)).profiles["all"].power
    after = look_at(study_of(replace(hit, mitigation="blanking"))).profiles["all"].power
    # beyond the cars there is interference alone, and, after blanking, side lobes of the echoes
    far = before.size - before.size // 10
    assert np.median(after[far:]) < 0.6 * np.median(before[far:])


@pytest.mark.parametrize("waveform", ["triangular", "diverse-triangular", "sawtooth"])
@pytest.mark.parametrize("start_time", [-50e-6, 0.0])
def test_the_other_radar_transmits_until_the_victim_ends(waveform, start_time):
    settings = PRESETS[FIRST_PRESET]
    other = RadarControls(waveform=waveform, ramp_duration=20e-6, start_time=start_time)
    settings = replace(
        settings,
        victim=replace(settings.victim, ramp_duration=40e-6),
        other=other,
        num_sweeps=32,
    )
    own, its = schedules_of(study_of(settings))
    assert its.end_time[-1] >= own.end_time[-1] * (1.0 - 1e-9)


def test_the_steepest_ramp_beats_within_the_pass_band():
    settings = PRESETS["motorway, oncoming"]
    settings = replace(settings, victim=replace(settings.victim, waveform="diverse-triangular"))
    study = study_of(settings)
    radar, reach = study.radars[0], study.receiver.greatest_range
    steepest = radar.waveform.bandwidth[1] / radar.waveform.ramp_duration[0]
    assert 2.0 * steepest * reach / SPEED_OF_LIGHT <= radar.if_filter.passband * (1.0 + 1e-9)


def test_the_distance_moves_the_other_radar_away():
    settings = PRESETS[FIRST_PRESET]
    near, far = (study_of(replace(settings, distance=d)) for d in (0.0, 10.0))
    assert far.street.vehicles[1].x - near.street.vehicles[1].x == 10.0


def test_beats_of_the_farthest_car_are_within_the_samples():
    for settings in PRESETS.values():
        radar = study_of(settings).radars[0]
        reach = study_of(settings).receiver.greatest_range
        beat = 2.0 * settings.victim.slope * reach / SPEED_OF_LIGHT
        assert beat <= radar.if_filter.passband
        assert radar.if_filter.stopband < radar.converter.sample_rate


def test_paths_end_at_the_radars(look):
    kinds = {kind for kind, _ in strongest_paths(look, 3)}
    assert kinds == {"echo", "direct", "indirect"}
    victim, other = look.scene.radar_position
    for kind, points in strongest_paths(look, 3):
        np.testing.assert_allclose(points[-1], victim)
        np.testing.assert_allclose(points[0], victim if kind == "echo" else other)


@pytest.mark.parametrize("is_dark", [False, True])
def test_figures_are_json_and_have_the_detections(look, seen, is_dark):
    import orjson

    drawn = [
        plots.range_profile(look, seen, is_dark=is_dark),
        plots.range_rate(look, None, is_dark=is_dark),
        plots.range_rate(look, seen, is_dark=is_dark),
        plots.beats_over_time(look, is_dark=is_dark),
    ]
    sizes = [len(orjson.dumps(one, option=orjson.OPT_SERIALIZE_NUMPY)) for one in drawn]
    assert max(sizes) < 1_000_000  # sent within the loop
    marks = [trace for trace in drawn[2]["data"] if trace.get("mode") == "markers"]
    count = sum(len(trace["x"]) for trace in marks if trace["name"] != "target")
    assert count == seen.detections.num_detections


def test_names_in_the_legend_are_short_enough_for_two_columns(look, seen):
    """A long one would make one column, which takes half of the plot's height."""
    names = [one["name"] for one in plots.range_profile(look, seen, is_dark=False)["data"]]
    assert "body, not on a target's<br>visible metal" in names
    assert max(len(line) for name in names for line in name.split("<br>")) <= plots.LEGEND_WIDTH


def test_the_map_shows_fast_targets_where_its_chirps_have_their_echoes():
    settings = replace(PRESETS["motorway, oncoming"], cars=())  # none hides the oncoming car
    fast = look_at(study_of(settings))
    found = detections_in(fast)
    map_ = fast.map
    drawn = {
        trace.get("name"): trace for trace in plots.range_rate(fast, found, is_dark=False)["data"]
    }
    (place,) = drawn["target"]["x"]
    (rate,) = found.truth.range_rate[found.truth.is_visible]
    assert map_.range_rate[0] <= place <= map_.range_rate[-1]
    step = map_.range_rate[1] - map_.range_rate[0]
    assert (place - rate) / (step * map_.range_rate.size) == pytest.approx(2.0, abs=1e-6)
    (beside,) = drawn["target"]["y"]
    row = np.argmin(np.abs(map_.range_rate - place))
    column = np.argmin(np.abs(map_.range - beside))
    near = map_.power[row - 3 : row + 4, column - 10 : column + 11].max()
    assert near > 100.0 * np.median(map_.power)  # the echo of the car
    for trace in drawn.values():
        if trace.get("mode") == "markers":
            assert np.all(np.abs(trace["x"]) <= np.abs(map_.range_rate).max() + step)


def test_the_copied_study_is_the_study_of_the_page(tmp_path):
    for settings in PRESETS.values():
        for is_traced in (False, True):
            text = study_text(settings, is_traced=is_traced)
            study = study_of_tables(toml_tables(text), folder=tmp_path)
            assert study == study_of(settings, is_traced=is_traced)
    assert isinstance(study.tracer, Composite)


def test_the_copied_script_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(script_text(PRESETS[FIRST_PRESET]), "script", "exec"), {"__name__": "script"})
    assert "direct" in capsys.readouterr().out


def test_a_full_trace_can_be_stopped():
    stop, shown = Stop(), []

    def show(what: str, done: int, total: int) -> None:
        shown.append(what)
        stop.press()

    with pytest.raises(Stopped):
        look_at(study_of(PRESETS[FIRST_PRESET], is_traced=True), progress=stop.noticed_by(show))
    assert len(shown) == 1
