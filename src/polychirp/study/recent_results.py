"""`RecentResults`: what the last trials computed, for others that have the same in common.

The paths of a trial depend on the scene, the tracer, the trace times and the receiving radars, but
not on waveforms of equal frame times, on mitigation or on the receiver; its received signals do not
depend on the latter two either. Points of a study that differ in these alone then need one tracing
and one synthesis per trial.
"""

import hashlib
import math
import pickle
from collections import OrderedDict
from collections.abc import Callable
from threading import Lock
from typing import Any, TypeVar, cast

T = TypeVar("T")


class RecentResults:
    """The ``most`` results that were asked for last, of ``most_bytes`` of memory together.

    Results that are found here are those that computing would give, since the key holds all that
    the computation reads. Threads may use one instance together.

    Parameters
    ----------
    most : number of results that are kept at most
    most_bytes, size_of : memory that they may take, and the function that gives that of a result

    Examples
    --------
    >>> traces = RecentResults(most=1)
    >>> traces.of("a street", tuple), traces.of("a street", lambda: 1 / 0)
    ((), ())
    """

    def __init__(
        self,
        *,
        most: int,
        most_bytes: float = math.inf,
        size_of: Callable[[Any], float] = lambda _: 0.0,
    ) -> None:
        self._most, self._most_bytes, self._size_of = most, most_bytes, size_of
        self._known: OrderedDict[bytes, Any] = OrderedDict()
        self._lock = Lock()

    def of(self, makers: Any, compute: Callable[[], T]) -> T:
        """The result made from ``makers``, all that ``compute`` reads; it is called if need be."""
        key = hashlib.sha256(pickle.dumps(makers)).digest()
        with self._lock:
            found = self._known.pop(key, None)
        if found is None:
            found = compute()
        with self._lock:
            self._known[key] = found
            while len(self._known) > self._most or self._bytes > self._most_bytes:
                self._known.popitem(last=False)
        return cast("T", found)

    @property
    def _bytes(self) -> float:
        return sum(map(self._size_of, self._known.values()))


def recalled(results: RecentResults | None, makers: Any, compute: Callable[[], T]) -> T:
    """The result of ``compute``, from ``results`` if there are any and they have it.

    >>> recalled(None, "a street", tuple)
    ()
    """
    return compute() if results is None else results.of(makers, compute)
