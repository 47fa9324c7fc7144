"""Lobes and tables of the points that represent a vehicle."""

import numpy as np
import pytest

from polychirp.channel.point_vehicles.scattering_points import (
    TablePoints,
    lobe_points,
    most_similar_table,
    table_points,
)
from polychirp.traffic.vehicle import vehicle_mesh

MODELS = {"one": lobe_points("one"), "five": lobe_points("five"), **table_points()}


def directions(count, seed=0):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def level(azimuth):
    return np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1)


@pytest.mark.parametrize("name", MODELS)
def test_transmitter_and_receiver_may_change_places(name):
    law, (out, back) = MODELS[name], directions(400).reshape(2, 200, 3)
    point = np.arange(200) % len(law.place)
    there, again = law.cross_section(point, out, back), law.cross_section(point, back, out)
    np.testing.assert_allclose(there, again, rtol=1e-12)
    assert np.all(there > 0)


@pytest.mark.parametrize("name", MODELS)
def test_left_and_right_are_alike(name):
    """3GPP's lobes and the bodies are their own mirror images; 3 % are the tables' 0.1 dB."""
    law, away = MODELS[name], directions(200, seed=2)
    flipped = law.place * (1, -1, 1) + (0, 1, 0)
    other = np.argmin(np.linalg.norm(law.place[:, None] - flipped[None], axis=-1), axis=0)
    point = np.arange(200) % len(law.place)
    mirror = away * (1, -1, 1)
    np.testing.assert_allclose(
        law.cross_section(point, away, away),
        law.cross_section(other[point], mirror, mirror),
        rtol=0.03,
    )


@pytest.mark.parametrize("points", ["one", "five"])
def test_no_lobe_falls_below_its_depth_nor_rises_above_its_peak(points):
    law, (out, back) = lobe_points(points), directions(2000).reshape(2, 1000, 3)
    floor = law.peak / law.depth
    for point in range(len(law.place)):
        found = law.cross_section(np.full(1000, point), out, back)
        least, most = (floor[point], law.peak[point]) if points == "five" else (0, law.peak.max())
        assert np.all((found >= least * (1 - 1e-12)) & (found <= most * (1 + 1e-12)))


def test_at_half_its_width_off_a_lobe_has_half_its_power():
    law = lobe_points("five")
    zenith = law.zenith[0]
    for turn in (law.azimuth_width[0] / 2, -law.azimuth_width[0] / 2):
        away = np.array([[np.sin(zenith) * np.cos(turn), np.sin(zenith) * np.sin(turn), 0]])
        away[0, 2] = np.cos(zenith)
        found = law.cross_section(np.array([0]), away, away)[0]
        assert found / law.peak[0] == pytest.approx(10**-0.3, rel=1e-9)


def test_a_bistatic_angle_weakens_a_lobe_as_equation_3_says():
    """60° between the directions, their bisector ahead: −6.05 sin(1.33 · 30°) + 5 lg cos 30° dB."""
    law = lobe_points("five")
    zenith = law.zenith[0]
    middle = np.array([np.sin(zenith), 0, np.cos(zenith)])
    side = np.array([0, 1.0, 0])
    out, back = (np.sqrt(0.75) * middle + 0.5 * sign * side for sign in (1, -1))
    found = law.cross_section(np.array([0]), out[None], back[None])[0]
    expected = -6.05 * np.sin(1.33 * np.pi / 6) + 5 * np.log10(np.cos(np.pi / 6))
    assert 10 * np.log10(found / law.peak[0]) == pytest.approx(expected, abs=1e-9)


def test_what_is_drawn_has_the_published_spread():
    """20 000 draws: the mean within 2 % (1 σ is 0.7 %), deviations within 2 %."""
    law, rng = lobe_points("one"), np.random.default_rng(0)
    drawn = np.array([law.matrix(rng) for _ in range(20_000)])
    power = np.abs(drawn[:, 0, 0]) ** 2
    cross = 10 * np.log10(power / np.abs(drawn[:, 0, 1]) ** 2)
    assert np.mean(power) == pytest.approx(1.0, rel=0.02)
    assert np.std(10 * np.log10(power)) == pytest.approx(3.41, rel=0.02)
    assert np.mean(cross) == pytest.approx(21.1, abs=0.2)
    assert np.std(cross) == pytest.approx(6.9, rel=0.02)
    np.testing.assert_array_equal(drawn[:, 0, 1], drawn[:, 1, 0])


def test_a_table_is_linear_between_its_columns():
    echo = np.array([[1.0, 3.0, 5.0, 3.0]])
    table = TablePoints(size=np.ones(3), place=np.zeros((1, 3)), echo=echo)
    azimuth = np.array([0.0, np.pi / 4, np.pi / 2, np.pi, -np.pi / 8])
    away = level(azimuth)
    found = table.cross_section(np.zeros(5, dtype=np.int64), away, away)
    np.testing.assert_allclose(found, [1, 2, 3, 5, 1.5])


@pytest.mark.parametrize("body", table_points())
def test_every_built_in_body_finds_its_own_table_in_its_own_size(body):
    corners = vehicle_mesh(body, max_edge=0.3, coarseness=4.0).corners
    size = corners.max(axis=(0, 1)) - corners.min(axis=(0, 1))
    table = most_similar_table(size)
    assert table is table_points()[body]
    assert table.scale(size) == pytest.approx(1.0, abs=0.02)
    assert np.all((table.place >= 0) & (table.place <= 1))


def test_a_body_twice_as_large_echoes_four_times_as_strongly():
    table = table_points()["sedan"]
    assert table.scale(2 * table.size) == pytest.approx(4.0)
