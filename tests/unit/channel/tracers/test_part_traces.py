"""Times at which a part is traced, by coherence times that its paths state."""

from itertools import pairwise

import numpy as np
import pytest

from polychirp.channel.base import Part, path_table, strength
from polychirp.channel.tracers.part_traces import (
    MAX_TRACE_INTERVAL,
    Frame,
    Limits,
    PartTraces,
    interpolation_error,
    trace_together,
)
from polychirp.testing.shapes import around

LAST, GRID, ALLOWED = 32, 1e-3, 1e-2
TIMES = np.arange(LAST + 1) * GRID


def traced(coherence, pairs=((0, 0),), longest=np.inf, faint=0.0):
    """The part after a frame; ``coherence`` gives the coherence time, s, at a time and of a pair.

    Its paths all have the same power; ``faint`` errors of it are tolerated.
    """
    pairs = np.array(pairs)
    scene = around([], [(0, 0, 0.6)] * (1 + int(pairs.max())))
    scenes = [scene.at(float(time)) for time in TIMES]

    def trace(moment, some, _):
        count = len(some)
        return path_table(
            scene=moment,
            frequency=79e9,
            pair=some,
            delay=np.full(count, 1e-7),
            delay_rate=np.zeros(count),
            transfer=np.tile(1e-4 * np.eye(2), (count, 1, 1)),
            departure=np.tile([1.0, 0.0, 0.0], (count, 1)),
            arrival=np.tile([1.0, 0.0, 0.0], (count, 1)),
            bounces=[],
            coherence_time=np.array([coherence(moment.time, tuple(pair)) for pair in some]),
        )

    num_radars = len(scene.radars)
    none = np.zeros((num_radars, num_radars))
    frame = Frame(TIMES, scenes, scenes, pairs, ALLOWED, none)
    first = trace(scenes[0], pairs, none)
    tolerated = none + faint * float(strength(first, scene)[0])
    part = PartTraces(Part("glint", trace, longest=longest), frame, Limits(none, tolerated), first)
    trace_together([part])
    return part


def times_of(part, pair=(0, 0)):
    return np.flatnonzero(part.is_traced[:, *pair])


def test_paths_that_stay_in_phase_are_traced_at_the_ends_of_equal_intervals():
    assert times_of(traced(lambda _, __: np.inf)).tolist() == [0, 16, 32]


@pytest.mark.parametrize(("faint", "interval"), [(0.5, 4), (2.0, 16)])
def test_traces_are_no_farther_apart_than_a_part_states_unless_it_is_faint(faint, interval):
    """Over the longest interval it is wrong by its own power, which may be tolerated."""
    times = times_of(traced(lambda _, __: np.inf, longest=4e-3, faint=faint))
    assert times.tolist() == list(range(0, LAST + 1, interval))


def test_a_glint_that_arrives_late_is_traced_before_it_arrives():
    """From 18 ms on, paths lose their phase within 5 ms, which no trace before says."""
    part = traced(lambda time, _: np.inf if time < 17.5e-3 else 5e-3)
    times = times_of(part)
    gaps = np.diff(times)[times[1:] >= 18]
    assert interpolation_error(gaps.max() * GRID / 5e-3) <= ALLOWED
    assert times[times <= 16].tolist() == [0, 16]
    assert sorted(part.tables) == times.tolist()


@pytest.mark.parametrize("seed", range(20))
def test_between_any_two_traces_the_error_is_allowed_at_both(seed):
    """Coherence times of 2 to 200 ms come and go, those of two radars on their own."""
    draw = np.random.default_rng([3, seed])
    knots = np.exp(draw.uniform(np.log(2e-3), np.log(0.2), (2, 9)))

    def coherence(time, pair):
        return float(np.interp(time, np.linspace(0, TIMES[-1], 9), knots[pair[0]]))

    part = traced(coherence, pairs=((0, 0), (1, 1)))
    for pair in ((0, 0), (1, 1)):
        times = times_of(part, pair)
        assert times[0] == 0
        assert times[-1] == LAST
        for begin, end in pairwise(times):
            least = min(coherence(GRID * at, pair) for at in (begin, end))
            error = interpolation_error((end - begin) * GRID / least)
            assert error <= ALLOWED or end - begin == 1
    for number, table in part.tables.items():
        assert len(table.delay) == np.count_nonzero(part.is_traced[number])


def test_both_directions_between_two_radars_are_traced_at_the_same_times():
    part = traced(
        lambda time, pair: 4e-3 if pair == (0, 1) and time > 0.02 else np.inf,
        pairs=((0, 1), (1, 0)),
    )
    assert times_of(part, (0, 1)).tolist() == times_of(part, (1, 0)).tolist()
    assert len(times_of(part, (0, 1))) > 3


def frame_of(times):
    return Frame(
        np.asarray(times, dtype=float), [], [], np.zeros((0, 2), dtype=int), 0.01, np.zeros((1, 1))
    )


@pytest.mark.parametrize("seed", range(20))
def test_intervals_cover_the_frame_and_are_equal_to_a_step(seed):
    draw = np.random.default_rng([41, seed])
    grid, count = 10 ** draw.uniform(-4, -1.0), int(draw.integers(2, 80))
    frame = frame_of(0.3 + grid * np.arange(count))
    marks, gaps = frame.marks, np.diff(frame.marks)
    assert marks[0] == 0
    assert marks[-1] == count - 1
    assert np.min(gaps) >= 1
    assert np.max(gaps) - np.min(gaps) <= 1
    assert np.mean(gaps) * grid <= max(MAX_TRACE_INTERVAL, grid) * (1 + 1e-6)
    # one interval fewer would be too long
    assert len(gaps) == 1 or (count - 1) * grid > MAX_TRACE_INTERVAL * (len(gaps) - 1)


def test_a_single_time_is_the_only_mark():
    assert frame_of([0.2]).marks.tolist() == [0]


def test_a_frame_of_the_papers_statistics_has_three_intervals():
    """14 times 4 ms apart had four intervals, of which the last lasted 4 ms."""
    assert frame_of(4e-3 * np.arange(14)).marks.tolist() == [0, 4, 8, 13]
