"""Parallel work in threads: independent pieces of work, and the rows of one kernel's result.

Kernels release the interpreter while they run; the code between them does not. Two pieces therefore
keep two cores busy, while one piece with its kernels in two threads keeps one and a half busy,
since a second thread hardly makes small kernels faster. Linear algebra runs in one thread
(`one_blas_thread`), because its matrices are small, and its waiting threads would take the cores of
other pieces.
"""

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from typing import Any, Final, TypeVar

Result = TypeVar("Result")

MOST_PIECES_AT_ONCE: Final = 4
"""Greatest number of pieces that run at once (chosen: each has its own tables in memory)."""

RANGES_PER_CORE: Final = 2
"""Ranges of rows per core (chosen: more than 1, since some rows take longer than others)."""


def num_cores() -> int:
    """Number of cores that this process may use."""
    # not every system knows which cores a process may use
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Share(threading.local):
    cores: int | None = None


_share = _Share()


def cores_here() -> int:
    """Number of cores for this thread's kernels: the thread's share, or all of the process.

    The environment variable ``NUMBA_NUM_THREADS`` may name a smaller number for the process.
    """
    return _share.cores or min(num_cores(), int(os.environ.get("NUMBA_NUM_THREADS") or num_cores()))


def limit_cores(count: int | None) -> None:
    """Limit the kernels of this thread to ``count`` cores; None removes the limit."""
    _share.cores = count


def side_by_side(pieces: Sequence[Callable[[], Result]]) -> Iterator[Result]:
    """Results of ``pieces``, in their order; after an error in one, no further piece begins.

    >>> list(side_by_side([lambda: 1, lambda: 2]))
    [1, 2]
    """
    cores = cores_here()
    at_a_time = min(cores, MOST_PIECES_AT_ONCE, len(pieces))
    if at_a_time <= 1:
        for piece in pieces:
            yield one_blas_thread()(piece)()
        return
    pool = ThreadPoolExecutor(at_a_time, initializer=limit_cores, initargs=(cores // at_a_time,))
    with one_blas_thread(), pool:
        try:
            yield from pool.map(lambda piece: piece(), pieces)
        finally:
            pool.shutdown(cancel_futures=True)


class _BlasUsers:
    """Number of contexts of `one_blas_thread` that last, and the limit that the first one set."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.count = 0
        self.limit: Any = None


_blas_users = _BlasUsers()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Linear algebra in one thread, in all of the process, as a context or a decorator.

    Threads of a BLAS library wait in loops. Two of them took twice the CPU time of one for a frame
    of a ray-traced street and were no faster, and beside other programs a frame took three to six
    times as long. Contexts may be nested, and begin and end in any threads: the last that ends
    gives back the number of threads that there was.

    >>> with one_blas_thread():
    ...     pass
    """
    users = _blas_users
    with users.lock:
        if not users.count:
            users.limit = _blas_libraries().limit(limits=1)
        users.count += 1
    try:
        yield
    finally:
        with users.lock:
            users.count -= 1
            if not users.count:
                users.limit.restore_original_limits()


@cache
def _blas_libraries() -> Any:
    """The BLAS libraries of numpy and scipy; to look for them takes some milliseconds."""
    import scipy.linalg  # noqa: F401  (loads its library)
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


def in_ranges(kernel: Callable[..., object], count: int, *arguments: Any, least: int = 1) -> None:
    """Call ``kernel(begin, end, *arguments)`` in threads, for ranges that make up ``range(count)``.

    The kernel must release the interpreter and write only the rows ``begin:end`` of its results. A
    range has ``least`` rows or more, so that its work outweighs the cost of a call.

    >>> squares = [0] * 5
    >>> def fill(begin, end, out):
    ...     out[begin:end] = [i * i for i in range(begin, end)]
    >>> in_ranges(fill, 5, squares)
    >>> squares
    [0, 1, 4, 9, 16]
    """
    cores = cores_here()
    parts = min(RANGES_PER_CORE * cores, count // least) if cores > 1 else 1
    if parts <= 1:
        kernel(0, count, *arguments)
        return
    ends = [count * part // parts for part in range(parts + 1)]
    others = [
        _pool(os.getpid()).submit(kernel, begin, end, *arguments)
        for begin, end in pairwise(ends[1:])
    ]
    try:
        kernel(ends[0], ends[1], *arguments)
    finally:
        wait(others)
    for other in others:
        other.result()


@cache
def _pool(_process: int) -> ThreadPoolExecutor:
    """Threads for ranges, made anew in each process: a forked one has none of its parent's."""
    return ThreadPoolExecutor(num_cores())
