"""The text "none" by which the command line and grids remove an optional value of a study."""

from types import NoneType, UnionType
from typing import Annotated, Any, Final, Union, get_args, get_origin

from polychirp.config.problems import below, kind_of, members

ABSENT: Final = "none"
"""Text that stands for None where a field may be None and holds no text; TOML has no such value."""


def without_absent(data: Any, hint: Any) -> Any:
    """The tables and values of a file for the type ``hint``, with None for each text "none".

    >>> from polychirp.receiver.settings import ReceiverSettings
    >>> without_absent({"mitigation": "none", "least_range": "none"}, ReceiverSettings)
    {'mitigation': None, 'least_range': 'none'}
    """
    if data == ABSENT and _may_be_absent(hint):
        return None
    if isinstance(data, list):
        return [without_absent(entry, below(hint, n)) for n, entry in enumerate(data)]
    if not isinstance(data, dict):
        return data
    chosen = [one for one in members(hint) if kind_of(one) == data.get("kind")]
    owners = chosen or members(hint)
    return {
        key: without_absent(value, next(filter(None, (below(one, key) for one in owners)), None))
        for key, value in data.items()
    }


def _may_be_absent(hint: Any) -> bool:
    """True if a field of this type may be None, and the text "none" means nothing else to it."""
    is_optional = get_origin(hint) in (Union, UnionType) and NoneType in get_args(hint)
    return is_optional and not any(
        member is str or ABSENT in get_args(member) for member in map(_plain, members(hint))
    )


def _plain(hint: Any) -> Any:
    """A type without its annotations."""
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint
