"""Trials are kept, counted, stopped and stored alike, whoever ran them and in whatever order.

Trials are made up here, by an executor that runs nothing and forgets the order of its tasks.
"""

import csv
import errno
import json
import shutil
import socket
import sys
import time
from collections import Counter
from dataclasses import replace
from itertools import islice, product
from pathlib import Path

import numpy as np
import pytest

from polychirp.axes import axes_of
from polychirp.config.monte_carlo import load_plan
from polychirp.errors import InputError, ModelWarning, RunError
from polychirp.model.baseband import no_progress
from polychirp.report.figures.study_curves import study_curves
from polychirp.scoring.statistics import proportion
from polychirp.study.monte_carlo import executor, tables
from polychirp.study.monte_carlo.dask_executor import DaskWorkers
from polychirp.study.monte_carlo.executor import WORKERS_PER_CORE, LocalWorkers
from polychirp.study.monte_carlo.grid import Axis, MonteCarlo, axes_of_grid
from polychirp.study.monte_carlo.records import (
    NATURES,
    TrialRecord,
    VictimRecord,
    read_records,
    trial_log,
)
from polychirp.study.monte_carlo.results import Results, load_results
from polychirp.study.monte_carlo.run import LOG, MOST_FAILURES, STORE, made_with, run_plan
from polychirp.study.monte_carlo.stopping import TRIALS_PER_DECISION, Stopping
from polychirp.study.monte_carlo.summary import differences, losses, summaries
from polychirp.study.monte_carlo.tasks import Outcome, Task
from tests.support.small_study import SMALL_GRID, SMALL_STUDY

HEADER = {"format": "version 2", "versions": {"polychirp": "1"}, "platform": "here"}
ERROR = 0.1


def made_up(point: int, seed: int) -> VictimRecord:
    """A victim of two targets: the second is hidden now and then, the first found more or less."""
    rng = np.random.default_rng([seed, 1])
    chance, is_visible = rng.uniform(size=2), (True, bool(rng.uniform() < 0.8))
    is_detected = tuple(
        bool(c < 0.9 - 0.2 * point) and v for c, v in zip(chance, is_visible, strict=True)
    )
    errors = tuple(ERROR * (1.0 if d else 0.0) for d in is_detected)
    counts = dict.fromkeys(NATURES, 0) | {"target": sum(is_detected), "direct": point}
    return VictimRecord(
        name="front",
        target=("near", "far"),
        is_visible=is_visible,
        is_in_sight=is_visible,
        is_detected=is_detected,
        range=(9.0, 18.0),
        range_rate=(0.0, -1.0),
        azimuth=(0.0, 0.1),
        elevation=(0.0, 0.1),
        range_error=errors,
        range_rate_error=errors,
        azimuth_error=errors,
        elevation_error=errors,
        detection_sinr=(10.0, 10.0),
        echo_snr=(50.0, 30.0),
        snr=(40.0, 20.0),
        inr=(3.0, 1.0),
        mitigated_sinr=(30.0, 15.0),
        num_points=tuple(2.0 * d for d in is_detected),
        length=errors,
        width=errors,
        range_rate_span=errors,
        visible_length=(4.0, 4.0),
        visible_width=(2.0, 2.0),
        visible_range_rate_span=(0.0, 0.0),
        detections=tuple(counts[name] for name in NATURES),
        floor_rise=2.0,
        num_unresolved=point,
    )


class MadeUp:
    """Outcomes in a random order, some tasks ahead; counts what it was asked."""

    def __init__(self, *, order: int = 0, ahead: int = 7, dies_after: int | None = None) -> None:
        self.rng = np.random.default_rng(order)
        self.ahead, self.dies_after = ahead, dies_after
        self.ran: Counter = Counter()
        self.failing: set = set()

    def run(self, studies, tasks):
        del studies
        while at := list(islice(tasks, self.ahead)):
            self.rng.shuffle(at)
            yield from map(self._outcome, at)

    def _outcome(self, task):
        if self.dies_after is not None and sum(self.ran.values()) >= self.dies_after:
            raise KeyboardInterrupt
        self.ran[task.point, task.trial] += 1
        if (task.point, task.trial) in self.failing:
            return Outcome(task=task, result=None, failure="the mast fell over")
        return Outcome(task=task, result=(made_up(task.point, task.seed),))


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "small.toml"
    path.write_text(SMALL_STUDY + SMALL_GRID, encoding="utf-8")
    return replace(load_plan(path), trials=3 * TRIALS_PER_DECISION)


def finish(plan, folder, executor):
    return run_plan(plan, folder=folder, executor=executor, progress=no_progress)


def files(folder: Path) -> dict[str, bytes]:
    """All but the trials as they came."""
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name != LOG
    }


def test_the_order_of_trials_changes_no_byte(plan, tmp_path):
    finish(plan, tmp_path / "a", MadeUp(order=1, ahead=1))
    finish(plan, tmp_path / "b", MadeUp(order=2, ahead=50))
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_a_stopped_run_goes_on_without_losing_or_repeating_a_trial(plan, tmp_path):
    first, second = MadeUp(order=3, dies_after=31), MadeUp(order=4)
    with pytest.raises(KeyboardInterrupt):
        finish(plan, tmp_path / "a", first)
    done = finish(plan, tmp_path / "a", second)
    assert sum(first.ran.values()) == 31
    assert not first.ran.keys() & second.ran.keys()
    assert set(first.ran + second.ran) == {(p, n) for p in range(4) for n in range(plan.trials)}
    assert done.num_new == 4 * plan.trials - 31
    finish(plan, tmp_path / "b", MadeUp())
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_a_run_anew_that_is_stopped_leaves_no_earlier_results(plan, tmp_path):
    """They would be taken for those of the study that was stopped."""
    finish(plan, tmp_path, MadeUp())
    assert {STORE, *tables.FILES} >= {path.name for path in tmp_path.iterdir()} - {LOG}
    page = tmp_path / "report.html"
    page.write_text("the earlier study", encoding="utf-8")
    with pytest.raises(KeyboardInterrupt):
        run_plan(plan, folder=tmp_path, executor=MadeUp(dies_after=3), anew=True, drawn=[page])
    assert [path.name for path in tmp_path.iterdir()] == [LOG]
    assert len(list(read_records(tmp_path / LOG))) == 3


def test_results_stay_if_another_run_uses_the_folder(plan, tmp_path):
    finish(plan, tmp_path, MadeUp())
    before = files(tmp_path)
    with (
        trial_log(tmp_path / LOG, made_with=made_with(plan.origin)),
        pytest.raises(InputError, match="another run uses"),
    ):
        run_plan(plan, folder=tmp_path, executor=MadeUp(), anew=True)
    assert files(tmp_path) == before


def test_more_trials_and_more_points_use_the_old_ones(plan, tmp_path):
    few = replace(plan, trials=10, points=plan.points[:2], axes=plan.axes[1:])
    few = replace(few, points=tuple(replace(p, labels=p.labels[1:]) for p in few.points))
    finish(few, tmp_path, MadeUp())
    again = MadeUp()
    finish(plan, tmp_path, again)
    assert sum(again.ran.values()) == 4 * plan.trials - 20
    assert load_results(tmp_path / STORE).shape == (2, 2)


@pytest.mark.parametrize("tear", [1, 40])
def test_a_torn_last_line_costs_its_own_trial_alone(plan, tmp_path, tear):
    finish(plan, tmp_path / "a", MadeUp())
    log = tmp_path / "a" / LOG
    log.write_bytes(log.read_bytes()[:-tear])
    again = MadeUp()
    finish(plan, tmp_path / "a", again)
    assert sum(again.ran.values()) == 1
    finish(plan, tmp_path / "b", MadeUp())
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_a_damaged_line_is_not_believed(plan, tmp_path):
    finish(plan, tmp_path, MadeUp())
    log = tmp_path / LOG
    lines = log.read_bytes().splitlines(keepends=True)
    lines[5] = lines[5].replace(b"9.0", b"7.0")
    log.write_bytes(b"".join(lines))
    again = MadeUp()
    finish(plan, tmp_path, again)
    assert sum(again.ran.values()) == 1


def test_a_log_without_its_header_is_refused_in_words(plan, tmp_path):
    path = tmp_path / LOG
    finish(plan, tmp_path, MadeUp())
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[1:]))
    with pytest.raises(InputError, match="were made with unknown versions"):
        finish(plan, tmp_path, MadeUp())


def test_logs_of_one_version_can_be_put_one_after_the_other(plan, tmp_path):
    """Trials of two machines, for example, whose logs begin with equal headers."""
    whole = finish(plan, tmp_path / "whole", MadeUp())
    lines = (tmp_path / "whole" / LOG).read_bytes().splitlines(keepends=True)
    joined = tmp_path / "joined"
    joined.mkdir()
    (joined / LOG).write_bytes(b"".join([*lines[:20], lines[0], *lines[15:]]))
    assert finish(plan, joined, MadeUp()).num_new == 0
    assert whole.num_new == len(lines) - 1
    assert files(joined) == files(tmp_path / "whole")


def test_a_log_of_another_version_behind_is_refused(plan, tmp_path):
    finish(plan, tmp_path, MadeUp())
    other = tmp_path / "other.log"
    with trial_log(other, made_with=HEADER):
        pass
    path = tmp_path / LOG
    path.write_bytes(path.read_bytes() + other.read_bytes())
    with pytest.raises(InputError, match="also holds trials made with polychirp 1 on here"):
        finish(plan, tmp_path, MadeUp())


def test_a_record_comes_back_from_its_line_to_the_bit(tmp_path):
    record = TrialRecord(study_hash="ab", trial=3, seed=5, victims=(made_up(1, 5),))
    odd = replace(record.victims[0], detection_sinr=(1e300, 1 / 3), floor_rise=float("inf"))
    record = replace(record, victims=(odd,))
    with trial_log(tmp_path / LOG, made_with=HEADER) as log:
        log.append(record)
        log.append(record)
    assert list(read_records(tmp_path / LOG)) == [record]


def test_trials_of_other_versions_are_not_mixed(tmp_path):
    with trial_log(tmp_path / LOG, made_with=HEADER):
        pass
    other = HEADER | {"versions": {"polychirp": "2"}}
    with (
        pytest.raises(InputError, match="were made with polychirp 1 on here"),
        trial_log(tmp_path / LOG, made_with=other),
    ):
        pass


def test_two_runs_do_not_share_a_folder(tmp_path):
    pytest.importorskip("fcntl", reason="this system has no locks of files")
    with (
        trial_log(tmp_path / LOG, made_with=HEADER),
        pytest.raises(InputError, match="another run uses"),
        trial_log(tmp_path / LOG, made_with=HEADER),
    ):
        pass


# ── early stop ────────────────────────────────────────────────────────────────


def test_a_point_stops_at_the_first_block_that_is_narrow_enough(plan, tmp_path):
    """The block is found again here from the trials themselves."""
    plan = replace(plan, trials=20 * TRIALS_PER_DECISION, stop_half_width=0.06)
    results = finish(plan, tmp_path, MadeUp()).results
    for point in range(4):
        records = [made_up(point, int(seed)) for seed in results.seed]
        found = np.array([sum(r.is_detected) for r in records], dtype=float)
        seen = np.array([sum(r.is_visible) for r in records], dtype=float)
        stops = [
            n
            for n in range(TRIALS_PER_DECISION, 20 * TRIALS_PER_DECISION + 1, TRIALS_PER_DECISION)
            if n > len(records) or proportion(found[:n], seen[:n]).half_width <= 0.06
        ]
        assert results.num_trials[point] == stops[0]
        assert proportion(found[: stops[0]], seen[: stops[0]]).half_width <= 0.06
    assert len(set(results.num_trials.tolist())) > 1
    assert results.num_trials.max() < 20 * TRIALS_PER_DECISION


@pytest.mark.parametrize("ahead", [1, 3, 64])
def test_where_a_point_stops_does_not_depend_on_how_many_work(plan, tmp_path, ahead):
    plan = replace(plan, trials=10 * TRIALS_PER_DECISION, stop_half_width=0.08)
    finish(plan, tmp_path / "a", MadeUp(ahead=1))
    other = MadeUp(order=ahead, ahead=ahead)
    finish(plan, tmp_path / "b", other)
    assert files(tmp_path / "a") == files(tmp_path / "b")
    # what was at work when the last point stopped is all that was too much
    needed = load_results(tmp_path / "b" / STORE).num_trials.sum()
    assert sum(other.ran.values()) < needed + 2 * ahead


def test_a_single_block_of_hits_is_no_reason_to_stop():
    stopping = Stopping(num_points=1, trials=200, half_width=0.02)
    for trial in range(TRIALS_PER_DECISION):
        stopping.add(0, trial, {"front": (10, 10)})
    assert stopping.limit == [200]


def test_a_victim_without_targets_in_sight_keeps_nobody_waiting():
    stopping = Stopping(num_points=1, trials=1000, half_width=0.1)
    for trial in range(100):
        stopping.add(0, trial, {"front": (1, 1), "blind": (0, 0)})
    assert stopping.limit[0] <= 100


# ── failures ──────────────────────────────────────────────────────────────────


def test_a_trial_that_fails_is_told_with_the_command_that_repeats_it(plan, tmp_path):
    executor = MadeUp()
    executor.failing = {(2, 5)}
    done = finish(plan, tmp_path, executor)
    (failure,) = done.failures
    assert failure.startswith("trial 5 at rcs = 10 dBsm, waveform = conventional: the mast fell")
    assert failure.endswith(f"--seed {done.results.seed[5]}")
    assert np.isnan(done.results.floor_rise[2, 5]).all()
    assert np.isnan(done.results.floor_rise).sum() == 1
    again = MadeUp()
    assert finish(plan, tmp_path, again).failures == ()
    assert set(again.ran) == {(2, 5)}


def test_a_trial_that_no_command_repeats_is_told_with_its_seed(plan, tmp_path):
    executor = MadeUp()
    executor.failing = {(0, 1)}
    points = tuple(replace(point, command=None) for point in plan.points)
    done = finish(replace(plan, points=points), tmp_path, executor)
    (failure,) = done.failures
    seed = done.results.seed[1]
    assert failure.endswith(f"the mast fell over; no command runs it alone; its seed is {seed}")


def test_points_of_one_trial_follow_each_other(plan, tmp_path):
    """They share random numbers, and what a worker keeps of them."""
    executor = MadeUp(ahead=1)
    finish(plan, tmp_path, executor)
    assert list(executor.ran) == [(p, n) for n in range(plan.trials) for p in range(4)]


def test_when_everything_fails_the_rest_is_not_tried(plan, tmp_path):
    executor = MadeUp(ahead=1)
    executor.failing = set(product(range(len(plan.points)), range(plan.trials)))
    with pytest.raises(RunError, match=f"{MOST_FAILURES} trials failed"):
        finish(plan, tmp_path, executor)
    assert sum(executor.ran.values()) == MOST_FAILURES


def test_what_models_warn_of_is_passed_on_once(plan, tmp_path):
    class Warned(MadeUp):
        def run(self, studies, tasks):
            for outcome in super().run(studies, tasks):
                yield replace(outcome, notes=("glass is guessed",))

    with pytest.warns(ModelWarning, match="glass is guessed") as caught:
        finish(plan, tmp_path, Warned())
    assert len(caught) == 1


def test_no_workers_do_nothing():
    with pytest.raises(InputError, match="number of workers is 0; use 1 or more"):
        LocalWorkers(count=0)


def test_workers_that_cannot_begin_are_not_started_for_ever(plan, monkeypatch):
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    tasks = iter([Task(point=0, trial=0, seed=0)])
    with pytest.raises(RunError, match="workers ended before they could begin"):
        next(LocalWorkers(count=2).run([plan.points[0].study], tasks))


# ── results ───────────────────────────────────────────────────────────────────


@pytest.fixture(scope="module")
def done(plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("done")
    return finish(plan, folder, MadeUp()), folder


def test_results_come_back(done):
    results, folder = done[0].results, done[1]
    stored = load_results(folder / STORE)
    assert stored.axes == results.axes
    assert (stored.victim, stored.target) == (("front",), ("near", "far"))
    assert stored.origin == results.origin
    assert stored.study_hash == results.study_hash
    for name in ("detected", "range_error", "num_detections", "floor_rise", "seed", "num_trials"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(results, name))


def test_nan_stands_where_nothing_is(done):
    results = done[0].results
    for trial, seed in enumerate(results.seed):
        record = made_up(3, int(seed))
        for target in range(2):
            place = (3, trial, 0, target)
            assert np.isnan(results.detected[place]) == (not record.is_visible[target])
            assert np.isnan(results.range_error[place]) == (not record.is_detected[target])
    assert not np.isnan(results.range).any()


def test_a_stopped_point_has_no_trials_beyond(plan, tmp_path):
    plan = replace(plan, trials=10 * TRIALS_PER_DECISION, stop_half_width=0.08)
    results = finish(plan, tmp_path, MadeUp(ahead=40)).results
    for point, number in enumerate(results.num_trials):
        was_run = ~np.isnan(results.floor_rise[point, :, 0])
        assert was_run.tolist() == [n < number for n in range(was_run.size)]


def test_the_mean_of_what_is_stored_is_what_is_summed_up(done):
    results = done[0].results
    for point, row in enumerate(summaries(results)):
        seen = results.detected[point]
        assert row.detection.value == pytest.approx(np.nanmean(seen))
        assert row.ghosts.value == point
        assert row.ghost.value == (point > 0)
        assert row.unexplained.value == 0.0
        assert row.range_rmse.value == pytest.approx(ERROR)
        assert row.missed.value * row.num_trials == np.sum(seen == 0.0)


def test_limits_of_two_trials_stay_where_the_truth_can_be(done):
    """Student's factor for two trials is 12.7; the others were not run."""
    results = done[0].results
    detected = np.full_like(results.detected, np.nan)
    detected[:, :2] = [[[1.0, 1.0]], [[0.0, 0.0]]]
    detected[1::2, 1, :, 0] = 1.0
    counts, hidden = results.num_detections.copy(), results.num_out_of_sight.copy()
    counts[:, 2:], hidden[:, 2:] = np.nan, np.nan
    hidden[:, 0] = 1.0
    few = replace(results, detected=detected, num_detections=counts, num_out_of_sight=hidden)
    for row in summaries(few):
        assert row.missed.value > 0.0
        assert 0.0 <= row.missed.low <= row.missed.high <= 2.0
        assert 0.0 <= row.out_of_sight.low <= row.out_of_sight.high <= 2.0
    changes = [row.detection for row in differences(few)]
    assert any(one.value for one in changes)
    assert all(-1.0 <= one.low <= one.high <= 1.0 for one in changes)


def test_limits_of_rms_angles_are_not_beyond_half_a_turn(done):
    """The limit would be above 1000° where one of two trials is 10° wrong, and the other 0.01°."""
    results = done[0].results
    detected = np.full_like(results.detected, np.nan)
    detected[:, :2] = 1.0
    error = np.full_like(results.azimuth_error, np.nan)
    error[:, 0], error[:, 1] = np.radians(10.0), np.radians(0.01)
    error[1::2, 0] = np.radians(60.0)
    counts = results.num_detections.copy()
    counts[:, 2:] = np.nan
    few = replace(
        results,
        detected=detected,
        num_detections=counts,
        azimuth_error=error,
        elevation_error=error,
    )
    for row in summaries(few):
        for angle in (row.azimuth_rmse, row.elevation_rmse):
            assert 0.0 < angle.low < angle.value < angle.high == np.pi
    changes = [row.azimuth_rmse for row in differences(few) if row.axis == "waveform"]
    assert changes
    assert [max(-one.low, one.high) for one in changes] == [np.pi] * len(changes)


def test_errors_of_targets_out_of_sight_are_not_counted(done):
    """A target out of sight that is detected all the same, metres off, changes no rms error."""
    results = done[0].results
    detected, error = results.detected.copy(), results.range_error.copy()
    detected[..., 1] = np.nan
    error[..., 1] = 1.0 + np.arange(len(error))[:, None, None]
    hidden = replace(results, detected=detected, range_error=error)
    assert all(row.range_rmse.value == pytest.approx(ERROR) for row in summaries(hidden))
    assert all(row.range_rmse.value == pytest.approx(0.0) for row in differences(hidden))


def test_differences_are_between_neighbours_on_an_axis(done):
    rows = differences(done[0].results)
    assert [(row.axis, row.labels) for row in rows] == [
        ("rcs", ("10 dBsm", "conventional")),
        ("rcs", ("10 dBsm", "diverse")),
        ("waveform", ("-10 dBsm", "diverse")),
        ("waveform", ("10 dBsm", "diverse")),
    ]
    assert [row.ghosts.value for row in rows] == [2.0, 2.0, 1.0, 1.0]
    assert all(row.detection.high < 0.0 for row in rows)


def test_tables_hold_every_trial_and_say_where_they_come_from(done, plan):
    folder = done[1]
    with (folder / "targets.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 * plan.trials * 2
    assert float(rows[0]["range_m"]) == 9.0
    hidden = [row for row in rows if row["detected"] == ""]
    assert hidden
    assert all(row["range_error_m"] == "" for row in hidden)
    with (folder / "summary.csv").open(encoding="utf-8") as file:
        summary = list(csv.DictReader(file))
    assert [row["study_hash"] for row in summary] == [p.study_hash for p in plan.points]
    origin = json.loads((folder / "provenance.json").read_text(encoding="utf-8"))
    assert origin["study_hash"] == plan.origin.study_hash


def test_no_axis_takes_the_name_of_an_array_or_of_a_column(done):
    """Zarr cannot store two arrays of one name; of two columns, one replaces the other."""
    arrays = axes_of(Results)
    names = {*arrays, *(axis for axes in arrays.values() for axis in axes if axis != "point")}
    for table in ("summary", "differences", "victims", "targets"):
        with (done[1] / f"{table}.csv").open(encoding="utf-8") as file:
            names |= {*next(csv.reader(file))}
    names |= {*study_curves(done[0].results, over="rcs", title="").data}
    for name in sorted(names - {"rcs", "waveform"}):
        with pytest.raises(InputError, match=f"an axis cannot be called '{name}'"):
            Axis(name=name, labels=("a",), changes=((),))


def test_a_key_with_the_name_of_an_array_is_an_axis_with_a_longer_name(tmp_path):
    grid = {"street.road.length": ["80 m", "90 m"], "street.road.lanes": [1]}
    axes = axes_of_grid(MonteCarlo(trials=1, grid=grid))
    assert [axis.name for axis in axes] == ["road_length", "lanes"]
    path = tmp_path / "road.toml"
    road = '[street.road]\nlength = "80 m"\nwidth = "9 m"\n'
    lines = '[monte_carlo]\ntrials = 2\ngrid = { "street.road.length" = ["80 m", "90 m"] }\n'
    path.write_text(f"{SMALL_STUDY}\n{road}\n{lines}", encoding="utf-8")
    done = finish(load_plan(path), tmp_path / "out", MadeUp())
    assert load_results(tmp_path / "out" / STORE).axes == done.results.axes


def test_xarray_reads_results_by_name(done):
    xarray = pytest.importorskip("xarray", reason="xarray is not installed")
    data = xarray.open_zarr(done[1] / STORE)
    assert data.detected.dims == ("rcs", "waveform", "trial", "victim", "target")
    chance = data.detected.sel(waveform="diverse", rcs="10 dBsm").mean(["trial", "target"])
    assert chance.sel(victim="front") == pytest.approx(
        np.nanmean(done[0].results.detected[3]), abs=0.05
    )
    assert data.range_error.attrs["units"] == "m"


def test_a_grid_of_numbers_has_numbers_for_coordinates(tmp_path):
    path = tmp_path / "numbers.toml"
    path.write_text(
        f"{SMALL_STUDY}\n[monte_carlo]\ntrials = 2\ngrid = {{ num_sweeps = [2, 4] }}\n",
        encoding="utf-8",
    )
    finish(load_plan(path), tmp_path / "out", MadeUp())
    assert load_results(tmp_path / "out" / STORE).axes == (("num_sweeps", (2, 4)),)


def test_without_a_grid_there_is_one_point(tmp_path):
    path = tmp_path / "alone.toml"
    path.write_text(f"{SMALL_STUDY}\n[monte_carlo]\ntrials = 3\n", encoding="utf-8")
    finish(load_plan(path), tmp_path / "out", MadeUp())
    stored = load_results(tmp_path / "out" / STORE)
    assert (stored.shape, stored.num_trials.tolist()) == ((), [3])
    assert [row.num_trials for row in summaries(stored)] == [3]


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(InputError, match="there are no results in"):
        load_results(tmp_path / "nothing.zarr")


@pytest.mark.parametrize("lost", ["range_error", "num_trials", "rcs", "victim"])
def test_damaged_results_are_refused(done, tmp_path, lost):
    path = tmp_path / STORE
    shutil.copytree(done[1] / STORE, path)
    shutil.rmtree(path / lost)
    content = json.loads((path / "zarr.json").read_text())
    content["consolidated_metadata"]["metadata"].pop(lost)
    (path / "zarr.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=rf"results in '.*' are damaged \(.*{lost}"):
        load_results(path)


def test_results_that_cannot_be_replaced_stay_whole(plan, tmp_path, monkeypatch):
    finish(plan, tmp_path, MadeUp(order=1))
    before = files(tmp_path)
    with monkeypatch.context() as patch:
        rename = Path.rename
        patch.setattr(
            Path, "rename", lambda a, b: (full_disk if "unfinished" in a.name else rename)(a, b)
        )
        with pytest.raises(RunError, match="cannot be written"):
            finish(plan, tmp_path, MadeUp(order=1))
    assert files(tmp_path) == before
    finish(plan, tmp_path, MadeUp(order=1))
    assert files(tmp_path) == before


def full_disk(*unused, **unused_too):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_table_is_replaced_as_a_whole_or_not_at_all(plan, tmp_path, monkeypatch):
    finish(plan, tmp_path, MadeUp(order=1))
    before = files(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(tables.csv, "writer", full_disk)
        with pytest.raises(RunError, match=r"summary\.csv' cannot be written: No space left.*kept"):
            finish(plan, tmp_path, MadeUp(order=1))
    assert files(tmp_path) == before
    finish(plan, tmp_path, MadeUp(order=1))


class FullFile:
    """A file whose disk is full: what is written cannot be flushed, nor the file closed."""

    def __init__(self, file):
        self._file, self.is_full = file, False

    def __getattr__(self, name):
        return getattr(self._file, name)

    def __iter__(self):
        return iter(self._file)

    def flush(self):
        if self.is_full:
            full_disk()
        self._file.flush()

    def close(self):
        self._file.close()
        if self.is_full:
            full_disk()


def test_a_full_disk_is_one_error_of_the_log(tmp_path, monkeypatch):
    """Closing the file fails again, and must not hide the reason."""
    made = []

    def opened(path, *mode):
        made.append(FullFile(open(path, *mode)))  # noqa: PTH123, SIM115
        return made[-1]

    monkeypatch.setattr(Path, "open", opened)
    record = TrialRecord(study_hash="a", trial=0, seed=1, victims=(made_up(0, 1),))

    def keep_one():
        with trial_log(tmp_path / LOG, made_with=HEADER) as log:
            made[0].is_full = True
            log.append(record)

    with pytest.raises(RunError, match="a finished trial cannot be stored: No space left"):
        keep_one()
    assert made[0]._file.closed


def test_text_of_a_table_is_never_a_formula(plan, tmp_path):
    """Numbers stay numbers; the label '-10 dBsm' is text."""
    finish(plan, tmp_path, MadeUp(order=1))
    with (tmp_path / "victims.csv").open(encoding="utf-8") as file:
        assert {row["rcs"] for row in csv.DictReader(file)} == {"'-10 dBsm", "10 dBsm"}
    with (tmp_path / "targets.csv").open(encoding="utf-8") as file:
        rates = {float(row["range_rate_m_per_s"]) for row in csv.DictReader(file)}
    assert rates == {0.0, -1.0}


@pytest.mark.parametrize(("asked", "trials"), [(100_000, 3), (100_000, 60), (2, 60)])
def test_no_more_workers_start_than_trials_or_than_cores_can_use(plan, monkeypatch, asked, trials):
    started = []

    class Pool:
        def __init__(self, _, tasks, *, count):
            started.append((count, len(list(tasks))))

        def outcomes(self):
            return iter(())

        def kill(self):
            pass

    monkeypatch.setattr(executor, "_Pool", Pool)
    monkeypatch.setattr(executor, "num_cores", lambda: 2)
    tasks = iter([Task(point=0, trial=n, seed=n) for n in range(trials)])
    list(LocalWorkers(count=asked).run([plan.points[0].study], tasks))
    assert started == [(min(asked, trials, 2 * WORKERS_PER_CORE), trials)]


@pytest.mark.parametrize("place", ["http://x", "tcp://", "tcp://head", "tcp://head:x", "ftp://a:1"])
def test_an_address_that_is_none_of_dasks_is_one_sentence(place):
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match=r"--cluster: there is no .* like tcp://10\.0\.0\.1:8786"):
        DaskWorkers(cluster=place, count=1)


def test_an_address_where_nothing_listens_is_refused_at_once(plan):
    """Dask tries it again for 30 s."""
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    workers = DaskWorkers(cluster=f"tcp://127.0.0.1:{port}", count=1)
    tasks = iter([Task(point=0, trial=0, seed=0)])
    start = time.monotonic()
    with pytest.raises(RunError, match=r"nothing answers there .* start its scheduler"):
        list(workers.run([plan.points[0].study], tasks))
    assert time.monotonic() - start < 15.0


def test_a_rule_of_fewer_frames_than_that_of_another_point_has_its_losses():
    """Arrays have as many frames as the longest rule; NaN stands beyond those of the others."""
    lost = np.array([[[1.0, 1.0, 0.0]], [[0.0, 1.0, 0.0]]])
    beyond = np.full((2, 1, 2), np.nan)
    assert losses(np.concatenate([lost, beyond], axis=2)) == losses(lost)
    assert losses(lost)["lost"].value == 0.5
    not_run = np.full((1, 1, 5), np.nan)
    assert losses(np.concatenate([np.concatenate([lost, beyond], axis=2), not_run])) == losses(lost)
    for none in (not_run, lost[:, :, :0]):
        assert all(np.isnan(one.value) for one in losses(none).values())


def test_levels_are_medians_over_visible_targets_found_or_not(plan, tmp_path):
    """SNR 40 and 20 and INR 3 and 1 of two targets: SINR 10 for both, and 30 and 15 mitigated."""
    finish(plan, tmp_path, MadeUp())
    results = load_results(tmp_path / STORE)
    is_seen = np.isfinite(results.detected[0, :, 0])
    for row in summaries(results)[:1]:
        assert row.sinr == 10.0
        assert row.snr == np.median(np.array([40.0, 20.0] * len(is_seen))[is_seen.ravel()])
        assert row.mitigated_sinr == 0.75 * row.snr
        assert row.inr == row.snr / 10.0 - 1.0
