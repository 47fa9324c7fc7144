"""Flat sides seen off their normal: what they return far below a mirror's echo, near and far."""

import numpy as np
import pytest

from polychirp.channel.materials.library import known_materials
from polychirp.channel.physical_optics import illumination
from polychirp.channel.physical_optics.flat_faces import NO_NEIGHBOUR, Flats
from polychirp.channel.physical_optics.paths import facet_echoes
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
from polychirp.units import from_db, to_db
from tests.support.references.physical_optics import scattered, scattered_by_rectangle

FREQUENCY = 79e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
TRACER = Composite(dynamic_range=1e20, max_bounces=1)
MIRRORED = np.array([-1.0, 1.0, 1.0])


def drawn(count, seed):
    """Sides of plates in x = 0 (m), and two places; every second pair is one place twice."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        side, distance = rng.uniform(0.4, 1.0), np.exp(rng.uniform(np.log(4.0), np.log(50.0)))
        off, around_it = np.radians(rng.uniform(0.3, 9.0)), rng.uniform(0, 2 * np.pi)
        place = distance * np.array(
            [np.cos(off), np.sin(off) * np.cos(around_it), np.sin(off) * np.sin(around_it)]
        )
        other = place + distance * rng.uniform(-0.1, 0.1, 3)
        yield side, place, place if number % 2 else other


def traced(corners, material, place, other, *, frequency=FREQUENCY, pose=None):
    """Transfer of the facets of a body, from one place to another or back to itself."""
    actor = Actor(name="body", kind="object", mesh=mesh_of(corners, material), pose=pose or Pose())
    places = [place] if other is place else [place, other]
    pair = (0, len(places) - 1)
    world = TRACER.prepare(around([actor], places))
    paths = facet_echoes(world, np.array([pair, pair[::-1]]), body=0)
    return transfer_at(paths, frequency, *pair)


def square(side):
    """The plate of `polychirp.testing.shapes.plate` as a rectangle."""
    return np.zeros(3), np.array([0, side / 2, 0]), np.array([0, 0, side / 2])


def facet_by_facet(monkeypatch):
    """Take no facets for a flat part, as if each were on a curved body."""

    def nothing(centroid, *_):
        size = len(centroid)
        none = np.full((size, 3), NO_NEIGHBOUR)
        return Flats(False, np.zeros(size, dtype=bool), none)

    monkeypatch.setattr(illumination, "flats_of", nothing)
    illumination.facet_levels.cache_clear()


@pytest.fixture(scope="module")
def expected():
    """Quadrature of 32 drawn plates: material, case, transfer and that of a mirror."""
    found = []
    for number, (side, place, other) in enumerate(drawn(32, seed=1708)):
        material = ("metal", "glass", "rubber")[number % 3]
        row = known_materials()[material]
        transfer = scattered_by_rectangle(square(side), row, place, other, FREQUENCY)
        mirror = WAVELENGTH / (4 * np.pi * np.linalg.norm(place * MIRRORED - other))
        found.append((material, side, place, other, transfer, mirror))
    return found


def errors(expected, edge, depth=60.0):
    """dB of all strong entries of cases that are less than ``depth`` dB below a mirror's echo."""
    found, least = [], from_db(-0.5 * depth)
    for material, side, place, other, right, mirror in expected:
        wrong = traced(plate(side, edge), material, place, other)
        size = np.abs(right)
        some = (size > least * mirror) & (size > 0.1 * size.max())
        found += list(to_db(np.abs(wrong[some] / right[some]) ** 2))
    return np.abs(found)


@pytest.mark.parametrize("edge", [0.05, 0.1])
def test_a_flat_side_is_right_down_to_60_db_below_a_mirror(compare, expected, edge):
    """Drawn sides, ranges and aspects, of metal, glass and rubber, monostatic and bistatic."""
    found = errors(expected, edge)
    assert len(found) > 20
    for name, value, tolerance in (
        ("median", np.median(found), 0.1),
        ("greatest", np.max(found), 0.5),
    ):
        compare(
            page="canonical-bodies",
            case=f"32 plates 0.3° to 9° off normal at 4 to 50 m, facets of {100 * edge:g} cm",
            quantity=f"{name} |error| of echoes down to 60 dB below a mirror's, dB",
            expected=0.0,
            measured=float(value),
            tolerance=tolerance,
            source="physical optics by quadrature without facets",
        )


def test_a_flat_side_is_right_even_where_it_hardly_echoes(expected):
    """To 100 dB below a mirror: what is left are terms of 1/kr."""
    assert np.median(errors(expected, 0.05, depth=100.0)) < 0.05


def test_facet_by_facet_a_flat_side_has_a_grating(monkeypatch, expected):
    """What the border mends: up to 9 dB with facets of 5 cm, over the same draws.

    Most draws are right, since facets near the mirror point are divided.
    """
    with monkeypatch.context() as patch:
        facet_by_facet(patch)
        found = errors(expected, 0.05)
    illumination.facet_levels.cache_clear()
    assert np.max(found) > 3.0


def halved(corners, times):
    """Every triangle as four, again and again."""
    for _ in range(times):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    return corners


@pytest.mark.parametrize("place", [(9.0, 0.2, 0.1), (8.0, 3.0, 1.0)], ids=["straight", "oblique"])
def test_a_flat_side_with_holes_is_the_sum_of_what_is_left(place):
    """Borders of any shape, also through the specular point: against facets of 6 mm one by one."""
    corners = plate(0.8, 0.05)
    is_left = np.random.default_rng(4).random(len(corners)) > 0.06
    place, metal = np.array(place), known_materials()["metal"]
    expected = scattered(halved(corners[is_left], 3), metal, place, place, FREQUENCY)
    found = traced(corners[is_left], "metal", place, place)
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())


def test_terms_of_a_border_keep_the_spectrum():
    """Half a gigahertz off, below −30 dB of the echo there, as every term has its own delay.

    Where an echo is 50 dB and more below that of a mirror, its terms nearly cancel: −20 dB.
    """
    for side, place, other in drawn(6, seed=5):
        right = scattered_by_rectangle(
            square(side), known_materials()["metal"], place, other, 78.5e9
        )
        found = traced(plate(side, 0.05), "metal", place, other, frequency=78.5e9)
        size, mirror = np.abs(right).max(), WAVELENGTH / (8 * np.pi * place[0])
        error = np.abs(found - right).max() / size
        assert to_db(error**2) < (-30 if to_db((size / mirror) ** 2) > -50 else -20)


def test_in_a_mirror_a_flat_side_is_that_of_the_image():
    """A plate over a metal floor: once by the floor is the plate lit by the radar's image."""
    floor = Plate(
        centre=(0, 0, -1), half_u=(30, 0, 0), half_v=(0, 30, 0), material="metal", part="floor"
    )
    side, place = 0.8, np.array([7.0, 2.0, 0.6])
    actors = [
        Actor(name="floor", kind="road", plates=(floor,)),
        Actor(name="body", kind="object", mesh=mesh_of(plate(side, 0.05))),
    ]
    found = TRACER.trace(around(actors, [place]))
    image = place * [1, 1, -1] - [0, 0, 2]
    twice = found.select(found.num_bounces == 3)
    metal = known_materials()["metal"]
    expected = scattered_by_rectangle(square(side), metal, image, image, FREQUENCY)
    # the polarisation along the floor is turned over twice
    measured = transfer_at(twice, FREQUENCY)
    assert abs(measured[1, 1]) == pytest.approx(abs(expected[1, 1]), rel=0.03)


@pytest.mark.parametrize("facet", [0.1, 0.3])
@pytest.mark.parametrize("off", [0.1, 0.3, 0.6])
def test_a_radar_on_a_plane_of_symmetry_sees_all_of_the_borders(off, facet):
    """A phase that is stationary exactly at a corner of two facets is so on one of the edges.

    The corners of an even grid lie on the plane. From a nanometre beside it the echo is the same,
    and from the plane itself it was 7 to 31 dB less.
    """
    side, distance = 1.2, 8.0
    place = distance * np.array([np.cos(off), np.sin(off), 0.0])
    expected = scattered_by_rectangle(
        square(side), known_materials()["metal"], place, place, FREQUENCY
    )
    found = traced(plate(side, facet), "metal", place, place)
    error = to_db(abs(found[0, 0] / expected[0, 0]) ** 2)
    assert error == pytest.approx(0.0, abs=0.3)
