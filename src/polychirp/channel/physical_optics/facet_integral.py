r"""Mean of :math:`e^{-jp}` over a triangle on which the phase p (rad) is linear."""

import math
from typing import Final

from polychirp.axes import ComplexArray, FloatArray
from polychirp.jit import fast, fused_inlined

ONE_TERM_SPAN: Final = 2.0
"""rad: a facet whose corner phases all differ by less has one term, at its centroid (chosen: small
enough that one path length describes the facet, large enough that its terms do not cancel)."""

TWO_TERMS_GAP: Final = 0.5
"""rad: two corners whose phases differ by less share one term (chosen as `ONE_TERM_SPAN` is)."""


@fused_inlined
def phasor(phase: float) -> complex:
    """e^{−jφ} with errors up to 1e-11 for |φ| ≤ 1e6, three times as fast as `math.sin` and `cos`.

    The function has no branches and no divisions, so that the processor can compute several
    phases at a time.
    """
    turns = math.floor(phase * (2.0 / math.pi) + 0.5)
    # π/2 in two parts; the first ends in 22 zero bits, so that its product with turns is exact
    x = (phase - turns * 1.5707963267341256) - turns * 6.077100506506192e-11
    y = x * x
    sine = 1.0 - y * (1 / 72) * (1.0 - y * (1 / 110))
    sine = x * (1.0 - y * (1 / 6) * (1.0 - y * (1 / 20) * (1.0 - y * (1 / 42) * sine)))
    cosine = 1.0 - y * (1 / 56) * (1.0 - y * (1 / 90) * (1.0 - y * (1 / 132)))
    cosine = 1.0 - y * (1 / 2) * (1.0 - y * (1 / 12) * (1.0 - y * (1 / 30) * cosine))
    quadrant = int(turns)
    is_odd, is_back = (quadrant & 1) != 0, (quadrant & 2) != 0
    real, imaginary = (-sine, -cosine) if is_odd else (cosine, -sine)
    return complex(-real, -imaginary) if is_back else complex(real, imaginary)


@fast
def _divided_difference(a: float, b: float) -> complex:
    """(e^{−ja} − e^{−jb})/(a − b), computed without cancellation for near phases."""
    half = 0.5 * (a - b)
    ratio = -phasor(half).imag / half if abs(half) > 1e-8 else 1.0
    turned = phasor(0.5 * (a + b))
    return complex(ratio * turned.imag, -ratio * turned.real)


@fast
def facet_integral(low: float, middle: float, high: float) -> complex:
    r"""Mean of e^{−jp} over a triangle, from the phases at its corners in rising order.

    The mean is :math:`-2` times the second divided difference of e^{−jp}. It equals Gordon's sum
    :math:`-2\sum_i e^{-jp_i}/\prod_{m\ne i}(p_i-p_m)`, whose terms would cancel for near phases.
    """
    spread = high - low
    if spread < 1e-3:
        x, y = middle - low, spread
        return phasor(low) * complex(1.0 - (x * x + y * y + x * y) / 12.0, -(x + y) / 3.0)
    difference = _divided_difference(low, middle) - _divided_difference(middle, high)
    return difference * (2.0 / spread)


@fast
def facet_terms(phases: tuple[float, float, float], weight: ComplexArray, place: FloatArray) -> int:
    """Split the mean of `facet_integral` into one to three terms; return their number.

    The function writes ``weight`` ``(3,)``, the terms, and ``place`` ``(3, corner)``, their
    barycentric coordinates. Each corner has a term of its own. If two corners' phases are so near
    each other that their terms would nearly cancel, one term half-way replaces both. If all three
    are, one term at the centroid replaces them.
    """
    p, q, r = phases
    lo, hi = min(p, q, r), max(p, q, r)
    mid = p + q + r - lo - hi
    if hi - lo < ONE_TERM_SPAN:
        weight[0] = facet_integral(lo, mid, hi)
        place[0] = 1.0 / 3.0
        return 1
    if min(mid - lo, hi - mid) >= TWO_TERMS_GAP:
        # one division for all: dividing complex numbers is slow
        scale = 2.0 / ((p - q) * (q - r) * (r - p))
        weight[0] = phasor(p) * (scale * (q - r))
        weight[1] = phasor(q) * (scale * (r - p))
        weight[2] = phasor(r) * (scale * (p - q))
        for i in range(3):
            for j in range(3):
                place[i, j] = 1.0 if i == j else 0.0
        return 3
    # the corner whose phase is far from the other two keeps its own term
    lone = hi if mid - lo < hi - mid else lo
    for i in range(3):
        is_lone = phases[i] == lone
        place[0, i] = 1.0 if is_lone else 0.0
        place[1, i] = 0.0 if is_lone else 0.5
    near, far = (lo, mid) if lone == hi else (mid, hi)
    weight[0] = phasor(lone) * (-2.0 / ((lone - near) * (lone - far)))
    weight[1] = facet_integral(lo, mid, hi) - weight[0]
    return 2
