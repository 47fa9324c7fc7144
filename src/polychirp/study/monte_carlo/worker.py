"""A worker process: it reads a function and tasks from stdin and writes outcomes, pickled.

The worker ends after its current trial once its stdin is closed, so that it does not outlive the
program that started it.
"""

import os
import pickle
import signal
import sys
from typing import IO, Any

READY_MESSAGE = "ready"
"""Message by which a worker says that it has started and can take tasks."""


def main() -> None:
    """Run tasks until stdin is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles Ctrl-C
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as out:
        # output that a library prints must not mix with the outcomes
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        try:
            _serve(sys.stdin.buffer, out)
        except (EOFError, BrokenPipeError):
            os._exit(0)  # without flushing, since no reader is left


def _serve(tasks: IO[bytes], out: IO[bytes]) -> None:
    work = pickle.load(tasks)
    _send(out, READY_MESSAGE)
    while True:
        _send(out, work(pickle.load(tasks)))


def _send(out: IO[bytes], message: Any) -> None:
    pickle.dump(message, out)
    out.flush()


if __name__ == "__main__":
    main()
