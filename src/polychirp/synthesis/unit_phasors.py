"""Complex numbers of magnitude 1, computed in kernels.

No kernel of the synthesis uses fast arithmetic, not even fused multiplications and additions: a
kernel is compiled into each of its callers, and which operations are fused would depend on which of
these copies runs, so that the run that compiles them would differ from all later ones.
"""

import math
from typing import Final

from polychirp.axes import FloatArray
from polychirp.jit import inlined


@inlined
def unit(cycles: float) -> complex:
    """The number of magnitude 1 with the phase ``cycles``."""
    angle = 2.0 * math.pi * (cycles - math.floor(cycles))
    return complex(math.cos(angle), math.sin(angle))


@inlined
def units(cycles: FloatArray, real: FloatArray, imag: FloatArray) -> None:
    """Numbers of magnitude 1 with phases ``cycles``, without branches, so that loops vectorise.

    Taylor's series give sine and cosine of half the angle, at most π/2, which is then doubled.
    """
    for c in range(cycles.size):
        # adding and subtracting 1.5·2⁵² rounds to the nearest integer
        x = math.pi * (cycles[c] - ((cycles[c] + _TO_INTEGER) - _TO_INTEGER))
        y = x * x
        cosine, sine = _COSINE[_NUM_TERMS - 1], _SINE[_NUM_TERMS - 1]
        for i in range(_NUM_TERMS - 2, -1, -1):
            cosine = cosine * y + _COSINE[i]
            sine = sine * y + _SINE[i]
        sine *= x
        real[c] = 1.0 - 2.0 * sine * sine
        imag[c] = 2.0 * sine * cosine


_NUM_TERMS: Final = 11
"""Terms of each series (chosen): at π/2, the first omitted term of the cosine is 2e-17."""
_TO_INTEGER: Final = 1.5 * 2.0**52
_COSINE: Final = tuple((-1.0) ** i / math.factorial(2 * i) for i in range(_NUM_TERMS))
_SINE: Final = tuple((-1.0) ** i / math.factorial(2 * i + 1) for i in range(_NUM_TERMS))
