"""Tasks and outcomes of executors, and the functions that run a task."""

import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

from polychirp.errors import ModelWarning, PolychirpError
from polychirp.study.monte_carlo.records import VictimRecord, victim_records
from polychirp.study.recent_results import RecentResults
from polychirp.study.spec import Study

MOST_DEATHS: Final = 3
"""Number of workers that die during one trial at which the trial counts as failed; chosen. If as
many in a row die before they are ready for a task, the run stops."""

ONE_THREAD: Final = {
    "NUMBA_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
}
"""Environment variables that give a worker one thread: by default, there is a worker per core."""


_TRACES: Final = RecentResults(most=4)
"""Paths of the last trials of this process. Workers take all points of one trial in a row, so that
points that differ in waveform, mitigation or receiver alone share a tracing; four differ in more
(chosen)."""

_SIGNALS: Final = RecentResults(
    most=16,
    most_bytes=256e6,
    size_of=lambda received: sum(one.samples.nbytes for one in received),
)
"""Signals that radars of the last trials received, which points that differ in mitigation or
receiver alone share. Chosen: eight radars of the paper's street take 40 MB each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One trial to run.

    Parameters
    ----------
    point : number of the point, whose study has this index in the executor's list
    trial : number of the trial, from 0
    seed : seed of the trial
    """

    point: int
    trial: int
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Result of a task.

    Parameters
    ----------
    result : what the task computes, for a trial of a study the record of each victim; None if it
        failed
    failure : reason of a failure, in one sentence; else empty
    notes : warnings of the models
    duration : time that the trial took, s
    """

    task: Task
    result: Any
    failure: str = ""
    notes: tuple[str, ...] = ()
    duration: float = 0.0


class Executor(Protocol):
    """An executor runs tasks on workers; if a worker dies, its tasks run again."""

    def run(
        self, studies: Sequence[Study], tasks: Iterator[Task]
    ) -> Generator[Outcome, None, None]:
        """Outcomes in any order; tasks are taken from the iterator when workers become free.

        Closing the generator ends all work.
        """


Work = Callable[[Task], Outcome]
"""Function that computes a task; it can be pickled, so that a worker process has it."""


def attempt(studies: Sequence[Study], task: Task) -> Outcome:
    """Run one trial in this process; an exception becomes the failure of the outcome."""

    def records() -> tuple[VictimRecord, ...]:
        from polychirp.study.trial import run_trial

        one = replace(studies[task.point], seed=task.seed)
        return victim_records(run_trial(one, names_radars=False, traces=_TRACES, signals=_SIGNALS))

    return outcome_of(task, records)


def outcome_of(task: Task, compute: Callable[[], Any]) -> Outcome:
    """Outcome of ``compute``, with its duration and notes; an exception becomes the failure."""
    start = time.perf_counter()
    result = None
    failure = ""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result = compute()
        except PolychirpError as error:
            failure = str(error)
        except Exception as error:  # a bug in one trial must not end the others
            failure = f"{type(error).__name__}: {error}"
    notes = [str(entry.message) for entry in caught if issubclass(entry.category, ModelWarning)]
    return Outcome(
        task=task,
        result=result,
        failure=failure,
        notes=tuple(dict.fromkeys(notes)),
        duration=time.perf_counter() - start,
    )
