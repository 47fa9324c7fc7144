"""Run the trials of a plan that have no record yet, and store the results of all its trials."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from polychirp.errors import ModelWarning, RunError
from polychirp.model.baseband import Progress, no_progress
from polychirp.study.kernel_parts import compile_parts, parts_of_all
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.plan import Plan
from polychirp.study.monte_carlo.records import TrialLog, TrialRecord, read_records, trial_log
from polychirp.study.monte_carlo.results import Results, gather, save_results
from polychirp.study.monte_carlo.stopping import Stopping, counts_of
from polychirp.study.monte_carlo.tables import FILES, save_tables
from polychirp.study.monte_carlo.tasks import Executor, Outcome, Task
from polychirp.study.provenance import Provenance

LOG: Final = "trials.log"
STORE: Final = "results.zarr"
"""Names of the log of trials and of the store of results, in the folder of a run."""

MOST_FAILURES: Final = 10
"""Number of failed trials in one run at which the run stops; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Finished:
    """Result of a run.

    `run_plan` returns it.

    Parameters
    ----------
    results : results of all trials, of this run and of earlier ones
    num_new : number of trials that this run added
    failures : for each failed trial, one sentence, with a command that repeats it if there is one
    files : names of the files that the run wrote in its folder
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
    progress: Progress = no_progress,
    anew: bool = False,
    drawn: Iterable[Path] = (),
) -> Finished:
    """Run the trials of which ``folder`` has no record; store results and tables of all trials.

    A trial is stored as soon as it is finished, so that the next run continues a run that was
    killed. Trials are stored under the hash of the study of their point, so that points that a
    later grid shares are not run again. Results depend neither on the number of workers nor on the
    order of trials.

    `load_plan` makes the plan; `LocalWorkers` are an executor on this machine.

    Parameters
    ----------
    anew : True to remove the trials and results that ``folder`` has, and ``drawn``, before the run
    drawn : files that were made from the results

    Raises
    ------
    InputError
        Another run uses the folder, or its trials have other versions or another platform.
    RunError
        The folder cannot be written, or `MOST_FAILURES` trials failed.
    """
    log_path = folder / LOG
    stopping = Stopping(
        num_points=len(plan.points), trials=plan.trials, half_width=plan.stop_half_width
    )
    results_of_log = [*(folder / name for name in (STORE, *FILES)), *drawn]
    with trial_log(
        log_path, made_with=made_with(plan.origin), anew=anew, results=results_of_log
    ) as log:
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
    """Format, versions and platform, which all trials in one log must share."""
    return {
        "format": "polychirp trials, version 7",
        "versions": origin.versions,
        "platform": origin.platform,
    }


def _known(plan: Plan, path: Path, stopping: Stopping) -> set[tuple[int, int]]:
    """Point and trial number of the plan's trials in the log; they are added to ``stopping``."""
    point_of = {point.study_hash: n for n, point in enumerate(plan.points)}
    known = set()
    for record in read_records(path):
        point = point_of.get(record.study_hash)
        if point is not None and record.trial < plan.trials:
            known.add((point, record.trial))
            stopping.add(point, record.trial, counts_of(record.victims))
    return known


class _Run:
    """One run: it hands missing trials to an executor and logs their outcomes."""

    def __init__(
        self, plan: Plan, stopping: Stopping, log: TrialLog, known: set[tuple[int, int]]
    ) -> None:
        self._plan, self._stopping, self._log, self._known = plan, stopping, log, known
        self._noted: set[str] = set()
        self.num_new = 0
        self.failures: list[str] = []

    def finish(self, executor: Executor, progress: Callable[[str, int, int], None]) -> None:
        """Run tasks until every point has as many trials as ``stopping`` demands."""
        kept = self._stopping.num_done()
        what = f"trials ({kept} from earlier runs)" if kept else "trials"
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
        """Missing tasks, trial by trial; each trial number for all points that have not stopped."""
        for trial in range(self._plan.trials):
            seed = trial_seed(self._plan.origin.seed, trial)
            for point, limit in enumerate(self._stopping.limit):
                if trial < limit and (point, trial) not in self._known:
                    yield Task(point=point, trial=trial, seed=seed)

    def _take(self, outcome: Outcome) -> None:
        task = outcome.task
        point = self._plan.points[task.point]
        if outcome.result is None:
            repeated = f"repeat it with: {point.command} --seed {task.seed}"
            if point.command is None:
                repeated = f"no command runs it alone; its seed is {task.seed}"
            self.failures.append(
                f"trial {task.trial} at {self._plan.where(point)}: {outcome.failure}; {repeated}"
            )
            if len(self.failures) >= MOST_FAILURES:
                raise RunError(
                    f"{MOST_FAILURES} trials failed; finished trials are kept. The first failure: "
                    f"{self.failures[0]}"
                )
            self._stopping.add(task.point, task.trial, None)
            return
        self._log.append(
            TrialRecord(
                study_hash=point.study_hash,
                trial=task.trial,
                seed=task.seed,
                victims=outcome.result,
            )
        )
        self.num_new += 1
        self._stopping.add(task.point, task.trial, counts_of(outcome.result))
        for note in outcome.notes:
            if note not in self._noted:
                self._noted.add(note)
                warnings.warn(note, ModelWarning, stacklevel=2)
