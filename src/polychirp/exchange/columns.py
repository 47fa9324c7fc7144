"""Detections, targets, paths and ramps of a victim as tables."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from polychirp.study.store.groups import ArrayGroup, NamedArray, Values, groups_of
from polychirp.study.store.load import StoredVictim

Table = Mapping[str, Values]
"""Columns of equal length, whose names contain their units."""

SOURCES: Final[Mapping[str, tuple[tuple[str, ...], str]]] = {
    "detections": (("detections", "score"), "detection"),
    "targets": (("truth", "score"), "target"),
    "paths": (("paths",), "path"),
    "bodies": (("placement",), "body"),
    "ramps": (("schedule", "times", "code"), "ramp"),
}
"""Tables by name: the groups of a stored run whose arrays are columns, and the axis of its rows.

The group ``code`` is there if ramps carry one: the columns are the row and the duration of the
chips, whose values are in the stored run."""

_SUFFIXES: Final[Mapping[str, str]] = {
    "m": "_m",
    "m/s": "_m_per_s",
    "rad": "_rad",
    "s": "_s",
    "1/s": "_per_s",
    "Hz": "_hz",
    "Hz/s": "_hz_per_s",
    "W": "_w",
    "V": "_v",
    "cycle": "_cycle",
}
"""Ends of the names of columns, by unit; ratios, numbers and names have none."""


def tables_of(victim: StoredVictim) -> dict[str, Table]:
    """The tables `SOURCES` of a victim, and "radar", one row with its pose in the world.

    Arrays with a second axis have a column for each place on it, such as ``point_x_m``. Complex
    numbers have two columns, ``_real`` and ``_imag``. The first column of targets holds their
    names, that of other tables their numbers. A name that two groups have is written a second time
    with the name of its group, as ``score_power_w``.
    """
    groups = groups_of(victim)
    tables: dict[str, Table] = {}
    for name, (sources, axis) in SOURCES.items():
        columns: dict[str, Values] = {axis: groups[sources[0]].coordinates[axis].values}
        for source in filter(groups.__contains__, sources):
            for column, values in _columns(groups[source], axis):
                columns[f"{source}_{column}" if column in columns else column] = values
        tables[name] = columns
    placement = groups["placement"]
    tables["radar"] = {"radar": (victim.name,), "vehicle": (_carrier(victim),)} | {
        f"{field}_{label}{_SUFFIXES[array.units]}": np.array([value])
        for field, array in placement.arrays.items()
        if array.axes[0] != "body"
        for label, value in zip(
            placement.coordinates[array.axes[0]].values, array.values, strict=True
        )
    }
    return tables


def _carrier(victim: StoredVictim) -> str:
    return victim.placement.name[victim.placement.carrier]


def _columns(group: ArrayGroup, axis: str) -> Iterator[tuple[str, Values]]:
    for field, array in group.arrays.items():
        if array.axes[0] == axis:
            yield from _flat(field, array, group)


def _flat(name: str, array: NamedArray, group: ArrayGroup) -> Iterator[tuple[str, Values]]:
    """The columns of one array, with one column for each place on its further axes."""
    values = array.values
    if isinstance(values, tuple):
        yield name, values
    elif len(array.axes) > 1:
        for place, label in enumerate(group.coordinates[array.axes[1]].values):
            inner = NamedArray(
                values=values[:, place], axes=array.axes[:1] + array.axes[2:], units=array.units
            )
            yield from _flat(f"{name}_{label}", inner, group)
    else:
        suffix = _SUFFIXES.get(array.units, "")
        if values.dtype.kind == "c":
            yield f"{name}_real{suffix}", values.real
            yield f"{name}_imag{suffix}", values.imag
        else:
            yield f"{name}{suffix}", values
