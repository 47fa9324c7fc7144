"""Waveforms and rules of other installed packages, in study files."""

import importlib
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from polychirp.config.load import _reader, build, with_defaults
from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.plugins import plugged
from polychirp.rng import Streams
from polychirp.study.mitigation.own_methods import methods_named
from polychirp.study.provenance import canonical_json
from polychirp.study.restored import restored
from polychirp.study.spec import Study, StudyRadar, schedules_of
from polychirp.testing.conformance import check_waveform
from polychirp.waveform import Sawtooth
from tests.support.plugin_package import HALVES, JITTERED, install
from tests.support.small_study import SMALL_STUDY
from tests.support.snippets import ROOT, blocks_of

GROUP = "polychirp.waveforms"


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """A folder of installed packages, forgotten after the test."""
    monkeypatch.syspath_prepend(str(tmp_path))
    before = set(sys.modules)
    importlib.invalidate_caches()
    plugged.cache_clear()
    _reader.cache_clear()
    yield tmp_path
    plugged.cache_clear()
    _reader.cache_clear()
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


@pytest.fixture
def jittered(packages):
    install(
        packages,
        module="jittered_chirps",
        text=JITTERED,
        entry_points=f"[{GROUP}]\njittered = jittered_chirps:Jittered\n",
    )
    return packages


def test_the_page_shows_the_module_that_is_tested():
    texts = [block.text for block in blocks_of(ROOT / "docs" / "how-to" / "plug-in.md")]
    assert JITTERED.strip() in [text.strip() for text in texts]


RADAR = {"name": "front", "vehicle": "ego"}


def test_a_study_file_names_a_waveform_of_another_package(jittered):
    radar = build(StudyRadar, {**RADAR, "waveform": {"kind": "jittered", "jitter": "3 us"}})
    assert type(radar.waveform).__name__ == "Jittered"
    assert radar.waveform.jitter == 3e-6
    check_waveform(radar.waveform)


def test_its_problems_have_a_place_and_a_sentence(jittered):
    for table, sentence in (
        ({"kind": "jittered", "jiter": "3 us"}, "waveform.jiter: unknown key; did you mean"),
        ({"kind": "jittered", "jitter": "3 Hz"}, "waveform.jitter: '3 Hz' is not a value in s"),
        ({"kind": "jittered", "jitter": "-3 us"}, "waveform: a jittered waveform cannot have"),
        ({"kind": "jitterd"}, "waveform.kind: there is no 'jitterd'; did you mean 'jittered'"),
    ):
        with pytest.raises(InputError) as caught:
            build(StudyRadar, {**RADAR, "waveform": table})
        assert sentence in str(caught.value)


def test_a_study_with_it_comes_back_from_its_text(jittered):
    import tomllib

    tables = with_defaults(tomllib.loads(SMALL_STUDY))
    for radar in tables["radars"]:
        radar["waveform"] = {"kind": "jittered"}
    study = build(Study, tables)
    again = restored(Study, json.loads(canonical_json(study)))
    assert again == study
    assert schedules_of(study)[0].num_ramps == study.num_sweeps


def test_without_plug_ins_there_are_none(packages):
    assert plugged(GROUP, "schedule") == ()
    with pytest.raises(InputError, match="there is no 'jittered'"):
        build(StudyRadar, {**RADAR, "waveform": {"kind": "jittered"}})


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("raise RuntimeError('no luck')", r"cannot be loaded \(RuntimeError: no luck\)"),
        ("Jittered = 3", r"3 is no dataclass; decorate the class"),
        (JITTERED.replace('"jittered"', '"other"'), r"needs the field kind: Literal\['jittered'\]"),
        (JITTERED.replace("def schedule", "def plan"), r"has no method 'schedule'; add it"),
    ],
)
def test_a_plug_in_that_cannot_be_used_is_one_sentence(packages, text, sentence):
    install(
        packages,
        module="broken_chirps",
        text=text,
        entry_points=f"[{GROUP}]\njittered = broken_chirps:Jittered\n",
    )
    with pytest.raises(InputError, match=sentence) as caught:
        build(StudyRadar, {**RADAR, "waveform": {"kind": "sawtooth"}})
    assert "the plug-in 'jittered' of the package 'broken_chirps'" in str(caught.value)


def test_a_kind_that_exists_is_not_replaced(packages):
    install(
        packages,
        module="other_chirps",
        text=JITTERED.replace('"jittered"', '"sawtooth"'),
        entry_points=f"[{GROUP}]\nsawtooth = other_chirps:Jittered\n",
    )
    with pytest.raises(InputError, match="has the kind 'sawtooth', which exists already"):
        build(StudyRadar, {**RADAR, "waveform": {"kind": "sawtooth"}})


def test_a_mitigation_of_another_package_is_in_study_files_and_in_the_benchmark(packages):
    import tomllib

    install(
        packages,
        module="halves",
        text=HALVES,
        entry_points="[polychirp.mitigations]\nfirst-half = halves:FirstHalf\n",
    )
    tables = with_defaults(tomllib.loads(SMALL_STUDY))
    tables["receiver"] = {"kind": "coherent", "mitigation": {"kind": "first-half", "share": 0.25}}
    assert build(Study, tables).receiver.mitigation.share == 0.25
    assert methods_named((), ())["first-half"].share == 0.5


# ── the conformance suite finds what it is for ────────────────────────────────


class Broken:
    """A sawtooth with one fault."""

    def __init__(self, change, *, refuses=True):
        self.change, self.refuses = change, refuses
        self.calls = 0

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        if num_sweeps < 1 and not self.refuses:
            num_sweeps = 1
        self.calls += 1
        ramps = Sawtooth().schedule(num_sweeps=num_sweeps, streams=streams)
        return self.change(ramps, self.calls)


@pytest.mark.parametrize(
    ("broken", "sentence"),
    [
        (
            Broken(lambda ramps, _: replace(ramps, start_time=ramps.start_time + 1e-3)),
            "its first ramp starts at 0.001 s",
        ),
        (
            Broken(lambda ramps, _: replace(ramps, sweep=ramps.sweep + 1)),
            "16 sweeps are not numbered from 0 to 15",
        ),
        (
            Broken(lambda ramps, _: replace(ramps, sweep=ramps.sweep[::-1])),
            "the numbers of its sweeps fall",
        ),
        (
            Broken(lambda ramps, calls: replace(ramps, start_phase=ramps.start_phase + calls)),
            "equal streams give another start_phase",
        ),
        (
            Broken(
                lambda ramps, _: replace(
                    ramps, slope=ramps.slope * (1 + 1e-3 * np.size(ramps.slope))
                )
            ),
            "a longer schedule has another slope on its first ramps",
        ),
        (Broken(lambda ramps, _: ramps, refuses=False), "num_sweeps = 0 is accepted"),
        (object(), "has no method 'schedule'"),
    ],
)
def test_a_broken_law_is_one_sentence(broken, sentence):
    with pytest.raises(InputError) as caught:
        check_waveform(broken)
    assert sentence in str(caught.value)
