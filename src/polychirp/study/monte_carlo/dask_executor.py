"""`DaskWorkers` — a Dask cluster: on this machine, under SLURM, or one that is there already."""

from __future__ import annotations

import os
import pickle
import subprocess
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import chain, islice
from tempfile import NamedTemporaryFile
from typing import Any, Final

from polychirp.errors import CapabilityError, InputError, RunError
from polychirp.study.monte_carlo.tasks import ONE_THREAD, PATIENCE, Outcome, Task, attempt
from polychirp.study.spec import Study

_BATCH_DURATION: Final = 0.5
"""s of work in one task of the cluster, which costs some milliseconds of its own."""

_MEMORY: Final = "4 GB"
"""Of a SLURM job, where dask-jobqueue is not configured otherwise."""

_PROTOCOLS: Final = ("tcp", "tls", "ucx", "ws", "wss")
"""Protocols that an address of a Dask scheduler may begin with."""

_AHEAD: Final = 2
"""Batches for every worker, so that none waits for the next."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DaskWorkers:
    """Workers of a Dask cluster; one that dies is replaced, and its trials run again.

    Outcomes come back over the network, so that workers need no common folder; mesh files must
    lie at the same place for all.

    Parameters
    ----------
    cluster : "local"; "slurm", jobs of one core, with queue, account, time and memory as
        dask-jobqueue is configured; or the address of a scheduler
    count : number of workers to start; no more start than there are trials
    """

    cluster: str
    count: int

    def __post_init__(self) -> None:
        if self.count < 1:
            raise InputError(f"{self.count} workers do nothing; use 1 or more")
        if self.cluster not in ("local", "slurm") and not _is_address(self.cluster):
            raise InputError(
                f"--cluster: there is no '{self.cluster}'; use local, slurm, or the address of a "
                "Dask scheduler, like tcp://10.0.0.1:8786"
            )
        needed = ["distributed", *(["dask_jobqueue"] if self.cluster == "slurm" else [])]
        if any(find_spec(name) is None for name in needed):
            raise CapabilityError(
                f"--cluster needs {' and '.join(needed)}, which are not installed; "
                "'pip install polychirp[cluster]' installs them, and --workers does without"
            )

    @property
    def _patience(self) -> float | None:
        """S, to wait for the first worker; a queue takes its time."""
        return None if self.cluster == "slurm" else 600.0

    def run(
        self, studies: Sequence[Study], tasks: Iterator[Task]
    ) -> Generator[Outcome, None, None]:
        """Outcomes as they come.

        Raises
        ------
        RunError
            The cluster cannot be reached, refuses the job, or is lost.
        """
        from distributed import Client

        first = list(islice(tasks, self.count))
        if not first:
            return
        with ExitStack() as stack:
            stack.enter_context(_own_environment())
            try:
                address = _address(replace(self, count=len(first)), stack)
                client = stack.enter_context(Client(address, timeout=30))
                client.wait_for_workers(1, timeout=self._patience)
            except (OSError, TimeoutError, ValueError) as error:
                raise RunError(f"the cluster '{self.cluster}' cannot be used: {error}") from error
            yield from _Batches(client, studies, chain(first, tasks)).outcomes()


def _is_address(text: str) -> bool:
    """True for ``PROTOCOL://HOST:PORT`` with a protocol that Dask's schedulers speak."""
    protocol, _, place = text.partition("://")
    host, _, port = place.rpartition(":")
    return protocol in _PROTOCOLS and bool(host) and port.isdecimal() and int(port) < 2**16


@contextmanager
def _own_environment() -> Iterator[None]:
    """The environment is afterwards what it was, whatever was set meanwhile.

    Dask's nannies set what their workers are to have in the process that starts them, and numba
    refuses to compile after a change of the number of threads.
    """
    before = dict(os.environ)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _address(workers: DaskWorkers, stack: ExitStack) -> Any:
    """A cluster that was started for this run, or the address of another."""
    import dask

    threads = {f"distributed.nanny.pre-spawn-environ.{k}": v for k, v in ONE_THREAD.items()}
    stack.enter_context(
        dask.config.set({**threads, "distributed.scheduler.allowed-failures": PATIENCE - 1})
    )
    if workers.cluster == "local":
        from distributed import LocalCluster

        return stack.enter_context(
            LocalCluster(
                n_workers=workers.count,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs="ERROR",
            )
        )
    if workers.cluster == "slurm":
        from dask_jobqueue import SLURMCluster

        cluster = stack.enter_context(
            SLURMCluster(
                cores=1,
                processes=1,
                memory=dask.config.get("jobqueue.slurm.memory", None) or _MEMORY,
                job_script_prologue=[f"export {k}={v}" for k, v in ONE_THREAD.items()],
            )
        )
        _check_job(cluster.job_script())
        # unlike scale, it replaces jobs that end
        cluster.adapt(minimum=workers.count, maximum=workers.count)
        return cluster
    return workers.cluster


def _check_job(script: str) -> None:
    """Ask SLURM whether it would take the job: those that it refuses are tried for ever."""
    with NamedTemporaryFile("w", suffix=".sh", encoding="utf-8") as file:
        file.write(script)
        file.flush()
        try:
            asked = subprocess.run(
                ["sbatch", "--test-only", file.name], capture_output=True, text=True, check=False
            )
        except FileNotFoundError:
            raise InputError(
                "--cluster slurm: there is no sbatch here; run it where SLURM's commands are"
            ) from None
    if asked.returncode != 0:
        why = " ".join(asked.stderr.split()).removeprefix("sbatch: error: ")
        raise InputError(
            f"--cluster slurm: SLURM refuses the job: {why}. Queue, account, memory and time "
            "are set in dask-jobqueue's configuration, under jobqueue.slurm"
        )


class _Batches:
    """Batches of tasks that are out, and those to be done again."""

    def __init__(self, client: Any, studies: Sequence[Study], tasks: Iterator[Task]) -> None:
        self._client = client
        self._tasks = tasks
        self._again: deque[Task] = deque()
        self._duration = _BATCH_DURATION
        # made anew from its bytes where a worker dies that held it, unlike what is scattered
        self._studies = client.submit(pickle.loads, pickle.dumps(tuple(studies)))

    def outcomes(self) -> Iterator[Outcome]:
        from distributed import as_completed

        out = as_completed()
        self._feed(out)
        while out.count():
            future = next(out)
            outcomes = self._outcomes_of(future)
            self._feed(out)
            yield from outcomes

    def _feed(self, out: Any) -> None:
        wanted = _AHEAD * max(1, sum(self._client.nthreads().values()))
        while out.count() < wanted:
            size = max(1, int(_BATCH_DURATION / max(self._duration, 1e-3)))
            # what killed a worker goes alone, so that it is known
            batch = [self._again.popleft()] if self._again else [*islice(self._tasks, size)]
            if not batch:
                return
            future = self._client.submit(_attempts, self._studies, batch, pure=False)
            future.batch = batch
            out.add(future)

    def _outcomes_of(self, future: Any) -> list[Outcome]:
        from distributed import KilledWorker

        batch: list[Task] = future.batch
        try:
            outcomes: list[Outcome] = future.result()
        except KilledWorker:
            if len(batch) == 1:
                failure = f"{PATIENCE} workers died of it"
                return [Outcome(task=batch[0], victims=None, failure=failure)]
            self._again.extend(batch)
            return []
        except Exception as error:
            raise RunError(
                f"the cluster is lost ({type(error).__name__}: {error}); finished trials are kept, "
                "and the same command goes on"
            ) from error
        self._duration = sum(outcome.duration for outcome in outcomes) / len(outcomes)
        return outcomes


def _attempts(studies: Sequence[Study], batch: Sequence[Task]) -> list[Outcome]:
    """What a worker does with a batch."""
    return [attempt(studies, task) for task in batch]
