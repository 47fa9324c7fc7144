"""Grid of a Monte Carlo study: the table of its file, its axes, and the seeds of its trials."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Annotated, Any, Final

import numpy as np

from polychirp.errors import InputError
from polychirp.spec import Spec
from polychirp.units import Between

Label = str | int | float
"""Name of one value of an axis, in tables and coordinates."""

OWN_AXES: Final = ("trial", "victim", "target", "nature", "frame")
"""Axes of the results that are not axes of the grid."""

_PLACES: Final = ("range", "range_rate", "azimuth", "elevation")
_TAKEN: Final = frozenset(
    (
        *("seed", "num_trials", "study_hash", "axis", "first", "other", "radar", "trials"),
        *(f"{name}{what}" for name in _PLACES for what in ("", "_error", "_rmse")),
        *("length", "width", "range_rate_span"),
        *("visible_length", "visible_width", "visible_range_rate_span"),
        *("detected", "found", "missed", "in_sight", "out_of_sight", "unresolved"),
        *("num_points", "num_detections", "num_unresolved", "num_out_of_sight"),
        *("detection", "detections", "ghost", "ghosts", "unexplained"),
        *("detection_sinr", "echo_snr", "snr", "inr", "sinr", "mitigated_sinr", "floor_rise"),
        *("lost", "longest_loss", "until_free"),
    )
)
"""Names of arrays of the results and of columns of their tables and of the data of their figures,
without units and limits."""

MOST_POINTS: Final = 10_000
"""Greatest number of points of a grid; chosen: all are checked before the first trial runs."""

_FIXED_KEYS: Final = {
    "seed": "every trial gets its own; set the number of trials with trials",
    "name": "all points of a grid belong to one study",
    "monte_carlo": "a grid cannot change itself",
}
"""Keys that a grid may not change, and why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice(Spec):
    """One value of a named axis: keys of the study that change together.

    Parameters
    ----------
    label : name of the value, in tables and coordinates
    set : values by dotted path, as for ``--set``
    """

    label: str
    set: dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedAxis(Spec):
    """An axis of a grid, with a name.

    Parameters
    ----------
    name : name of the axis
    values : values of the axis, in order
    """

    name: str
    values: tuple[Choice, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MonteCarlo(Spec):
    """The table ``[monte_carlo]`` of a study file: the number of trials and the grid.

    Every combination of the values of all axes is a point. Trial n has the same seed at every
    point, so that points differ only by the keys of the grid.

    Parameters
    ----------
    trials : greatest number of trials of each point
    stop_half_width : if given, a point stops as soon as the 95 % interval of the detection
        probability of each of its victims has this half width or less
    grid : values by dotted path, as for ``--set``; ``*`` stands for every entry of a list
    axes : further axes, with names, labels and keys that change together

    Examples
    --------
    >>> study = MonteCarlo(trials=10, grid={"radars.*.start_time": ["0 s", "1 us"]})
    >>> axes_of_grid(study)[0].name, axes_of_grid(study)[0].labels
    ('start_time', ('0 s', '1 us'))
    """

    trials: Annotated[int, Between(greatest=1_000_000)]
    stop_half_width: float | None = None
    grid: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    axes: tuple[NamedAxis, ...] = ()

    def __post_init__(self) -> None:
        if self.trials < 1:
            raise InputError(f"trials is {self.trials}; a point needs 1 or more")
        if self.stop_half_width is not None and not 0.0 < self.stop_half_width < 0.5:
            raise InputError(
                f"stop_half_width is {self.stop_half_width:g}; it is a difference of "
                "probabilities, so try 0.02"
            )
        axes_of_grid(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One axis of a grid.

    Parameters
    ----------
    name : name of the axis
    labels : label of each value
    changes : for each value, pairs of dotted path and value
    """

    name: str
    labels: tuple[Label, ...]
    changes: tuple[tuple[tuple[str, Any], ...], ...]

    def __post_init__(self) -> None:
        if not re.fullmatch(r"\w[\w.-]*", self.name) or self.name in OWN_AXES:
            raise InputError(
                f"an axis cannot be called '{self.name}'; give it a name of letters, digits, '_', "
                f"'-' and '.', other than {', '.join(OWN_AXES)}"
            )
        if not self.labels:
            raise InputError(f"axis '{self.name}' has no values; give it one or more")
        twice = [label for n, label in enumerate(self.labels) if label in self.labels[:n]]
        if twice:
            raise InputError(f"axis '{self.name}' has '{twice[0]}' twice; give each label once")
        for path, _ in (change for value in self.changes for change in value):
            first = path.partition(".")[0].strip()
            if first in _FIXED_KEYS:
                raise InputError(f"a grid cannot change {first}: {_FIXED_KEYS[first]}")
        if is_taken(self.name):
            raise InputError(
                f"an axis cannot be called '{self.name}': the results have an array or a column of "
                f"this name; call it 'set_{self.name}', for example"
            )


def is_taken(name: str) -> bool:
    """True if the results have an array, or one of their tables a column, of this name.

    >>> is_taken("length"), is_taken("range_rmse_m_low"), is_taken("road_length")
    (True, True, False)
    """
    bare = re.sub(r"(_m|_m_per_s|_rad)?(_low|_high)?$", "", name)
    return name in _TAKEN or bare in _TAKEN or name.startswith("detections_")


def axes_of_grid(table: MonteCarlo) -> tuple[Axis, ...]:
    """All axes: those of ``grid``, then those with names, in the order of the file."""
    names = _short_names([*table.grid])
    plain = [
        Axis(
            name=name,
            labels=tuple(_label(value) for value in values),
            changes=tuple(((path, value),) for value in values),
        )
        for name, (path, values) in zip(names, table.grid.items(), strict=True)
    ]
    named = [
        Axis(
            name=axis.name,
            labels=tuple(choice.label for choice in axis.values),
            changes=tuple(tuple(choice.set.items()) for choice in axis.values),
        )
        for axis in table.axes
    ]
    axes = (*plain, *named)
    names = [axis.name for axis in axes]
    for n, name in enumerate(names):
        if name in names[:n]:
            raise InputError(f"two axes are called '{name}'; give each its own name")
    return axes


def _short_names(paths: Sequence[str]) -> list[str]:
    """Names of paths: their shortest unique tails that begin with neither a number nor ``kind``.

    A tail that the results have as a name of their own is not used, if there is a longer one.
    """
    keys = [[key.strip() for key in path.split(".") if key.strip() != "*"] for path in paths]
    names = []
    for own in keys:
        for depth in range(1, len(own) + 1):
            tail = own[-depth:]
            alike = sum(other[-depth:] == tail for other in keys)
            is_free = not is_taken("_".join(tail))
            if alike == 1 and tail[0] != "kind" and not tail[0].isdigit() and is_free:
                break
        else:
            tail = own
        names.append("_".join(tail))
    return names


def _label(value: Any) -> Label:
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        return value
    return re.sub(r"[{}'\"\[\]]", "", str(value).lower() if isinstance(value, bool) else str(value))


def combinations(axes: Sequence[Axis]) -> list[tuple[int, ...]]:
    """Indices of the values of each point, one per axis; the last axis changes fastest.

    `InputError` is raised if there are more than `MOST_POINTS` points.
    """
    count = math.prod(len(axis.labels) for axis in axes)
    if count > MOST_POINTS:
        raise InputError(
            f"the grid has {count:.3g} points, more than {MOST_POINTS}; give its axes fewer values"
        )
    return list(product(*(range(len(axis.labels)) for axis in axes)))


def trial_seed(seed: int, trial: int) -> int:
    """Seed of trial number ``trial`` of every point of a study with ``seed``.

    It depends on nothing else, and is below 2⁵², so that every reader of JSON keeps it exactly.

    >>> trial_seed(1, 0) == trial_seed(1, 1)
    False
    """
    if seed < 0:
        raise InputError(f"seed: is {seed}; use 0 or more")
    word = np.random.SeedSequence([seed, trial]).generate_state(1, np.uint64)[0]
    return int(word >> np.uint64(12))
