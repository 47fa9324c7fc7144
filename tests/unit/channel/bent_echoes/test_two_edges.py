"""The field behind two edges beside its slow twin, which integrates every side on its own."""

import math

import numpy as np
import pytest

from polychirp.channel.bent_echoes.two_edges import two_edge_field
from polychirp.channel.ray_tubes.fresnel_window import signed_edge_term
from polychirp.jit import compiled

FAR_AWAY = 1e7
"""Place along an edge, in units of (u, v), that stands for infinity in the slow twin."""


@compiled
def fields(first, second, correlation):
    """U/U₀ behind both edges: the fast one, and that of its slow twin, ``(point, 2)``."""
    out = np.empty((first.size, 2), dtype=np.complex128)
    for i in range(first.size):
        found = two_edge_field(first[i], second[i], correlation[i])
        out[i, 0] = found.clear + found.wave
        sine = math.sqrt(1.0 - correlation[i] ** 2)
        height = (second[i] - correlation[i] * first[i]) / sine
        start = sine * first[i] - correlation[i] * height
        border = signed_edge_term(first[i], height) - signed_edge_term(first[i], FAR_AWAY)
        border += signed_edge_term(second[i], start) - signed_edge_term(second[i], FAR_AWAY)
        out[i, 1] = (0.5 * math.pi + math.asin(correlation[i]) + border) / (2.0 * math.pi)
    return out


@pytest.mark.parametrize("greatest", [1.0, 10.0, 100.0])
def test_the_field_is_that_of_both_sides_on_their_own(greatest):
    """The twin's edges end at 1e7, where an edge at ν still misses ν/(2π·1e7) of each side."""
    draw = np.random.default_rng(7)
    first, second = draw.uniform(-greatest, greatest, (2, 4000))
    both = fields(first, second, draw.uniform(0.01, 0.999, 4000))
    bound = 1e-9 + 2.0 * greatest / (2.0 * math.pi * FAR_AWAY)
    assert np.max(np.abs(both[:, 0] - both[:, 1])) < bound
