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
    for name in ("two rows", "rectangle"):
        window = unambiguous_window(Elements(place=0.98 * places(name)), estimator="bartlett")
        assert min(window) == pytest.approx(np.pi / 2, abs=1e-6)


def test_scattered_elements_are_ambiguous_in_both_cosines_at_once():
    """Seven elements have a lobe of 83 % at (0.40, −1.04), which no projection onto an axis has."""
    place = 0.98 * places("scattered")
    left, up = np.meshgrid(np.linspace(0.3, 0.5, 201), np.linspace(-1.15, -0.95, 201))
    phases = left[..., None] * place[:, 0] + up[..., None] * place[:, 1]
    power = np.abs(np.exp(2j * np.pi * phases).mean(axis=-1)) ** 2
    assert power.max() > AMBIGUOUS_POWER
    window = unambiguous_window(Elements(place=place), estimator="bartlett")
    half = 0.5 * abs(up.ravel()[np.argmax(power)])
    assert np.sin(window) == pytest.approx([1.0, half], abs=1e-3)


def staggered(rng) -> tuple[Elements, np.ndarray]:
    """Rows of a drawn pitch 2a and distance b, every other one shifted by a; and all their lobes.

    The places 2a n + a m to the left and b m up have equal phases at cosines (i/2a, (k − i/2)/b)
    apart, for all integers i and k.
    """
    aside, above = rng.uniform(0.35, 0.9, 2)
    place = [(aside * (2 * n + m % 2), above * m) for m in range(3) for n in range(4)]
    i, k = np.meshgrid(np.arange(-6, 7), np.arange(-6, 7))
    lobes = np.stack([i / (2 * aside), (k - i / 2) / above], axis=-1).reshape(-1, 2)
    far = np.linalg.norm(lobes, axis=1)
    return Elements(place=place), lobes[(far > 0.0) & (far <= 2.0)]


def has_lobe(lobes, sines) -> bool:
    """True if two directions in a box of sines differ by a lobe."""
    return bool(np.any(np.all(np.abs(lobes) < 2.0 * np.array(sines) - 1e-6, axis=1)))


def test_the_window_of_staggered_rows_is_the_best_box_without_a_lobe():
    """Against every box of 200 × 200 sines, for 40 drawn arrays, each with a drawn beam.

    The box holds no lobe, cannot grow, and no other one covers more of the beam.
    """
    rng = np.random.default_rng(5)
    steps = np.arange(1, 201) / 200
    both_shrink = 0
    for _ in range(40):
        elements, lobes = staggered(rng)
        beam = tuple(rng.uniform(0.2, np.pi / 2, 2))
        sines = np.sin(unambiguous_window(elements, estimator="bartlett", beam=beam))
        assert not has_lobe(lobes, sines)
        for grown in (sines * [1.02, 1.0], sines * [1.0, 1.02]):
            assert has_lobe(lobes, grown) or max(grown) > 1.0
        # the least elevation at which a box of each azimuth meets a lobe
        meets = np.abs(lobes[:, 0]) < 2.0 * steps[:, None] - 1e-6
        tall = np.min(np.where(meets, 0.5 * np.abs(lobes[:, 1]), 1.0), axis=1)
        covered = np.minimum(steps, np.sin(beam[0])) * np.minimum(tall, np.sin(beam[1]))
        assert np.prod(np.minimum(sines, np.sin(beam))) >= covered.max() - 1e-6
        both_shrink += max(sines) < 0.999
    assert both_shrink >= 5


def test_directions_within_the_window_of_staggered_rows_are_reported_as_they_are():
    """Ten drawn directions on each of 20 drawn arrays, for beams that are wide and upright."""
    rng = np.random.default_rng(6)
    for beam in ((np.pi / 2, np.pi / 2), np.radians([60.0, 15.0]), np.radians([10.0, 60.0])):
        for _ in range(20):
            elements, _ = staggered(rng)
            window = unambiguous_window(elements, estimator="bartlett", beam=tuple(beam))
            azimuth, elevation = (0.97 * np.array(window) * rng.uniform(-1, 1, (10, 2))).T
            left = np.cos(elevation) * np.sin(azimuth)
            wave = elements.steering(np.stack([left, np.sin(elevation)], axis=-1))
            found = directions(wave[..., None], elements, estimator="bartlett", beam=tuple(beam))
            np.testing.assert_allclose(found.azimuth, azimuth, atol=1e-5)
            np.testing.assert_allclose(found.elevation, elevation, atol=1e-5)


def test_of_two_equal_boxes_the_beam_chooses():
    """Rows staggered by half of one wavelength, half a wavelength apart, have a lobe at (1, 1)."""
    elements = Elements(place=[(n + 0.5 * (m % 2), 0.5 * m) for m in range(4) for n in range(4)])
    for beam, expected in (((90, 90), (90, 30)), ((50, 20), (90, 30)), ((20, 50), (30, 90))):
        half = tuple(np.radians(beam))
        window = unambiguous_window(elements, estimator="bartlett", beam=half)
        assert np.degrees(window) == pytest.approx(expected, abs=1e-3)
