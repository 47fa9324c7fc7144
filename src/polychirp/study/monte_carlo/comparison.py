"""Comparison of schemes over scenarios: results of several studies with one grid, in one table.

The last axis of the grid holds the schemes that are compared. Every scenario, and every combination
of labels on the other axes, is a condition under which all schemes meet the same trials.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.scoring.causes import Nature
from polychirp.scoring.statistics import Estimate, mean_count, proportion, ratio_difference
from polychirp.study.monte_carlo.grid import Label
from polychirp.study.monte_carlo.plan import Plan
from polychirp.study.monte_carlo.records import NATURES
from polychirp.study.monte_carlo.results import Results
from polychirp.study.monte_carlo.summary import losses

_IS_GHOST: Final = np.array([Nature(name).is_ghost for name in NATURES])
_UNEXPLAINED: Final = NATURES.index(Nature.UNEXPLAINED.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One scheme under one condition, over all victims; a trial counts as one draw.

    Parameters
    ----------
    scenario : name of the study
    condition : labels on all axes but the last
    scheme : label on the last axis
    num_trials : number of trials with a result
    detection : probability that a target in sight is detected
    ghosts, unexplained : mean number in a frame; ``unexplained`` are those ghosts that no signal of
        a radar explains
    errors : mean number of missed targets and ghosts in a frame
    behind : mean number of errors less that of the condition's best scheme, trials paired
    lost, longest_loss : share of frames that interference takes, and mean of the greatest number
        in a row; unknown but for rules that act from frame to frame
    """

    scenario: str
    condition: tuple[Label, ...]
    scheme: Label
    num_trials: int
    detection: Estimate
    ghosts: Estimate
    unexplained: Estimate
    errors: Estimate
    behind: Estimate
    lost: Estimate
    longest_loss: Estimate

    @property
    def is_among_the_best(self) -> bool:
        """True unless the interval of the difference from the best scheme is above zero."""
        return not self.behind.low > 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Counts:
    """Counts of one point: numbers of the trials with a result, and for each of them the rest.

    ``found`` and ``seen`` are sums over the victims of a trial; ``ghosts``, ``unexplained`` and
    ``missed`` are means over them, which are the numbers in a frame.
    """

    trial: FloatArray
    found: FloatArray
    seen: FloatArray
    missed: FloatArray
    ghosts: FloatArray
    unexplained: FloatArray

    @property
    def errors(self) -> FloatArray:
        """Missed targets and ghosts in a frame of every trial, ``(trial,)``."""
        return np.asarray(self.missed + self.ghosts)


def refuse_unlike(plans: Sequence[Plan]) -> None:
    """Refuse studies that cannot be compared.

    Raises
    ------
    InputError
        Two studies have one name, their grids differ, or the grid has no axis of schemes.
    """
    first = plans[0]
    if not first.axes:
        raise InputError(
            f"{first.points[0].study.name}: its grid has no axis, and so no schemes to compare; "
            "add a table [[monte_carlo.axes]] with one value for each scheme"
        )
    names: set[str] = set()
    for plan in plans:
        name = plan.points[0].study.name
        if name in names:
            raise InputError(f"two studies are called '{name}'; give each scenario its own name")
        names.add(name)
        for own, other in zip(_axes(first), _axes(plan), strict=False):
            if own != other:
                raise InputError(
                    f"{name}: its grid has the axis '{other[0]}' of {_listed(other[1])} where "
                    f"'{first.points[0].study.name}' has '{own[0]}' of {_listed(own[1])}; use one "
                    "grid for all of them, as in a file for --common"
                )
        if len(plan.axes) != len(first.axes):
            raise InputError(
                f"{name}: its grid has {len(plan.axes)} axes, and that of "
                f"'{first.points[0].study.name}' has {len(first.axes)}; use one grid for all of "
                "them, as in a file for --common"
            )


def _axes(plan: Plan) -> list[tuple[str, tuple[Label, ...]]]:
    return [(axis.name, axis.labels) for axis in plan.axes]


def _listed(labels: Sequence[Label]) -> str:
    return ", ".join(str(label) for label in labels)


def comparison(results: Mapping[str, Results]) -> list[Cell]:
    """All cells, by scenario, then condition, then scheme.

    The best scheme of a condition is the one with the fewest errors. ``results`` has those of every
    scenario by its name.
    """
    return [cell for name, one in results.items() for cell in _cells(name, one)]


def _cells(scenario: str, results: Results) -> Iterator[Cell]:
    points = range(len(results.study_hash))
    for condition, group in groupby(points, key=lambda n: results.labels(n)[:-1]):
        counts = {point: _counts(results, point) for point in group}
        known = {point: one for point, one in counts.items() if one.trial.size}
        if not known:
            continue
        best = min(known.values(), key=lambda one: float(one.errors.mean()))
        for point, one in known.items():
            frames = losses(results.lost[point])
            yield Cell(
                scenario=scenario,
                condition=condition,
                scheme=results.labels(point)[-1],
                num_trials=one.trial.size,
                detection=proportion(one.found, one.seen),
                ghosts=mean_count(one.ghosts),
                unexplained=mean_count(one.unexplained),
                errors=mean_count(one.errors),
                behind=_behind(one, best),
                lost=frames["lost"],
                longest_loss=frames["longest_loss"],
            )


def _behind(one: _Counts, best: _Counts) -> Estimate:
    common = np.intersect1d(one.trial, best.trial)
    errors = [some.errors[np.isin(some.trial, common)] for some in (one, best)]
    ones = np.ones(common.size)
    return ratio_difference((errors[0], ones), (errors[1], ones))


def _counts(results: Results, point: int) -> _Counts:
    was_run = ~np.any(np.isnan(results.num_detections[point, :, :, 0]), axis=1)
    detected = results.detected[point, was_run]
    numbers = results.num_detections[point, was_run].mean(axis=1)
    found = np.nansum(detected, axis=(1, 2))
    seen = np.sum(~np.isnan(detected), axis=(1, 2)).astype(np.float64)
    return _Counts(
        trial=np.flatnonzero(was_run).astype(np.float64),
        found=found,
        seen=seen,
        missed=(seen - found) / detected.shape[1],
        ghosts=numbers[:, _IS_GHOST].sum(axis=1),
        unexplained=numbers[:, _UNEXPLAINED],
    )


def columns(cells: Sequence[Cell]) -> dict[str, list[str | int | float]]:
    """The cells as columns of a table, with the limits of every estimate."""
    out: dict[str, list[str | int | float]] = {
        "scenario": [cell.scenario for cell in cells],
        "condition": [", ".join(str(label) for label in cell.condition) for cell in cells],
        "scheme": [cell.scheme for cell in cells],
        "num_trials": [cell.num_trials for cell in cells],
    }
    estimates = ("detection", "ghosts", "unexplained", "errors", "behind", "lost", "longest_loss")
    for name in estimates:
        for end in ("value", "low", "high"):
            key = name if end == "value" else f"{name}_{end}"
            out[key] = [getattr(getattr(cell, name), end) for cell in cells]
    return out
