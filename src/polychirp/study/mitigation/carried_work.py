"""Work that a worker process can do although it was not started like this one."""

from __future__ import annotations

import pickle
import sys
from dataclasses import dataclass
from functools import lru_cache

from polychirp.errors import InputError
from polychirp.study.monte_carlo.tasks import Outcome, Task, Work


@dataclass(frozen=True, slots=True)
class CarriedWork:
    """Pickled work, with the folders in which this process finds modules, a user's too.

    Parameters
    ----------
    folders : of `sys.path`
    content : the pickled work
    """

    folders: tuple[str, ...]
    content: bytes

    @classmethod
    def of(cls, work: Work) -> CarriedWork:
        """The work, pickled.

        Raises
        ------
        InputError
            It cannot be pickled.
        """
        try:
            content = pickle.dumps(work)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise InputError(
                f"a method cannot be sent to worker processes: {error}; use --workers 1, or give "
                "an object of a class in a module"
            ) from None
        return cls(tuple(sys.path), content)

    def __call__(self, task: Task) -> Outcome:
        """Outcome of the work on a task."""
        return _unpacked(self.folders, self.content)(task)


@lru_cache(maxsize=1)
def _unpacked(folders: tuple[str, ...], content: bytes) -> Work:
    sys.path += [folder for folder in folders if folder not in sys.path]
    work: Work = pickle.loads(content)
    return work
