"""A run as a MATLAB file, version 5, which MATLAB, GNU Octave and SciPy read."""

from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Final, get_args, get_type_hints

import numpy as np

from polychirp.errors import CapabilityError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.study.store.groups import OWN_GROUP, ArrayGroup, NamedArray, groups_of
from polychirp.study.store.load import StoredRun, StoredVictim
from polychirp.units import Unit

LARGEST_VARIABLE: Final = 2**31 - 1
"""Greatest size of a variable in a file of version 5, bytes (its size has 31 bits)."""

HEADER: Final = "MATLAB 5.0 MAT-file, written by polychirp"
HEADER_BYTES: Final = 116
"""Text at the start of the file and its length in the format; SciPy's has the time of day, with
which equal runs would give different files."""


def write_mat(run: StoredRun, folder: Path) -> list[Path]:
    """Write ``run.mat`` and return its path.

    Its variables are ``study`` (JSON), ``radars``, ``actors`` and ``victims``, a cell array of
    structures. Each has the arrays of a stored run with the same names and axes: ``samples``
    (channel, ramp, fast), ``parts.echo`` and so on, ``times``, ``schedule``, ``paths``,
    ``detections``, ``truth`` and ``score``. ``array`` has the places of the elements in the radar's
    frame and all values of its `AntennaArray`, such as the gains of the channels; ``high_pass`` has
    the corners of its high-pass filter, ``if_filter`` the values of its `IfFilter`, both empty if
    there is none. The structure ``units`` repeats the names, with the unit of each.

    Raises
    ------
    CapabilityError
        The victims need more than a variable in a file of version 5 can hold.
    """
    from scipy.io import savemat

    victims = [_structure(victim) for victim in run.victims]
    if (size := sum(map(_size, victims))) > LARGEST_VARIABLE:
        raise CapabilityError(
            f"the victims of this run need {size / 1e9:.2g} GB, more than the 2.1 GB that a "
            "variable in a MATLAB file of version 5 holds; export to hdf5, which MATLAB reads with "
            "h5read"
        )
    path = folder / "run.mat"
    content = {
        "study": run.provenance.study,
        "radars": _names(run.radars),
        "actors": _names(run.actors),
        "victims": _cells(victims),
    }
    file: Any = BytesIO()  # the types of SciPy know paths alone
    savemat(file, content, do_compression=True, oned_as="column")
    file.getbuffer()[:HEADER_BYTES] = HEADER.encode("ascii").ljust(HEADER_BYTES)
    path.write_bytes(file.getbuffer())
    return [path]


def _structure(victim: StoredVictim) -> dict[str, Any]:
    groups = groups_of(victim)
    own = groups.pop(OWN_GROUP)
    array = victim.frame.array
    parts = own.arrays["parts"].values
    if_filter = victim.frame.if_filter
    inner = {name: _fields(group) for name, group in groups.items()}
    return {
        "name": victim.name,
        "samples": own.arrays["samples"].values,
        "parts": dict(zip(victim.parts.names, parts, strict=True)),
        "fast": own.coordinates["fast"].values,
        "neglected": victim.parts.neglected,
        "array": {
            "channel_position": array.position,
            "transmit_position": array.transmit_position,
            **_spec(asdict(array)),
        },
        "high_pass": np.array(own.attributes["high_pass"] or [], dtype=np.float64),
        "if_filter": np.zeros(0) if if_filter is None else asdict(if_filter),
        **inner,
        "units": {
            "samples": "V",
            "parts": "V",
            "fast": "s",
            "neglected": "V",
            "array": {
                "channel_position": "m",
                "transmit_position": "m",
                **_spec_units(AntennaArray),
            },
            "high_pass": "Hz",
            "if_filter": _spec_units(IfFilter),
            **{name: _units(group) for name, group in groups.items()},
        },
    }


def _size(value: Any) -> int:
    """Size of all arrays in a structure, bytes."""
    if isinstance(value, dict):
        return sum(map(_size, value.values()))
    return int(np.asarray(value).nbytes)


def _fields(group: ArrayGroup) -> dict[str, Any]:
    """Arrays of a group, and those of its attributes that are numbers or names."""
    fields = {
        name: _names(value) if isinstance(value, list) else value
        for name, value in group.attributes.items()
        if name not in group.arrays
    }
    return fields | {name: _value(array) for name, array in group.arrays.items()}


def _spec(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a spec and of the specs in it, as structures."""
    return {
        name: _spec(value) if isinstance(value, Mapping) else _setting(value)
        for name, value in values.items()
    }


def _setting(value: Any) -> Any:
    """A number or text as it is, several numbers as a vector or as rows, None as an empty one."""
    if isinstance(value, str | int | float):
        return value
    return np.array([] if value is None else value, dtype=np.float64)


def _spec_units(kind: type) -> dict[str, Any]:
    """Units of a spec's quantities, also in specs within it; of ratios "1"."""
    hints = get_type_hints(kind, include_extras=True)
    units = {
        name: _spec_units(one) if isinstance(one, type) and is_dataclass(one) else _unit(one)
        for name, one in hints.items()
    }
    return {name: unit for name, unit in units.items() if unit}


def _unit(hint: Any) -> str:
    """SI unit of a field; empty if it is no quantity."""
    if isinstance(hint, Unit):
        return hint.symbol if hint.symbol not in ("dB", "ppm") else "1"
    notes = getattr(hint, "__metadata__", ())
    return next(filter(None, map(_unit, (*notes, *get_args(hint)))), "")


def _units(group: ArrayGroup) -> dict[str, str]:
    return {name: array.units for name, array in group.arrays.items()}


def _value(array: NamedArray) -> Any:
    return _names(array.values) if isinstance(array.values, tuple) else array.values


def _names(values: list[Any] | tuple[Any, ...]) -> Any:
    """Names as a cell array of texts; numbers as a vector."""
    if all(isinstance(value, str) for value in values):
        return _cells(list(values))
    return np.array(values, dtype=np.float64)


def _cells(values: list[Any]) -> Any:
    """A cell array of one column."""
    cells = np.empty((len(values), 1), dtype=object)
    for number, value in enumerate(values):
        cells[number, 0] = value
    return cells
