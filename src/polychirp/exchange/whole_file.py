"""Files of an export that are written as a whole or not at all, in place of earlier ones."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

from polychirp.errors import RunError
from polychirp.study.folders import replace_folder


def write_whole(write: Callable[[Path], list[Path]], folder: Path) -> list[Path]:
    """Call ``write`` with a temporary folder, then move what it has made into ``folder``.

    ``write`` returns the paths of the files and folders it has made, and this function their paths
    in ``folder``. `RunError` is raised if one of them cannot be written; those that were there
    before are as they were.
    """
    try:
        with TemporaryDirectory(dir=folder, prefix="unfinished-") as made_in:
            made = write(Path(made_in))
            return [_moved(path, folder / path.relative_to(made_in)) for path in made]
    except OSError as error:
        raise RunError(
            f"'{folder}' cannot be written: {error.strerror or error}; make room on its disk, or "
            "name another folder with --out"
        ) from error


def remove_other_victims(written: Sequence[Path], folder: Path, *, num_victims: int) -> None:
    """Remove the files in ``folder`` of victims that the run does not have.

    An earlier export of a run with more victims left them there. They have the names of those of
    ``victim-0`` in ``written``, with a number from ``num_victims`` on. Other files stay.
    `RunError` is raised if one of them cannot be removed.
    """
    names = [path.relative_to(folder).as_posix() for path in written]
    of_first = [name.removeprefix("victim-0") for name in names if name.startswith("victim-0")]
    for number in count(num_victims):
        places = [folder / f"victim-{number}{name}" for name in of_first]
        former = [place for place in places if place.is_file()]
        if not former:
            return
        for place in former:
            try:
                place.unlink()
            except OSError as error:
                raise RunError(
                    f"'{place}' is of an earlier run and cannot be removed: "
                    f"{error.strerror or error}; name another folder with --out"
                ) from error
        for inner in {place.parent for place in former} - {folder}:
            with suppress(OSError):  # it holds files of others
                inner.rmdir()


def _moved(path: Path, goal: Path) -> Path:
    goal.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        replace_folder(goal, path)
    else:
        path.replace(goal)
    return goal
