"""Reader of study files: a `Study`, or every problem of the file in one message."""

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from pydantic import TypeAdapter, ValidationError

from polychirp.bounded_text import text_of, toml_tables
from polychirp.config.absent import ABSENT, without_absent
from polychirp.config.override import apply_override
from polychirp.config.problems import Place, problems
from polychirp.errors import InputError
from polychirp.spec import Spec
from polychirp.study.spec import Study

S = TypeVar("S", bound=Spec)

MONTE_CARLO: Final = "monte_carlo"
"""Key of the table in a study file that asks for many trials."""


def load_study(path: Path | str, *, overrides: Iterable[str] = ()) -> Study:
    """The study that a TOML file describes.

    The ``overrides``, each like ``radars.0.start_time=1 ms``, change the tables of the file first.
    Then keys of ``[defaults.radar]`` go into every ``[[radars]]`` that does not give them itself.
    Paths of mesh files are relative to the study file. A table ``[monte_carlo]`` is not read here,
    but in `config.monte_carlo`. `InputError` is raised if the file cannot be read, is not TOML, or
    does not describe a study; the message lists every problem with its place.

    `dump` writes a study as such a file.
    """
    path = Path(path)
    data = read_toml(path)
    with naming_the_file(path):
        return study_of_tables(_changed(data, overrides), folder=path.parent)


def radar_tables(path: Path | str, *, overrides: Iterable[str] = ()) -> list[dict[str, Any]]:
    """Tables of the radars of a study file that `load_study` reads, with the defaults for radars.

    They have the keys that the file gives, but none that has its value by default.
    """
    return list(with_defaults(_changed(read_toml(Path(path)), overrides))["radars"])


def _changed(data: dict[str, Any], overrides: Iterable[str]) -> dict[str, Any]:
    """Tables of a study file after the changes, without that of many trials."""
    for change in overrides:
        apply_override(data, change)
    data.pop(MONTE_CARLO, None)
    return data


@contextmanager
def naming_the_file(path: Path) -> Iterator[None]:
    """Put the name of the file in front of the message of an `InputError`."""
    try:
        yield
    except InputError as error:
        raise InputError(f"this study cannot be read: {path}\n{_indented(str(error))}") from None


def study_of_tables(data: dict[str, Any], *, folder: Path) -> Study:
    """The study that the tables of a file in ``folder`` describe."""
    study = build(Study, with_defaults(data), where=partial(_as_written, data=data))
    return _with_meshes_from(folder, study)


def _with_meshes_from(folder: Path, study: Study) -> Study:
    """The study with ``folder`` put before the paths of its mesh files."""
    vehicles = tuple(
        vehicle if vehicle.mesh is None else replace(vehicle, mesh=str(folder / vehicle.mesh))
        for vehicle in study.street.vehicles
    )
    return replace(study, street=replace(study.street, vehicles=vehicles))


def read_toml(path: Path, *, if_missing: str = "") -> dict[str, Any]:
    """Tables of a TOML file; an `InputError` says why it cannot be read, with the line if known.

    ``if_missing`` is the advice for a file that does not exist, instead of ``polychirp init``.
    """
    try:
        return toml_tables(text_of(path))
    except FileNotFoundError:
        advice = if_missing or f"'polychirp init {path}' writes one to start from"
        raise InputError(f"there is no file '{path}'; {advice}") from None
    except IsADirectoryError:
        raise InputError(f"'{path}' is a folder; name the study file in it") from None
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"'{path}' is not a text file in UTF-8; a study is TOML text") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"this study cannot be read: {path}\n  {_with_its_place_first(str(error))}"
        ) from None
    except InputError as error:
        raise InputError(f"this study cannot be read: {path}\n  {error}") from None


def with_defaults(data: dict[str, Any]) -> dict[str, Any]:
    """The tables with ``defaults.radar`` moved into every radar.

    Inner tables are merged key by key, unless a radar's table has another ``kind``. `InputError` is
    raised if ``defaults`` holds something else than the table ``radar``.

    >>> with_defaults({"defaults": {"radar": {"vehicle": "car"}}, "radars": [{"name": "front"}]})
    {'radars': [{'vehicle': 'car', 'name': 'front'}]}
    """
    defaults = data.get("defaults", {})
    if not isinstance(defaults, dict):
        raise InputError("defaults: must be a table, as in [defaults.radar]")
    for key in defaults.keys() - {"radar"}:
        raise InputError(f"defaults.{key}: unknown key; only [defaults.radar] is known")
    shared = defaults.get("radar", {})
    if not isinstance(shared, dict):
        raise InputError("defaults.radar: must be a table, as in [defaults.radar]")
    merged = {key: value for key, value in data.items() if key != "defaults"}
    if isinstance(merged.get("radars"), list):
        merged["radars"] = [_merged(shared, radar) for radar in merged["radars"]]
    return merged


def _as_written(place: Place, data: dict[str, Any]) -> Place:
    """Place in the file of a problem that was found after defaults were merged."""
    if len(place) < 3 or place[0] != "radars" or not isinstance(place[1], int):
        return place
    own, shared = data["radars"][place[1]], data.get("defaults", {}).get("radar", {})
    for key in place[2:]:
        if not (isinstance(shared, dict) and key in shared):
            return place
        if not (isinstance(own, dict) and key in own):
            return ("defaults", "radar", *place[2:])
        own, shared = own[key], shared[key]
    return place


def _merged(default: Any, own: Any) -> Any:
    if not (isinstance(default, dict) and isinstance(own, dict)):
        return own
    if "kind" in own and own["kind"] != default.get("kind", own["kind"]):
        return own
    return {
        **default,
        **{key: _merged(default[key], own[key]) if key in default else own[key] for key in own},
    }


def build(spec: type[S], data: object, *, where: Callable[[Place], Place] = tuple) -> S:
    """A spec from the tables and values of a file; "none" removes an optional value.

    ``where`` gives the place in the file of a problem, from its place in ``data``. An `InputError`
    has one line for each problem: where it is, what is wrong, what would work.

    >>> from polychirp.waveform import Triangular
    >>> build(Triangular, {"bandwidth": "1 GHz"}).bandwidth
    1000000000.0
    """
    # strict mode turns JSON's lists into tuples and objects into specs, but not "3" or true into 3
    text = json.dumps(data, default=str)
    if f'"{ABSENT}"' in text:  # few studies have it, and the search for its fields takes time
        text = json.dumps(without_absent(data, spec), default=str)
    try:
        built: S = _reader(cast("Any", spec)).validate_json(text, strict=True)
    except ValidationError as error:
        found = problems(error.errors(include_url=False), spec=spec)
        raise InputError(_listed((where(place), sentence) for place, sentence in found)) from None
    return built


@cache
def _reader(spec: Any) -> TypeAdapter[Any]:
    return TypeAdapter(spec)


def _listed(found: Iterable[tuple[Place, str]]) -> str:
    """One line for each problem, in their order, without repetitions."""
    lines = []
    for place, sentence in found:
        path = ".".join(str(part) for part in place)
        lines.append(f"{path}: {sentence}" if path else sentence)
    return "\n".join(dict.fromkeys(lines))


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())


def _with_its_place_first(message: str) -> str:
    """Message 'line 3, column 5: …' from the TOML reader's '… (at line 3, column 5)'."""
    found = re.fullmatch(r"(.*) \(at (.*)\)", message, re.DOTALL)
    if found is None:
        return message
    reason = found[1][:1].lower() + found[1][1:]
    return f"{found[2]}: {reason}; TOML is written like 'name = \"text\"' or '[table]'"
