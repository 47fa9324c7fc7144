"""Waveforms and rules of other installed packages, in study files."""

import importlib
import json
import sys
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from polychirp.config.load import _reader, build, with_defaults
from polychirp.errors import CapabilityError, InputError
from polychirp.model.ramp import RampSchedule
from polychirp.plugins import plugged
from polychirp.receiver.attribution import attribute
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.study.check import check
from polychirp.study.mitigation.own_methods import methods_named
from polychirp.study.provenance import canonical_json
from polychirp.study.restored import restored
from polychirp.study.spec import Study, StudyRadar, schedule_of, schedules_of
from polychirp.study.trial import run_trial
from polychirp.testing.conformance import check_access, check_receiver, check_waveform
from polychirp.waveform import HopAfterHit, ListenBeforeTalk, Sawtooth, Slots, Turn
from tests.support.plugin_package import HALVES, JITTERED, PLAIN_FFT, install
from tests.support.points import frame_of
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


SMALL = build(Study, with_defaults(tomllib.loads(SMALL_STUDY)))
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
        (
            JITTERED.replace("jitter: Seconds", "jitter: 'Sekunden'"),
            r"types of its fields cannot be read \(NameError: name 'Sekunden' is not defined\)",
        ),
        (
            JITTERED.replace("(frozen=True, kw_only=True)", "(kw_only=True)"),
            r"Jittered cannot be hashed; decorate it with @dataclass\(frozen=True\)",
        ),
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


def test_a_field_that_no_study_file_can_hold_is_one_sentence(packages):
    install(
        packages,
        module="jittered_chirps",
        text=JITTERED.replace("= 2e-6\n", "= 2e-6\n    times: np.ndarray | None = None\n"),
        entry_points=f"[{GROUP}]\njittered = jittered_chirps:Jittered\n",
    )
    with pytest.raises(InputError, match=r"plug-in jittered_chirps\.Jittered .*ndarray") as caught:
        build(StudyRadar, {**RADAR, "waveform": {"kind": "sawtooth"}})
    assert "\n" not in str(caught.value)


def test_plug_ins_of_one_name_in_two_packages_are_refused(jittered):
    """Otherwise the one that is loaded last would replace the other without a word."""
    install(
        jittered,
        module="other_chirps",
        text=JITTERED,
        entry_points=f"[{GROUP}]\njittered = other_chirps:Jittered\n",
    )
    with pytest.raises(InputError, match="both have a plug-in 'jittered'") as caught:
        build(StudyRadar, {**RADAR, "waveform": {"kind": "jittered"}})
    assert "'jittered_chirps'" in str(caught.value)
    assert "'other_chirps'" in str(caught.value)


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


class Hasty:
    """A method of another package that returns something of another type."""

    def schedule(self, *, num_sweeps, streams):
        del num_sweeps, streams
        return {}

    def mitigate(self, frame):
        return frame.samples

    def detect(self, frame):
        del frame
        return []


FRAME = frame_of(Sawtooth().schedule(num_sweeps=2, streams=Streams(1)), [])


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: schedule_of(SMALL, replace(SMALL.radars[0], waveform=Hasty())),
            "'schedule' of Hasty, the waveform of 'front', returns dict; return",
        ),
        (lambda: mitigated(Hasty(), FRAME), "'mitigate' of Hasty returns ndarray; return"),
        (lambda: attribute(Hasty(), FRAME), "'detect' of Hasty returns list; return"),
    ],
)
def test_a_result_of_another_type_is_one_sentence(call, sentence):
    with pytest.raises(InputError, match=sentence):
        call()


# ── receivers of another package ──────────────────────────────────────────────


@pytest.fixture
def plain_fft(packages):
    install(
        packages,
        module="plain_fft",
        text=PLAIN_FFT,
        entry_points="[polychirp.receivers]\nplain-fft = plain_fft:PlainFft\n",
    )
    return packages


def study_of_chirps(**receiver):
    tables = with_defaults(tomllib.loads(SMALL_STUDY))
    for radar in tables["radars"]:
        radar["waveform"] = {"kind": "sawtooth", "bandwidth": "300 MHz", "ramp_duration": "40 us"}
        radar["converter"] = {"sample_rate": "20 MS/s", "start": "1 us", "margin": "0 us"}
        radar["if_filter"] = {"passband": "6 MHz", "stopband": "9 MHz"}
    tables["num_sweeps"] = 64
    tables["receiver"] = {"kind": "plain-fft", **receiver}
    return build(Study, tables)


def test_the_page_shows_the_receiver_that_is_tested():
    texts = [block.text for block in blocks_of(ROOT / "docs" / "how-to" / "plug-in.md")]
    assert PLAIN_FFT.strip() in [text.strip() for text in texts]


def test_a_receiver_of_another_package_reads_the_frames_of_a_study(plain_fft):
    study = study_of_chirps(false_alarm_probability=1e-7)
    assert check(study).radars[0].receiver == "plain-fft"
    trial = run_trial(study)
    assert trial.victims[0].detections.num_detections > 0
    assert restored(Study, json.loads(canonical_json(study))) == study
    check_receiver(study.receiver)


def test_its_own_refusal_of_ramps_is_heard_before_the_run(plain_fft):
    study = study_of_chirps()
    drawn = build(StudyRadar, {**RADAR, "waveform": {"kind": "diverse-sawtooth"}}).waveform
    radars = tuple(replace(radar, waveform=drawn) for radar in study.radars)
    with pytest.raises(CapabilityError, match=r"radars\.0\.waveform: chirps differ"):
        check(replace(study, radars=radars))


def test_a_receiver_without_the_settings_of_receivers_is_refused(packages):
    install(
        packages,
        module="plain_fft",
        text=PLAIN_FFT.replace("(SearchSettings)", ""),
        entry_points="[polychirp.receivers]\nplain-fft = plain_fft:PlainFft\n",
    )
    with pytest.raises(InputError, match=r"does not inherit from .*settings\.SearchSettings"):
        study_of_chirps()


class BrokenReceiver:
    """A range-Doppler receiver with one fault."""

    def __init__(self, change, **settings):
        self.inner, self.change = RangeDoppler(**settings), change
        self.calls = 0

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def detect(self, frame):
        self.calls += 1
        return self.change(self.inner.detect(frame), self.calls, frame)


@pytest.mark.parametrize(
    ("broken", "sentence"),
    [
        (
            BrokenReceiver(lambda found, n, _: replace(found, power=found.power * n)),
            "another power",
        ),
        (
            BrokenReceiver(lambda found, *_: replace(found, power=100.0 * found.power)),
            "the power of that point is +",
        ),
        (
            BrokenReceiver(lambda found, *_: replace(found, range=2.0 * found.range)),
            "the strongest detection has the range",
        ),
        (
            BrokenReceiver(lambda found, *_: replace(found, power=-found.power)),
            "the power of that point is not positive",
        ),
        (
            BrokenReceiver(lambda found, _, frame: frame.samples.__imul__(2.0) is None or found),
            "read-only",
        ),
        (BrokenReceiver(lambda *_: []), "'detect' returns list"),
        (
            BrokenReceiver(lambda found, *_: found, false_alarm_probability=1e-2),
            "10 frames of noise have",
        ),
        (object(), "has no method 'detect'"),
    ],
)
def test_a_receiver_that_breaks_a_law_is_one_sentence(broken, sentence):
    with pytest.raises((InputError, ValueError)) as caught:
        check_receiver(broken)
    assert sentence in str(caught.value)


# ── rules ─────────────────────────────────────────────────────────────────────


class BrokenRule:
    """A rule from frame to frame, or another one, with one fault."""

    def __init__(self, inner, **faults):
        self.inner, self.faults = inner, faults

    def __getattr__(self, name):
        return self.faults.get(name, getattr(self.inner, name))

    def assign(self, **given):
        return self.faults.get("assign", lambda one: one)(self.inner.assign(**given))


def moved(change):
    """A rule whose assignment is changed, differently at every call."""
    calls = iter(range(1, 99))
    return lambda one: change(one, next(calls))


@pytest.mark.parametrize(
    ("broken", "sentence"),
    [
        (
            BrokenRule(Slots(slot=1e-6, num_slots=3),
                       assign=moved(lambda one, n: replace(one, delay=one.delay + n))),
            "equal streams give another delay",
        ),
        (
            BrokenRule(Slots(slot=1e-6, num_slots=3),
                       assign=moved(lambda one, _: replace(one, delay=one.delay - 1.0))),
            "a delay is negative",
        ),
        (
            BrokenRule(Slots(slot=1e-6, num_slots=3),
                       assign=moved(lambda one, _: replace(one, shift=one.shift[:3]))),
            "its shift has the shape (3,) for 12 radars",
        ),
        (object(), "has no method 'assign'"),
    ],
)  # fmt: skip
def test_a_rule_that_breaks_a_law_is_one_sentence(broken, sentence):
    with pytest.raises(InputError) as caught:
        check_access(broken)
    assert sentence in str(caught.value)


class Forgetful(HopAfterHit):
    """It starts before its frame."""

    def next_turn(self, last, measured, *, streams):
        del last, measured, streams
        return Turn(delay=-1e-6)


class Deaf(ListenBeforeTalk):
    """It waits for ever."""

    def wait(self, energy, *, samples, attempt, streams):
        del energy, samples, attempt, streams
        return 1e-3


@pytest.mark.parametrize(
    ("rule", "sentence"),
    [
        (Forgetful(), "a next turn has the delay -1e-06 s"),
        (Deaf(), "it still waits after 1000 attempts"),
    ],
)
def test_a_rule_from_frame_to_frame_that_breaks_a_law_is_one_sentence(rule, sentence):
    with pytest.raises(InputError) as caught:
        check_access(rule)
    assert sentence in str(caught.value)


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
