"""A file that is written as a whole or not at all."""

from contextlib import suppress
from pathlib import Path

from polychirp.errors import RunError


def write_whole(path: Path, content: bytes | memoryview) -> None:
    """Write ``content`` under a temporary name, then rename it to ``path``.

    The libraries of HDF5 end with a segmentation fault if a disk is full, or leave a part of the
    file, so that files of theirs are made in memory and written here. `RunError` is raised if the
    file cannot be written; one that was there before is as it was.
    """
    unfinished = path.with_name(f"{path.name}.unfinished")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    except OSError as error:
        raise RunError(
            f"'{path}' cannot be written: {error.strerror or error}; make room on its disk, or "
            "name another folder with --out"
        ) from error
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
