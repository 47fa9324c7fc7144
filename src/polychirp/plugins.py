"""Classes that other installed packages add to polychirp, by their entry points."""

from dataclasses import is_dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, get_args, get_type_hints

from polychirp.errors import InputError


@cache
def plugged(group: str, method: str, base: type = object) -> tuple[type, ...]:
    """Classes of all entry points of a group, in the order of their names.

    Each must be a dataclass that inherits from ``base``, with the ``method``, and with a field
    ``kind: Literal["NAME"]`` whose value is the name of the entry point.

    Raises
    ------
    InputError
        A plug-in cannot be loaded, or its class lacks one of these.

    Examples
    --------
    >>> plugged("polychirp.nothing", "schedule")
    ()
    """
    entries = sorted(entry_points(group=group), key=lambda entry: entry.name)
    return tuple(_loaded(entry, method, base) for entry in entries)


def _loaded(entry: EntryPoint, method: str, base: type) -> type:
    package = entry.dist.name if entry.dist else "unknown"
    place = f"the plug-in '{entry.name}' of the package '{package}'"
    try:
        found: Any = entry.load()
    except Exception as error:  # any error of foreign code is one of the plug-in
        raise InputError(
            f"{place} cannot be loaded ({type(error).__name__}: {error}); repair or uninstall it"
        ) from error
    reason = _unfit(found, entry.name, method, base)
    if reason:
        raise InputError(f"{place} cannot be used: {reason}")
    return found  # type: ignore[no-any-return]


def _unfit(found: Any, name: str, method: str, base: type) -> str:
    """Reason why an object is no plug-in, as the end of a sentence; empty if it is one."""
    if not (isinstance(found, type) and is_dataclass(found)):
        return f"{found!r} is no dataclass; decorate the class with @dataclass"
    if not issubclass(found, base):
        return f"{found.__name__} does not inherit from {base.__module__}.{base.__name__}; it must"
    kinds = get_args(get_type_hints(found).get("kind"))
    if kinds != (name,):
        return f"{found.__name__} needs the field kind: Literal['{name}'] = '{name}'"
    if not callable(getattr(found, method, None)):
        return f"{found.__name__} has no method '{method}'; add it"
    return ""
