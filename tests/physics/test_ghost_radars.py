"""Every ghost of interference is named by the radar that makes it.

Radars stand at different distances from a victim in free space, and all start together with equal
slopes. A one-way path of delay τ is read as an echo from cτ/2, where no other radar has a beat.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from polychirp import paper_study, run_trial
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.front_end import FrontEnd, HighPass, IqImbalance
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.mitigation import Blanking
from polychirp.rng import Streams
from polychirp.study.ghost_radars import radars_of_ghosts
from polychirp.study.reception import Reception
from polychirp.study.spec import scene_of, schedules_of
from polychirp.study.trial import trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch

VICTIM, OTHERS = "vehicle-2", ("vehicle-3", "vehicle-4")


def study(**changes):
    whole = paper_study("conventional", radars=(VICTIM, *OTHERS))
    return replace(whole, victims=(VICTIM,), num_sweeps=4, tracer=FreeSpace(), **changes)


@pytest.mark.parametrize(
    ("changes", "farthest"),
    [({}, 30.0), ({"receiver": PaperReceiver(greatest_range=30.0)}, 30.0)],
    ids=["coherent", "paper"],
)
def test_a_ghost_at_half_the_distance_of_a_radar_has_its_name(changes, farthest):
    """The coherent receiver loses the ghost at 14.8 m beside the one at 6.6 m (limits)."""
    one = study(**changes)
    seen, scene = run_trial(one).victim(VICTIM), scene_of(one)
    named = np.array([radar or "" for radar in seen.score.radar])
    assert not np.any(named == VICTIM)
    for name in OTHERS:
        is_from = seen.paths.transmitter == scene.radar_index(name)
        expected = 0.5 * SPEED_OF_LIGHT * seen.paths.delay[is_from].min()
        if expected > farthest:
            continue
        nearest = np.argmin(np.abs(seen.detections.range - expected))
        assert seen.detections.range[nearest] == pytest.approx(expected, abs=0.3)
        assert seen.score.nature[nearest] == "direct"
        assert named[nearest] == name
        assert seen.score.origin[nearest] == f"radar {name}"


def reception(one, *, interferers=None):
    scene, schedules = scene_of(one), schedules_of(one)
    victim = scene.radar_index(VICTIM)
    snapshots = trace_frame(
        one.tracer, scene, schedules, refresh_interval=one.refresh_interval, receivers=(victim,)
    )
    return Reception(
        engine=Stretch(),
        scene=scene,
        schedules=schedules,
        snapshots=snapshots,
        victim=victim,
        interferers=interferers,
    )


HIGH_PASS = HighPass(corners=(50e3, 20e3))
FRONT_ENDS = {
    "complex": FrontEnd(high_pass=HIGH_PASS, imbalance=IqImbalance(gain=1.05, phase=0.03)),
    "real": FrontEnd(high_pass=HIGH_PASS),
}


@pytest.mark.parametrize("sampling", FRONT_ENDS)
def test_the_signals_of_all_radars_add_up_to_the_interference_of_the_frame(sampling):
    one = study()
    radars = tuple(
        replace(
            radar,
            front_end=FRONT_ENDS[sampling],
            converter=replace(radar.converter, sampling=sampling),
        )
        for radar in one.radars
    )
    again = reception(replace(one, radars=radars))
    _, parts = synthesize(
        again.engine,
        again.scene,
        again.schedules,
        again.snapshots,
        victim=again.victim,
        interferers=None,
        streams=Streams(1),
    )
    assert len(again.audible()) == 2
    total = sum(again.parts(number).samples for number in again.audible())
    expected = np.stack([parts["direct"], parts["indirect"]])
    assert np.any(expected != 0.0)
    np.testing.assert_allclose(total, expected, atol=1e-12 * np.abs(expected).max())


@dataclass
class _Counting:
    """An engine that counts the signals that it computes."""

    inner: Stretch = field(default_factory=Stretch)
    asked: list[int] = field(default_factory=list)

    def contribution(self, *arguments, victim, transmitter):
        self.asked.append(transmitter)
        return self.inner.contribution(*arguments, victim=victim, transmitter=transmitter)


@pytest.mark.parametrize(("most", "repeated"), [(8, 0), (1, 1)])
def test_signals_of_the_first_few_radars_are_computed_once(most, repeated, monkeypatch):
    monkeypatch.setattr("polychirp.study.reception.MOST_KEPT", most)
    twin, counting = reception(study()), _Counting()
    one = replace(twin, engine=counting)
    frame, _ = one.frame(Streams(1))
    expected, _ = twin.frame(Streams(1), keeps=False)
    np.testing.assert_array_equal(frame.samples, expected.samples)
    computed, others = list(counting.asked), one.audible()
    assert sorted(computed) == sorted((one.victim, *others))
    for number in others:
        np.testing.assert_array_equal(one.parts(number).samples, twin.parts(number).samples)
    assert len(counting.asked) - len(computed) == repeated


def test_mitigation_is_applied_to_each_radar():
    seen = run_trial(study(receiver=replace(study().receiver, mitigation=Blanking())))
    score = seen.victim(VICTIM).score
    assert {radar for radar in score.radar if radar} <= set(OTHERS)
    assert all(
        (radar is not None) == (what == "direct")
        for radar, what in zip(score.radar, score.nature, strict=True)
    )


def test_nothing_is_computed_if_one_radar_alone_is_audible():
    again = reception(study(), interferers=[2])

    def refuse(parts):
        raise AssertionError("computed")

    name = again.scene.radars[2].name
    assert radars_of_ghosts(("target", "indirect"), again, refuse) == (None, name)
    assert radars_of_ghosts(("target",), again, refuse) == (None,)
