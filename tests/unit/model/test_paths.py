"""Kinds of paths by their bounces."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.paths import Bounce
from polychirp.testing.paths import HandPath, paths_of

R, S, D, T = Bounce.REFLECTION, Bounce.SCATTERING, Bounce.DIFFRACTION, Bounce.TRANSMISSION


@pytest.mark.parametrize(
    ("bounces", "actors", "is_direct", "is_mirrored"),
    [
        ((), (), True, False),
        ((D,), (0,), True, False),
        ((T, D), (0, 1), True, False),
        ((R,), (0,), False, False),
        ((S,), (0,), False, False),
        ((R, S), (0, 1), False, True),
        ((R, R), (0, 1), False, True),
        ((R, S, R), (0, 1, 0), False, True),
        ((R, T, S), (0, 2, 1), False, True),
        ((R, R, S), (0, 0, 0), False, False),  # in a lamp
        ((R, D), (0, 1), False, False),  # a wall's echo that bends over a car
        ((R, T, R), (0, 1, 0), False, False),  # the corner of a house behind a pane
        ((Bounce.DIFFUSE,), (0,), False, False),
    ],
)
def test_bounces_tell_what_kind_of_path_it_is(bounces, actors, is_direct, is_mirrored):
    other = HandPath(delay=2e-7, bounces=(S,), actors=(3,))
    paths = paths_of(
        HandPath(delay=1e-7), other, HandPath(delay=2e-7, bounces=bounces, actors=actors), other
    ).select(np.array([0, 2]))
    assert paths.is_direct.tolist() == [True, is_direct]
    assert paths.is_mirrored.tolist() == [False, is_mirrored]


def test_paths_carried_there_and_back_are_the_same():
    paths = replace(
        paths_of(HandPath(delay=1e-7, delay_rate=-2e-8), reference_time=0.5),
        delay_acceleration=np.array([3e-7]),
    )
    there = paths.carried(4e-3)
    assert there.reference_time == 0.504
    assert there.delay[0] == pytest.approx(1e-7 - 8e-11 + 2.4e-12, rel=1e-12, abs=0)
    assert there.delay_rate[0] == pytest.approx(-2e-8 + 1.2e-9, rel=1e-12, abs=0)
    back = there.carried(-4e-3)
    np.testing.assert_allclose(back.delay, paths.delay, rtol=1e-14)
    np.testing.assert_allclose(back.delay_rate, paths.delay_rate, rtol=1e-14)


def test_what_is_known_of_no_group_holds_together_for_ever():
    assert np.all(np.isinf(paths_of(HandPath(delay=1e-7)).coherence_time))


@pytest.mark.parametrize("name", ["delay", "delay_rate", "transfer", "departure", "arrival"])
def test_a_path_that_is_not_finite_is_named(name):
    """A single NaN had silently removed all interference of a radar."""
    paths = paths_of(HandPath(delay=1e-7), HandPath(delay=2e-7))
    value = getattr(paths, name).copy()
    value[1] = np.nan
    with pytest.raises(InputError, match=rf"PropagationPaths\.{name} of path 1 is not finite"):
        replace(paths, **{name: value})
