"""Simulator of mutual interference between FMCW automotive radars in ray-traced traffic.

``__init__.pyi`` lists the public names with their modules, once for type checkers and for this
module. Each name is imported when it is first used, so that ``import polychirp`` is fast.
"""

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

_RENAMED: dict[str, tuple[str, str]] = {}
"""Deprecated names: for each the name that replaces it, and the version that removes the old one.
docs/reference/api.md states the rule."""


@cache
def _homes() -> dict[str, str]:
    """Module of every public name, from the lines ``from MODULE import NAME as NAME``."""
    lines = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8").splitlines()
    words = [line.split() for line in lines if line.startswith("from ")]
    return {name: module for _, module, _, name, *_ in words}


def __getattr__(name: str) -> Any:
    """Import a public name from its module."""
    if name == "__all__":
        return __dir__()
    if name == "__version__":
        from importlib.metadata import version

        return version("polychirp")
    if name in _RENAMED:
        from polychirp.deprecation import warn_deprecated

        new, removed_in = _RENAMED[name]
        warn_deprecated(f"polychirp.{name}", new=f"polychirp.{new}", removed_in=removed_in)
        name = new
    # an underscore begins no public name, and Python looks up many such names
    if name.startswith("_") or name not in _homes():
        raise AttributeError(f"module 'polychirp' has no attribute '{name}'")
    return getattr(import_module(_homes()[name]), name)


def __dir__() -> list[str]:
    return sorted(_homes())
