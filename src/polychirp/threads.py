"""Parallel pieces of work in threads, each with a share of the cores for its kernels.

Kernels release the interpreter while they run; the code between them does not. Two pieces therefore
keep two cores busy, while one piece with its kernels in two threads keeps one and a half busy:
small kernels hardly gain from a second thread, and wait for it. Linear algebra runs in one thread
here, because its matrices are small, and its waiting threads would take the cores of other pieces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeVar

Result = TypeVar("Result")

MOST_PIECES_AT_ONCE: Final = 4
"""Greatest number of pieces that run at once (chosen, since each has its tables in memory)."""


def side_by_side(pieces: Sequence[Callable[[], Result]]) -> Iterator[Result]:
    """Results of ``pieces``, in the order of the pieces.

    If numba has no threading layer that several threads may use at once (OpenMP or TBB), the pieces
    run one after another. After an error no further piece begins.

    >>> list(side_by_side([lambda: 1, lambda: 2]))
    [1, 2]
    """
    import numba
    from threadpoolctl import threadpool_limits

    cores = numba.get_num_threads()
    at_a_time = min(cores, MOST_PIECES_AT_ONCE, len(pieces))
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
    """True if kernels of several threads may run at once."""
    import numba

    numba.get_num_threads()  # chooses the threading layer, if none is chosen yet
    return bool(numba.threading_layer() != "workqueue")  # type: ignore[attr-defined]
