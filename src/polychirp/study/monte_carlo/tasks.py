"""What executors are given, and what they give back."""

from __future__ import annotations

import time
import warnings
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from polychirp.errors import ModelWarning, PolychirpError
from polychirp.study.monte_carlo.records import VictimRecord, victim_records
from polychirp.study.spec import Study

PATIENCE: Final = 3
"""So many workers may die of one trial before it is given up."""

ONE_THREAD: Final = {
    "NUMBA_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
}
"""Environment of a worker: as many workers as cores, each with one thread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One trial to run.

    Parameters
    ----------
    point : number of its study among those that the executor was given
    trial : its number, for whoever gave the task
    seed : of the study
    """

    point: int
    trial: int
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of a task.

    Parameters
    ----------
    victims : what was found; None where the trial failed
    failure : why, in one sentence
    notes : what models warned of
    duration : s
    """

    task: Task
    victims: tuple[VictimRecord, ...] | None
    failure: str = ""
    notes: tuple[str, ...] = ()
    duration: float = 0.0


class Executor(Protocol):
    """Runs tasks somewhere; a worker that dies loses no trial."""

    def run(
        self, studies: Sequence[Study], tasks: Iterator[Task]
    ) -> Generator[Outcome, None, None]:
        """Outcomes in whatever order they come; ``tasks`` is asked as workers become free.

        Closing the generator ends all work.
        """


def attempt(studies: Sequence[Study], task: Task) -> Outcome:
    """Run one trial here; whatever it raises becomes its outcome's failure."""
    from dataclasses import replace

    from polychirp.study.trial import run_trial

    start = time.perf_counter()
    victims: tuple[VictimRecord, ...] | None = None
    failure = ""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            victims = victim_records(run_trial(replace(studies[task.point], seed=task.seed)))
        except PolychirpError as error:
            failure = str(error)
        except Exception as error:  # a fault of ours must not end the other trials
            failure = f"{type(error).__name__}: {error}"
    notes = [str(entry.message) for entry in caught if issubclass(entry.category, ModelWarning)]
    return Outcome(
        task=task,
        victims=victims,
        failure=failure,
        notes=tuple(dict.fromkeys(notes)),
        duration=time.perf_counter() - start,
    )
