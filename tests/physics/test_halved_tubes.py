"""Tubes that are halved where it matters, against tubes that are all as narrow."""

import numpy as np
import pytest

from polychirp.channel.ray_tubes import paths as ray_tubes
from polychirp.channel.ray_tubes import refinement
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.channel.ray_tubes.refinement import MIN_TUBES, Level, Widths, first_level
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, plate, transfer_at, trihedral

FREQUENCY = 79e9
WIDTHS = {"tube": 0.01, "coarsest": 0.04, "across": 1}
ENDS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])


@pytest.fixture(scope="module")
def world():
    """A trihedral and a box before two radars; nothing is too weak."""
    actors = [
        Actor(name="corner", kind="object", mesh=mesh_of(trihedral(0.6, 0.1)),
              pose=Pose(x=6.0, y=0.5, z=0.5, yaw=3.0)),
        Actor(name="box", kind="object", mesh=mesh_of(box((0.5, 0.4, 0.3), 0.1)),
              pose=Pose(x=3.0, y=0.4, z=0.4, yaw=0.2)),
    ]  # fmt: skip
    scene = around(actors, [(0.0, 0.0, 0.5), (0.3, 1.2, 0.6)])
    return Composite(dynamic_range=1e14).prepare(scene)


@pytest.fixture
def wide(monkeypatch):
    """The first tubes are wide although the bodies are small and near."""
    monkeypatch.setattr(refinement, "MIN_TUBES", 256)
    monkeypatch.setattr(refinement, "_times_nearer", lambda _: 0)


def field(world, ends=(0, 1), **how):
    """Transfer of the tubes from one radar to the other; ``how`` are options of `tube_paths`."""
    return transfer_at(tube_paths(world, ENDS, **{**WIDTHS, **how}), FREQUENCY, *ends)


def start_narrow(monkeypatch, times):
    """Halve all tubes ``times`` times before they are followed, and no more afterwards."""

    def narrow(*how):
        level = first_level(*how)
        windows = list(level.windows)
        for number, left in enumerate(level.left):
            for _ in range(min(times, left)):
                windows[number] = windows[number].finer
        return Level(
            windows,
            level.body,
            np.zeros(len(windows), dtype=np.int64),
            [np.arange(window.num_tubes) for window in windows],
            [np.full(window.num_tubes, how[-1]) for window in windows],
        )

    monkeypatch.setattr(ray_tubes, "first_level", narrow)


def halve_all(monkeypatch, turns):
    """Halve every tube, for paths of up to ``turns`` bounces."""
    monkeypatch.setattr(ray_tubes, "_hits_to_halve", lambda *_: np.zeros(0, dtype=int))
    monkeypatch.setattr(
        Level,
        "with_neighbours",
        lambda level, *_: np.repeat(turns * (level.left > 0), np.diff(level.start)),
    )


@pytest.mark.usefixtures("wide")
def test_halving_every_tube_is_the_same_as_narrow_tubes(world, monkeypatch):
    with monkeypatch.context() as patch:
        start_narrow(patch, 2)
        narrow = field(world)
    with monkeypatch.context() as patch:
        start_narrow(patch, 0)
        wide = field(world)
    halve_all(monkeypatch, 3)
    np.testing.assert_allclose(field(world), narrow, atol=1e-6 * np.abs(narrow).max())
    assert np.abs(wide - narrow).max() > 1e-2 * np.abs(narrow).max()


@pytest.mark.usefixtures("wide")
def test_bounces_that_narrow_tubes_are_not_followed_to_stay_those_of_wide_tubes(world, monkeypatch):
    """Halved for two bounces: two are those of narrow tubes, the third that of wide ones."""
    by = {}
    for times in (0, 2):
        with monkeypatch.context() as patch:
            start_narrow(patch, times)
            for most in (2, 3):
                by[times, most] = field(world, (0, 0), max_bounces=most)
    third = by[0, 3] - by[0, 2]
    assert np.abs(third - by[2, 3] + by[2, 2]).max() > 1e-3 * np.abs(third).max() > 0
    halve_all(monkeypatch, 2)
    found = field(world, (0, 0))
    np.testing.assert_allclose(found - by[2, 2], third, atol=1e-6 * np.abs(found).max())


@pytest.mark.usefixtures("wide")
@pytest.mark.parametrize("ends", [(0, 0), (0, 1), (1, 1)])
@pytest.mark.parametrize(("left", "share"), [(ray_tubes.UNHALVED_SHARE, 1.0), ((1e-9,), 0.05)])
def test_the_less_power_is_left_to_wide_tubes_the_less_of_their_error_is_left(
    world, monkeypatch, ends, left, share
):
    """Less than all of it with the default share, less than 5 % if almost no power may be left."""
    by = []
    for times in (0, 2):
        with monkeypatch.context() as patch:
            start_narrow(patch, times)
            by.append(field(world, ends))
    wide, narrow = by
    monkeypatch.setattr(ray_tubes, "UNHALVED_SHARE", left)
    error = np.abs(field(world, ends) - narrow).max()
    assert error < share * np.abs(wide - narrow).max()


def test_four_tubes_fill_the_place_of_one(world):
    level = first_level(world, 0, [0], Widths(0.01, 0.04, 1), 3)
    wanted = np.array([level.windows[0].shape[1] + 1])
    halved = level.with_neighbours(wanted, np.array([2]))
    assert np.sum(halved == 2) == 9
    assert np.sum(halved) == 18
    finer = level.halved(halved)
    assert len(finer.tubes[0]) == 36
    corners = [window.start - 0.5 * window.step for window in (level.windows[0], finer.windows[0])]
    np.testing.assert_allclose(*corners, atol=1e-15)
    # rows 0 to 2 and columns 0 to 2, twice as fine
    row, column = np.divmod(np.sort(finer.tubes[0]), finer.windows[0].shape[1])
    np.testing.assert_array_equal(row, np.repeat(np.arange(6), 6))
    np.testing.assert_array_equal(column, np.tile(np.arange(6), 6))
    assert np.all(finer.max_turns[0] == 2)


def test_tubes_of_the_narrowest_kind_are_not_halved(world):
    level = first_level(world, 0, [0], Widths(0.01, 0.01, 1), 3)
    assert np.all(level.left == 0)


def test_tubes_over_small_bodies_are_narrower(world):
    small = first_level(world, 0, [1], Widths(1e-3, 0.064, 1), 3)
    assert small.windows[0].num_tubes >= MIN_TUBES
    assert 0 < small.left[0] < 6


def test_a_small_body_has_the_tubes_across_that_are_asked_for(world):
    """The diagonal of the box of 0.5 m × 0.4 m × 0.3 m over the number; a large body as before."""
    width = np.linalg.norm([0.5, 0.4, 0.3]) / 100
    for across, expected in ((100, width), (1, 0.01)):
        window = first_level(world, 0, [1], Widths(0.01, 0.01, across), 3).windows[0]
        nearest = np.linalg.norm(np.array([3.0, 0.4, 0.4]) - [0.0, 0.0, 0.5]) - 0.25
        assert np.max(window.step) * nearest == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize(("x", "times"), [(12.0, 0), (4.0, 1), (1.0, 2)])
def test_tubes_over_near_bodies_are_narrower(x, times):
    big = Actor(name="wall", kind="object", mesh=mesh_of(plate(4.0, 0.5)), pose=Pose(x=x, yaw=3.14))
    world = Composite().prepare(around([big], [(0.0, 0.0, 0.0)]))
    level = first_level(world, 0, [0], Widths(0.0025, 0.02, 1), 3)
    assert level.left[0] == 3 - times
