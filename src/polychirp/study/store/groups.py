"""The arrays of a victim, named as they are stored, with their axes, units and coordinates."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, astuple, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import axes_of
from polychirp.model.antenna import AntennaArray
from polychirp.model.score import Score
from polychirp.study.store.layout import (
    FOLDERS,
    POLARISATION_AXES,
    UNIT_OF_NAMES,
    UNITS,
    stored_axes,
)

if TYPE_CHECKING:
    from polychirp.study.store.load import StoredVictim
    from polychirp.study.trial import VictimResult

OWN_GROUP: Final = ""
"""Name of the group of samples and parts, which are a victim's own."""

Values = NDArray[Any] | tuple[str, ...]
"""Numbers, or names along one axis."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NamedArray:
    """An array with the names of its axes and its unit ("1" for numbers, ratios and masks)."""

    values: Values
    axes: tuple[str, ...]
    units: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArrayGroup:
    """Arrays that belong together, by name, the coordinates of their axes, and attributes."""

    attributes: Mapping[str, Any]
    arrays: Mapping[str, NamedArray]
    coordinates: Mapping[str, NamedArray]


def groups_of(victim: VictimResult | StoredVictim) -> dict[str, ArrayGroup]:
    """All arrays of a victim, by the name of their group; samples and parts are in `OWN_GROUP`.

    Samples are rounded to ``complex64``. Every axis has a coordinate, an array of its own name: the
    names of parts, targets, bodies, angles and x, y, z; seconds after a ramp's first sample for
    ``fast``; numbers for all others.
    """
    frame, found, truth = victim.frame, victim.detections, victim.truth
    placed = victim.placement
    coordinates = _known_coordinates(victim)
    groups = {OWN_GROUP: _group(_own_attributes(victim), _own_arrays(victim), coordinates)}
    attributes: dict[str, dict[str, Any]] = {
        "times": {"rate": frame.times.rate},
        "schedule": {},
        "code": {},
        "paths": {
            "reference_time": victim.paths.reference_time,
            "frequency": victim.paths.frequency,
        },
        "detections": {"time": found.time, "num_unresolved": found.num_unresolved},
        "truth": {"time": truth.time, "name": list(truth.name)},
        "score": _score_attributes(victim.score),
        "placement": {
            "time": placed.time,
            "name": list(placed.name),
            "carrier": placed.carrier,
        },
    }
    codes = [] if frame.schedule.code is None else [frame.schedule.code]
    nouns = (frame.times, frame.schedule, *codes, victim.paths, found, truth, victim.score, placed)
    for noun in nouns:
        name = FOLDERS[type(noun)]
        groups[name] = _group(attributes[name], dict(_noun_arrays(noun)), coordinates)
    return groups


def _own_arrays(victim: VictimResult | StoredVictim) -> dict[str, NamedArray]:
    return {
        name: NamedArray(
            values=noun.samples.astype(np.complex64),
            axes=stored_axes(type(noun), "samples"),
            units=UNITS[type(noun)]["samples"],
        )
        for name, noun in (("samples", victim.frame), ("parts", victim.parts))
    }


def _own_attributes(victim: VictimResult | StoredVictim) -> dict[str, Any]:
    corners = None if victim.frame.high_pass is None else list(victim.frame.high_pass.corners)
    if_filter = victim.frame.if_filter
    return {
        "name": victim.name,
        "array": _array_text(victim.frame.array),
        "high_pass": corners,
        "if_filter": None if if_filter is None else list(astuple(if_filter)),
        "part": list(victim.parts.names),
        "neglected": victim.parts.neglected,
    }


def _score_attributes(score: Score) -> dict[str, Any]:
    return {
        "nature": list(score.nature),
        "body": list(score.body),
        "radar": list(score.radar),
        "target_detection": list(score.target_detection),
        "num_missed": score.num_missed,
        "floor_rise": score.floor_rise,
        "num_unresolved": score.num_unresolved,
    }


def _noun_arrays(noun: Any) -> Iterator[tuple[str, NamedArray]]:
    """Every array of a data type by its name; of a score also the causes of the detections."""
    kind = type(noun)
    for field in axes_of(kind):
        axes, units = stored_axes(kind, field), UNITS[kind][field]
        yield field, NamedArray(values=getattr(noun, field), axes=axes, units=units)
    if isinstance(noun, Score):
        bodies = tuple(body or "" for body in noun.body)
        radars = tuple(radar or "" for radar in noun.radar)
        for name, values in (("nature", noun.nature), ("body", bodies), ("radar", radars)):
            yield name, NamedArray(values=values, axes=("detection",), units=UNIT_OF_NAMES)


def _known_coordinates(victim: VictimResult | StoredVictim) -> dict[str, NamedArray]:
    """Coordinates of the axes that have names or a unit."""
    names = {
        "part": victim.parts.names,
        "target": victim.truth.name,
        "xyz": tuple("xyz"),
        "body": victim.placement.name,
        "angle": ("yaw", "pitch", "roll"),
        **dict.fromkeys(POLARISATION_AXES, tuple("VH")),
    }
    times = victim.frame.times
    fast = np.arange(times.most_samples) / times.rate
    return {
        "fast": NamedArray(values=fast, axes=("fast",), units="s"),
        **{
            axis: NamedArray(values=values, axes=(axis,), units=UNIT_OF_NAMES)
            for axis, values in names.items()
        },
    }


def _group(
    attributes: Mapping[str, Any],
    arrays: Mapping[str, NamedArray],
    known: Mapping[str, NamedArray],
) -> ArrayGroup:
    """The group with a coordinate for every axis: a known one, or numbers."""
    lengths = {
        axis: length
        for array in arrays.values()
        for axis, length in zip(array.axes, np.shape(array.values), strict=True)
    }
    coordinates = {
        axis: known.get(axis) or NamedArray(values=np.arange(length), axes=(axis,), units="1")
        for axis, length in lengths.items()
    }
    return ArrayGroup(attributes=attributes, arrays=arrays, coordinates=coordinates)


def _array_text(array: AntennaArray) -> str:
    # JSON text, since an isotropic element's infinite beamwidth is no JSON number for Zarr
    return json.dumps(asdict(array))
