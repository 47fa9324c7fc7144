"""Runs of a measurement: stored frame by frame, continued, and the same in any order."""

from random import Random

import pytest

from polychirp.errors import InputError, RunError
from polychirp.report.figures.roc import curve_data, noise_data, roc_picture
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.monte_carlo.tasks import outcome_of
from polychirp.study.roc.plan import case_name, roc_plan
from polychirp.study.roc.run import LOG, run_roc
from polychirp.study.roc.trial import RocRecord
from tests.support.roc_study import roc_study

ASK = {"snrs_db": [12.0, 16.0], "trials": 4, "noise_trials": 6}


def silent(*_):
    """Progress that nobody sees."""


class Made:
    """An executor with made-up records, in a random order; it may stop after some of them."""

    def __init__(self, seed=1, *, stops_after=None, fails=()):
        self.random, self.stops_after, self.fails = Random(seed), stops_after, fails
        self.num_asked = 0

    def compute(self, work, tasks):
        (plan,) = work.args
        waiting = list(tasks)
        self.random.shuffle(waiting)
        for number, task in enumerate(waiting):
            if number == self.stops_after:
                raise KeyboardInterrupt
            self.num_asked += 1
            yield outcome_of(task, lambda task=task: self.record(plan, task))

    def record(self, plan, task):
        if task.trial in self.fails:
            raise InputError("the mast fell over")
        draw = Random(task.seed + task.point)
        curves = len(plan.curves)
        return RocRecord(
            case=case_name(plan.cases[task.point]),
            trial=task.trial,
            found=tuple(draw.random() < 0.5 for _ in range(curves)),
            others=tuple(draw.randrange(3) for _ in range(curves)),
        )


@pytest.fixture
def plan():
    return roc_plan(roc_study(), probabilities=[1e-3, 1e-5], **ASK)


def run(plan, folder, executor=None, **more):
    return run_roc(plan, folder=folder, executor=executor or Made(), progress=silent, **more)


def files_of(summary):
    drawing = roc_picture(summary, title="a", note="b")
    return drawing.png(), drawing.csv(), curve_data(summary), noise_data(summary)


def test_the_order_of_frames_has_no_effect(plan, tmp_path):
    results = [run(plan, tmp_path / str(seed), Made(seed)) for seed in (1, 2)]
    assert results[0].num_new == 2 * 4 + 6
    first, second = (files_of(result.summary) for result in results)
    assert first[:2] == second[:2]


def test_a_run_that_was_stopped_keeps_its_frames_and_goes_on(plan, tmp_path):
    whole = run(plan, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        run(plan, tmp_path / "part", Made(stops_after=5))
    rest = Made(seed=7)
    again = run(plan, tmp_path / "part", rest)
    assert (rest.num_asked, again.num_new) == (9, 9)
    assert again.summary == whole.summary


def test_a_frame_that_the_log_has_twice_counts_once(plan, tmp_path):
    whole = run(plan, tmp_path)
    log = tmp_path / LOG
    log.write_bytes(2 * log.read_bytes())
    again = run(plan, tmp_path)
    assert (again.num_new, again.summary) == (0, whole.summary)


def test_further_snrs_and_trials_are_added(plan, tmp_path):
    run(plan, tmp_path)
    more = roc_plan(
        roc_study(), probabilities=[1e-3, 1e-5], snrs_db=[12.0, 14.0], trials=5, noise_trials=6
    )
    asked = Made()
    found = run(more, tmp_path, asked)
    assert asked.num_asked == 1 + 5
    assert [point.num_trials for point in found.summary.points] == [5, 5, 5, 5]
    fresh = Made()
    run(more, tmp_path, fresh, anew=True)
    assert fresh.num_asked == 16


def test_a_folder_of_another_measurement_is_refused(plan, tmp_path):
    run(plan, tmp_path)
    other = roc_plan(roc_study(), probabilities=[1e-3], **ASK)
    with pytest.raises(InputError, match=r"measurement \w+\); name another folder with --out"):
        run(other, tmp_path)


def test_frames_that_fail_are_named_and_tried_again(plan, tmp_path):
    with pytest.raises(RunError, match=r"failed: 3; .*noise, trial 2: the mast fell over|dB, "):
        run(plan, tmp_path, Made(fails=(2,)))
    again = Made()
    run(plan, tmp_path, again)
    assert again.num_asked == 3
    assert (tmp_path / LOG).exists()


@pytest.mark.slow
def test_one_worker_and_two_give_the_same_bytes(tmp_path):
    plan = roc_plan(roc_study(), snrs_db=[14.0, 18.0], trials=3, noise_trials=4)
    found = [
        files_of(run(plan, tmp_path / str(count), LocalWorkers(count=count)).summary)
        for count in (1, 2)
    ]
    assert found[0][:2] == found[1][:2]
