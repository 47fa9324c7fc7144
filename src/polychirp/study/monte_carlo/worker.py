"""A worker: studies, then tasks come in on stdin, outcomes go out on stdout, all pickled.

It ends when its stdin does, so that no worker outlives the program that started it by more than
the trial it is at.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from typing import IO, Any

READY = "ready"
"""What a worker says once it can begin."""


def main() -> None:
    """Serve until there is nobody left to serve."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started it decides
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as out:
        # what a library prints must not get among the outcomes
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        try:
            _serve(sys.stdin.buffer, out)
        except (EOFError, BrokenPipeError):
            os._exit(0)  # nobody reads what is still to be flushed


def _serve(tasks: IO[bytes], out: IO[bytes]) -> None:
    from polychirp.study.monte_carlo.tasks import attempt

    studies = pickle.load(tasks)
    _send(out, READY)
    while True:
        _send(out, attempt(studies, pickle.load(tasks)))


def _send(out: IO[bytes], message: Any) -> None:
    pickle.dump(message, out)
    out.flush()


if __name__ == "__main__":
    main()
