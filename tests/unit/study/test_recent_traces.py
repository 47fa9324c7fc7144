"""`RecentTraces`: trials on the same street share one tracing, with the same results."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.config.load import load_study
from polychirp.receiver.mitigation.blanking import Blanking
from polychirp.study import trial
from polychirp.study.recent_traces import RecentTraces
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
    traces = RecentTraces(most=1)
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
    traces = RecentTraces(most=1)
    for one in (study, lower, study):
        run_trial(one, traces=traces)
    assert len(calls) == 3


def test_points_that_differ_in_waveform_share_a_tracing_of_a_stated_time(study, monkeypatch):
    """The frames have different lengths; the stated time is longer than both."""
    calls = counted(monkeypatch)
    longer = replace(study, least_traced_time=60e-3)
    radars = tuple(replace(radar, waveform=DiverseTriangular()) for radar in longer.radars)
    diverse = replace(longer, radars=radars)
    traces = RecentTraces(most=1)
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
    traces = RecentTraces(most=2)
    for one in (study, replace(study, radars=radars)):
        run_trial(one, traces=traces)
    assert len(calls) == 2
