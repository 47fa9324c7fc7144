"""Reader of study files with a table ``[monte_carlo]``: a `Plan` with a study for each point."""

import shlex
from collections.abc import Iterable, Sequence
from copy import deepcopy
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
    path: Path | str, *, overrides: Iterable[str] = (), program: str = "polychirp"
) -> Plan:
    """The Monte Carlo study that a TOML file describes.

    The ``overrides`` change the tables of the file first, those of the grid included, as in
    ``monte_carlo.trials=20``. Then each point of the grid sets its own values. The command that
    runs a point begins with ``program``. `InputError` is raised if the file has no table
    ``[monte_carlo]``, the table is wrong, or points of its grid are no valid studies; the message
    lists every problem with its place and the points that have it.

    `run_plan` runs it.
    """
    path, overrides = Path(path), [*overrides]
    data = read_toml(path)
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
                axes, data, path=path, command=[program, "run", str(path), *_options(kept)]
            ),
            trials=table.trials,
            stop_half_width=table.stop_half_width,
            origin=provenance(base),
        )


def _points(
    axes: Sequence[Axis], data: dict[str, Any], *, path: Path, command: list[str]
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
                command=shlex.join([*command, *written]),
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
