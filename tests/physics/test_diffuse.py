"""Diffuse echoes of rough plates: Lambert's law and its energy, speckle, motion, shadow."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.stats import kstest

from polychirp.channel.base import all_pairs
from polychirp.channel.clutter.rough_plates import CELL_SIZE, diffuse_paths, diffuse_share, lambert
from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.materials.library import NamedMaterial, known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.material import Material
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, transfer_at
from polychirp.units import to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
ROUGH = NamedMaterial(name="rough", relative_permittivity=4.0, roughness=0.8e-3)
TRACER = Composite(dynamic_range=1e14, materials=(ROUGH,))
PAGE = "clouds-and-roughness"


def decibels(ratio):
    return float(to_db(ratio))


def road(*, length=8.0, width=6.0, material="rough", name="road", velocity=(0.0, 0.0, 0.0)):
    return Actor(
        name=name,
        kind="road",
        velocity=velocity,
        plates=(
            Plate(
                centre=(0, 0, 0),
                half_u=(length / 2, 0, 0),
                half_v=(0, width / 2, 0),
                material=material,
                part="road",
            ),
        ),
    )


def traced(scene, *, seed=1, only=None):
    pairs = all_pairs(scene) if only is None else np.array([only])
    return diffuse_paths(TRACER.prepare(scene), pairs, seed=seed)


def pair(paths, transmitter, receiver):
    return paths.select((paths.transmitter == transmitter) & (paths.receiver == receiver))


def hemisphere(function):
    """Integral of a function of the cosine over the hemisphere."""
    node, weight = np.polynomial.legendre.leggauss(64)
    return 2 * np.pi * np.sum(0.5 * weight * function(0.5 * (node + 1)))


@pytest.mark.parametrize("cosine", [0.1, 0.5, 1.0])
def test_what_a_very_rough_conductor_gets_it_scatters_whole(compare, cosine):
    """∫σ⁰ dΩ / 4π cosθ = 1: a very rough plate reflects nothing, and no energy is lost."""
    metal = Material(conductivity=np.inf, roughness=10.0)
    compare(
        page=PAGE,
        case=f"very rough conductor at {np.degrees(np.arccos(cosine)):.0f}°",
        quantity="scattered over incident power",
        expected=1.0,
        measured=float(
            hemisphere(lambda c: lambert(metal, cosine, c, 79e9)) / (4 * np.pi * cosine)
        ),
        tolerance=1e-9,
        source="conservation of energy",
    )


@pytest.mark.parametrize("name", ["asphalt", "brick", "concrete", "wood"])
def test_mirrored_and_diffuse_power_are_what_the_smooth_surface_reflects(name):
    material, cosine = known_materials()[name], np.linspace(0.05, 1.0, 12)
    smooth = reflection(replace(material, roughness=0.0), cosine, 79e9)
    mirrored = np.mean(np.abs(reflection(material, cosine, 79e9)) ** 2, axis=0)
    total = mirrored + diffuse_share(material, cosine, 79e9)
    np.testing.assert_allclose(total, np.mean(np.abs(smooth) ** 2, axis=0), rtol=1e-12)


@pytest.mark.parametrize("name", ["asphalt", "brick"])
def test_both_ways_round_scatter_no_more_than_the_one_way_law(name):
    """Over all angles of incidence; equal only if the share is independent of the angle."""
    material = known_materials()[name]
    share = partial(diffuse_share, material, frequency=79e9)
    law = hemisphere(lambda c: 4 * share(c) * c * hemisphere(lambda d: d))
    made = hemisphere(
        lambda c: np.array([hemisphere(lambda d, one=one: lambert(material, one, d, 79e9))
                            for one in c])
    )  # fmt: skip
    assert 0.8 * law < made <= law
    np.testing.assert_allclose(lambert(material, 0.3, 0.9, 79e9), lambert(material, 0.9, 0.3, 79e9))


def by_quadrature(transmitter, receiver, *, length=8.0, width=6.0):
    """∫ σ⁰ λ² / (4π)³ r₁² r₂² dA over the road, midpoints of 2 cm."""
    x = (np.arange(int(length * 50)) + 0.5) / 50 - length / 2
    y = (np.arange(int(width * 50)) + 0.5) / 50 - width / 2
    points = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], axis=-1)
    ways = [np.array(end) - points for end in (transmitter, receiver)]
    r1, r2 = (np.linalg.norm(way, axis=-1) for way in ways)
    sigma = lambert(ROUGH, ways[0][..., 2] / r1, ways[1][..., 2] / r2, 79e9)
    return np.sum(sigma / (r1 * r2) ** 2) / 2500 * WAVELENGTH**2 / (4 * np.pi) ** 3


PLACES = [(-3.0, -1.0, 1.5), (2.0, 4.0, 2.5)]


@pytest.mark.parametrize("ends", [(0, 0), (0, 1)], ids=["own echo", "other radar"])
def test_the_mean_power_of_a_road_is_the_integral_of_its_cross_section(compare, ends):
    """Power of all paths, both received polarisations, mean of 100 seeds.

    The places of points scatter the sum by about 20 % and 4 %; three standard deviations of the
    mean of 100 are 0.26 dB and 0.05 dB.
    """
    scene = around([road()], PLACES)
    power = []
    for seed in range(100):
        paths = traced(scene, seed=seed, only=ends)
        assert np.all(paths.bounce_kind == Bounce.DIFFUSE)
        power.append(np.sum(np.abs(paths.transfer) ** 2, axis=(0, 1)))
    expected = by_quadrature(PLACES[ends[0]], PLACES[ends[1]])
    spread = np.std(power, axis=0) / np.mean(power, axis=0) / 10
    for number, name in enumerate("VH"):
        compare(
            page=PAGE,
            case=f"rough road of 8 m × 6 m, radars {ends[0]} and {ends[1]}, {name}",
            quantity="mean power, dB",
            expected=decibels(expected),
            measured=decibels(np.mean(power, axis=0)[number]),
            tolerance=decibels(1 + 3 * spread[number]),
            source="∫σ⁰λ²/(4π)³r₁²r₂² dA by quadrature",
        )
    assert np.all(spread < 0.03)


@pytest.mark.slow
def test_the_sum_of_many_cells_is_speckle(compare):
    """Power of the coherent sum over seeds: exponential, with the mean of the integral."""
    places = [(-20.0, -1.0, 4.0), (-21.0, 3.0, 5.0)]
    scene = around([road()], places)
    co_polar = []
    for seed in range(400):
        field = transfer_at(traced(scene, seed=seed, only=(0, 1)), 79e9, 0, 1)
        co_polar.append(np.abs(field[0, 0]) ** 2)
    mean = 0.9 * by_quadrature(*places)
    compare(
        page=PAGE,
        case="speckle of a road of 48 cells",
        quantity="mean co-polar power over the integral's",
        expected=1.0,
        measured=float(np.mean(co_polar) / mean),
        tolerance=3 / np.sqrt(400),
        source="∫σ⁰ dA, the co-polar 0.9 of it",
    )
    assert kstest(np.array(co_polar) / mean, "expon").pvalue > 0.01


def test_the_same_seed_gives_the_same_bytes_and_another_other_phases():
    scene = around([road()], PLACES)
    first, again, other = (traced(scene, seed=s) for s in (1, 1, 2))
    for name in ("delay", "transfer", "bounce_point", "departure"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()
    assert first.num_paths == other.num_paths == 4 * 8 * 6 / CELL_SIZE**2
    assert not np.any(
        np.isclose(first.transfer[:, 0, 0], other.transfer[:, 0, 0], rtol=1e-3, atol=0)
    )


def test_points_know_nothing_of_other_actors():
    """A second road moves no point of the first."""
    alone = traced(around([road()], PLACES))
    scene = around([road(name="another"), road()], PLACES)
    both = traced(scene)
    mine = both.select(both.bounce_actor == 3)
    assert np.isin(alone.transfer[:, 0, 0], mine.transfer[:, 0, 0]).all()


def test_points_stay_where_they_are_while_radars_move():
    """Positions and phases a second later are the same, though the road has moved too."""
    scene = around([road(velocity=(3.0, 0, 0))], PLACES, velocities=[(5.0, 0, 0), (0, -2.0, 0)])
    now, then = traced(scene), traced(scene.at(1.0))
    assert now.num_paths == then.num_paths
    moved = then.bounce_point - now.bounce_point
    # the retarded place differs by v τ, below 1 µm
    np.testing.assert_allclose(moved, np.broadcast_to([3.0, 0, 0], moved.shape), atol=1e-6)
    np.testing.assert_allclose(
        np.angle(then.transfer[:, 0, 1]), np.angle(now.transfer[:, 0, 1]), atol=1e-12
    )


def test_phases_of_moving_radars_turn_as_the_rates_foretell():
    """Finite differences of the delays over 0.1 ms, in cycles per second at 79 GHz."""
    later = 1e-4
    scene = around([road(velocity=(3.0, 1.0, 0))], PLACES, velocities=[(-9.0, 2, 0), (12.0, 3, 1)])
    now, then = traced(scene), traced(scene.at(later))
    assert now.num_paths == then.num_paths
    rate = (then.delay - now.delay) / later
    # second order: v²/r · t/2λ, 15² / 1.5 m · 50 µs / 3.8 mm
    np.testing.assert_allclose(79e9 * now.delay_rate, 79e9 * rate, atol=4.0)


def test_there_and_back_are_transposed():
    paths = traced(around([road()], PLACES))
    there, back = pair(paths, 0, 1), pair(paths, 1, 0)
    np.testing.assert_allclose(back.transfer, np.swapaxes(there.transfer, 1, 2), rtol=1e-12)
    assert back.delay == pytest.approx(there.delay, rel=1e-15)


def test_what_a_wagon_hides_does_not_return():
    """A box 2 m high at x = 0…1 hides the road behind it from a radar 1.5 m high before it."""
    wagon = Actor(
        name="wagon",
        kind="object",
        pose=Pose(x=0.5, z=1.0),
        mesh=mesh_of(box((1.0, 40.0, 2.0), 2.0)),
    )
    paths = traced(around([road(), wagon], [PLACES[0], (4.0, 0.0, 1.5)]))
    here, beyond = pair(paths, 0, 0), pair(paths, 1, 1)
    assert (here.num_paths, beyond.num_paths) == (24, 18)
    assert np.all(here.bounce_point[:, 0] < 0)
    assert np.all(beyond.bounce_point[:, 0] > 1)
    # no point is seen by both
    assert paths.num_paths == here.num_paths + beyond.num_paths


def test_a_smooth_plate_and_a_plate_from_behind_scatter_nothing():
    assert traced(around([road(material="metal")], PLACES)).num_paths == 0
    assert traced(around([road()], [(0.0, 0.0, -1.0)])).num_paths == 0


def test_a_pair_has_no_more_than_two_thousand_paths_and_those_are_the_strongest():
    scene = around([road(length=80.0, width=40.0)], [(0.0, 0.0, 1.0)])
    paths = traced(scene)
    assert paths.num_paths == 2000
    away = np.linalg.norm(paths.bounce_point[:, :2], axis=-1)
    # as many cells as fit into a circle of 25 m
    assert np.max(away) < 1.1 * np.sqrt(2000 / np.pi)
