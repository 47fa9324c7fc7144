"""`LocalWorkers` — processes on this machine, one thread each."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections import Counter, deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain, groupby, islice
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import IO, Any, Final, cast

from polychirp.errors import InputError, RunError
from polychirp.study.monte_carlo.tasks import (
    MOST_DEATHS,
    ONE_THREAD,
    Outcome,
    Task,
    Work,
    attempt,
)
from polychirp.study.monte_carlo.worker import READY_MESSAGE
from polychirp.study.spec import Study
from polychirp.threads import num_cores

_SHORT_TRIAL: Final = 1.0
"""Duration of a trial, s, below which a worker is given its next trial in advance; chosen."""

WORKERS_PER_CORE: Final = 4
"""Greatest number of processes for each core; chosen. Each takes some 600 MB and has one thread, so
that more than one for each core gain nothing; small machines may have a few more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalWorkers:
    """Worker processes on this machine; a worker that dies is replaced, and its trial runs again.

    A worker runs its tasks in order, so that the task during which it died is known. Consecutive
    tasks of one trial number share random numbers, and results that one worker computes only once:
    they go to the same worker as long as the other workers have tasks of their own.

    `run_plan` and `run_roc` take it as their executor.

    Parameters
    ----------
    count : greatest number of processes; no more start than there are trials, and no more than
        `WORKERS_PER_CORE` for each core
    """

    count: int

    def __post_init__(self) -> None:
        if self.count < 1:
            raise InputError(f"the number of workers is {self.count}; use 1 or more")

    def run(
        self, studies: Sequence[Study], tasks: Iterator[Task]
    ) -> Generator[Outcome, None, None]:
        """Outcomes in the order in which trials finish.

        `RunError` is raised if a worker cannot be started.
        """
        return self.compute(partial(attempt, tuple(studies)), tasks)

    def compute(self, work: Work, tasks: Iterator[Task]) -> Generator[Outcome, None, None]:
        """Outcomes of ``work`` on each task, in the order in which they finish; as `run`."""
        first = list(islice(tasks, min(self.count, WORKERS_PER_CORE * num_cores())))
        pool = _Pool(work, chain(first, tasks), count=len(first))
        try:
            yield from pool.outcomes()
        finally:
            pool.kill()


class _Pool:
    """Workers with their tasks, and tasks that must run again."""

    def __init__(self, work: Work, tasks: Iterator[Task], *, count: int) -> None:
        self._work = work
        self._trials = (group for _, group in groupby(tasks, key=lambda task: task.trial))
        self._again: deque[Task] = deque()
        self._deaths: Counter[Task] = Counter()
        self._news: SimpleQueue[tuple[_Worker, Any]] = SimpleQueue()
        self._duration = _SHORT_TRIAL
        self._failed_starts = 0
        self._workers = [_Worker(work, self._news) for _ in range(count)]

    def outcomes(self) -> Iterator[Outcome]:
        for worker in self._workers:
            self._feed(worker)
        while any(worker.given for worker in self._workers):
            worker, message = self._news.get()
            if message == READY_MESSAGE:
                worker.is_ready, self._failed_starts = True, 0
            elif message is None:
                yield from self._replace(worker)
            else:
                worker.given.popleft()
                self._duration = message.duration
                self._feed(worker)
                yield message

    def kill(self) -> None:
        for worker in self._workers:
            worker.kill()

    def _feed(self, worker: _Worker) -> None:
        """Give a worker its next tasks."""
        while len(worker.given) < (2 if self._duration < _SHORT_TRIAL else 1):
            task = self._again.popleft() if self._again else self._next_task(worker)
            if task is None:
                return
            worker.give(task)

    def _next_task(self, worker: _Worker) -> Task | None:
        """Next task of the worker's trial or of a new one, else the last of the busiest worker."""
        if not worker.ahead:
            worker.ahead.extend(next(self._trials, ()))
        if worker.ahead:
            return worker.ahead.popleft()
        busiest = max(self._workers, key=lambda other: len(other.ahead))
        return busiest.ahead.pop() if busiest.ahead else None

    def _replace(self, worker: _Worker) -> Iterator[Outcome]:
        """Replace a dead worker; its tasks run again."""
        worker.kill()
        self._workers.remove(worker)
        if not worker.is_ready:
            self._failed_starts += 1
            if self._failed_starts >= MOST_DEATHS:
                raise RunError(
                    f"{MOST_DEATHS} workers ended before they could begin; their messages say why. "
                    "Finished trials are kept, and the same command continues with the missing "
                    "trials"
                )
            self._again.extendleft(reversed(worker.given))
        elif worker.given:
            culprit = worker.given.popleft()
            self._again.extendleft(reversed(worker.given))
            self._deaths[culprit] += 1
            if self._deaths[culprit] < MOST_DEATHS:
                self._again.appendleft(culprit)
            else:
                yield Outcome(
                    task=culprit,
                    result=None,
                    failure=f"{MOST_DEATHS} workers died during this trial",
                )
        successor = _Worker(self._work, self._news)
        successor.ahead.extend(worker.ahead)
        self._workers.append(successor)
        for one in self._workers:
            self._feed(one)


class _Worker:
    """A process, and threads that write and read its pipes, so that this process never blocks.

    ``given`` are its tasks without an outcome, ``ahead`` later tasks of the same trial.
    """

    def __init__(self, work: Work, news: SimpleQueue[tuple[_Worker, Any]]) -> None:
        self.given: deque[Task] = deque()
        self.ahead: deque[Task] = deque()
        self.is_ready = False
        self._inbox: SimpleQueue[Any] = SimpleQueue()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "polychirp.study.monte_carlo.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
        )
        self._inbox.put(work)
        Thread(target=self._write, daemon=True).start()
        Thread(target=self._read, args=(news,), daemon=True).start()

    def give(self, task: Task) -> None:
        self.given.append(task)
        self._inbox.put(task)

    def kill(self) -> None:
        self._process.kill()
        self._inbox.put(None)
        self._process.wait()

    def _write(self) -> None:
        # a dead process breaks the pipe; the thread that reads reports its death
        with suppress(OSError), cast("IO[bytes]", self._process.stdin) as pipe:
            while (message := self._inbox.get()) is not None:
                pickle.dump(message, pipe)
                pipe.flush()

    def _read(self, news: SimpleQueue[tuple[_Worker, Any]]) -> None:
        with cast("IO[bytes]", self._process.stdout) as pipe:
            while True:
                try:
                    message = pickle.load(pipe)
                except (EOFError, pickle.UnpicklingError, OSError):
                    news.put((self, None))
                    return
                news.put((self, message))


def _environment() -> dict[str, str]:
    """Environment of a worker: one thread, and the same polychirp as in this process."""
    home = str(Path(__file__).parents[3])
    paths = [home, *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(paths)}
