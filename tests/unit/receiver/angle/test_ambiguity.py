"""Directions that arrays cannot tell apart."""

import numpy as np
import pytest

from polychirp.receiver.angle.ambiguity import (
    AMBIGUOUS_POWER,
    ambiguities,
    grating_lobes,
    nearest_to_boresight,
    unambiguous_window,
)
from polychirp.receiver.angle.directions import directions
from polychirp.receiver.angle.elements import Elements
from tests.support.directions import places, unit_noise


@pytest.mark.parametrize("step", [0.45, 0.55, 0.8, 1.5])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_uniform_line_is_ambiguous_at_multiples_of_the_wavelength_over_its_step(step, axis):
    place = np.zeros((6, 2))
    place[:, axis] = step * np.arange(6)
    lobes = grating_lobes(Elements(place=place))
    expected = [n / step for n in range(-5, 6) if n and abs(n / step) <= 2.0]
    np.testing.assert_allclose(lobes[:, axis], expected, atol=1e-9)
    window = unambiguous_window(Elements(place=place), estimator="bartlett")
    angle = np.arcsin(min(1.0, 0.5 / step))
    assert window[axis] == pytest.approx(angle, abs=1e-9)
    assert window[1 - axis] is None


def test_a_rectangle_has_the_lobes_of_both_its_steps_and_their_sums():
    place = np.array([(0.8 * n, 0.7 * m) for m in range(3) for n in range(4)])
    lobes = grating_lobes(Elements(place=place))
    expected = [
        (n / 0.8, m / 0.7)
        for n in (-1, 0, 1)
        for m in (-1, 0, 1)
        if 0 < np.hypot(n / 0.8, m / 0.7) <= 2.0
    ]
    assert len(lobes) == len(expected)
    for lobe in expected:
        assert np.min(np.linalg.norm(lobes - lobe, axis=1)) < 1e-9
    window = unambiguous_window(Elements(place=place), estimator="bartlett")
    assert np.sin(window) == pytest.approx([0.625, 0.5 / 0.7], abs=1e-9)


def test_lobes_repeat_the_phases_of_every_wave():
    """The definition, tried on drawn directions and arrays of drawn multiples of 0.7 λ."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        place = 0.7 * np.unique(rng.integers(0, 6, (9, 2)), axis=0).astype(float)
        elements = Elements(place=place)
        lobes = grating_lobes(elements, least=1.0 - 1e-6)
        assert len(lobes) >= 4
        cosines = rng.uniform(-0.5, 0.5, 2)
        wave = elements.steering(cosines)
        power = np.abs(elements.steering(cosines + lobes).conj() @ wave) ** 2 / len(place) ** 2
        np.testing.assert_allclose(power, 1.0, atol=1e-5)


def test_a_sparse_row_of_coprime_gaps_has_the_window_of_its_least_step():
    """Gaps of 1.5 and 1 λ, each ambiguous: their lobes 0.667 n and 1 m meet at 2 alone."""
    place = np.array([(x, 0.0) for x in (0.0, 1.5, 2.5, 4.0, 5.0)])
    exact = grating_lobes(Elements(place=place), least=1.0 - 1e-6)
    np.testing.assert_allclose(np.abs(exact[:, 0]), 2.0, atol=1e-9)
    window = unambiguous_window(Elements(place=place), estimator="bartlett")
    assert window.azimuth == pytest.approx(np.pi / 2, abs=1e-6)


def test_esprit_is_ambiguous_at_the_wavelength_over_its_shift():
    """Eight elements a wavelength apart, and one in the middle between two of them.

    The ninth element lowers the lobes of the others at ±1 to (7/9)², but only two pairs are half a
    wavelength apart, so that ESPRIT compares elements a wavelength apart.
    """
    place = [(float(n), 0.0) for n in range(8)] + [(3.5, 0.0)]
    elements = Elements(place=place)
    assert unambiguous_window(elements, estimator="bartlett").azimuth == pytest.approx(np.pi / 2)
    assert unambiguous_window(elements, estimator="esprit").azimuth == pytest.approx(np.pi / 6)
    added = ambiguities(elements, estimator="esprit")[len(grating_lobes(elements)) :]
    np.testing.assert_allclose(added, [[1.0, 0.0]])


@pytest.mark.parametrize(("snr", "most"), [(10.0, 0.25), (100.0, 0.002)])
def test_a_lobe_of_the_least_power_is_taken_for_the_wave_as_often_as_stated(snr, most):
    """One of six at 10 dB, one of two thousand at 20 dB; 4000 draws of the two matched filters."""
    rng = np.random.default_rng(2)
    common = np.sqrt(AMBIGUOUS_POWER)
    noise = unit_noise((2, 4000), rng)
    right = np.sqrt(snr) + noise[0]
    wrong = np.sqrt(snr) * common + common * noise[0] + np.sqrt(1 - common**2) * noise[1]
    share = np.mean(np.abs(wrong) > np.abs(right))
    assert share < most
    assert share > 0.1 or snr > 10.0


def test_ambiguous_directions_are_confused_in_noise_and_others_are_not():
    """Elements 0.8 λ apart: ±sines beyond 0.625 are taken for others, those within are not."""
    elements, rng = Elements(place=[(0.8 * n, 0.0) for n in range(6)]), np.random.default_rng(3)
    edge = unambiguous_window(elements, estimator="bartlett").azimuth
    for azimuth, expected in ((0.95 * edge, 0.0), (1.05 * edge, 1.0)):
        wave = elements.steering(np.array([np.sin(azimuth), 0.0]))
        snapshots = 10.0 * wave[None, :, None] + unit_noise((200, 6, 1), rng)
        found = directions(snapshots, elements, estimator="bartlett").azimuth
        assert np.mean(np.abs(found - azimuth) > 0.2) == pytest.approx(expected, abs=0.02)


def test_of_directions_with_equal_phases_the_nearest_to_boresight_is_chosen():
    elements = Elements(place=[(0.8 * n, 0.0) for n in range(4)])
    chosen = nearest_to_boresight(np.array([[0.7, 0.0], [-0.5, 0.0]]), elements)
    np.testing.assert_allclose(chosen, [[-0.55, 0.0], [-0.5, 0.0]], atol=1e-9)


def test_usual_arrays_are_unambiguous_to_the_sides():
    for name in ("two rows", "rectangle", "scattered"):
        window = unambiguous_window(Elements(place=0.98 * places(name)), estimator="bartlett")
        assert min(window) == pytest.approx(np.pi / 2, abs=1e-6)
