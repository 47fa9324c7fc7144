"""`DaskWorkers` — a Dask cluster on this machine, under SLURM, or already running."""

import os
import pickle
import socket
import subprocess
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import chain, islice
from tempfile import NamedTemporaryFile
from typing import Any, Final

from polychirp.errors import CapabilityError, InputError, PolychirpError, RunError
from polychirp.study.monte_carlo.tasks import MOST_DEATHS, ONE_THREAD, Outcome, Task, attempt
from polychirp.study.spec import Study

_BATCH_DURATION: Final = 0.5
"""Duration of the batch in one Dask task, s; chosen: each task costs some further milliseconds."""

_JOB_MEMORY: Final = "4 GB"
"""Memory of a SLURM job if dask-jobqueue is not configured otherwise; chosen."""

_PROTOCOLS: Final = ("tcp", "tls", "ucx", "ws", "wss")
"""Protocols that an address of a Dask scheduler may begin with."""

_ANSWER_TIME: Final = 5.0
"""Time in which a scheduler must take a connection, s; chosen. Dask tries for 30 s, also where
nothing listens."""

_BATCHES_PER_WORKER: Final = 2
"""Batches submitted for each worker; with two, no worker waits for its next batch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DaskWorkers:
    """Workers of a Dask cluster; a worker that dies is replaced, and its trials run again.

    Outcomes come back over the network, so that workers need no common folder; mesh files must
    have the same path on all workers.

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
            raise InputError(f"the number of workers is {self.count}; use 1 or more")
        if self.cluster not in ("local", "slurm") and not _is_address(self.cluster):
            raise InputError(
                f"--cluster: there is no '{self.cluster}'; use local, slurm, or the address of a "
                "Dask scheduler, like tcp://10.0.0.1:8786"
            )
        needed = ["distributed", *(["dask_jobqueue"] if self.cluster == "slurm" else [])]
        if any(find_spec(name) is None for name in needed):
            raise CapabilityError(
                f"--cluster needs these packages: {', '.join(needed)}; not all of them are "
                "installed. Install them with 'pip install polychirp[cluster]', or use --workers, "
                "which does not need them"
            )

    @property
    def _patience(self) -> float | None:
        """Time to wait for the first worker, s; None (no limit) for SLURM, which has a queue."""
        return None if self.cluster == "slurm" else 600.0

    def run(
        self, studies: Sequence[Study], tasks: Iterator[Task]
    ) -> Generator[Outcome, None, None]:
        """Outcomes in the order in which batches finish.

        `RunError` is raised if the cluster cannot be reached, refuses the job, or is lost.
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
            except PolychirpError:
                raise
            except (OSError, TimeoutError, ValueError) as error:
                raise RunError(f"the cluster '{self.cluster}' cannot be used: {error}") from error
            yield from _Batches(client, studies, chain(first, tasks)).outcomes()


def _is_address(text: str) -> bool:
    """True for ``PROTOCOL://HOST:PORT`` with one of `_PROTOCOLS`."""
    protocol, _, place = text.partition("://")
    host, _, port = place.rpartition(":")
    return protocol in _PROTOCOLS and bool(host) and port.isdecimal() and int(port) < 2**16


@contextmanager
def _own_environment() -> Iterator[None]:
    """Restore the environment variables of this process at the end.

    Dask's nannies set the variables of their workers in the process that starts them, and numba
    refuses to compile after a change of the number of threads.
    """
    before = dict(os.environ)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _address(workers: DaskWorkers, stack: ExitStack) -> Any:
    """A cluster that is started for this run, or the address of one that is running."""
    import dask

    threads = {f"distributed.nanny.pre-spawn-environ.{k}": v for k, v in ONE_THREAD.items()}
    stack.enter_context(
        dask.config.set({**threads, "distributed.scheduler.allowed-failures": MOST_DEATHS - 1})
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
                memory=dask.config.get("jobqueue.slurm.memory", None) or _JOB_MEMORY,
                job_script_prologue=[f"export {k}={v}" for k, v in ONE_THREAD.items()],
            )
        )
        _check_job(cluster.job_script())
        # adapt, unlike scale, replaces jobs that end
        cluster.adapt(minimum=workers.count, maximum=workers.count)
        return cluster
    _refuse_silent(workers.cluster)
    return workers.cluster


def _refuse_silent(address: str) -> None:
    """Refuse the address of a scheduler where nothing takes a connection."""
    protocol, _, place = address.partition("://")
    host, _, port = place.rpartition(":")
    if protocol == "ucx":  # does not go over sockets
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_ANSWER_TIME).close()
    except OSError as error:
        raise RunError(
            f"the cluster '{address}' cannot be used: nothing answers there ({error}); start its "
            "scheduler with 'dask scheduler', or correct the address"
        ) from error


def _check_job(script: str) -> None:
    """Refuse a job that SLURM would not accept; dask-jobqueue would submit it again for ever."""
    with NamedTemporaryFile("w", suffix=".sh", encoding="utf-8") as file:
        file.write(script)
        file.flush()
        try:
            asked = subprocess.run(
                ["sbatch", "--test-only", file.name], capture_output=True, text=True, check=False
            )
        except FileNotFoundError:
            raise InputError(
                "--cluster slurm: the command sbatch is not found; run polychirp on a node that "
                "has SLURM's commands"
            ) from None
    if asked.returncode != 0:
        why = " ".join(asked.stderr.split()).removeprefix("sbatch: error: ")
        raise InputError(
            f"--cluster slurm: SLURM refuses the job: {why}. Queue, account, memory and time "
            "are set in dask-jobqueue's configuration, under jobqueue.slurm"
        )


class _Batches:
    """Batches of tasks on the cluster, and tasks that must run again."""

    def __init__(self, client: Any, studies: Sequence[Study], tasks: Iterator[Task]) -> None:
        self._client = client
        self._tasks = tasks
        self._again: deque[Task] = deque()
        self._duration = _BATCH_DURATION
        # if the worker that holds them dies, Dask makes them again; scattered data would be lost
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
        wanted = _BATCHES_PER_WORKER * max(1, sum(self._client.nthreads().values()))
        while out.count() < wanted:
            size = max(1, int(_BATCH_DURATION / max(self._duration, 1e-3)))
            # tasks of a batch that killed a worker run alone, so that the culprit is known
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
                failure = f"{MOST_DEATHS} workers died during this trial"
                return [Outcome(task=batch[0], result=None, failure=failure)]
            self._again.extend(batch)
            return []
        except Exception as error:
            raise RunError(
                f"the cluster is lost ({type(error).__name__}: {error}); finished trials are kept, "
                "and the same command continues with the missing trials"
            ) from error
        self._duration = sum(outcome.duration for outcome in outcomes) / len(outcomes)
        return outcomes


def _attempts(studies: Sequence[Study], batch: Sequence[Task]) -> list[Outcome]:
    """Outcomes of a batch, computed by a worker."""
    return [attempt(studies, task) for task in batch]
