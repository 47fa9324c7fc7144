"""Echoes of crowns: mean power by radiative transfer, attenuation, speckle and motion."""

import numpy as np
import pytest
from scipy.stats import kstest

from polychirp.channel.base import all_pairs
from polychirp.channel.clutter.foliage import foliage_paths
from polychirp.channel.geometry.enclosure import enclosed_volume, winding_numbers
from polychirp.channel.materials.library import NamedMaterial
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, sphere, transfer_at
from polychirp.traffic.street import Tree
from polychirp.units import to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
PAGE = "clouds-and-roughness"
ALPHA, ALBEDO = 0.5, 0.4
CLOUD = NamedMaterial(name="cloud", attenuation=ALPHA, albedo=ALBEDO)
TRACER = Composite(dynamic_range=1e14, materials=(CLOUD,))
BALL = mesh_of(sphere(1.0, 0.25), "cloud")
VOLUME = enclosed_volume(BALL.corners)


def decibels(ratio):
    return float(to_db(ratio))


def ball(name="ball", *, velocity=(0.0, 0.0, 0.0), mesh=BALL, **pose):
    return Actor(name=name, kind="tree", mesh=mesh, pose=Pose(**pose), velocity=velocity)


def traced(scene, *, seed=1, only=None):
    pairs = all_pairs(scene) if only is None else np.array([only])
    return foliage_paths(TRACER.prepare(scene), pairs, seed=seed)


def pair(paths, transmitter, receiver):
    return paths.select((paths.transmitter == transmitter) & (paths.receiver == receiver))


def inside(place, points):
    """Lengths inside the unit ball of the ways from points in it to a place."""
    way = np.asarray(place) - points
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    along = np.sum(points * way, axis=-1)
    return -along + np.sqrt(along**2 + 1 - np.sum(points**2, axis=-1))


def by_transfer(transmitter, receiver):
    """Power of the ball by radiative transfer to first order, by quadrature over its volume."""
    node, weight = np.polynomial.legendre.leggauss(24)
    grid = np.stack(np.meshgrid(0.5 * (node + 1), node, indexing="ij"), axis=-1).reshape(-1, 2)
    each = np.outer(0.5 * weight, weight).reshape(-1)
    turn = 2 * np.pi * (np.arange(48) + 0.5) / 48
    radius, cosine = grid[:, :1], grid[:, 1:]
    sine = np.sqrt(1 - cosine**2)
    points = np.stack(
        [radius * sine * np.cos(turn), radius * sine * np.sin(turn), radius * cosine + 0 * turn],
        axis=-1,
    )
    r1, r2 = (np.linalg.norm(np.array(end) - points, axis=-1) for end in (transmitter, receiver))
    fade = np.exp(-ALPHA * (inside(transmitter, points) + inside(receiver, points)))
    total = np.sum((each * radius[:, 0] ** 2)[:, None] * fade / (r1 * r2) ** 2) * 2 * np.pi / 48
    return ALBEDO * ALPHA * total * WAVELENGTH**2 / (4 * np.pi) ** 3


def test_seen_from_afar_a_ball_of_leaves_has_the_cross_section_of_its_front(compare):
    """Check of the quadrature above against σ = ωα 2π ∫ b (1 − e^{−4αh})/2α db, by hand."""
    b = (np.arange(100_000) + 0.5) / 100_000
    by_hand = ALBEDO * ALPHA * 2 * np.pi * np.mean(
        b * (1 - np.exp(-4 * ALPHA * np.sqrt(1 - b**2))) / (2 * ALPHA)
    )  # fmt: skip
    far = (3000.0, 0.0, 0.0)
    sigma = by_transfer(far, far) * (4 * np.pi) ** 3 / WAVELENGTH**2 * 3000.0**4
    assert sigma == pytest.approx(by_hand, rel=1e-3)


PLACES = [(12.0, 0.0, 3.0), (2.0, -9.0, 1.0)]


@pytest.mark.slow
@pytest.mark.parametrize("ends", [(0, 0), (0, 1)], ids=["own echo", "other radar"])
def test_the_mean_power_of_a_crown_is_that_of_radiative_transfer(compare, ends):
    """Power of all paths, both received polarisations, mean of 100 seeds."""
    scene, power = around([ball()], PLACES), []
    for seed in range(100):
        paths = traced(scene, seed=seed, only=ends)
        assert np.all(paths.bounce_kind == Bounce.DIFFUSE)
        power.append(np.sum(np.abs(paths.transfer) ** 2, axis=(0, 1)))
    spread = np.std(power, axis=0) / np.mean(power, axis=0) / 10
    assert np.all(spread < 0.02)
    # the mesh's volume is that of its chords
    expected = by_transfer(PLACES[ends[0]], PLACES[ends[1]]) * VOLUME / (4 / 3 * np.pi)
    for number, name in enumerate("VH"):
        compare(
            page=PAGE,
            case=f"ball of leaves, α = {ALPHA:g}/m, radars {ends[0]} and {ends[1]}, {name}",
            quantity="mean power, dB",
            expected=decibels(expected),
            measured=decibels(np.mean(power, axis=0)[number]),
            tolerance=decibels(1 + 3 * spread[number]),
            source="first-order radiative transfer by quadrature",
        )


def test_every_leaf_fades_by_the_way_of_both_legs_through_the_crown():
    """Expected from the chords of a ball; the mesh is within 2 mm of it."""
    mesh = mesh_of(sphere(1.0, 0.1), "cloud")
    paths = traced(around([ball(mesh=mesh)], PLACES), only=(0, 1))
    points = paths.bounce_point
    r1, r2 = (np.linalg.norm(np.array(end) - points, axis=-1) for end in PLACES)
    fade = np.exp(-ALPHA * (inside(PLACES[0], points) + inside(PLACES[1], points)))
    sigma = ALBEDO * ALPHA * enclosed_volume(mesh.corners) / paths.num_paths
    expected = sigma * WAVELENGTH**2 / (4 * np.pi) ** 3 * fade / (r1 * r2) ** 2
    found = np.sum(np.abs(paths.transfer) ** 2, axis=1)
    np.testing.assert_allclose(found, np.stack([expected, expected], axis=-1), rtol=0.01)


def test_a_crown_in_front_takes_its_share_twice():
    """Each path has e^{−2αd}, with d its length in the block in front."""
    block = ball("block", mesh=mesh_of(box((1.5, 20.0, 20.0), 20.0), "cloud"), x=5.0)
    place = [(60.0, 0.0, 0.0)]
    free, behind = traced(around([ball()], place)), traced(around([ball(), block], place))
    behind = behind.select(behind.bounce_actor == 1)
    assert behind.num_paths == free.num_paths
    np.testing.assert_allclose(
        np.abs(behind.transfer / free.transfer), np.exp(-ALPHA * 1.5), rtol=1e-3
    )


def test_a_quarter_of_the_power_returns_cross_polarised():
    """Thin needles in all directions: ⟨(nᵥnₕ)²⟩ / (⟨nᵥ⁴⟩ + ⟨(nᵥnₕ)²⟩) = (1/15)/(1/5 + 1/15)."""
    power = np.sum(np.abs(traced(around([ball()], PLACES), only=(0, 0)).transfer) ** 2, axis=0)
    assert power[1, 0] / np.sum(power[:, 0]) == pytest.approx(0.25, rel=1e-9)


@pytest.mark.slow
def test_the_sum_of_many_leaves_is_speckle():
    """Power of the coherent sum over 150 seeds is exponential."""
    scene = around([ball()], PLACES)
    power = np.array(
        [
            np.abs(transfer_at(traced(scene, seed=s, only=(0, 1)), 79e9, 0, 1)[0, 0]) ** 2
            for s in range(150)
        ]
    )
    mean = 0.75 * by_transfer(*PLACES)
    assert np.mean(power) / mean == pytest.approx(1, abs=3 / np.sqrt(150))
    assert kstest(power / mean, "expon").pvalue > 0.01


def test_points_lie_evenly_inside_the_crown():
    """In a turned and shifted ball of 3 m, r³ is uniform and the mean is the middle."""
    mesh = mesh_of(sphere(3.0, 0.4), "cloud")
    actor = ball(mesh=mesh, x=20.0, y=3.0, z=4.0, yaw=0.4)
    gap = traced(around([actor], [(0.0, 0, 0)])).bounce_point - [20.0, 3.0, 4.0]
    away = np.linalg.norm(gap, axis=-1)
    assert len(away) == 512
    assert np.max(away) < 3.0
    assert kstest((away / 3.0) ** 3, "uniform").pvalue > 0.01
    np.testing.assert_allclose(np.mean(gap, axis=0), 0.0, atol=4 * 3 / np.sqrt(5 * 512))


def test_a_surface_winds_once_about_what_is_inside():
    corners = sphere(1.0, 0.1)
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (200, 3))
    away = np.linalg.norm(points, axis=-1)
    sure = np.abs(away - 1) > 0.01
    np.testing.assert_allclose(winding_numbers(corners, points)[sure], (away < 1)[sure], atol=1e-9)
    assert enclosed_volume(corners) == pytest.approx(4 / 3 * np.pi, rel=0.01)


def test_faces_that_enclose_nothing_are_refused():
    inside_out = mesh_of(sphere(1.0, 0.4)[:, ::-1], "cloud")
    with pytest.raises(InputError, match="enclose no volume"):
        traced(around([ball(mesh=inside_out)], PLACES))


def test_the_same_seed_gives_the_same_bytes_and_another_other_phases():
    scene = around([ball()], PLACES)
    first, again, other = (traced(scene, seed=s) for s in (1, 1, 2))
    for name in ("delay", "transfer", "bounce_point", "departure"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()
    assert first.num_paths == other.num_paths
    assert not np.any(
        np.isclose(first.transfer[:, 0, 0], other.transfer[:, 0, 0], rtol=1e-3, atol=0)
    )


def test_two_trees_of_one_mesh_have_leaves_of_their_own():
    scene = around([ball("a", x=-2.0), ball("b", x=2.0)], PLACES)
    paths = traced(scene, only=(0, 0))
    a, b = (paths.select(paths.bounce_actor == actor) for actor in (2, 3))
    assert not np.any(np.isclose(np.angle(a.transfer[:, 0, 0]), np.angle(b.transfer[:, 0, 0])))


def test_phases_of_moving_radars_turn_as_the_rates_foretell():
    """Finite differences of the delays over 0.1 ms, in cycles per second at 79 GHz."""
    later = 1e-4
    scene = around([ball()], PLACES, velocities=[(-9.0, 2, 0), (12.0, 3, 1)])
    now, then = traced(scene), traced(scene.at(later))
    assert now.num_paths == then.num_paths
    rate = (then.delay - now.delay) / later
    np.testing.assert_allclose(79e9 * now.delay_rate, 79e9 * rate, atol=2.0)


def test_there_and_back_are_transposed():
    paths = traced(around([ball(), ball("other", x=3.0)], PLACES))
    there, back = pair(paths, 0, 1), pair(paths, 1, 0)
    np.testing.assert_allclose(back.transfer, np.swapaxes(there.transfer, 1, 2), rtol=1e-9)


def test_a_trunk_hides_leaves_and_is_no_cloud():
    """A street's tree has leaves in its crown only, and none right behind the trunk."""
    oak = Tree(name="oak", x=0.0, y=0.0, height=6.0, crown_radius=1.4).actor()
    scene = around([oak], [(15.0, 0.0, 3.5)])
    paths = Composite(dynamic_range=1e14).prepare(scene)
    found = foliage_paths(paths, all_pairs(scene), seed=1)
    assert found.num_paths > 50
    assert np.all(found.bounce_point[:, 2] > 2.0)
    behind = (found.bounce_point[:, 0] < -0.2) & (np.abs(found.bounce_point[:, 1]) < 0.05)
    assert not np.any(behind & (found.bounce_point[:, 2] < 3.5))


def test_only_clouds_scatter():
    assert traced(around([ball(mesh=mesh_of(sphere(1.0, 0.3)))], PLACES)).num_paths == 0
