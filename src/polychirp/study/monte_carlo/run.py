"""Run a plan: what is missing of it, wherever it was left, and the results of the whole."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from polychirp.errors import ModelWarning, RunError
from polychirp.study.kernel_parts import compile_parts, parts_of_all
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.plan import Plan
from polychirp.study.monte_carlo.records import TrialLog, TrialRecord, read_records, trial_log
from polychirp.study.monte_carlo.results import Results, gather, save_results
from polychirp.study.monte_carlo.stopping import Stopping, counts_of
from polychirp.study.monte_carlo.tables import save_tables
from polychirp.study.monte_carlo.tasks import Executor, Outcome, Task
from polychirp.study.provenance import Provenance

LOG: Final = "trials.log"
STORE: Final = "results.zarr"

GIVE_UP: Final = 10
"""Failed trials after which the rest is not tried."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Finished:
    """What a run gave.

    Parameters
    ----------
    results : of all trials, old and new
    num_new : trials that this run did
    failures : of trials, one sentence each with the command that repeats it
    files : names of what is in the folder
    """

    results: Results
    num_new: int
    failures: tuple[str, ...]
    files: tuple[str, ...]


def run_plan(
    plan: Plan,
    *,
    folder: Path,
    executor: Executor,
    progress: Callable[[str, int, int], None],
    anew: bool = False,
) -> Finished:
    """Do the trials that ``folder`` does not have; store results and tables of all.

    A trial is kept as soon as it is finished, so that a run that was killed goes on where it was.
    Trials are kept under the hash of their point's study: points that a later grid shares are not
    run again. Results do not depend on the number of workers, nor on the order of trials.

    Parameters
    ----------
    anew : throw away the trials that ``folder`` has

    Raises
    ------
    InputError
        The folder is in use, or its trials were made with other versions.
    RunError
        It cannot be written, or `GIVE_UP` trials failed.
    """
    log_path = folder / LOG
    stopping = Stopping(
        num_points=len(plan.points), trials=plan.trials, half_width=plan.stop_half_width
    )
    with trial_log(log_path, made_with=made_with(plan.origin), anew=anew) as log:
        run = _Run(plan, stopping, log, _known(plan, log_path, stopping))
        run.finish(executor, progress)
        results = gather(plan, num_trials=stopping.limit, records=read_records(log_path))
        save_results(folder / STORE, results, plan=plan)
        files = save_tables(folder, results)
    return Finished(
        results=results,
        num_new=run.num_new,
        failures=tuple(run.failures),
        files=(STORE, *files, LOG),
    )


def made_with(origin: Provenance) -> Mapping[str, Any]:
    """What trials must have in common to be one result."""
    return {
        "format": "polychirp trials, version 1",
        "versions": origin.versions,
        "platform": origin.platform,
    }


def _known(plan: Plan, path: Path, stopping: Stopping) -> set[tuple[int, int]]:
    """Points and numbers of the trials that were done before."""
    point_of = {point.study_hash: n for n, point in enumerate(plan.points)}
    known = set()
    for record in read_records(path):
        point = point_of.get(record.study_hash)
        if point is not None and record.trial < plan.trials:
            known.add((point, record.trial))
            stopping.add(point, record.trial, counts_of(record.victims))
    return known


class _Run:
    """Trials that are done, and what is still to do."""

    def __init__(
        self, plan: Plan, stopping: Stopping, log: TrialLog, known: set[tuple[int, int]]
    ) -> None:
        self._plan, self._stopping, self._log, self._known = plan, stopping, log, known
        self._noted: set[str] = set()
        self.num_new = 0
        self.failures: list[str] = []

    def finish(self, executor: Executor, progress: Callable[[str, int, int], None]) -> None:
        """Run tasks until every point has what it needs."""
        kept = self._stopping.num_done()
        what = f"trials ({kept} kept)" if kept else "trials"
        total = sum(self._stopping.limit)
        progress(what, 0, total - kept)
        if kept < total:
            studies = [point.study for point in self._plan.points]
            compile_parts(parts_of_all(studies), progress=progress)
            with closing(executor.run(studies, self._tasks())) as outcomes:
                for outcome in outcomes:
                    self._take(outcome)
                    total, done = sum(self._stopping.limit), self._stopping.num_done()
                    progress(what, done - kept, total - kept)
                    if done == total:
                        break

    def _tasks(self) -> Iterator[Task]:
        """Trial by trial, each of all points that still go on."""
        for trial in range(self._plan.trials):
            seed = trial_seed(self._plan.origin.seed, trial)
            for point, limit in enumerate(self._stopping.limit):
                if trial < limit and (point, trial) not in self._known:
                    yield Task(point=point, trial=trial, seed=seed)

    def _take(self, outcome: Outcome) -> None:
        task = outcome.task
        point = self._plan.points[task.point]
        if outcome.victims is None:
            command = f"{point.command} --seed {task.seed}"
            self.failures.append(
                f"trial {task.trial} at {self._plan.where(point)}: {outcome.failure}; repeat it "
                f"with: {command}"
            )
            if len(self.failures) >= GIVE_UP:
                raise RunError(
                    f"{GIVE_UP} trials failed; finished ones are kept. The first: "
                    f"{self.failures[0]}"
                )
            self._stopping.add(task.point, task.trial, None)
            return
        self._log.append(
            TrialRecord(
                study_hash=point.study_hash,
                trial=task.trial,
                seed=task.seed,
                victims=outcome.victims,
            )
        )
        self.num_new += 1
        self._stopping.add(task.point, task.trial, counts_of(outcome.victims))
        for note in outcome.notes:
            if note not in self._noted:
                self._noted.add(note)
                warnings.warn(note, ModelWarning, stacklevel=2)
