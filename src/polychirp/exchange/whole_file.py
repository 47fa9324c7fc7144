"""Files of an export that are written as a whole or not at all."""

from collections.abc import Callable
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


def _moved(path: Path, goal: Path) -> Path:
    goal.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        replace_folder(goal, path)
    else:
        path.replace(goal)
    return goal
