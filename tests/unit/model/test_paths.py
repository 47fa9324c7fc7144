"""What a path's bounces say of it."""

import numpy as np
import pytest

from polychirp.model.paths import Bounce
from polychirp.testing.paths import HandPath, paths_of

R, S, D, T = Bounce.REFLECTION, Bounce.SCATTERING, Bounce.DIFFRACTION, Bounce.TRANSMISSION


@pytest.mark.parametrize(
    ("bounces", "is_direct", "is_mirrored"),
    [
        ((), True, False),
        ((D,), True, False),
        ((T, D), True, False),
        ((R,), False, False),
        ((S,), False, False),
        ((R, S), False, True),
        ((R, R), False, True),
        ((Bounce.DIFFUSE,), False, False),
    ],
)
def test_bounces_tell_what_kind_of_path_it_is(bounces, is_direct, is_mirrored):
    paths = paths_of(HandPath(delay=1e-7), HandPath(delay=2e-7, bounces=bounces))
    assert paths.is_direct.tolist() == [True, is_direct]
    assert paths.is_mirrored.tolist() == [False, is_mirrored]


def test_what_is_known_of_no_group_holds_together_for_ever():
    assert np.all(np.isinf(paths_of(HandPath(delay=1e-7)).coherence_time))
