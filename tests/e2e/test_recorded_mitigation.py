"""Methods of mitigation on a recording of a real radar with simulated interference.

The recording lies in the folder that the variable POLYCHIRP_SHARED names, or in ``shared`` beside
the checkout; where it is absent, these tests are skipped.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from polychirp.rng import Streams
from polychirp.units import to_db
from tools.experiments.recorded_mitigation import (
    FILE,
    METHODS,
    compare_recorded,
    injected,
    recorded_frame,
)

SHARED = Path(os.environ.get("POLYCHIRP_SHARED", Path(__file__).parents[3] / "shared"))

pytestmark = pytest.mark.skipif(not (SHARED / FILE).exists(), reason="there is no recording here")


@pytest.fixture(scope="module")
def recording():
    return recorded_frame(SHARED / FILE)


def test_the_recording_has_signed_samples_of_four_channels(recording):
    assert recording.samples.shape == (4, 128, 128)
    assert np.abs(recording.samples.real).max() < 2**15
    assert np.abs(np.mean(recording.samples)) < np.sqrt(np.mean(np.abs(recording.samples) ** 2))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_method_leaves_less_than_a_tenth_of_the_interference(recording, seed):
    """Interference is 10 dB above the recording: what is left is weaker than the recording."""
    results = compare_recorded(recording, injected(recording, streams=Streams(seed)))
    left = {one.method: float(to_db(one.left)) for one in results}
    assert left.pop("nothing") == pytest.approx(0.0, abs=1e-9)
    assert max(left.values()) < -10.0
    assert left["Burg"] < left["blanking"]


def test_on_the_recording_itself_no_method_changes_more_than_a_quarter_of_the_power(recording):
    """Echoes of a real radar that beat with each other exceed the default threshold: a fifth."""
    power = np.sum(np.abs(recording.samples) ** 2)
    for name, method in METHODS.items():
        if method is not None:
            change = method.mitigate(recording).samples - recording.samples
            assert np.sum(np.abs(change) ** 2) < 0.25 * power, name
