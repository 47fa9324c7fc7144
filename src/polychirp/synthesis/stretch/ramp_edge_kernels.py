"""Compiled parts of `ramp_edges`: sums over many links at corners far out of band."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.jit import compiled, inlined
from polychirp.synthesis.stretch.batch_kernels import fill_columns
from polychirp.synthesis.stretch.chirp_kernels import phase_of
from polychirp.synthesis.stretch.kernel_records import (
    Batch,
    CornerRange,
    CutExpansion,
)
from polychirp.synthesis.stretch.path_kernels import received
from polychirp.synthesis.unit_phasors import units


@compiled
def corner_columns(
    term: FloatArray, value: FloatArray, batch: Batch, low: int, corners: CornerRange
) -> None:
    """Fill in ``term`` and ``value`` of the links from ``low`` on, at their corners.

    ``term`` (channel, term, link) are Chebyshev's polynomials of the corner's distance from
    ``corners.time``; ``value`` (channel, link, 2 × power) are values at the corner times powers of
    the distance of its beat from ``corners.beat``; distances are in units of the widths.
    """
    pair, links, count = batch.pair, batch.links, term.shape[2]
    x, z, cycles = np.empty(count), np.empty(count), np.empty(count)
    amplitude = np.empty(count, dtype=np.complex128)
    for m in range(term.shape[0]):
        for p in range(count):
            chirp = received(pair, links, low + p, m)
            corner = chirp.end if corners.side > 0 else chirp.begin
            amplitude[p] = chirp.amplitude
            cycles[p] = phase_of(chirp, corner)
            x[p] = (corner - corners.time) / corners.time_width
            z[p] = (chirp.beat + chirp.rate * corner - corners.beat) / corners.beat_width
        fill_columns(term[m], value[m], x, z, amplitude, cycles)


@compiled
def cut_sums(
    out: ComplexArray, batch: Batch, side: int, time: float, expansion: CutExpansion
) -> None:
    """Add to every channel the sample at ``time``, whose window has the corners of some links.

    A link's value has two terms: one at its corner, or at the window's edge if the corner lies
    beyond it, and one at the window's other edge. ``side`` is that of `CornerRange`.
    """
    pair, links, half, count = batch.pair, batch.links, batch.taps.half, batch.high - batch.low
    corner_gain, edge_gain = expansion.corner_gain, expansion.edge_gain
    x, z, y = np.empty(count), np.empty(count), np.empty(count)
    here, there, real, imag = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    amplitude = np.empty(count, dtype=np.complex128)
    far = time - side * half
    for m in range(out.size):
        # where each link's integral begins and ends; beats and phases there
        for p in range(count):
            chirp = received(pair, links, batch.low + p, m)
            if side > 0:
                corner = min(chirp.end, time + half)
                is_met = corner > far
            else:
                corner = max(chirp.begin, time - half)
                is_met = corner < far
            amplitude[p] = -side * chirp.amplitude if is_met else 0.0j
            here[p], there[p] = phase_of(chirp, corner), phase_of(chirp, far)
            z[p] = (chirp.beat + chirp.rate * corner - expansion.beat) / expansion.beat_width
            x[p] = (time - corner - expansion.delay) / expansion.delay_width
            y[p] = (chirp.beat + chirp.rate * far - expansion.edge_beat) / expansion.edge_width
        units(here, real, imag)
        for p in range(count):
            gain = _polynomial_of_two(corner_gain, z[p], x[p])
            out[m] += amplitude[p] * complex(real[p], imag[p]) * gain
        units(there, real, imag)
        for p in range(count):
            gain = edge_gain[edge_gain.size - 1]
            for e in range(edge_gain.size - 2, -1, -1):
                gain = gain * y[p] + edge_gain[e]
            out[m] -= amplitude[p] * complex(real[p], imag[p]) * gain


@inlined
def _polynomial_of_two(coefficient: ComplexArray, z: float, x: float) -> complex:
    """Value of the sum with coefficients ``(power of z, Chebyshev's polynomial of x)``.

    Horner's rule in z; Clenshaw's in x, as many powers of x would lose digits.
    """
    terms = coefficient.shape[1]
    value = 0.0j
    for e in range(coefficient.shape[0] - 1, -1, -1):
        last, inner = 0.0j, 0.0j
        for q in range(terms - 1, 0, -1):
            last, inner = inner, coefficient[e, q] + 2.0 * x * inner - last
        value = value * z + (coefficient[e, 0] + x * inner - last)
    return value
