"""Storing of a run."""

from __future__ import annotations

import shutil
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polychirp.errors import RunError
from polychirp.study.folders import replace_folder
from polychirp.study.provenance import Provenance
from polychirp.study.store.groups import ArrayGroup, NamedArray, groups_of
from polychirp.study.store.layout import FORMAT, FORMAT_VERSION

if TYPE_CHECKING:
    from zarr import Group

    from polychirp.study.trial import Trial


def save_run(path: Path | str, trial: Trial, *, provenance: Provenance) -> None:
    """Store the results of all victims of a trial; equal trials give equal files.

    Samples and parts are stored as ``complex64``, all else in full precision. A folder at ``path``
    is replaced once the new run is complete. If it cannot be replaced, both are kept. `RunError` is
    raised if the folder cannot be written.
    """
    path = Path(path)
    unfinished = path.with_name(f"{path.name}.unfinished")
    is_complete = False
    try:
        shutil.rmtree(unfinished, ignore_errors=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(unfinished, trial, provenance)
        is_complete = True
        replace_folder(path, unfinished)
    except OSError as error:
        kept = f"; the new run is kept in '{unfinished}'" if is_complete else ""
        raise RunError(f"'{path}' cannot be written: {error.strerror or error}{kept}") from error
    finally:
        if not is_complete:
            shutil.rmtree(unfinished, ignore_errors=True)


def _write(path: Path, trial: Trial, provenance: Provenance) -> None:
    import zarr

    root = zarr.create_group(store=path, zarr_format=3)
    root.attrs.update(
        {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "has_all_chunks": True,
            "provenance": asdict(provenance),
            "victims": [victim.name for victim in trial.victims],
            "radars": [radar.name for radar in trial.scene.radars],
            "actors": [actor.name for actor in trial.scene.actors],
        }
    )
    for number, victim in enumerate(trial.victims):
        for name, group in groups_of(victim).items():
            _write_group(root.create_group(f"victim-{number}/{name}".rstrip("/")), group)
    with warnings.catch_warnings():
        # a part of no standard yet, which xarray reads and others may leave aside
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        zarr.consolidate_metadata(path)


def _write_group(stored: Group, group: ArrayGroup) -> None:
    stored.attrs.update(group.attributes)
    for name, array in {**group.arrays, **group.coordinates}.items():
        if isinstance(array.values, tuple):
            _write_names(stored, name, array.values, array)
        else:
            _write_numbers(stored, name, array.values, array)


def _write_numbers(group: Group, name: str, values: NDArray[Any], array: NamedArray) -> None:
    from zarr.codecs import BloscCodec

    # each part is one chunk, so that a part can be read without the others
    whole = tuple(max(1, length) for length in values.shape)
    chunks = (1, *whole[1:]) if name == "parts" else whole
    stored = group.create_array(
        name,
        shape=values.shape,
        dtype=values.dtype,
        chunks=chunks,
        compressors=BloscCodec(cname="lz4", shuffle="bitshuffle", typesize=values.dtype.itemsize),
        dimension_names=array.axes,
        attributes={"units": array.units},
        # a chunk of zeros is stored too, so that a missing chunk is noticed
        config={"write_empty_chunks": True},
    )
    if values.size:
        stored[...] = values


def _write_names(group: Group, name: str, values: tuple[str, ...], array: NamedArray) -> None:
    stored = group.create_array(
        name,
        shape=(len(values),),
        dtype="string",
        chunks=(max(1, len(values)),),
        dimension_names=array.axes,
        attributes={"units": array.units},
        config={"write_empty_chunks": True},
    )
    if values:
        stored[...] = np.array(values, dtype=object)
