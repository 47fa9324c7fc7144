"""`RecentResults`: trials share tracing and synthesis, with the same results."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.config.load import load_study
from polychirp.receiver.mitigation.blanking import Blanking
from polychirp.study import reception, trial
from polychirp.study.recent_results import RecentResults
from polychirp.study.trial import run_trial
from polychirp.waveform import DiverseTriangular
from tests.support.small_study import SMALL_STUDY


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL_STUDY, encoding="utf-8")
    return load_study(path)


def counted(monkeypatch):
    """Frames that are traced, one entry each."""
    calls = []
    inner = trial.interpolate_paths
    monkeypatch.setattr(
        trial, "interpolate_paths", lambda *a, **k: calls.append(1) or inner(*a, **k)
    )
    return calls


def test_points_that_differ_in_mitigation_share_a_tracing(study, monkeypatch):
    calls = counted(monkeypatch)
    blanked = replace(study, receiver=replace(study.receiver, mitigation=Blanking()))
    traces = RecentResults(most=1)
    shared = [run_trial(one, traces=traces) for one in (study, blanked)]
    assert len(calls) == 1
    alone = [run_trial(one) for one in (study, blanked)]
    assert len(calls) == 3
    for one, other in zip(shared, alone, strict=True):
        assert np.array_equal(one.victims[0].frame.samples, other.victims[0].frame.samples)
        assert np.array_equal(one.victims[0].detections.range, other.victims[0].detections.range)


def test_another_channel_is_traced_anew(study, monkeypatch):
    calls = counted(monkeypatch)
    lower = replace(study, tracer=replace(study.tracer, frequency=77e9))
    traces = RecentResults(most=1)
    for one in (study, lower, study):
        run_trial(one, traces=traces)
    assert len(calls) == 3


def test_points_that_differ_in_waveform_share_a_tracing_of_a_stated_time(study, monkeypatch):
    """The frames have different lengths; the stated time is longer than both."""
    calls = counted(monkeypatch)
    longer = replace(study, least_traced_time=60e-3)
    radars = tuple(replace(radar, waveform=DiverseTriangular()) for radar in longer.radars)
    diverse = replace(longer, radars=radars)
    traces = RecentResults(most=1)
    shared = [run_trial(one, traces=traces) for one in (longer, diverse)]
    assert len(calls) == 1
    alone = [run_trial(one) for one in (longer, diverse)]
    for one, other in zip(shared, alone, strict=True):
        assert np.array_equal(one.victims[0].frame.samples, other.victims[0].frame.samples)
    ends = [float(one.victims[0].frame.schedule.end_time[-1]) for one in alone]
    assert ends[0] != ends[1]
    assert max(ends) < 60e-3


def test_without_a_stated_time_other_frame_times_are_traced_anew(study, monkeypatch):
    calls = counted(monkeypatch)
    radars = tuple(replace(radar, waveform=DiverseTriangular()) for radar in study.radars)
    traces = RecentResults(most=2)
    for one in (study, replace(study, radars=radars)):
        run_trial(one, traces=traces)
    assert len(calls) == 2


@pytest.fixture
def synthesized(monkeypatch):
    """Frames that are synthesized, one entry each."""
    calls = []
    inner = reception.synthesize
    monkeypatch.setattr(reception, "synthesize", lambda *a, **k: calls.append(1) or inner(*a, **k))
    return calls


def test_points_that_differ_in_mitigation_share_their_signals(study, synthesized):
    blanked = replace(study, receiver=replace(study.receiver, mitigation=Blanking()))
    signals = RecentResults(most=2)
    shared = [run_trial(one, signals=signals) for one in (study, blanked)]
    count = len(synthesized)
    assert count == len(shared[0].victims)
    alone = run_trial(blanked)
    assert len(synthesized) == 2 * count
    for one, other in zip(shared[1].victims, alone.victims, strict=True):
        assert np.array_equal(one.frame.samples, other.frame.samples)
        assert np.array_equal(one.parts.samples, other.parts.samples)
        assert np.array_equal(one.detections.range, other.detections.range)


def test_other_noise_waveforms_and_radars_have_signals_of_their_own(study, synthesized):
    study = replace(study, least_traced_time=60e-3)  # all have the same traced times
    radars = tuple(replace(radar, waveform=DiverseTriangular()) for radar in study.radars)
    late = tuple(replace(radar, start_time=1e-5) for radar in study.radars)
    louder = tuple(
        replace(radar, transmit_power=2.0 * radar.transmit_power) for radar in study.radars
    )
    signals = RecentResults(most=99)
    several = [
        study,
        replace(study, seed=study.seed + 1),
        replace(study, num_sweeps=study.num_sweeps - 1),
        replace(study, radars=radars),
        replace(study, radars=late),
        replace(study, radars=louder),
        replace(study, tracer=replace(study.tracer, frequency=77e9)),
    ]
    victims = [len(run_trial(one, signals=signals).victims) for one in several]
    assert len(synthesized) == sum(victims)


def test_results_are_kept_while_they_take_little_memory():
    results = RecentResults(most=3, most_bytes=10.0, size_of=len)
    calls = []

    def text(size):
        return results.of(size, lambda: calls.append(size) or size * "x")

    for size in (4, 5, 4, 5):
        assert len(text(size)) == size
    assert calls == [4, 5]
    text(6)  # with it, the others take too much
    text(5)
    assert calls == [4, 5, 6, 5]
    text(11)  # takes too much alone
    text(11)
    assert calls == [4, 5, 6, 5, 11, 11]
