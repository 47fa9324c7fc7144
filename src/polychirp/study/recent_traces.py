"""`RecentTraces`: paths of the last frames that were traced, for trials on the same street.

The paths depend on the scene, the tracer, the trace times and the receiving radars, but not on
waveforms of equal frame times, on mitigation or on the receiver. Points of a study that differ in
these alone then need one tracing per trial.
"""

import hashlib
import pickle
from collections import OrderedDict
from collections.abc import Callable
from threading import Lock
from typing import Any, TypeVar, cast

T = TypeVar("T")


class RecentTraces:
    """The paths of the ``most`` frames that were asked for last.

    Paths that are found here are those that tracing would give, since the key holds all that
    tracing reads. Threads may use one instance together.

    Examples
    --------
    >>> traces = RecentTraces(most=1)
    >>> traces.of("a street", tuple), traces.of("a street", lambda: 1 / 0)
    ((), ())
    """

    def __init__(self, *, most: int) -> None:
        self._most = most
        self._known: OrderedDict[bytes, Any] = OrderedDict()
        self._lock = Lock()

    def of(self, makers: Any, trace: Callable[[], T]) -> T:
        """The paths made from ``makers``, all that ``trace`` reads; it is called if need be."""
        key = hashlib.sha256(pickle.dumps(makers)).digest()
        with self._lock:
            found = self._known.pop(key, None)
        if found is None:
            found = trace()
        with self._lock:
            self._known[key] = found
            while len(self._known) > self._most:
                self._known.popitem(last=False)
        return cast("T", found)
