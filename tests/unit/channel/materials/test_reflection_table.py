"""Tabulated reflection coefficients against those computed for every angle."""

import numpy as np
import pytest

from polychirp.channel.materials.fresnel import media_of, smooth_reflection
from polychirp.channel.materials.library import known_materials
from polychirp.channel.materials.reflection_table import reflection_table, tabulated_reflection
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.material import Material
from tests.support.kernels import callable_from_python

FREQUENCY = 79e9
WAVENUMBER = 2 * np.pi * FREQUENCY / SPEED_OF_LIGHT
MATERIALS = {
    "metal": known_materials()["metal"],
    "glass": known_materials()["glass"],
    "concrete": known_materials()["concrete"],
    "steel": Material(conductivity=1e6),
    "thick": Material(relative_permittivity=4.0, thickness=0.05),
}


read = callable_from_python(tabulated_reflection)

LIMITS = {"metal": 0.0, "glass": 5e-6, "concrete": 3e-7, "steel": 3e-5, "thick": 5e-4}


@pytest.mark.parametrize(("name", "limit"), LIMITS.items())
def test_the_table_gives_what_the_formula_gives(name, limit):
    """The error depends on how fast Γ changes with the angle."""
    names = tuple(MATERIALS)
    table = reflection_table(tuple(MATERIALS.values()), FREQUENCY)
    exact = media_of(names, MATERIALS, FREQUENCY)
    medium = names.index(name)
    worst = 0.0
    for cosine in np.random.default_rng(1).uniform(0.0, 1.0, 2000) ** 3:
        found = read(table, medium, cosine)
        expected = smooth_reflection(exact, medium, cosine, WAVENUMBER)
        worst = max(worst, np.max(np.abs(np.subtract(found, expected))))
    assert worst <= limit


def test_the_table_has_the_ends_of_the_range():
    table = reflection_table(tuple(MATERIALS.values()), FREQUENCY)
    exact = media_of(tuple(MATERIALS), MATERIALS, FREQUENCY)
    for cosine in (0.0, 1.0):
        np.testing.assert_allclose(
            read(table, 2, cosine),
            smooth_reflection(exact, 2, cosine, WAVENUMBER),
            atol=1e-9,
        )


def test_roughness_is_a_phase_and_no_part_of_the_coefficients():
    rough = Material(relative_permittivity=3.0, roughness=1e-3)
    table = reflection_table((rough, Material(relative_permittivity=3.0)), FREQUENCY)
    assert table.roughness[0] == pytest.approx(WAVENUMBER * 1e-3)
    np.testing.assert_array_equal(table.gamma[0], table.gamma[1])
