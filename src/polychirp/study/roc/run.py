"""Run the frames of a plan that have no record yet, and summarise those of all its frames."""

import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from polychirp.errors import ModelWarning, RunError
from polychirp.model.baseband import Progress, no_progress
from polychirp.study.kernel_parts import compile_parts, parts_of_all
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.records import TrialLog, read_contents, trial_log
from polychirp.study.monte_carlo.run import MOST_FAILURES, made_with
from polychirp.study.monte_carlo.tasks import Outcome, Task
from polychirp.study.roc.plan import RocPlan, case_name
from polychirp.study.roc.summary import RocSummary, summary_of
from polychirp.study.roc.trial import RocRecord, attempt_frame

LOG: Final = "frames.log"
"""Name of the log of frames, in the folder of a run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RocResult:
    """Result of a run.

    `run_roc` returns it.

    Parameters
    ----------
    summary : estimates from the frames of this run and of earlier ones
    num_new : number of frames that this run added
    """

    summary: RocSummary
    num_new: int


def run_roc(
    plan: RocPlan,
    *,
    folder: Path,
    executor: LocalWorkers,
    progress: Progress = no_progress,
    anew: bool = False,
    results: Iterable[Path] = (),
) -> RocResult:
    """Compute the frames of which ``folder`` has no record; summarise the records of all frames.

    A frame's record is stored as soon as the frame is read, so that the next run continues a run
    that was stopped. Further SNRs and trials are added to those that the folder has. Results depend
    neither on the number of workers nor on the order of frames.

    `roc_plan` makes the plan.

    Parameters
    ----------
    anew : True to remove the records that ``folder`` has, and before them ``results``
    results : files that were made from the records

    Raises
    ------
    InputError
        Another run uses the folder, or its records are of another plan, version or platform.
    RunError
        The folder cannot be written, or a frame failed.
    """
    path = folder / LOG
    with trial_log(path, made_with=_made_with(plan), anew=anew, results=results) as log:
        known = {(record.case, record.trial) for record in _records(path)}
        missing = [task for task in _tasks(plan) if _key(plan, task) not in known]
        _compute(plan, missing, log, executor, progress)
        summary = summary_of(plan, _records(path))
    return RocResult(summary=summary, num_new=len(missing))


def _made_with(plan: RocPlan) -> dict[str, Any]:
    label = f"polychirp roc, version 1, of measurement {plan.key[:8]}"
    return {**made_with(plan.origin), "format": label}


def _key(plan: RocPlan, task: Task) -> tuple[str, int]:
    return case_name(plan.cases[task.point]), task.trial


def _tasks(plan: RocPlan) -> Iterator[Task]:
    """All frames: trial by trial, each for all cases, so that a run that is stopped has of each."""
    for trial in range(max(plan.trials, plan.noise_trials)):
        seed = trial_seed(plan.study.seed, trial)
        for case in range(len(plan.cases)):
            if trial < plan.num_trials(case):
                yield Task(point=case, trial=trial, seed=seed)


def _records(path: Path) -> Iterator[RocRecord]:
    """Every record of the log, each once."""
    records = map(RocRecord.of, read_contents(path))
    return iter({(record.case, record.trial): record for record in records}.values())


def _compute(
    plan: RocPlan,
    tasks: list[Task],
    log: TrialLog,
    executor: LocalWorkers,
    progress: Callable[[str, int, int], None],
) -> None:
    progress("frames", 0, len(tasks))
    if not tasks:
        return
    studies = [replace(plan.study, receiver=curve.receiver) for curve in plan.curves]
    compile_parts(parts_of_all(studies), progress=progress)
    noted: set[str] = set()
    failures: list[str] = []
    done = 0
    with closing(executor.compute(partial(attempt_frame, plan), iter(tasks))) as outcomes:
        for outcome in outcomes:
            done += 1
            if outcome.result is None:
                failures.append(_failure(plan, outcome))
            else:
                log.append(outcome.result)
            for note in outcome.notes:
                if note not in noted:
                    noted.add(note)
                    warnings.warn(note, ModelWarning, stacklevel=2)
            progress("frames", done, len(tasks))
            if len(failures) >= MOST_FAILURES:
                break
    if failures:
        raise RunError(
            f"frames that failed: {len(failures)}; the others are kept, and the same command tries "
            f"again. The first failure: {failures[0]}"
        )


def _failure(plan: RocPlan, outcome: Outcome) -> str:
    case, trial = _key(plan, outcome.task)
    return f"{case}, trial {trial}: {outcome.failure}"
