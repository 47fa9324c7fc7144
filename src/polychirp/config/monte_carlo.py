"""Reader of study files with a table ``[monte_carlo]``: a `Plan` with a study for each point."""

import shlex
from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from polychirp.config.dump import inline
from polychirp.config.load import (
    MONTE_CARLO,
    build,
    naming_the_file,
    read_toml,
    study_of_tables,
)
from polychirp.config.override import apply_override, set_value
from polychirp.errors import InputError
from polychirp.study.monte_carlo.grid import (
    Axis,
    MonteCarlo,
    axes_of_grid,
    combinations,
)
from polychirp.study.monte_carlo.plan import Plan, Point, complaints
from polychirp.study.provenance import provenance

MOST_TRIALS: Final = 10_000_000
"""Greatest number of trials over all points of a study's grid. Chosen."""

Changes = list[tuple[str, Any]]


def load_plan(
    path: Path | str,
    *,
    overrides: Iterable[str] = (),
    program: str = "polychirp",
    common: Path | str | Sequence[Path | str] | None = None,
) -> Plan:
    """The Monte Carlo study that a TOML file describes.

    The tables of the file ``common``, if there is one, first complete those of the study, so that
    several studies can share radars, receiver and grid; of several such files, each completes what
    the study and those before it lack. The ``overrides`` then change the tables,
    those of the grid included, as in ``monte_carlo.trials=20``, and each point of the grid sets its
    own values. The command that runs a point begins with ``program``; with a common file no command
    does. `InputError` is raised if there is no table ``[monte_carlo]``, the table is wrong, or
    points of its grid are no valid studies; the message lists every problem with its place and the
    points that have it.

    `run_plan` runs it.
    """
    path, overrides = Path(path), [*overrides]
    data = read_toml(path)
    shared = (common,) if isinstance(common, str | Path) else (common or ())
    for file in shared:
        advice = "name a file with the tables that all studies share"
        data = completed(data, read_toml(Path(file), if_missing=advice))
    with naming_the_file(path):
        for change in overrides:
            apply_override(data, change)
        if MONTE_CARLO not in data:
            raise InputError(
                f"{MONTE_CARLO}: is missing; add the table [{MONTE_CARLO}] with trials = 100, or "
                "use 'polychirp run' for a single trial"
            )
        table = build(MonteCarlo, data.pop(MONTE_CARLO), where=lambda place: (MONTE_CARLO, *place))
        base = study_of_tables(data, folder=path.parent)
        axes = axes_of_grid(table)
        num_trials = len(combinations(axes)) * table.trials
        if num_trials > MOST_TRIALS:
            raise InputError(
                f"{MONTE_CARLO}.trials: {table.trials} at every point are {num_trials} trials, "
                f"more than {MOST_TRIALS}; use fewer trials or points"
            )
        kept = [change for change in overrides if not change.startswith(f"{MONTE_CARLO}.")]
        return Plan(
            axes=axes,
            points=_points(
                axes,
                data,
                path=path,
                command=None if shared else [program, "run", str(path), *_options(kept)],
            ),
            trials=table.trials,
            stop_half_width=table.stop_half_width,
            origin=provenance(base),
        )


def refuse_bad_grid(path: Path | str, *, overrides: Iterable[str] = ()) -> None:
    """Refuse a table ``[monte_carlo]`` that `load_plan` would refuse, without building every point.

    Each value of an axis is tried once, beside the first values of all others. A table without
    ``trials`` is left alone, because a common file may complete it.
    """
    path = Path(path)
    data = read_toml(path)
    with naming_the_file(path):
        for change in overrides:
            apply_override(data, change)
        table = data.pop(MONTE_CARLO, {})
        if isinstance(table, dict) and "trials" not in table:
            return
        axes = axes_of_grid(build(MonteCarlo, table, where=lambda place: (MONTE_CARLO, *place)))
        first = [replace(axis, labels=axis.labels[:1], changes=axis.changes[:1]) for axis in axes]
        for number, axis in enumerate(axes):
            others = [*first[:number], axis, *first[number + 1 :]]
            _points(others, data, path=path, command=None)


def completed(tables: dict[str, Any], common: dict[str, Any]) -> dict[str, Any]:
    """Tables with the keys that they lack taken from ``common``, also in tables within tables.

    >>> completed({"a": {"b": 1}}, {"a": {"b": 2, "c": 3}, "d": 4})
    {'a': {'b': 1, 'c': 3}, 'd': 4}
    """
    out = {key: value for key, value in common.items() if key not in tables}
    for key, value in tables.items():
        both = isinstance(value, dict) and isinstance(common.get(key), dict)
        out[key] = completed(value, common[key]) if both else value
    return {key: out[key] for key in [*tables, *(key for key in common if key not in tables)]}


def _points(
    axes: Sequence[Axis], data: dict[str, Any], *, path: Path, command: list[str] | None
) -> tuple[Point, ...]:
    points, found, names = [], [], []
    for numbers in combinations(axes):
        labels = tuple(axis.labels[n] for axis, n in zip(axes, numbers, strict=True))
        name = ", ".join(f"{a.name} = {v}" for a, v in zip(axes, labels, strict=True))
        names.append(name)
        changes = [
            change for axis, n in zip(axes, numbers, strict=True) for change in axis.changes[n]
        ]
        try:
            study = study_of_tables(_changed(data, changes), folder=path.parent)
        except InputError as error:
            found.append((name, str(error).splitlines()))
            continue
        written = _options(f"{key}={inline(value)}" for key, value in changes)
        points.append(
            Point(
                labels=labels,
                study=study,
                study_hash=provenance(study).study_hash,
                command=None if command is None else shlex.join([*command, *written]),
            )
        )
    if found:
        raise InputError("\n".join(complaints(found, points=names)))
    return tuple(points)


def _changed(data: dict[str, Any], changes: Changes) -> dict[str, Any]:
    tables = deepcopy(data)
    for path, value in changes:
        set_value(tables, path, value)
    return tables


def _options(changes: Iterable[str]) -> list[str]:
    """Words of a command line that make these changes to a study."""
    return [word for change in changes for word in ("--set", change)]
