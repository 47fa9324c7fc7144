"""Classes that other installed packages add to polychirp, by their entry points."""

from dataclasses import is_dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from itertools import pairwise
from typing import Any, get_args, get_type_hints

from polychirp.errors import InputError


@cache
def plugged(group: str, method: str, base: type = object) -> tuple[type, ...]:
    """Classes of all entry points of a group, in the order of their names.

    Each must be a dataclass whose objects can be hashed and that inherits from ``base``, with the
    ``method``, and with a field ``kind: Literal["NAME"]`` whose value is the name of the entry
    point.

    Raises
    ------
    InputError
        A plug-in cannot be loaded, its class lacks one of these, or two packages have entry points
        of one name.

    Examples
    --------
    >>> plugged("polychirp.nothing", "schedule")
    ()
    """
    entries = sorted(entry_points(group=group), key=lambda entry: entry.name)
    for one, other in pairwise(entries):
        if one.name == other.name:
            raise InputError(
                f"the packages '{_package(one)}' and '{_package(other)}' both have a plug-in "
                f"'{one.name}' of the group '{group}'; uninstall one, or give its plug-in another "
                "name and kind"
            )
    return tuple(_loaded(entry, method, base) for entry in entries)


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist else "unknown"


def _loaded(entry: EntryPoint, method: str, base: type) -> type:
    place = f"the plug-in '{entry.name}' of the package '{_package(entry)}'"
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
    if getattr(found, "__hash__", None) is None:  # of dataclasses that are not frozen
        return f"{found.__name__} cannot be hashed; decorate it with @dataclass(frozen=True)"
    return _unfit_content(found, name, method)


def _unfit_content(found: type, name: str, method: str) -> str:
    """Reason why a dataclass without the right kind and method is no plug-in, or no text."""
    try:
        hints = get_type_hints(found)
    except Exception as error:  # annotations are foreign code, which may raise anything
        return f"the types of its fields cannot be read ({type(error).__name__}: {error})"
    kinds = get_args(hints.get("kind"))
    if kinds != (name,):
        return f"{found.__name__} needs the field kind: Literal['{name}'] = '{name}'"
    if not callable(getattr(found, method, None)):
        return f"{found.__name__} has no method '{method}'; add it"
    return ""
