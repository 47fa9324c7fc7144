"""Storing of a run."""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import axes_of
from polychirp.errors import RunError
from polychirp.model.antenna import AntennaArray
from polychirp.model.score import Score
from polychirp.study.folders import replace_folder
from polychirp.study.provenance import Provenance
from polychirp.study.store.layout import (
    FOLDERS,
    FORMAT,
    FORMAT_VERSION,
    POLARISATION_AXES,
    UNIT_OF_NAMES,
    UNITS,
    stored_axes,
)

if TYPE_CHECKING:
    from zarr import Group

    from polychirp.study.trial import Trial, VictimResult

Coordinates = Mapping[str, Sequence[str] | NDArray[Any]]
"""Names or numbers along axes, by the name of the axis."""


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
        _write_victim(root.create_group(f"victim-{number}"), victim)
    with warnings.catch_warnings():
        # a part of no standard yet, which xarray reads and others may leave aside
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        zarr.consolidate_metadata(path)


def _write_victim(group: Group, victim: VictimResult) -> None:
    frame, parts, found, truth = victim.frame, victim.parts, victim.detections, victim.truth
    corners = None if frame.high_pass is None else list(frame.high_pass.corners)
    group.attrs.update(
        {"name": victim.name, "array": _array_attributes(frame.array), "high_pass": corners}
    )
    lengths: dict[str, int] = {}
    for name, sampled in (("samples", frame), ("parts", parts)):
        values, kind = sampled.samples.astype(np.complex64), type(sampled)
        axes = stored_axes(kind, "samples")
        _write_numbers(group, name, values, axes=axes, units=UNITS[kind]["samples"])
        lengths.update(zip(axes, values.shape, strict=True))
    group["parts"].attrs.update({"part": list(parts.names), "neglected": parts.neglected})
    known: Coordinates = {
        "part": parts.names,
        "fast": np.arange(frame.times.most_samples) / frame.times.rate,
        "target": truth.name,
        "xyz": tuple("xyz"),
        **dict.fromkeys(POLARISATION_AXES, tuple("VH")),
    }
    _write_coordinates(group, lengths, known)
    attributes: dict[str, dict[str, Any]] = {
        "times": {"rate": frame.times.rate},
        "schedule": {},
        "paths": {
            "reference_time": victim.paths.reference_time,
            "frequency": victim.paths.frequency,
        },
        "detections": {"time": found.time, "num_unresolved": found.num_unresolved},
        "truth": {"time": truth.time, "name": list(truth.name)},
        "score": _score_attributes(victim.score),
    }
    for noun in (frame.times, frame.schedule, victim.paths, found, truth, victim.score):
        name = FOLDERS[type(noun)]
        _write_noun(group.create_group(name), noun, attributes[name], known)


def _score_attributes(score: Score) -> dict[str, Any]:
    return {
        "nature": list(score.nature),
        "body": list(score.body),
        "target_detection": list(score.target_detection),
        "num_missed": score.num_missed,
        "floor_rise": score.floor_rise,
        "num_unresolved": score.num_unresolved,
    }


def _write_noun(
    group: Group,
    noun: Any,
    attributes: Mapping[str, Any],
    known: Coordinates,
) -> None:
    group.attrs.update(attributes)
    kind, lengths = type(noun), dict[str, int]()
    for field in axes_of(kind):
        values, axes = getattr(noun, field), stored_axes(kind, field)
        _write_numbers(group, field, values, axes=axes, units=UNITS[kind][field])
        lengths.update(zip(axes, values.shape, strict=True))
    if isinstance(noun, Score):
        _write_names(group, "nature", noun.nature, axis="detection")
        _write_names(group, "body", [body or "" for body in noun.body], axis="detection")
    _write_coordinates(group, lengths, known)


def _write_coordinates(group: Group, lengths: Mapping[str, int], known: Coordinates) -> None:
    """Write an array for every axis: what is ``known`` of it, else numbers."""
    for axis, length in lengths.items():
        values = known.get(axis, np.arange(length))
        if isinstance(values, np.ndarray):
            units = "s" if axis in known else "1"
            _write_numbers(group, axis, values, axes=(axis,), units=units)
        else:
            _write_names(group, axis, values, axis=axis)


def _write_numbers(
    group: Group, name: str, values: NDArray[Any], *, axes: tuple[str, ...], units: str
) -> None:
    from zarr.codecs import BloscCodec

    # each part is one chunk, so that a part can be read without the others
    whole = tuple(max(1, length) for length in values.shape)
    chunks = (1, *whole[1:]) if name == "parts" else whole
    array = group.create_array(
        name,
        shape=values.shape,
        dtype=values.dtype,
        chunks=chunks,
        compressors=BloscCodec(cname="lz4", shuffle="bitshuffle", typesize=values.dtype.itemsize),
        dimension_names=axes,
        attributes={"units": units},
        # a chunk of zeros is stored too, so that a missing chunk is noticed
        config={"write_empty_chunks": True},
    )
    if values.size:
        array[...] = values


def _write_names(group: Group, name: str, values: Sequence[str], *, axis: str) -> None:
    array = group.create_array(
        name,
        shape=(len(values),),
        dtype="string",
        chunks=(max(1, len(values)),),
        dimension_names=(axis,),
        attributes={"units": UNIT_OF_NAMES},
        config={"write_empty_chunks": True},
    )
    if values:
        array[...] = np.array(values, dtype=object)


def _array_attributes(array: AntennaArray) -> str:
    # JSON text, since an isotropic element's infinite beamwidth is no JSON number for Zarr
    return json.dumps(asdict(array))
