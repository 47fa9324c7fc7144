"""Azimuth and elevation by every estimator from arrays of every shape."""

import numpy as np
import pytest

from polychirp.errors import CapabilityError, InputError
from polychirp.receiver.angle.beams import beam_power, grid
from polychirp.receiver.angle.directions import cosines_of_waves, directions, unfit
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.angle.esprit import esprit, shift_along
from tests.support.directions import (
    ARRAYS,
    drawn_directions,
    noisy_waves,
    phases,
    places,
    unit_noise,
)

ESTIMATORS = ("bartlett", "capon", "root-music", "esprit")
READ = [
    (name, estimator)
    for name in ARRAYS
    for estimator in ESTIMATORS
    if not unfit(Elements(place=places(name)), estimator)
]


def test_every_estimator_reads_the_arrays_that_it_can():
    """Beams read any; root-MUSIC lines; ESPRIT those of which a third repeats another part."""
    for estimator in ("bartlett", "capon"):
        assert all((name, estimator) in READ for name in ARRAYS)
    lines = {name for name, estimator in READ if estimator == "root-music"}
    assert lines == {"row", "column", "sparse row", "overlapping row"}
    shifted = {name for name, estimator in READ if estimator == "esprit"}
    assert shifted == {"two rows", "rectangle", "row", "column", "overlapping row"}


@pytest.mark.parametrize(("name", "estimator"), READ)
def test_a_wave_without_noise_is_exact(name, estimator):
    place = places(name)
    azimuth, elevation = drawn_directions(place, 200, np.random.default_rng(1))
    found = directions(
        phases(place, azimuth, elevation)[..., None], Elements(place=place), estimator=estimator
    )
    measured = np.ptp(place, axis=0) > 0
    for is_measured, angle, true in zip(measured, found, (azimuth, elevation), strict=True):
        expected = true if is_measured else np.full(200, np.nan)
        np.testing.assert_allclose(angle, expected, atol=1e-7)


@pytest.mark.parametrize("name", ARRAYS)
def test_the_estimators_agree_on_a_strong_wave(name):
    """At 70 dB per channel, errors are below 1e-4 rad in all of them."""
    place, rng = places(name), np.random.default_rng(2)
    azimuth, elevation = drawn_directions(place, 100, rng)
    snapshots = noisy_waves(place, azimuth, elevation, snr=1e7, rng=rng)
    found = [
        directions(snapshots, Elements(place=place), estimator=estimator)
        for estimator in ESTIMATORS
        if (name, estimator) in READ
    ]
    assert len(found) >= 2
    for other in found[1:]:
        np.testing.assert_allclose(other.azimuth, found[0].azimuth, atol=5e-4)
        np.testing.assert_allclose(other.elevation, found[0].elevation, atol=5e-4)


def test_the_order_of_the_channels_does_not_matter():
    place, rng = places("two rows"), np.random.default_rng(3)
    azimuth, elevation = drawn_directions(place, 20, rng)
    snapshots = noisy_waves(place, azimuth, elevation, snr=100.0, rng=rng)
    mixed = rng.permutation(len(place))
    for estimator in ("bartlett", "capon", "esprit"):
        first = directions(snapshots, Elements(place=place), estimator=estimator)
        other = directions(snapshots[:, mixed], Elements(place=place[mixed]), estimator=estimator)
        np.testing.assert_allclose(first, other, atol=1e-9)


def test_a_row_reports_the_direction_cosine_of_a_raised_target_as_its_azimuth():
    """At 30° left and 40° up: sin φ' = cos 40° sin 30°."""
    place = places("row")
    wave = phases(place, np.radians(30.0), np.radians(40.0))
    found = directions(wave[None, :, None], Elements(place=place), estimator="bartlett")
    expected = np.arcsin(np.cos(np.radians(40.0)) * 0.5)
    assert found.azimuth[0] == pytest.approx(expected, abs=1e-9)
    assert np.isnan(found.elevation[0])


def test_a_single_channel_measures_no_direction():
    found = directions(np.ones((3, 1, 1)), Elements(place=[[0.0, 0.0]]), estimator="root-music")
    assert np.all(np.isnan(found))
    assert found.azimuth.shape == (3,)


def test_a_wave_from_the_side_is_at_ninety_degrees():
    place = places("rectangle")
    wave = phases(0.96 * place, np.radians(90.0), 0.0)[None, :, None]
    found = directions(wave, Elements(place=0.96 * place), estimator="bartlett")
    # an error of 1e-9 of the sine is one of 5e-5 rad here
    assert found.azimuth[0] == pytest.approx(np.radians(90.0), abs=1e-3)


def test_the_grids_beams_are_the_matched_filters():
    """The slow twin: one beam after the other, one factor after the other."""
    elements = Elements(place=places("scattered"))
    factor = unit_noise((7, 3), np.random.default_rng(4))
    points = grid(elements)
    power = beam_power(factor, elements, points)
    for row, column in ((0, 0), (5, 9), (11, 2)):
        cosines = np.array([points.left[row], points.up[column]])
        wave = elements.steering(cosines)
        expected = sum(abs(np.vdot(wave, one)) ** 2 for one in factor.T)
        assert power[row, column] == pytest.approx(expected, rel=1e-12)


def cosines(azimuth, elevation):
    return np.stack([np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1)


def in_order(found):
    """Waves from right to left, then from bottom to top."""
    return found[np.lexsort((found[:, 1], found[:, 0].round(2)))]


@pytest.mark.parametrize("estimator", ["capon", "esprit"])
def test_two_waves_in_many_snapshots_are_told_apart_in_azimuth_and_elevation(estimator):
    """By half the way to the first null along both axes of a 6 × 4 rectangle, 20 dB, 100 pairs.

    The nulls are 1/3 and 1/2 from the middle of a beam, so that Bartlett's beams merge the waves.
    """
    place = 0.5 * np.array([(x, z) for z in range(4) for x in range(6)], dtype=float)
    elements, rng = Elements(place=place), np.random.default_rng(5)
    counts, apart = dict.fromkeys((estimator, "bartlett"), 0), np.array([1 / 6, 1 / 4])
    for _ in range(100):
        first = rng.uniform(-0.4, 0.2, 2)
        true = np.stack([first, first + apart])
        waves = elements.steering(true)
        shape = (2, 200)
        snapshots = 10.0 * waves.T @ unit_noise(shape, rng) + unit_noise((24, 200), rng)
        for name in counts:
            found = cosines_of_waves(snapshots[None], elements, num_waves=2, estimator=name)[0]
            counts[name] += bool(np.all(np.abs(in_order(found) - true) < 0.05))
    assert counts[estimator] >= 98
    assert counts["bartlett"] <= 50


def test_cosines_of_equal_azimuth_are_paired_with_the_right_elevations():
    """Two waves above each other, and two of exchanged cosines: no pairing by one axis alone."""
    place, rng = places("rectangle"), np.random.default_rng(6)
    elements = Elements(place=place)
    for true in ([(0.2, -0.3), (0.2, 0.4)], [(-0.4, 0.3), (0.3, -0.4)], [(0.1, 0.5), (0.5, 0.1)]):
        waves = elements.steering(np.array(true))
        snapshots = waves.T @ unit_noise((2, 50), rng)
        found = cosines_of_waves(snapshots[None], elements, num_waves=2, estimator="esprit")[0]
        np.testing.assert_allclose(in_order(found), in_order(np.array(true)), atol=1e-9)


def test_root_music_tells_two_waves_apart_on_a_row_with_gaps():
    """A tenth of the width's cell: 1/5.5 between the first null and the middle of a beam."""
    place, rng = places("sparse row"), np.random.default_rng(7)
    elements = Elements(place=place)
    true = np.array([-0.1, 0.0])
    waves = elements.steering(np.stack([true, 0.0 * true], axis=-1))
    snapshots = 10.0 * waves.T @ unit_noise((2, 400), rng) + unit_noise((5, 400), rng)
    found = cosines_of_waves(snapshots[None], elements, num_waves=2, estimator="root-music")
    np.testing.assert_allclose(found[0, :, 0], true, atol=0.01)


def test_a_row_of_equal_steps_beyond_half_a_wavelength_keeps_to_its_window():
    """λ/d = 1.25: a sine of 0.7 appears as −0.55, in any estimator."""
    place = np.array([(0.8 * n, 0.0) for n in range(5)])
    wave = Elements(place=place).steering(np.array([0.7, 0.0]))[None, :, None]
    for estimator in ESTIMATORS:
        found = directions(wave, Elements(place=place), estimator=estimator)
        assert np.sin(found.azimuth[0]) == pytest.approx(-0.55, abs=1e-6)


def test_of_equal_directions_of_a_rectangle_the_nearest_to_boresight_is_reported():
    place = np.array([(0.8 * n, 0.7 * m) for m in range(3) for n in range(4)])
    elements = Elements(place=place)
    wave = elements.steering(np.array([0.7, -0.75]))[None, :, None]
    for estimator in ("bartlett", "capon", "esprit"):
        found = cosines_of_waves(wave, elements, num_waves=1, estimator=estimator)[0, 0]
        np.testing.assert_allclose(found, [0.7 - 1.25, -0.75 + 1 / 0.7], atol=1e-6)


def test_a_shift_is_found_where_a_part_of_the_array_repeats_another():
    elements = Elements(place=places("two rows"))
    assert shift_along(elements, 0).length == 0.5
    assert shift_along(elements, 0).first.size == 7 + 3
    assert shift_along(elements, 1).first.size == 4
    assert shift_along(Elements(place=places("sparse row")), 0) is None


@pytest.mark.parametrize(
    ("place", "estimator", "message"),
    [
        (places("rectangle"), "root-music", "one horizontal or vertical line"),
        (places("scattered"), "esprit", "to repeat others one shift to the side"),
        ([[0.0, 0.0], [0.5, 0.5], [1.0, 1.0]], "bartlett", "one slanted line"),
        ([[0.0, 0.0], [0.5, 0.0], [0.5 + np.sqrt(0.5), 0.0]], "root-music", "multiples of one"),
        (
            [[0.0, 0.0], [900.0, 0.0], [0.0, 900.0]],
            "capon",
            "span 900 by 900 wavelengths.*take too long",
        ),
    ],
)
def test_what_an_estimator_cannot_read_is_refused_in_one_sentence(place, estimator, message):
    with pytest.raises(CapabilityError, match=message) as caught:
        directions(np.ones((1, len(place), 1)), Elements(place=place), estimator=estimator)
    assert "\n" not in str(caught.value)


def test_snapshots_without_their_axes_and_too_few_for_esprit_are_refused():
    elements = Elements(place=places("two rows"))
    with pytest.raises(InputError, match="detection, channel, snapshot"):
        directions(np.ones((2, 12)), elements, estimator="bartlett")
    with pytest.raises(CapabilityError, match="as many snapshots"):
        esprit(np.ones((1, 12, 1)), elements, num_waves=2)
