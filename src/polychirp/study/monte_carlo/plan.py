"""`Plan` — the studies of all points of a grid, and its check before any trial runs."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from polychirp.errors import CapabilityError, InputError, PhysicsError
from polychirp.study.check import check
from polychirp.study.monte_carlo.grid import Axis, Label, trial_seed
from polychirp.study.provenance import Provenance
from polychirp.study.spec import Study


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One combination of the values of all axes.

    Parameters
    ----------
    labels : label of the point's value on each axis
    study : study of the point, with the seed of the whole grid
    study_hash : hash of ``study``; finished trials of the point are stored under it
    command : command line that runs the point once, to which ``--seed`` must be added; None if no
        command does
    """

    labels: tuple[Label, ...]
    study: Study
    study_hash: str
    command: str | None

    def trial(self, number: int) -> Study:
        """Study of trial ``number``, which differs from the point's study by its seed alone."""
        return replace(self.study, seed=trial_seed(self.study.seed, number))


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A Monte Carlo study, ready to run.

    `load_plan` makes it from a study file, and `run_plan` runs it.

    Parameters
    ----------
    axes : axes of the grid
    points : all points; the value of the last axis changes fastest
    trials : greatest number of trials of each point
    stop_half_width : half width of the 95 % interval of the detection probability at which a point
        stops; None: no point stops early
    origin : provenance of the study in its file, without the grid
    """

    axes: tuple[Axis, ...]
    points: tuple[Point, ...]
    trials: int
    stop_half_width: float | None
    origin: Provenance

    def __post_init__(self) -> None:
        first: dict[str, Point] = {}
        for point in self.points:
            twin = first.setdefault(point.study_hash, point)
            if twin is not point:
                raise InputError(
                    f"{self.where(twin)} and {self.where(point)} are one and the same study; "
                    "check the keys of the grid, or remove one of the values"
                )

    def where(self, point: Point) -> str:
        """Name of each axis and label of the point on it, as text for messages."""
        pairs = zip(self.axes, point.labels, strict=True)
        return ", ".join(f"{axis.name} = {label}" for axis, label in pairs) or "the only point"


def complaints(found: Iterable[tuple[str, Sequence[str]]], *, points: Sequence[str]) -> list[str]:
    """One line for each problem, with the points at which it occurs.

    >>> complaints([("a", ["x.y: is missing"]), ("b", ["x.y: is missing"])], points=["a", "b", "c"])
    ['x.y: is missing (at a, and 1 more)']
    """
    where: dict[str, list[str]] = {}
    for point, sentences in found:
        for sentence in sentences:
            where.setdefault(sentence, []).append(point)
    return [f"{sentence}{_at(names, points)}" for sentence, names in where.items()]


def _at(names: Sequence[str], points: Sequence[str]) -> str:
    if len(names) == len(points):
        return "" if len(points) == 1 else " (at every point)"
    return f" (at {names[0]}{f', and {len(names) - 1} more' if len(names) > 1 else ''})"


def check_plan(plan: Plan, *, progress: Callable[[str, int, int], None]) -> None:
    """Refuse a plan if `check` refuses the first trial of any point.

    The message lists every problem and its points; it is an `InputError` if any problem is one, and
    else a `PhysicsError`.
    """
    found: list[tuple[str, list[str]]] = []
    refused_by_physics = True
    for number, point in enumerate(plan.points):
        progress("checking", number, len(plan.points))
        try:
            check(point.trial(0))
        except (InputError, PhysicsError, CapabilityError) as error:
            refused_by_physics &= not isinstance(error, InputError)
            lines = str(error).splitlines()
            found.append((plan.where(point), [line.strip() for line in lines[1:] or lines]))
    progress("checking", len(plan.points), len(plan.points))
    if found:
        names = [plan.where(point) for point in plan.points]
        lines = complaints(found, points=names)
        text = "\n".join(f"  {line}" for line in lines)
        sentence = f"this study cannot run over its grid: {plan.points[0].study.name}\n{text}"
        raise PhysicsError(sentence) if refused_by_physics else InputError(sentence)
