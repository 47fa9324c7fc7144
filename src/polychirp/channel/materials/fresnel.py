"""Reflection and transmission at a half-space, a sheet and a conductor; loss by roughness.

The time dependence is e^{+jωt}, and permittivities are relative, ε = ε′ − jε″. The field of s is
perpendicular to the plane of incidence, that of p is in it; a perfect conductor has Γs = −1 and
Γp = +1. Kernels call the scalar functions, other code the NumPy functions; tests compare both.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import compiled, inlined
from polychirp.model.material import Material


def half_space(permittivity: complex, cosine: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    r"""Reflection coefficients (Γs, Γp) of a half-space at ``cosine`` of the angle of incidence θ.

    .. math:: q = \sqrt{\varepsilon - \sin^2\theta}, \quad
        \Gamma_s = \frac{\cos\theta - q}{\cos\theta + q}, \quad
        \Gamma_p = \frac{\varepsilon\cos\theta - q}{\varepsilon\cos\theta + q}

    >>> s, p = half_space(4.0, 1.0)
    >>> float(s.real), float(p.real)
    (-0.3333333333333333, 0.3333333333333333)
    """
    c = np.asarray(cosine, dtype=np.complex128)
    q = np.sqrt(permittivity - (1.0 - c * c))
    return (c - q) / (c + q), (permittivity * c - q) / (permittivity * c + q)


class SheetCoefficients(NamedTuple):
    """Amplitude coefficients of a sheet for s and p: reflection Rs, Rp, transmission Ts, Tp."""

    reflection_s: ComplexArray
    reflection_p: ComplexArray
    transmission_s: ComplexArray
    transmission_p: ComplexArray


def sheet(
    permittivity: complex, thickness: float, cosine: ArrayLike, frequency: float
) -> SheetCoefficients:
    r"""Coefficients of a sheet of thickness t (m) with air on both sides.

    .. math:: R = \Gamma\frac{1 - e^2}{1 - \Gamma^2 e^2}, \quad
        T = \frac{(1 - \Gamma^2)\,e}{1 - \Gamma^2 e^2}, \quad e = e^{-jkqt}

    k is the wavenumber in air; Γ and q are those of `half_space`. ``frequency`` is in Hz.
    """
    c = np.asarray(cosine, dtype=np.complex128)
    q = np.sqrt(permittivity - (1.0 - c * c))
    delay = np.exp(-2j * np.pi * frequency / SPEED_OF_LIGHT * thickness * q)
    back, through = [], []
    for single in half_space(permittivity, cosine):
        below = 1.0 - single**2 * delay**2
        back.append(single * (1.0 - delay**2) / below)
        through.append((1.0 - single**2) * delay / below)
    return SheetCoefficients(*back, *through)


def roughness_factor(roughness: float, cosine: ArrayLike, frequency: float) -> FloatArray:
    r"""Factor by which Gaussian roughness (rms height σₕ, m) reduces the specular amplitude.

    .. math:: \rho = e^{-2 (k\sigma_h\cos\theta)^2}
    """
    phase = 2 * np.pi * frequency / SPEED_OF_LIGHT * roughness * np.asarray(cosine)
    return np.asarray(np.exp(-2.0 * phase**2))


def reflection(
    material: Material, cosine: ArrayLike, frequency: float
) -> tuple[ComplexArray, ComplexArray]:
    """Reflection coefficients (Γs, Γp) of a material's surface, its roughness included."""
    c = np.asarray(cosine, dtype=np.float64)
    if material.is_conductor:
        s, p = -np.ones(c.shape, dtype=np.complex128), np.ones(c.shape, dtype=np.complex128)
    elif material.thickness > 0:
        s, p = sheet(material.permittivity(frequency), material.thickness, c, frequency)[:2]
    else:
        s, p = half_space(material.permittivity(frequency), c)
    loss = roughness_factor(material.roughness, c, frequency)
    return s * loss, p * loss


def power_through(material: Material, frequency: float) -> float:
    """Share of the power that a sheet transmits at normal incidence; 0 for other surfaces."""
    if material.is_conductor or material.thickness == 0:
        return 0.0
    found = sheet(material.permittivity(frequency), material.thickness, 1.0, frequency)
    return float(np.abs(found.transmission_s) ** 2)


class Media(NamedTuple):
    """Materials as arrays ``(medium,)`` for kernels, with the fields of `Material` in SI units."""

    permittivity: ComplexArray
    thickness: FloatArray
    roughness: FloatArray
    is_conductor: BoolArray
    attenuation: FloatArray


def media_of(names: tuple[str, ...], table: Mapping[str, Material], frequency: float) -> Media:
    """Materials of ``names`` as arrays, in the order of the names."""
    rows = [table[name] for name in names]
    return Media(
        permittivity=np.array(
            # a conductor's permittivity is not used: any number is right
            [1.0 if row.is_conductor else row.permittivity(frequency) for row in rows],
            dtype=np.complex128,
        ),
        thickness=np.array([row.thickness for row in rows], dtype=np.float64),
        roughness=np.array([row.roughness for row in rows], dtype=np.float64),
        is_conductor=np.array([row.is_conductor for row in rows], dtype=np.bool_),
        attenuation=np.array([row.attenuation for row in rows], dtype=np.float64),
    )


@compiled
def sheet_transmission(
    media: Media, medium: int, cosine: float, wavenumber: float
) -> tuple[complex, complex]:
    r"""Transmission coefficients (Ts, Tp) of a sheet, relative to the air that it displaces.

    A straight path already has the phase of this air, :math:`-kt\cos\theta`; hence the sheet
    multiplies its amplitude by :math:`T e^{+jkt\cos\theta}`.
    """
    permittivity, thickness = media.permittivity[medium], media.thickness[medium]
    q = np.sqrt(permittivity - (1.0 - cosine * cosine))
    s = (cosine - q) / (cosine + q)
    p = (permittivity * cosine - q) / (permittivity * cosine + q)
    single = np.exp(-1j * wavenumber * thickness * q)
    undo = np.exp(1j * wavenumber * thickness * cosine)
    return _slab_transmission(s, single) * undo, _slab_transmission(p, single) * undo


@inlined
def _slab_transmission(interface: complex, single: complex) -> complex:
    square = interface * interface
    return (1.0 - square) * single / (1.0 - square * single * single)


@inlined
def _slab_reflection(single: complex, square: complex) -> complex:
    return single * (1.0 - square) / (1.0 - single * single * square)


@compiled
def smooth_reflection(
    media: Media, medium: int, cosine: float, wavenumber: float
) -> tuple[complex, complex]:
    """(Γs, Γp) without roughness: the scalar form of `reflection`, for kernels."""
    if media.is_conductor[medium]:
        return complex(-1.0), complex(1.0)
    permittivity = media.permittivity[medium]
    q = np.sqrt(permittivity - (1.0 - cosine * cosine))
    s = (cosine - q) / (cosine + q)
    p = (permittivity * cosine - q) / (permittivity * cosine + q)
    thickness = media.thickness[medium]
    if thickness > 0.0:
        angle = -2j * wavenumber * thickness * q
        square = math.exp(angle.real) * complex(math.cos(angle.imag), math.sin(angle.imag))
        return _slab_reflection(s, square), _slab_reflection(p, square)
    return s, p
