"""Waves that arrive at illuminated facets, and the facets' reflection coefficients."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, row, vector_at
from polychirp.channel.materials.reflection_table import ReflectionTable, tabulated_reflection
from polychirp.channel.physical_optics.kernels import (
    INCIDENCE,
    REFLECTION,
    SENT_H,
    SENT_V,
    Faces,
    LitFacets,
    across_plane_of_incidence,
    any_normal_to,
)
from polychirp.channel.physical_optics.view_losses import Losses
from polychirp.channel.physical_optics.views import ViewTable
from polychirp.channel.scene.blockers import PLATE_MEDIUM, PLATE_NORMAL
from polychirp.jit import fast, fast_inlined
from polychirp.threads import in_ranges

FieldPair = tuple[complex, complex]
"""Components of the field of a wave along d: along a unit vector a ⊥ d, and along d×a."""


class Mirrors(NamedTuple):
    """Plates that mirror waves, in a body's frame.

    ``plate`` has the rows of `Blockers`; ``media`` holds the reflection by the plates' media;
    ``upwards`` ``(2, xyz)`` holds the world's z and y axes, which define the polarisations.
    """

    plate: FloatArray
    media: ReflectionTable
    upwards: FloatArray


def incident_waves(
    faces: Faces,
    media: ReflectionTable,
    mirrors: Mirrors,
    views: ViewTable,
    losses: Losses,
    lit: LitFacets,
) -> NDArray[np.complex64]:
    """Fields on facets and the facets' reflection coefficients, as `LitFacets.wave` has them."""
    # single precision suffices: its error of 1e-7 of the field is a phase error of 1e-7 rad
    wave = np.empty((len(lit.face), 4, 2), dtype=np.complex64)
    what = faces, media, mirrors, views, losses, lit, lit.view
    in_ranges(_fill_waves, len(wave), *what, wave, least=500)
    return wave


@fast
def _fill_waves(
    begin: int,
    end: int,
    faces: Faces,
    media: ReflectionTable,
    mirrors: Mirrors,
    views: ViewTable,
    losses: Losses,
    lit: LitFacets,
    view: IntArray,
    wave: NDArray[np.complex64],
) -> None:
    for i in range(begin, end):
        d, f, v = row(lit.direction, i), lit.face[i], view[i]
        lost = losses.number[v, losses.patch[f]]
        across, sent_v, sent_h = _arriving(
            d,
            views.is_mirrored[v],
            views.plate[v],
            mirrors,
            lost > 0,
            losses.matrix[lost],
        )
        n, t1 = row(faces.normal, f), row(faces.tangent, f)
        side, cosine = across_plane_of_incidence(d, n, t1), -dot(n, d)
        out = wave[i]
        out[SENT_V, 0], out[SENT_V, 1] = _in_basis(sent_v, across, side, d)
        out[SENT_H, 0], out[SENT_H, 1] = _in_basis(sent_h, across, side, d)
        out[REFLECTION, 0], out[REFLECTION, 1] = tabulated_reflection(
            media, faces.medium[f], cosine
        )
        out[INCIDENCE, 0] = cosine
        out[INCIDENCE, 1] = complex(dot(side, t1), dot(side, cross(n, t1)))


@fast_inlined
def _arriving(
    d: Vector,
    is_mirrored: bool,
    number: int,
    mirrors: Mirrors,
    is_weakened: bool,
    loss: ComplexArray,
) -> tuple[Vector, FieldPair, FieldPair]:
    """Waves sent with polarisations V and H, as they arrive along d, directly or over a plate.

    The first result is a unit vector a; both fields are given along a and d×a. ``number`` is the
    plate's; ``loss`` ``(leg, 2, 2)`` holds the transmission matrices of the parts of the path
    before and behind the plate.
    """
    leaving, normal = d, d
    if is_mirrored:
        normal = vector_at(mirrors.plate, number, PLATE_NORMAL)
        turn = 2.0 * dot(d, normal)
        leaving = (d[0] - turn * normal[0], d[1] - turn * normal[1], d[2] - turn * normal[2])
    # across is H of frames.polarisation_basis; V is d×H
    z, y = row(mirrors.upwards, 0), row(mirrors.upwards, 1)
    across = across_plane_of_incidence(z, leaving, y)
    v, h = (complex(0.0), complex(1.0)), (complex(1.0), complex(0.0))
    if is_weakened:
        first = loss[0]
        v, h = (first[1, 0], first[0, 0]), (first[1, 1], first[0, 1])
    if is_mirrored:
        cosine, medium = -dot(leaving, normal), int(mirrors.plate[number, PLATE_MEDIUM])
        gamma_s, gamma_p = tabulated_reflection(mirrors.media, medium, cosine)
        phase = mirrors.media.roughness[medium] * cosine
        coherent = math.exp(-2.0 * phase * phase)
        side = across_plane_of_incidence(leaving, normal, any_normal_to(normal))
        v, h = _in_basis(v, across, side, leaving), _in_basis(h, across, side, leaving)
        v = (coherent * gamma_s * v[0], coherent * gamma_p * v[1])
        h = (coherent * gamma_s * h[0], coherent * gamma_p * h[1])
        across = side
    if is_weakened:
        side = across_plane_of_incidence(z, d, y)
        v, h = _in_basis(v, across, side, d), _in_basis(h, across, side, d)
        v, h = _behind_sheet(v, loss[1]), _behind_sheet(h, loss[1])
        across = side
    return across, v, h


@fast_inlined
def _in_basis(field: FieldPair, old: Vector, new: Vector, d: Vector) -> FieldPair:
    """Components along ``new`` and d×new of a field given along ``old`` and d×old."""
    a, b = dot(old, new), dot(old, cross(d, new))
    return a * field[0] - b * field[1], b * field[0] + a * field[1]


@fast_inlined
def _behind_sheet(field: FieldPair, matrix: ComplexArray) -> FieldPair:
    """A field, given and returned as (H, V), times a matrix whose rows and columns are (V, H)."""
    h, v = field
    return matrix[1, 0] * v + matrix[1, 1] * h, matrix[0, 0] * v + matrix[0, 1] * h
