"""Stored runs and studies, by the names that users give them on the command line."""

from pathlib import Path
from typing import Final

from polychirp.errors import InputError

RUN: Final = "run.zarr"
"""Folder into which ``polychirp run`` stores its results."""

STUDY: Final = "results.zarr"
"""Folder into which ``polychirp study`` stores its results."""


def stored_results(name: str, *, folders: tuple[str, ...] = (RUN, STUDY)) -> Path:
    """The stored results that are called ``name``, or that are in the folder of this name.

    ``folders`` are the kinds that are looked for. A path without the name `STUDY` is a run's.

    Raises
    ------
    InputError
        There are none of these kinds.
    """
    path = Path(name)
    for found in (path, *(path / folder for folder in folders)):
        is_other = found.name in {RUN, STUDY} - set(folders)
        if (found / "zarr.json").is_file() and not is_other:
            return found
    kinds = [{RUN: "run", STUDY: "study"}[folder] for folder in folders]
    raise InputError(
        f"there is no {' and no '.join(kinds)} in '{path}'; name the folder into which "
        f"{' or '.join(map(repr, kinds))} stored its results"
    )
