"""Pieces of work in several threads, each of whose kernels has its share of the cores.

Kernels let go of the interpreter while they run, and what lies between them does not. So two
pieces keep two cores busy, where one with its kernels in two threads keeps one and a half: small
kernels hardly gain from a second thread, and wait for it. The threads that linear algebra keeps
for itself do harm here: matrices are small, and while those threads wait for the next one they
take the cores of others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeVar

Result = TypeVar("Result")

MOST: Final = 4
"""Pieces at a time: each has its tables in memory."""


def side_by_side(pieces: Sequence[Callable[[], Result]]) -> Iterator[Result]:
    """What ``pieces`` return, in their order, whichever is done first.

    Where numba has no threading layer that several threads may use at once (OpenMP or TBB), one
    goes after another. The first piece to raise an error ends the others before they begin.

    >>> list(side_by_side([lambda: 1, lambda: 2]))
    [1, 2]
    """
    import numba
    from threadpoolctl import threadpool_limits

    cores = numba.get_num_threads()
    at_a_time = min(cores, MOST, len(pieces))
    if at_a_time <= 1 or not _may_be_shared():
        for piece in pieces:
            yield piece()
        return
    pool = ThreadPoolExecutor(
        at_a_time, initializer=numba.set_num_threads, initargs=(cores // at_a_time,)
    )
    with threadpool_limits(1, user_api="blas"), pool:
        try:
            yield from pool.map(lambda piece: piece(), pieces)
        finally:
            pool.shutdown(cancel_futures=True)


def _may_be_shared() -> bool:
    """Whether kernels of several threads may run at once."""
    import numba

    numba.get_num_threads()  # which chooses the layer, where nothing has yet
    return bool(numba.threading_layer() != "workqueue")  # type: ignore[attr-defined]
