"""Parts of the kernels that studies need, and their compilation before a study runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Final

from polychirp.kernel_cache import Compiled, Part, Progress, cache_folder, compile_ahead

if TYPE_CHECKING:
    from polychirp.study.spec import Study

WORKER: Final = "polychirp.study.warm_up"
"""Module that compiles the parts."""

PARTS: Final = {
    part.name: part
    for part in (
        Part(name="visibility", duration=12.0, kernels=51),
        Part(name="bounces", duration=30.0, kernels=128),
        Part(name="facets", duration=26.0, kernels=104),
        Part(name="synthesis", duration=19.0, kernels=46),
        Part(name="codes", duration=1.0, kernels=1),
        Part(name="bundles", duration=9.0, kernels=17),
        Part(name="edges", duration=8.0, kernels=43),
        Part(name="tables", duration=1.0, kernels=1),
        Part(name="targets", duration=1.0, kernels=1),
        Part(name="profiles", duration=1.0, kernels=1),
        Part(name="range-Doppler", duration=1.0, kernels=1),
        Part(name="coherent", duration=47.0, kernels=76),
        Part(name="point vehicles", duration=2.0, kernels=5),
    )
}
"""All parts, in the order of compilation: bounces and facets use kernels of visibility. Durations
are the CPU time, s, that one worker took for all parts on a busy machine; kernels are counted in
the same run, in which a part compiles what those before it left. Only the announcement and the
progress use them."""

OF_PAPER: Final = tuple(
    name for name in PARTS if name not in ("point vehicles", "range-Doppler", "codes")
)
"""Parts that the paper's scenarios need."""

FEWEST_BUNDLED: Final = 20
"""Number of points and radars of a study from which on the kernels of bundles are compiled; chosen
below 24, the number of paths from which on the engine synthesises them in bundles."""

_ANY_TRIAL: Final = ("synthesis", "targets", "tables")
_OF_RECEIVER: Final = {
    "range-doppler": "range-Doppler",
    "decoding": "range-Doppler",
    "mfsk": "range-Doppler",
    "coherent": "coherent",
    "paper": "profiles",
}
_STREET: Final = ("visibility", "bounces", "facets", "bundles", "edges")
_OF_TRACER: Final = {
    "free-space": (),
    "point-vehicles": ("visibility", "point vehicles", "bundles"),
    "sionna": ("visibility", "bundles"),
}
"""Parts that a tracer's paths need, by its ``kind``; `_STREET` for one that is not listed."""


def parts_of(study: Study) -> tuple[str, ...]:
    """Names of the parts that a trial of this study needs.

    >>> from polychirp.study.paper.scenarios import paper_study
    >>> parts_of(paper_study("diverse"))[:5]
    ('visibility', 'bounces', 'facets', 'synthesis', 'bundles')
    """
    kinds = _receiver_kinds(study)
    names = [_OF_RECEIVER[kind] for kind in kinds if kind in _OF_RECEIVER]
    # a tracer of the caller's own may have no kind
    tracer = getattr(study.tracer, "kind", "")
    names += [*_ANY_TRIAL, *_OF_TRACER.get(tracer, _STREET)]
    if _has_codes(study):
        names.append("codes")
    if len(study.street.points) + len(study.radars) >= FEWEST_BUNDLED:
        names.append("bundles")
    return _ordered(names)


def _has_codes(study: Study) -> bool:
    """True if the ramps of one of the study's radars carry a code."""
    from polychirp.study.spec import schedules_of

    return any(schedule.code is not None for schedule in schedules_of(study))


def _receiver_kinds(study: Study) -> set[str]:
    """Kinds of the receivers that the study's victims have."""
    from polychirp.receiver.selection import receiver_for
    from polychirp.study.spec import schedule_of, victim_indices

    radars = [study.radars[number] for number in victim_indices(study)]
    return {receiver_for(study.receiver, schedule_of(study, radar)).kind for radar in radars}


def parts_of_rcs(*, max_bounces: int) -> tuple[str, ...]:
    """Names of the parts that the radar cross section of a mesh needs."""
    return _ordered(("visibility", "facets", *(["bounces"] if max_bounces > 1 else [])))


def parts_of_all(studies: Iterable[Study]) -> tuple[str, ...]:
    """Names of the parts that any of these studies needs."""
    return _ordered([name for study in studies for name in parts_of(study)])


def _ordered(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in PARTS if name in names)


def compile_parts(names: Sequence[str], *, progress: Progress | None = None) -> Compiled:
    """Compile what the cache does not have of these parts; `compile_ahead` says how.

    A process looks at the cache once for each set of names.
    """
    key = tuple(names)
    if key in _known():
        return Compiled(folder=cache_folder())
    done = compile_ahead([PARTS[name] for name in names], worker=WORKER, progress=progress)
    _known().add(key)
    return done


def compile_all(*, progress: Progress | None = None) -> Compiled:
    """Compile what the cache does not have of all parts."""
    return compile_parts(tuple(PARTS), progress=progress)


@cache
def _known() -> set[tuple[str, ...]]:
    """Sets of names of parts that this process found in the cache or compiled."""
    return set()
