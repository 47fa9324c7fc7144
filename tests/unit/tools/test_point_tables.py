"""Splitting an echo among points."""

import tomllib

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around, mesh_of, sphere
from tools.point_tables import (
    MIRRORED,
    PLACES,
    as_text,
    cross_section,
    echo_paths,
    mean_power,
    split_echo,
)


def test_each_of_two_points_gets_its_own_cross_section():
    """Their beat turns six times in 1 GHz, so that 1 % of it is left."""
    rcs = {(0.5, 0.0, 0.0): 2.0, (-0.4, 0.0, 0.0): 5.0}
    points = tuple(PointScatterer(position=place, rcs=value) for place, value in rcs.items())
    body = Actor(name="body", kind="object", points=points)
    paths = FreeSpace().trace(around([body], [(20.0, 0, 0)]))
    found = split_echo(paths, np.array(list(rcs)), np.array([20.0, 0, 0]))
    np.testing.assert_allclose(found, list(rcs.values()), rtol=0.01)


def test_averaged_over_frequency_two_points_add_their_powers():
    """A metre apart their beat turns six times in 1 GHz: 3 % are left of the cross term."""
    points = tuple(PointScatterer(position=(x, 0, 0), rcs=1.0) for x in (0.0, 0.9))
    paths = FreeSpace().trace(
        around([Actor(name="body", kind="object", points=points)], [(200.0, 0, 0)])
    )
    assert cross_section(mean_power(paths), 200.0, 79e9) == pytest.approx(2.0, rel=0.03)


def test_an_echo_of_a_sphere_is_traced_from_where_it_was_asked():
    """πr², and 20·lg(1 + r/R₀) of near field; 0.3 dB for facets of 4 mm."""
    paths, radar = echo_paths(mesh_of(sphere(0.1, 4e-3)), 0.7, distance=5.0, height=0.0)
    np.testing.assert_allclose(radar, (5 * np.cos(0.7), 5 * np.sin(0.7), 0))
    found = cross_section(mean_power(paths), 5.0, paths.frequency)
    expected = np.pi * 0.1**2 * (1 + 0.1 / 4.9) ** 2
    assert 10 * np.log10(found / expected) == pytest.approx(0.0, abs=0.3)


def test_the_point_on_the_other_side_has_the_mirrored_place():
    places = np.array(list(PLACES.values()))
    np.testing.assert_allclose(places[MIRRORED], places * (1, -1) + (0, 1))


def test_a_table_reads_back(monkeypatch):
    echo = np.full((12, 72), 10.0)
    monkeypatch.setattr("tools.point_tables.point_table", lambda _: (np.full((12, 3), 0.5), echo))
    table = tomllib.loads(as_text("sedan"))["sedan"]
    assert [point["name"] for point in table["point"]] == list(PLACES)
    assert table["point"][3]["echo"] == [100] * 72
