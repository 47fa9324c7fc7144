"""Parts of a frame's samples by name, some of them absent."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.if_frame import PARTS, IfParts


def parts(*names):
    samples = np.arange(1.0, len(names) + 1)[:, None, None, None] * np.ones((1, 2, 1, 3))
    return IfParts(samples=samples, names=names)


def test_a_part_that_is_not_there_is_zero_and_takes_no_memory():
    found = parts(*PARTS[:5])
    assert found["distortion"].shape == (2, 1, 3)
    assert not found["distortion"].any()
    assert found["distortion"].strides == (0, 0, 0)


def test_parts_are_found_by_name_wherever_they_stand():
    found = parts(*PARTS[:5], "distortion")
    assert found["distortion"][0, 0, 0] == 6.0
    assert np.array_equal(found.total("noise", "distortion", "leakage"), np.full((2, 1, 3), 11.0))
    assert np.array_equal(found.total(), np.full((2, 1, 3), 21.0))


def test_an_unknown_part_is_told():
    with pytest.raises(InputError, match="did you mean 'noise'"):
        parts(*PARTS)["nois"]


@pytest.mark.parametrize(
    ("names", "count", "message"),
    [
        (("noise", "echo"), 2, "in this order"),
        (("echo", "hum"), 2, "in this order"),
        (("echo", "noise"), 3, "needs the parts echo, noise"),
    ],
)
def test_names_and_samples_agree(names, count, message):
    with pytest.raises(InputError, match=message):
        IfParts(samples=np.zeros((count, 1, 1, 2)), names=names)
