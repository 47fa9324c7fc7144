"""Datasets of frames in the formats of other tools: one HDF5 file, or a MATLAB file per frame."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from polychirp.capture.zarr_file import ZarrArray
from polychirp.errors import CapabilityError, InputError
from polychirp.exchange.hdf5 import LAYOUT
from polychirp.exchange.matlab import HEADER, HEADER_BYTES
from polychirp.exchange.whole_file import write_whole
from polychirp.study.mitigation.dataset import ARRAYS

EXPORTS: Final = ("hdf5", "mat")
"""Formats beside Zarr."""


def frames_of(folder: Path) -> Iterator[tuple[str, dict[str, NDArray[Any]]]]:
    """Name and arrays of every frame of a dataset, in the order of their numbers.

    `InputError` is raised if the folder holds none, or a frame is damaged.
    """
    paths = sorted(folder.glob("frame-*.zarr"))
    if not paths:
        raise InputError(f"'{folder}' holds no frames of a dataset; `polychirp dataset` makes them")
    for path in paths:
        arrays = {}
        for name in ARRAYS:
            if (path / name).is_dir():
                stored = ZarrArray(path / name)
                arrays[name] = stored[tuple(slice(None) for _ in stored.shape)]
        yield path.stem, arrays


def refuse_export(to: str) -> None:
    """Refuse a format whose package is not installed.

    Raises
    ------
    CapabilityError
        The package h5py is missing.
    """
    if to == "hdf5" and find_spec("h5py") is None:
        raise CapabilityError(
            "the format 'hdf5' needs the package 'h5py' (pip install \"polychirp[exchange]\"); mat "
            "needs no further package"
        )


def export_dataset(folder: Path, *, to: str) -> list[Path]:
    """Write a dataset as ``dataset.h5``, or as one ``frame-NUMBER.mat`` each, beside its frames.

    `RunError` is raised if the folder cannot be written; what was there before is as it was.
    """
    refuse_export(to)
    frames = frames_of(folder)
    if to == "hdf5":
        return write_whole(lambda goal: [_hdf5(goal, frames)], folder)
    return write_whole(lambda goal: [_mat(goal, *one) for one in frames], folder)


def _hdf5(folder: Path, frames: Iterator[tuple[str, dict[str, NDArray[Any]]]]) -> Path:
    import h5py

    path = folder / "dataset.h5"
    # in a file of Python's, since HDF5's own ends with a segmentation fault if a disk is full
    with (
        path.open("w+b") as raw,
        h5py.File(raw, "w", libver=LAYOUT, track_order=True) as file,
    ):
        for frame, arrays in frames:
            group = file.create_group(frame)
            for name, values in arrays.items():
                stored = group.create_dataset(name, data=values, track_times=False)
                axes, unit, _ = ARRAYS[name]
                stored.attrs["units"] = unit
                for number, axis in enumerate(axes):
                    stored.dims[number].label = axis
    return path


def _mat(folder: Path, frame: str, arrays: dict[str, NDArray[Any]]) -> Path:
    from scipy.io import savemat

    path = folder / f"{frame}.mat"
    units = {name: ARRAYS[name][1] for name in arrays}
    content = {name: np.asarray(values) for name, values in arrays.items()}
    savemat(path, {**content, "units": units}, do_compression=True, oned_as="column")
    with path.open("r+b") as file:  # SciPy's header has the time of day
        file.write(HEADER.encode("ascii").ljust(HEADER_BYTES))
    return path
