"""What `synthesize` refuses, before any long computation."""

import pytest

from polychirp.errors import InputError
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.base import SynthesisEngine
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import paths_of
from tests.support.references.fullband import FullBand

PLAN = RampSchedule(
    start_time=[0.0],
    duration=[100e-6],
    start_frequency=[79e9],
    slope=[1e12],
    start_phase=[0.0],
    sweep=[0],
)
SCENE = Scene(
    time=0.0,
    actors=(Actor(name="car", kind="vehicle"),),
    radars=(Radar(name="a"), Radar(name="b")),
    carriers=(0, 0),
)


@pytest.mark.parametrize("engine", [Stretch(), FullBand()])
def test_both_engines_are_engines(engine):
    assert isinstance(engine, SynthesisEngine)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schedules": [PLAN]}, "give every radar its own"),
        ({"victim": 2}, "the scene has 0 to 1"),
        ({"interferers": [-1]}, "the scene has 0 to 1"),
        ({"interferers": [0]}, "other radars than the victim"),
        ({"interferers": [1, 1]}, "each named once"),
        ({"snapshots": []}, "one snapshot of paths or more"),
        ({"snapshots": [paths_of(reference_time=t) for t in (1.0, 0.0)]}, "in order of time"),
    ],
)
def test_impossible_requests_are_refused(change, message):
    request = {
        "schedules": [PLAN, PLAN],
        "snapshots": [paths_of()],
        "victim": 0,
        "interferers": None,
    } | change
    with pytest.raises(InputError, match=message):
        synthesize(Stretch(), SCENE, streams=Streams(seed=1), **request)


def test_a_full_band_rate_must_be_positive():
    with pytest.raises(InputError, match="positive sample rate"):
        FullBand(sample_rate=0.0)
