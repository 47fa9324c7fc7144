"""Named materials near 79 GHz, each with its source."""

import tomllib
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType

from polychirp.errors import InputError, ModelWarning
from polychirp.model.material import Material


@dataclass(frozen=True, kw_only=True)
class NamedMaterial(Material):
    """A material that a study defines; one with a known name replaces that material."""

    name: str


@cache
def known_materials() -> Mapping[str, Material]:
    """The materials of ``materials.toml``, by name.

    >>> known_materials()["metal"].is_conductor
    True
    """
    text = (
        files("polychirp.channel.materials").joinpath("materials.toml").read_text(encoding="utf-8")
    )
    return MappingProxyType({name: Material(**row) for name, row in tomllib.loads(text).items()})


def material_table(extra: Mapping[str, Material] | None = None) -> Mapping[str, Material]:
    """Known materials and those of a study, by name; a study's replace known ones of the same name.

    >>> table = material_table({"brick": Material(relative_permittivity=4.1)})
    >>> table["brick"].relative_permittivity, table["glass"].thickness
    (4.1, 0.004)
    """
    return MappingProxyType({**known_materials(), **(extra or {})})


def check_materials(names: Iterable[str], table: Mapping[str, Material], frequency: float) -> None:
    """Check that every name is in the table, and that its values are valid at the frequency, Hz.

    Raises
    ------
    InputError
        A material is not in the table.

    Warns
    -----
    ModelWarning
        The frequency is outside the band in which a material's values are valid.
    """
    for name in sorted(set(names)):
        if name not in table:
            raise InputError(
                f"there is no material '{name}'; use one of {', '.join(sorted(table))}, or define "
                "it in the study"
            )
        row = table[name]
        if not row.lowest_frequency <= frequency <= row.highest_frequency:
            # Python shows the same warning only once
            warnings.warn(
                f"values of material '{name}' are valid from {row.lowest_frequency / 1e9:g} to "
                f"{row.highest_frequency / 1e9:g} GHz, but the frequency is {frequency / 1e9:g} "
                "GHz; choose one in this band, or give the study's own values",
                ModelWarning,
                stacklevel=2,
            )
