"""Untrusted TOML and JSON files, read with limits on their size, nesting and integers."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any, Final, TypeVar

from polychirp.errors import InputError

Value = TypeVar("Value")

MOST_BYTES: Final = 16 << 20
"""Greatest size of a file, bytes. Chosen: a vehicle takes only some 150 bytes of a study file."""

MOST_LEVELS: Final = 32
"""Greatest depth of tables and lists within each other. Chosen: a study needs about 8."""

_KEY: Final = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+')"""
"""Pattern of one part of a dotted TOML key, bare or in quotation marks."""
_MORE: Final = rf"(?:[ \t]*+\.[ \t]*+{_KEY})"
"""Pattern of a further part of a dotted key."""
_LONG_KEY: Final = re.compile(
    rf"""\#[^\n]*+
    |"{{3}}(?:[^"\\]++|\\.|"{{1,2}}(?!"))*+"{{0,5}}
    |'{{3}}(?:[^']++|'{{1,2}}(?!'))*+'{{0,5}}
    |({_KEY}{_MORE}{{{MOST_LEVELS},}})
    |{_KEY}{_MORE}*+
    |["'][^\n]*+""",
    re.DOTALL | re.VERBOSE,
)
"""In its group, a dotted key of more than `MOST_LEVELS` parts, which the TOML reader can take very
long to read. Comments, strings and short keys match too, so that no key is found in them."""


def text_of(path: Path) -> str:
    """Text of a file in UTF-8, without the byte-order mark that some editors write.

    `InputError` is raised if the file is too large, `OSError` if it cannot be read, and
    `UnicodeDecodeError` if it is not in UTF-8.
    """
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise InputError(
            f"'{path}' is larger than {MOST_BYTES >> 20} MiB; it is not a file of this kind"
        )
    return content.decode("utf-8-sig")


def toml_tables(text: str) -> dict[str, Any]:
    """Tables of TOML text.

    `InputError` is raised if tables or lists are nested too deeply, or an integer has thousands of
    digits, and `tomllib.TOMLDecodeError` if the text is not TOML.
    """
    if any(match[1] for match in _LONG_KEY.finditer(text)):
        raise _too_deep()
    try:
        return _shallow(tomllib.loads(text))
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise _too_deep() from None
    except ValueError:  # only integers raise it: Python limits the number of their digits
        raise InputError("an integer has thousands of digits; write a smaller one") from None


def json_value(text: str) -> Any:
    """Value of JSON text.

    `InputError` is raised if lists or objects are nested too deeply, or an integer has thousands of
    digits, and `json.JSONDecodeError` if the text is not JSON.
    """
    try:
        return _shallow(json.loads(text))
    except json.JSONDecodeError:
        raise
    except RecursionError:
        raise _too_deep() from None
    except ValueError:
        raise InputError("an integer has thousands of digits; write a smaller one") from None


def _shallow(value: Value) -> Value:
    """The value itself; raises `InputError` if it is nested too deeply."""
    level: list[Any] = [value]
    for _ in range(MOST_LEVELS + 1):
        level = [
            child
            for one in level
            if isinstance(one, dict | list)
            for child in (one.values() if isinstance(one, dict) else one)
        ]
        if not level:
            return value
    raise _too_deep()


def _too_deep() -> InputError:
    return InputError(
        f"tables and lists are nested more than {MOST_LEVELS} levels deep; use fewer levels"
    )
