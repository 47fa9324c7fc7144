"""The errors that polychirp raises on purpose, each with the exit code of the command line."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar


class PolychirpError(Exception):
    """Everything that polychirp raises on purpose; the message is one sentence for a person."""

    exit_code: ClassVar[int] = 4


class InputError(PolychirpError, ValueError):
    """What was given cannot be used: says what is wrong, where, and what would work."""

    exit_code = 2


class PhysicsError(PolychirpError, ValueError):
    """A well-formed request that no radar, wave or street can meet."""

    exit_code = 3


class CapabilityError(PolychirpError):
    """The chosen engine cannot do what is asked; names what is missing and who can."""

    exit_code = 3


class RunError(PolychirpError, RuntimeError):
    """Something failed while running; what was computed before is kept."""

    exit_code = 4


class ModelWarning(UserWarning):
    """A model is used outside its range of validity; the message names the limit."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A hint: the closest known word, or all of them.

    >>> did_you_mean("duraton", ["duration", "slope"])
    "did you mean 'duration'?"
    """
    from difflib import get_close_matches

    known = list(known)
    close = get_close_matches(word, known, n=1)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"known are {', '.join(known)}"


def no_such(what: str, name: str, known: Iterable[str]) -> str:
    """A sentence about a name that does not exist, with all that do.

    >>> no_such("radar", "frnt", ["front", "rear"])
    "there is no radar 'frnt'; there are 'front', 'rear'; did you mean 'front'?"
    """
    from difflib import get_close_matches

    known = list(known)
    if not known:
        return f"there is no {what} '{name}', nor any other"
    close = get_close_matches(name, known, n=1)
    names = ", ".join(f"'{one}'" for one in known)
    hint = f"; did you mean '{close[0]}'?" if close and len(known) > 1 else ""
    return f"there is no {what} '{name}'; there {'is' if len(known) == 1 else 'are'} {names}{hint}"
