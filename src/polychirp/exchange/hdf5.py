"""A run as an HDF5 file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from polychirp.study.store.groups import ArrayGroup, NamedArray, groups_of
from polychirp.study.store.load import StoredRun

if TYPE_CHECKING:
    import h5py

LAYOUT: Final = ("v108", "v108")
"""Oldest and newest layout of the parts of a file: that of HDF5 1.8, which all later versions read,
those in MATLAB too. HDF5 1.14 cannot read the newest layout of HDF5 2.0. In layouts older than 1.8,
equal runs may have different bytes."""


def write_hdf5(run: StoredRun, folder: Path) -> list[Path]:
    """Write ``run.h5`` and return its path.

    Groups and arrays have the names of a stored run, as in ``/victim-0/detections/range``. Complex
    numbers are pairs of ``r`` and ``i``, which h5py reads as complex and MATLAB as a structure. The
    label of each axis is its name; coordinates are attached as dimension scales. The file is made
    in memory, since the library ends with a segmentation fault if a disk is full.
    """
    import h5py

    path = folder / "run.h5"
    memory = {"driver": "core", "backing_store": False}
    with h5py.File(path, "w", libver=LAYOUT, track_order=True, **memory) as file:
        file.attrs["study"] = run.provenance.study
        file.attrs["radars"], file.attrs["actors"] = list(run.radars), list(run.actors)
        for number, victim in enumerate(run.victims):
            for name, group in groups_of(victim).items():
                _write(file.create_group(f"victim-{number}/{name}".rstrip("/")), group)
        file.flush()
        content = file.id.get_file_image()
    path.write_bytes(content)
    return [path]


def _write(stored: h5py.Group, group: ArrayGroup) -> None:
    for name, value in group.attributes.items():
        stored.attrs[name] = _attribute(value)
    for axis, array in group.coordinates.items():
        _dataset(stored, axis, array).make_scale(axis)
    for name, array in group.arrays.items():
        dataset = _dataset(stored, name, array)
        for number, axis in enumerate(array.axes):
            dataset.dims[number].label = axis
            dataset.dims[number].attach_scale(stored[axis])


def _dataset(stored: h5py.Group, name: str, array: NamedArray) -> h5py.Dataset:
    import h5py

    if isinstance(array.values, tuple):
        kind = h5py.string_dtype()
        dataset = stored.create_dataset(name, data=np.array(array.values, dtype=object), dtype=kind)
    else:
        dataset = stored.create_dataset(name, data=array.values, track_times=False)
    dataset.attrs["units"] = array.units
    return dataset


def _attribute(value: Any) -> Any:
    """A number or text as it is, all else as JSON."""
    return value if isinstance(value, str | int | float) else json.dumps(value)
