"""Strips, mirrors and subdivision keep surfaces whole."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.errors import InputError
from polychirp.model.mesh import Mesh
from polychirp.traffic.surface import (
    WAVELENGTH,
    Fineness,
    SurfaceBuilder,
    edge_limit,
    mirrored,
    subdivided,
)


def area_vector(mesh: Mesh) -> np.ndarray:
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    return np.cross(b - a, c - a).sum(axis=0) / 2


def directed_edges(mesh: Mesh) -> list[tuple[int, int]]:
    return [(int(f[k]), int(f[(k + 1) % 3])) for f in mesh.face for k in range(3)]


def test_the_edge_limit_stands_a_sixty_fourth_of_a_wavelength_off_a_circle():
    """A chord e on a circle r has the sagitta e²/8r."""
    for radius in (0.1, 0.25, 1.0):
        assert edge_limit(radius) ** 2 / (8 * radius) == pytest.approx(WAVELENGTH / 64)
    assert edge_limit(0.25) == pytest.approx(0.011, abs=2e-4)
    assert edge_limit(1.0) == pytest.approx(0.022, abs=3e-4)


def test_the_edge_limit_on_flats_follows_the_distance():
    """raytracing.md: 4.9, 6.9 and 11.9 cm at 5, 10 and 30 m."""
    limits = [edge_limit(math.inf, distance) for distance in (5.0, 10.0, 30.0)]
    assert limits == pytest.approx([0.049, 0.069, 0.119], abs=5e-4)


def test_a_mesh_without_size_is_refused():
    with pytest.raises(InputError, match="positive max_edge"):
        Fineness(max_edge=0.0)
    with pytest.raises(InputError, match="positive max_edge"):
        subdivided(
            Mesh(
                vertex=np.zeros((3, 3)),
                face=[[0, 1, 2]],
                material=[0],
                part=[0],
                materials=("metal",),
                parts=("p",),
            ),
            -1.0,
        )


@given(st.integers(1, 12), st.integers(2, 12))
def test_a_strip_between_lines_of_any_length_covers_it_once_and_faces_one_way(first, second):
    builder = SurfaceBuilder()
    x = [np.linspace(0, 1, n) if n > 1 else np.array([0.3]) for n in (first, second)]
    lines = [
        builder.line(np.column_stack([places, np.full(len(places), y), np.zeros(len(places))]))
        for places, y in zip(x, (0.0, 1.0), strict=True)
    ]
    builder.strip(*lines, part="p", material="metal")
    mesh = builder.mesh()
    width = 0.5 * (float(first > 1) + 1.0)
    assert mesh.num_faces == first + second - 2
    assert area_vector(mesh) == pytest.approx([0.0, 0.0, width])
    assert len(set(directed_edges(mesh))) == 3 * mesh.num_faces


def test_a_mirrored_half_is_joined_where_it_meets_its_image():
    builder = SurfaceBuilder()
    inner = builder.line(np.array([[0.0, 0, 0], [1, 0, 0]]))
    outer = builder.line(np.array([[0.0, 1, 0], [1, 1, 0]]))
    builder.strip(inner, outer, part="door-left", material="metal")
    whole = mirrored(builder.mesh())
    assert whole.parts == ("door-left", "door-right")
    assert whole.vertex.shape[0] == 6
    assert area_vector(whole) == pytest.approx([0.0, 0.0, 2.0])
    assert (whole.vertex[whole.face[whole.part == 1]][..., 1] <= 0).all()


@settings(max_examples=30)
@given(st.floats(0.3, 3.0), st.integers(0, 10**6))
def test_subdivision_shortens_every_edge_and_keeps_area_and_closure(max_edge, seed):
    """A tetrahedron stays closed: every edge is used once in each direction."""
    vertex = np.random.default_rng(seed).normal(size=(4, 3))
    if np.linalg.det(vertex[1:] - vertex[0]) > 0:
        vertex = vertex[[0, 2, 1, 3]]
    before = Mesh(
        vertex=vertex,
        face=[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        material=[0, 0, 1, 0],
        part=[0] * 4,
        materials=("metal", "glass"),
        parts=("body",),
    )
    max_edge *= np.ptp(vertex, axis=0).max() / 4
    after = subdivided(before, max_edge)
    corners = after.corners
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert lengths.max() <= max_edge * (1 + 1e-12)
    edges = directed_edges(after)
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)

    def area(mesh: Mesh, material: int) -> float:
        a, b, c = np.moveaxis(mesh.corners[mesh.material == material], 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    for material in (0, 1):
        assert area(after, material) == pytest.approx(area(before, material))
