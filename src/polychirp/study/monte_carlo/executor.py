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
from itertools import chain, groupby, islice
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import IO, Any, Final, cast

from polychirp.errors import InputError, RunError
from polychirp.study.monte_carlo.tasks import ONE_THREAD, PATIENCE, Outcome, Task
from polychirp.study.monte_carlo.worker import READY
from polychirp.study.spec import Study


def num_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


_SHORT: Final = 1.0
"""s: a worker at trials as short as this has its next one waiting."""

WORKERS_PER_CORE: Final = 4
"""Most processes that are started for each core. Each takes some 600 MB and one thread, so that
more than one for each core gains nothing; chosen so that small machines may have a few more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalWorkers:
    """So many worker processes; one that dies is replaced, and its trial runs again.

    A trial goes to a worker when it is free, and its outcome comes back at once. The worker does
    its tasks in their order, so that when it dies it is known of which. Tasks of one trial number
    that follow each other stay with one worker as long as there are others for the rest: they have
    their random numbers in common, and with them much that is worked out once.

    Parameters
    ----------
    count : of processes; fewer start if there are fewer trials, or if they were more than
        `WORKERS_PER_CORE` for each core
    """

    count: int

    def __post_init__(self) -> None:
        if self.count < 1:
            raise InputError(f"{self.count} workers do nothing; use 1 or more")

    def run(
        self, studies: Sequence[Study], tasks: Iterator[Task]
    ) -> Generator[Outcome, None, None]:
        """Outcomes as they come.

        Raises
        ------
        RunError
            A worker cannot be started.
        """
        first = list(islice(tasks, min(self.count, WORKERS_PER_CORE * num_cores())))
        pool = _Pool(studies, chain(first, tasks), count=len(first))
        try:
            yield from pool.outcomes()
        finally:
            pool.kill()


class _Pool:
    """Workers, what they are at, and what is to be done again."""

    def __init__(self, studies: Sequence[Study], tasks: Iterator[Task], *, count: int) -> None:
        self._studies = tuple(studies)
        self._trials = (group for _, group in groupby(tasks, key=lambda task: task.trial))
        self._again: deque[Task] = deque()
        self._deaths: Counter[Task] = Counter()
        self._news: SimpleQueue[tuple[_Worker, Any]] = SimpleQueue()
        self._duration = _SHORT
        self._stillborn = 0
        self._workers = [_Worker(self._studies, self._news) for _ in range(count)]

    def outcomes(self) -> Iterator[Outcome]:
        for worker in self._workers:
            self._feed(worker)
        while any(worker.at for worker in self._workers):
            worker, message = self._news.get()
            if message == READY:
                worker.is_ready, self._stillborn = True, 0
            elif message is None:
                yield from self._bury(worker)
            else:
                worker.at.popleft()
                self._duration = message.duration
                self._feed(worker)
                yield message

    def kill(self) -> None:
        for worker in self._workers:
            worker.kill()

    def _feed(self, worker: _Worker) -> None:
        """Give a worker what keeps it busy."""
        while len(worker.at) < (2 if self._duration < _SHORT else 1):
            task = self._again.popleft() if self._again else self._next_of(worker)
            if task is None:
                return
            worker.give(task)

    def _next_of(self, worker: _Worker) -> Task | None:
        """Of the trial it is at; of a new one; or the last that another has before it."""
        if not worker.ahead:
            worker.ahead.extend(next(self._trials, ()))
        if worker.ahead:
            return worker.ahead.popleft()
        busiest = max(self._workers, key=lambda other: len(other.ahead))
        return busiest.ahead.pop() if busiest.ahead else None

    def _bury(self, worker: _Worker) -> Iterator[Outcome]:
        """Put another in the place of a dead worker; its trials run again."""
        worker.kill()
        self._workers.remove(worker)
        if not worker.is_ready:
            self._stillborn += 1
            if self._stillborn >= PATIENCE:
                raise RunError(
                    f"{PATIENCE} workers ended before they could begin, which their own messages "
                    "should explain; finished trials are kept, and the same command goes on"
                )
            self._again.extendleft(reversed(worker.at))
        elif worker.at:
            culprit = worker.at.popleft()
            self._again.extendleft(reversed(worker.at))
            self._deaths[culprit] += 1
            if self._deaths[culprit] < PATIENCE:
                self._again.appendleft(culprit)
            else:
                yield Outcome(task=culprit, victims=None, failure=f"{PATIENCE} workers died of it")
        successor = _Worker(self._studies, self._news)
        successor.ahead.extend(worker.ahead)
        self._workers.append(successor)
        for one in self._workers:
            self._feed(one)


class _Worker:
    """A process, and the threads that talk to it so that nobody waits for anybody.

    ``at`` it has been given, ``ahead`` are tasks of the same trial that it is to get.
    """

    def __init__(self, studies: Sequence[Study], news: SimpleQueue[tuple[_Worker, Any]]) -> None:
        self.at: deque[Task] = deque()
        self.ahead: deque[Task] = deque()
        self.is_ready = False
        self._inbox: SimpleQueue[Any] = SimpleQueue()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "polychirp.study.monte_carlo.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
        )
        self._inbox.put(tuple(studies))
        Thread(target=self._write, daemon=True).start()
        Thread(target=self._read, args=(news,), daemon=True).start()

    def give(self, task: Task) -> None:
        self.at.append(task)
        self._inbox.put(task)

    def kill(self) -> None:
        self._process.kill()
        self._inbox.put(None)
        self._process.wait()

    def _write(self) -> None:
        # a dead one takes nothing more; its reader says so
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
    """One thread, and the polychirp that is running, wherever it lies."""
    home = str(Path(__file__).parents[3])
    paths = [home, *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(paths)}
