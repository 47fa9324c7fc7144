"""Replacement and removal of a folder of results as a whole or not at all."""

import shutil
from pathlib import Path


def replace_folder(path: Path, new: Path) -> None:
    """Put the folder ``new`` in place of the one at ``path``, which is deleted afterwards.

    The old folder is renamed first, since a folder that is deleted may be left with a part of its
    files. If ``new`` cannot be renamed, the old folder gets its name back. `OSError` is raised if a
    folder cannot be renamed; the old one is as it was.
    """
    old = path.with_name(f"{path.name}.replaced")
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(old, ignore_errors=True)
        path.rename(old)
    try:
        new.rename(path)
    except OSError:
        if old.exists():
            old.rename(path)
        raise
    shutil.rmtree(old, ignore_errors=True)


def remove_results(path: Path) -> None:
    """Delete a file or folder of results, if it is there.

    A folder is renamed first, as in `replace_folder`: of a store that has lost a part of its files,
    a reader would take the missing values for NaN.
    """
    if path.is_dir() and not path.is_symlink():
        old = path.with_name(f"{path.name}.replaced")
        shutil.rmtree(old, ignore_errors=True)
        path.rename(old)
        shutil.rmtree(old, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
