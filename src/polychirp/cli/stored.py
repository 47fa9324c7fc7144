"""Stored runs and studies, by the names that users give them on the command line."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from polychirp.errors import InputError

RUN: Final = "run.zarr"
"""Folder into which ``polychirp run`` stores its results."""

STUDY: Final = "results.zarr"
"""Folder into which ``polychirp study`` stores its results."""

LOG: Final = "trials.log"
"""Log of the trials of a study, beside its results; `study.monte_carlo.run` has the same name,
but imports the kernels."""

OF_RUNS: Final = (
    "range-profile",
    "range-rate",
    "range-azimuth",
    "spectrogram",
    "ramps",
    "detections",
)
OF_STUDIES: Final = ("curves", "differences")
"""Figures of a run and of a study."""

_DRAWN: Final = {
    RUN: rf"(({'|'.join(OF_RUNS)})(-\d+)?|maps-.+)\.(png|svg|pdf|csv)",
    STUDY: rf"({'|'.join(OF_STUDIES)})-.+\.(png|svg|pdf|csv)",
}
"""Names of the files of figures, as regular expressions."""


def drawn_files(folder: Path, kind: str) -> Iterator[Path]:
    """The page and the figures of the results ``kind`` in a folder, and of those in ``figures``.

    ``kind`` is `RUN` or `STUDY`. The commands ``plot`` and ``report``, and ``run`` with ``--maps``,
    write them there unless another folder is named.
    """
    yield folder / "report.html"
    for inner in (folder, folder / "figures"):
        files = sorted(inner.iterdir()) if inner.is_dir() else []
        yield from (path for path in files if re.fullmatch(_DRAWN[kind], path.name))


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
