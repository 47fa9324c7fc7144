"""Reflection coefficients tabulated over the angle of incidence, for kernels that need many."""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.channel.materials.fresnel import reflection
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import inlined
from polychirp.model.material import Material

NUM_NODES: Final = 8192
"""Angles in the table of a medium. Chosen: interpolated coefficients are wrong by 5e-6 for window
panes, and by 5e-4 for a sheet of 5 cm, whose two faces' echoes change phase fast with the angle."""


class ReflectionTable(NamedTuple):
    r"""(Γs, Γp) without roughness, ``(medium, node, 2)``, at cosines of (node / last node)².

    The square makes nodes dense near grazing, where the coefficients of good conductors change.
    ``roughness`` is the phase :math:`k\sigma_h`, rad; it and ``is_conductor`` are ``(medium,)``.
    """

    gamma: ComplexArray
    roughness: FloatArray
    is_conductor: BoolArray


@lru_cache(maxsize=16)
def reflection_table(materials: tuple[Material, ...], frequency: float) -> ReflectionTable:
    """Table of materials at a frequency, Hz; it is kept for later snapshots."""
    wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
    cosine = (np.arange(NUM_NODES) / (NUM_NODES - 1)) ** 2
    smooth = [reflection(replace(row, roughness=0.0), cosine, frequency) for row in materials]
    return ReflectionTable(
        gamma=np.array([np.stack(both, axis=-1) for both in smooth], dtype=np.complex128).reshape(
            -1, NUM_NODES, 2
        ),
        roughness=wavenumber * np.array([row.roughness for row in materials], dtype=np.float64),
        is_conductor=np.array([row.is_conductor for row in materials], dtype=np.bool_),
    )


@inlined
def tabulated_reflection(
    table: ReflectionTable, medium: int, cosine: float
) -> tuple[complex, complex]:
    """(Γs, Γp) of a medium by interpolation: a fast form of `fresnel.smooth_reflection`."""
    if table.is_conductor[medium]:
        return complex(-1.0), complex(1.0)
    g = table.gamma[medium]
    last = g.shape[0] - 1
    place = math.sqrt(min(max(cosine, 0.0), 1.0)) * last
    node = min(int(place), last - 1)
    # linear in the cosine, on which Γ depends smoothly, and not in ``place``
    low, high = float(node * node), float((node + 1) * (node + 1))
    share = (place * place - low) / (high - low)
    return (
        g[node, 0] + share * (g[node + 1, 0] - g[node, 0]),
        g[node, 1] + share * (g[node + 1, 1] - g[node, 1]),
    )
