"""The formats that a stored run can be exported to, by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial, wraps
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from polychirp.errors import CapabilityError, InputError, no_such
from polychirp.exchange.whole_file import remove_other_victims, write_whole
from polychirp.study.store.load import StoredRun


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """A format: the function that writes it, and what that needs.

    Parameters
    ----------
    writer : module of this package and its function, from a run and a folder to the files written
    packages : packages of the extra ``exchange`` that it needs
    """

    writer: tuple[str, str]
    packages: tuple[str, ...] = ()


FORMATS: Final[Mapping[str, Format]] = {
    "mat": Format(
        writer=("matlab", "write_mat"),
    ),
    "netcdf": Format(
        writer=("netcdf", "write_netcdf"),
        packages=("xarray", "h5netcdf"),
    ),
    "hdf5": Format(
        writer=("hdf5", "write_hdf5"),
        packages=("h5py",),
    ),
    "sigmf": Format(
        writer=("sigmf_samples", "write_sigmf_samples"),
    ),
    "csv": Format(
        writer=("csv_tables", "write_csv"),
    ),
    "osi": Format(
        writer=("osi", "write_osi"),
        packages=("betterosi",),
    ),
    "rosbag": Format(
        writer=("rosbag", "write_rosbag"),
        packages=("rosbags",),
    ),
}
"""Every format by its name."""


def refuse_unknown(name: str) -> None:
    """Raise `InputError` if there is no format of this name."""
    if name not in FORMATS:
        raise InputError(no_such("format", name, FORMATS))


def writer_of(name: str) -> Callable[[StoredRun, Path], list[Path]]:
    """The function that writes a format into a folder and returns the paths of what it wrote.

    It raises `RunError` if the folder cannot be written, and then leaves what was there before.
    Files of the same format that an earlier run with more victims left there are removed.

    Raises
    ------
    InputError
        There is no such format.
    CapabilityError
        A package that it needs is not installed.

    Examples
    --------
    >>> writer_of("csv").__name__
    'write_csv'
    """
    refuse_unknown(name)
    chosen = FORMATS[name]
    missing = [package for package in chosen.packages if find_spec(package) is None]
    if missing:
        raise CapabilityError(
            f"the format '{name}' needs the package '{missing[0]}' (pip install "
            '"polychirp[exchange]"); csv, mat and sigmf need no further package'
        )
    module, function = chosen.writer
    writer: Callable[[StoredRun, Path], list[Path]] = getattr(
        import_module(f"polychirp.exchange.{module}"), function
    )

    @wraps(writer)
    def write(run: StoredRun, folder: Path) -> list[Path]:
        written = write_whole(partial(writer, run), folder)
        remove_other_victims(written, folder, num_victims=len(run.victims))
        return written

    return write


def export(run: StoredRun, folder: Path | str, *, to: str) -> list[Path]:
    """Write a stored run into a folder in one of the `FORMATS`; return the paths of the files.

    Parameters
    ----------
    run : from `load_run`
    folder : made if it does not exist
    to : name of the format, such as ``"mat"``

    Raises
    ------
    InputError
        There is no such format.
    CapabilityError
        A package that it needs is not installed.
    RunError
        The folder cannot be written; what was there before is as it was.
    """
    writer = writer_of(to)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return writer(run, folder)
