"""A run as a NetCDF-4 file, written through xarray."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polychirp.study.store.groups import NamedArray, groups_of
from polychirp.study.store.load import StoredRun, StoredVictim

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(run: StoredRun, folder: Path) -> list[Path]:
    """Write ``run.nc`` and return its path.

    Groups have the names of a stored run, as in ``/victim-0/detections``. NetCDF has no complex
    numbers: ``samples_real`` and ``samples_imag`` are two arrays. Attributes are numbers and text;
    lists among them are JSON, since readers take a list of one entry for that entry.
    """
    import xarray as xr

    path = folder / "run.nc"
    groups: dict[str, Any] = {
        "/": xr.Dataset(
            attrs={
                "study": run.provenance.study,
                "radars": _attribute(list(run.radars)),
                "actors": _attribute(list(run.actors)),
            }
        )
    }
    for number, victim in enumerate(run.victims):
        groups |= dict(_datasets(victim, f"/victim-{number}"))
    path.write_bytes(xr.DataTree.from_dict(groups).to_netcdf(engine="h5netcdf"))
    return [path]


def _datasets(victim: StoredVictim, place: str) -> Iterator[tuple[str, xr.Dataset]]:
    import xarray as xr

    for name, group in groups_of(victim).items():
        data = {
            field: (part.axes, _values(part), {"units": part.units})
            for whole, array in group.arrays.items()
            for field, part in _real_arrays(whole, array)
        }
        coordinates = {
            axis: ((axis,), _values(array), {"units": array.units})
            for axis, array in group.coordinates.items()
        }
        attributes = {key: _attribute(value) for key, value in group.attributes.items()}
        yield (
            f"{place}/{name}".rstrip("/"),
            xr.Dataset(data, coords=coordinates, attrs=attributes),
        )


def _real_arrays(name: str, array: NamedArray) -> Iterator[tuple[str, NamedArray]]:
    """The array, or its real and its imaginary part if it is complex."""
    values = array.values
    if isinstance(values, tuple) or values.dtype.kind != "c":
        yield name, array
        return
    for end, part in (("real", values.real), ("imag", values.imag)):
        yield f"{name}_{end}", NamedArray(values=part, axes=array.axes, units=array.units)


def _values(array: NamedArray) -> Any:
    """Numbers as they are, masks as small integers, names as objects."""
    if isinstance(array.values, tuple):
        return np.array(array.values, dtype=object)
    return array.values.astype(np.int8) if array.values.dtype == bool else array.values


def _attribute(value: Any) -> Any:
    """A number or text as it is, all else as JSON."""
    return value if isinstance(value, str | int | float) else json.dumps(value, ensure_ascii=False)
