"""Origin of stored numbers: the study as canonical text, its hash, versions and platform."""

import json
import platform
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePath
from typing import Any, Final

from polychirp.errors import InputError
from polychirp.study.spec import Study

LIBRARIES: Final = ("polychirp", "numpy", "scipy", "numba", "zarr")
"""Packages whose versions can change a result; each result is stored with them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """All that is needed to compute the same results again.

    `provenance` gives it for a `Study`.

    Parameters
    ----------
    study : the study as canonical JSON, in SI units, defaults included
    study_hash : SHA-256 of the text ``study``
    seed : seed of all random streams
    versions : version of each of `LIBRARIES`, by name
    platform : operating system, processor and Python
    """

    study: str
    study_hash: str
    seed: int
    versions: dict[str, str]
    platform: str


def versions() -> dict[str, str]:
    """Version of each of `LIBRARIES`, by name."""
    return {name: _version(name) for name in LIBRARIES}


def provenance(study: Study) -> Provenance:
    """Provenance of results that are computed from ``study``.

    Equal studies have equal text and hash: no time of day is stored, and a mesh file is identified
    by its name without folder and by its contents. `InputError` is raised if a mesh file cannot be
    read.

    `save_run` stores it with the results.
    """
    text = canonical_json(_with_mesh_contents(study))
    return Provenance(
        study=text,
        study_hash=sha256(text.encode()).hexdigest(),
        seed=study.seed,
        versions=versions(),
        platform=f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
    )


def _with_mesh_contents(study: Study) -> Study:
    vehicles = tuple(
        vehicle if vehicle.mesh is None else replace(vehicle, mesh=_content(Path(vehicle.mesh)))
        for vehicle in study.street.vehicles
    )
    return replace(study, street=replace(study.street, vehicles=vehicles))


def _content(path: Path) -> str:
    try:
        return f"{path.name} sha256:{sha256(path.read_bytes()).hexdigest()}"
    except OSError as error:
        raise InputError(f"the mesh file '{path}' cannot be read: {error.strerror}") from None


def canonical_json(spec: Any) -> str:
    """A spec as JSON: keys sorted, SI numbers in their shortest exact form, defaults included.

    >>> from polychirp.frames import Pose
    >>> canonical_json(Pose(yaw=0.5))[:27]
    '{"pitch": 0.0, "roll": 0.0,'
    """
    return json.dumps(plain(spec), sort_keys=True, ensure_ascii=False)


def plain(value: Any) -> Any:
    """A spec as dicts, lists and plain values; the names of its types are left out."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, PurePath):
        return value.as_posix()
    return value.value if isinstance(value, Enum) else value


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "absent"
