"""Errors that polychirp raises on purpose, each with the exit code of the command line."""

from collections.abc import Iterable
from typing import ClassVar, Final


class PolychirpError(Exception):
    """Base of all errors that polychirp raises on purpose; the message is one sentence.

    `InputError`, `PhysicsError`, `CapabilityError` and `RunError` are its kinds.
    """

    exit_code: ClassVar[int] = 4


class InputError(PolychirpError, ValueError):
    """An input that cannot be used; the message says what is wrong, where, and what works.

    It is a `PolychirpError`.
    """

    exit_code = 2


class PhysicsError(PolychirpError, ValueError):
    """A well-formed request that is physically impossible.

    It is a `PolychirpError`.
    """

    exit_code = 3


class CapabilityError(PolychirpError):
    """A request that the chosen engine cannot meet; the message names an engine that can.

    It is a `PolychirpError`.
    """

    exit_code = 3


class RunError(PolychirpError, RuntimeError):
    """A failure during a run; results that were computed before are kept.

    It is a `PolychirpError`.
    """

    exit_code = 4


class ModelWarning(UserWarning):
    """A warning that a model is used outside its range of validity; the message names the limit.

    `check` warns so before a study runs.
    """


def short(text: str) -> str:
    """The text, or its first 37 characters if it is too long for a sentence of an error."""
    return text if len(text) <= 40 else f"{text[:37]}…"


LEAST_LIKENESS: Final = 0.65
"""Least likeness (difflib's ratio) of two words for one to be suggested for the other. Chosen: a
word of three letters with one wrong has 0.67, and "repetition" has 0.63 to "direction"."""


MOST_LISTED: Final = 40
"""Greatest number of known words that a hint lists beside a suggestion. Chosen: the keys of any
table are fewer."""


def suggestion(word: str, known: Iterable[str]) -> str:
    """A question for the known word that is closest to a misspelt one; empty if none is close.

    >>> suggestion("duraton", ["duration", "slope"]), suggestion("repetition", ["direction"])
    ("did you mean 'duration'?", '')
    """
    from difflib import get_close_matches

    close = get_close_matches(word, list(known), n=1, cutoff=LEAST_LIKENESS)
    return f"did you mean '{close[0]}'?" if close else ""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A hint for a misspelt word: the closest known word, and all known words.

    The closest word need not be the one that was meant. Beside it, words are not listed if they are
    more than `MOST_LISTED`.

    >>> did_you_mean("duraton", ["duration", "slope"])
    "did you mean 'duration'? known are duration, slope"
    >>> did_you_mean("repetition", ["direction", "idle"])
    'known are direction, idle'
    """
    known = list(known)
    close = suggestion(word, known)
    if close and not 1 < len(known) <= MOST_LISTED:
        return close
    return f"{close} known are {', '.join(known)}".lstrip()


def no_such(what: str, name: str, known: Iterable[str]) -> str:
    """A sentence which says that a name does not exist, and lists all names that do.

    >>> no_such("radar", "frnt", ["front", "rear"])
    "there is no radar 'frnt'; there are 'front', 'rear'; did you mean 'front'?"
    """
    known = list(known)
    if not known:
        return f"there is no {what} '{name}', nor any other"
    close = suggestion(name, known) if len(known) > 1 else ""
    names = ", ".join(f"'{one}'" for one in known)
    hint = f"; {close}" if close else ""
    return f"there is no {what} '{name}'; there {'is' if len(known) == 1 else 'are'} {names}{hint}"
