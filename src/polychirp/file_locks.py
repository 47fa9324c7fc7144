"""Locks on open files; a lock ends when the file is closed, or with the program that has it.

On systems without ``flock``, such as Windows, nothing is locked.
"""

from types import ModuleType
from typing import IO, Any


def _flock() -> ModuleType | None:
    """The module with ``flock``, on systems that have it."""
    try:
        import fcntl
    except ImportError:
        return None
    return fcntl


def try_to_lock(file: IO[Any]) -> bool:
    """Lock a file; False if another program has locked it."""
    system = _flock()
    if system is None:
        return True
    try:
        system.flock(file, system.LOCK_EX | system.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def wait_for_lock(file: IO[Any]) -> None:
    """Lock a file as soon as no other program has locked it."""
    system = _flock()
    if system is not None:
        system.flock(file, system.LOCK_EX)
