"""Tables of materials: what the paper's surfaces are made of, and what doubts of it are worth."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.materials.library import known_materials
from polychirp.constants import VACUUM_PERMITTIVITY
from polychirp.model.material import Material
from polychirp.units import to_db
from tools.pages.markdown import table

FREQUENCY: Final = 79e9

USES: Final = (
    ("vehicle body", "metal"),
    ("mirrors, windows", "glass"),
    ("wheels", "rubber"),
    ("bumpers", "plastic"),
    ("road", "asphalt"),
    ("buildings", "brick"),
    ("foliage: trunks", "wood"),
    ("foliage: leaves", "leaf"),
)
"""Surfaces of the paper's table 1 and the materials that stand for them."""

ANGLES: Final = (0.0, math.pi / 4, math.radians(80.0))
"""rad from the normal, at which reflections are shown."""


NOTHING: Final = 1e-3
"""|Γ| below which a surface has no coherent echo to speak of: a millionth of the power."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubt:
    """A constant of a material that is assumed, and the range in which it plausibly lies.

    Parameters
    ----------
    material : name
    what : constant, as people call it, with its unit
    values : the lowest, the one in use, the highest, as shown
    variants : the material with each of these values
    reason : why this range
    """

    material: str
    what: str
    values: tuple[str, str, str]
    variants: tuple[Material, Material, Material]
    reason: str


def loss_tangent(material: Material) -> float:
    """ε″/ε′ at 79 GHz.

    >>> round(loss_tangent(known_materials()["rubber"]), 3)
    0.1
    """
    return -material.permittivity(FREQUENCY).imag / material.relative_permittivity


def _with_permittivity(material: Material, value: float) -> Material:
    """With another ε′ and the same loss tangent."""
    scale = value / material.relative_permittivity
    return replace(
        material, relative_permittivity=value, conductivity=scale * material.conductivity
    )


def _with_loss_tangent(material: Material, value: float) -> Material:
    omega = 2 * math.pi * FREQUENCY
    loss = value * material.relative_permittivity * omega * VACUUM_PERMITTIVITY
    return replace(material, conductivity=loss)


def _permittivity_doubt(name: str, low: float, high: float, reason: str) -> Doubt:
    used = known_materials()[name]
    return Doubt(
        material=name,
        what="ε′",
        values=(f"{low:g}", f"{used.relative_permittivity:g}", f"{high:g}"),
        variants=(_with_permittivity(used, low), used, _with_permittivity(used, high)),
        reason=reason,
    )


def _loss_doubt(name: str, low: float, high: float, reason: str) -> Doubt:
    used = known_materials()[name]
    return Doubt(
        material=name,
        what="ε″/ε′",
        values=(f"{low:g}", f"{loss_tangent(used):.2g}", f"{high:g}"),
        variants=(_with_loss_tangent(used, low), used, _with_loss_tangent(used, high)),
        reason=reason,
    )


def _roughness_doubt(name: str, low: float, high: float, reason: str) -> Doubt:
    used = known_materials()[name]
    return Doubt(
        material=name,
        what="roughness, mm",
        values=(f"{1e3 * low:g}", f"{1e3 * used.roughness:g}", f"{1e3 * high:g}"),
        variants=(replace(used, roughness=low), used, replace(used, roughness=high)),
        reason=reason,
    )


def doubts() -> tuple[Doubt, ...]:
    """Assumptions on the materials of the paper's street.

    >>> [doubt.material for doubt in doubts()][:2]
    ['rubber', 'brick']
    """
    return (
        _permittivity_doubt(
            "rubber", 2.5, 6.0, "a guess: raw rubber to compounds full of carbon black"
        ),
        _permittivity_doubt("brick", 3.5, 5.0, "a guess: bricks differ in density and moisture"),
        _roughness_doubt("brick", 0.3e-3, 2e-3, "a guess: smooth facing brick to rough brick"),
        _permittivity_doubt("asphalt", 8.3, 10.4, "measured: SMA11S to SMA8S (Kurz 2021)"),
        _loss_doubt("asphalt", 0.01, 0.15, "a guess: dry to damp"),
        _roughness_doubt("asphalt", 0.2e-3, 1e-3, "a guess: worn smooth to open texture"),
        _roughness_doubt("wood", 0.5e-3, 4e-3, "a guess: smooth bark to furrowed bark"),
    )


def amplitudes(material: Material) -> FloatArray:
    """|Γ| at 79 GHz, roughness included: at 0°, then s and p at 45° and at 80°, ``(5,)``.

    >>> amplitudes(known_materials()["metal"])
    array([1., 1., 1., 1., 1.])
    """
    s, p = np.abs(reflection(material, np.cos(ANGLES), FREQUENCY))
    return np.array([s[0], s[1], p[1], s[2], p[2]])


def paper_materials() -> str:
    """The surfaces of the paper's table 1: what stands for them, in which band, and from where."""
    rows = []
    for use, name in USES:
        row = known_materials()[name]
        band = f"{row.lowest_frequency / 1e9:g}–{row.highest_frequency / 1e9:g} GHz"
        rows.append((use, name, _constants(row), band, row.source))
    return table(("surface", "material", "constants", "used within", "source"), rows)


def _constants(row: Material) -> str:
    if row.is_conductor:
        return "perfect conductor"
    found = [f"ε′ {row.relative_permittivity:g}, σ {row.conductivity:g} S/m"]
    if row.thickness:
        found.append(f"sheet of {1e3 * row.thickness:g} mm")
    if row.roughness:
        found.append(f"rms roughness {1e3 * row.roughness:g} mm")
    if row.is_cloud:
        found.append(f"cloud: α {row.attenuation:g}/m, albedo {row.albedo:g}")
    return "; ".join(found)


def sensitivity() -> str:
    """Table of the change of reflections when an assumed constant changes within its range.

    The table holds |Γ| and, in brackets, the change in dB of mirror images and echoes. An albedo
    is a share of scattered power: its diffuse echo changes by the ratio.
    """
    head = ("assumed", "value", "0°", "45°, s", "45°, p", "80°, s", "80°, p")
    rows: list[tuple[str, ...]] = []
    for doubt in doubts():
        used = amplitudes(doubt.variants[1])
        for place, (value, variant) in enumerate(zip(doubt.values, doubt.variants, strict=True)):
            cells = [
                _amplitude(mine) + ("" if place == 1 else _change(mine, reference))
                for mine, reference in zip(amplitudes(variant), used, strict=True)
            ]
            label = f"{doubt.material}: {doubt.what}" if place == 0 else ""
            rows.append((label, f"**{value}**" if place == 1 else value, *cells))
    ranges = "\n".join(
        f"- {doubt.material}, {doubt.what} {doubt.values[0]} to {doubt.values[2]}: {doubt.reason}."
        for doubt in doubts()
    )
    albedo = known_materials()["leaf"].albedo
    low, high = 0.2, 0.9
    moves = [_signed(float(to_db(value / albedo))) for value in (low, high)]
    leaf = (
        f"- leaf, albedo {low:g} to {high:g} (in use {albedo:g}): the diffuse echo of a crown "
        f"moves by {moves[0]} to {moves[1]} dB."
    )
    return f"{table(head, rows)}\n\n{ranges}\n{leaf}"


def _amplitude(value: float) -> str:
    return f"{value:.3f}" if value >= NOTHING else f"< {NOTHING:g}"


def _change(value: float, reference: float) -> str:
    """Change in dB as text; empty if there is no reflection."""
    if min(value, reference) < NOTHING:
        return ""
    return f" ({_signed(float(to_db(value**2 / reference**2)))} dB)"


def _signed(decibels: float) -> str:
    return f"{decibels:+.1f}".replace("-", "−").replace("+0.0", "±0.0").replace("−0.0", "±0.0")
