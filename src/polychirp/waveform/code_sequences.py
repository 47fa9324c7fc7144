r"""Binary sequences for phase codes: m-sequences, Gold's sequences, almost perfect ones.

Their periodic correlations are :math:`C(d) = \sum_i a_i b_{i+d}`:

- An m-sequence of the length :math:`L = 2^n - 1` has C(0) = L, and C(d) = −1 elsewhere
  (Golomb 1967).
- Two Gold sequences of this length have :math:`|C(d)| \le 2^{(n+1)/2} + 1` for odd n and
  :math:`2^{(n+2)/2} + 1` for even n (Gold 1967).
- An almost perfect sequence of the length :math:`L = 2(q + 1)`, q an odd prime, has C(0) = L,
  C(L/2) = 4 − L, and C(d) = 0 elsewhere (Wolfmann 1992).

Any M sequences of the length L have a correlation of at least :math:`L\sqrt{(M-1)/(ML-1)}` in
magnitude somewhere (Welch 1974).
"""

import math
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError

PRIMITIVE: Final[dict[int, tuple[int, ...]]] = {
    3: (3, 1),
    4: (4, 1),
    5: (5, 2),
    6: (6, 1),
    7: (7, 3),
    8: (8, 4, 3, 2),
    9: (9, 4),
    10: (10, 3),
    11: (11, 2),
    12: (12, 6, 4, 1),
    13: (13, 4, 3, 1),
    14: (14, 10, 6, 1),
}
"""Exponents of a primitive polynomial over GF(2) of each order, without the constant term
(Peterson and Weldon 1972)."""

PREFERRED: Final[dict[int, tuple[int, ...]]] = {
    5: (5, 4, 3, 2),
    6: (6, 5, 2, 1),
    7: (7, 3, 2, 1),
    9: (9, 6, 4, 3),
    10: (10, 8, 3, 2),
    11: (11, 8, 5, 2),
}
"""Polynomials that are preferred partners of those in `PRIMITIVE` (Dixon 1976)."""


def m_sequence(order: int) -> FloatArray:
    """The m-sequence of an order n, values ±1 of the length 2^n − 1.

    >>> m_sequence(3)
    array([-1., -1., -1.,  1.,  1., -1.,  1.])
    """
    if order not in PRIMITIVE:
        raise InputError(
            f"there is no m-sequence of the order {order} here; use {min(PRIMITIVE)} to "
            f"{max(PRIMITIVE)}"
        )
    return _shift_register(PRIMITIVE[order])


def gold_sequence(order: int, member: int) -> FloatArray:
    """A member of Gold's family of an order n: values ±1 of the length 2^n − 1.

    Members 0 and 1 are the two m-sequences, member 2 + d is their product with the shift d.
    `InputError` is raised if there is no such family or member.

    >>> gold_sequence(5, 7).size
    31
    """
    if order not in PREFERRED:
        raise InputError(
            f"there are no Gold sequences of the order {order} here; use one of "
            f"{', '.join(map(str, PREFERRED))}"
        )
    if not 0 <= member < num_gold(order):
        raise InputError(f"Gold's family has members 0 to {num_gold(order) - 1}, not {member}")
    one, other = _shift_register(PRIMITIVE[order]), _shift_register(PREFERRED[order])
    if member < 2:
        return (one, other)[member]
    return one * np.roll(other, member - 2)


def num_gold(order: int) -> int:
    """Number of members of Gold's family of an order."""
    return int(2**order + 1)


def almost_perfect_sequence(prime: int) -> FloatArray:
    r"""The almost perfect sequence of an odd prime q: values ±1 of the length 2(q + 1).

    It is :math:`\eta(\mathrm{Tr}\,\alpha^i)` with a primitive element α of GF(q²), its trace to
    GF(q), and the quadratic character η there; the two zeros are replaced by 1. As
    :math:`\alpha^{q+1}` is a non-residue of GF(q), its second half is the negative of its first
    one, so that the replaced zeros cancel in all correlations but C(0) and C(L/2).

    >>> almost_perfect_sequence(3)
    array([-1., -1.,  1., -1.,  1.,  1.,  1.,  1.])
    """
    if prime < 3 or not _is_prime(prime):
        raise InputError(f"an almost perfect sequence needs an odd prime, not {prime}")
    root = next(d for d in range(2, prime) if pow(d, (prime - 1) // 2, prime) == prime - 1)
    real, imag = _primitive_element(prime, root)
    x, y = 1, 0
    out = np.empty(2 * (prime + 1))
    for i in range(out.size):
        trace = 2 * x % prime
        out[i] = 1.0 if trace == 0 or pow(trace, (prime - 1) // 2, prime) == 1 else -1.0
        x, y = (x * real + root * y * imag) % prime, (x * imag + y * real) % prime
    return out


def largest_prime(most: int) -> int:
    """The largest prime up to ``most``."""
    return next(number for number in range(most, 1, -1) if _is_prime(number))


def _shift_register(exponents: tuple[int, ...]) -> FloatArray:
    """Output of a shift register with the feedback of a polynomial, from the state of all ones."""
    order = exponents[0]
    bits = [1] * order
    for _ in range(2**order - 1 - order):
        # a_(i+n) = Σ a_(i+e) over the lower exponents e and the constant term
        bits.append(sum(bits[len(bits) - order + e] for e in (0, *exponents[1:])) % 2)
    return np.asarray(1.0 - 2.0 * np.array(bits[: 2**order - 1]))


def _primitive_element(prime: int, root: int) -> tuple[int, int]:
    """A generator x + y√root of the multiplicative group of GF(prime²)."""
    size = prime * prime - 1
    factors = [p for p in range(2, prime + 2) if size % p == 0 and _is_prime(p)]
    for y in range(1, prime):
        for x in range(prime):
            if all(_power(x, y, size // p, prime, root) != (1, 0) for p in factors):
                return x, y
    raise InputError(f"there is no generator for {prime}")  # pragma: no cover


def _power(x: int, y: int, exponent: int, prime: int, root: int) -> tuple[int, int]:
    a, b = 1, 0
    while exponent:
        if exponent & 1:
            a, b = (a * x + root * b * y) % prime, (a * y + b * x) % prime
        x, y = (x * x + root * y * y) % prime, 2 * x * y % prime
        exponent >>= 1
    return a, b


def _is_prime(number: int) -> bool:
    return number > 1 and all(number % p for p in range(2, math.isqrt(number) + 1))
