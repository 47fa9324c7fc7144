"""Receivers in study files: a kind may be named, and is "auto" if none is."""

import re
import tomllib
from pathlib import Path

import pytest

from polychirp.cli.init import TEMPLATES, template
from polychirp.config.dump import dump
from polychirp.config.load import load_study, study_of_tables
from polychirp.config.monte_carlo import load_plan
from polychirp.errors import CapabilityError, InputError, ModelWarning
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver
from polychirp.study.check import check

ROOT = Path(__file__).parents[3]


@pytest.fixture
def chirps(tmp_path):
    path = tmp_path / "chirps.toml"
    path.write_text(template("chirp-sequence"), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("receiver={}", AutoReceiver()),
        ('receiver={angle="capon"}', AutoReceiver(angle="capon")),
        ('receiver={kind="coherent"}', CoherentReceiver()),
        ('receiver={kind="range-doppler", quantile=0.7}', RangeDoppler(quantile=0.7)),
        (
            'receiver={kind="coherent", dynamic_range="50 dB"}',
            CoherentReceiver(dynamic_range=1e5),
        ),
        (
            'receiver={kind="paper", greatest_speed="90 km/h"}',
            PaperReceiver(greatest_speed=25.0),
        ),
    ],
)
def test_a_table_without_a_kind_is_auto(chirps, change, expected):
    study = load_study(chirps, overrides=[change])
    assert study.receiver == expected
    assert study_of_tables(tomllib.loads(dump(study)), folder=chirps.parent) == study


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ('receiver={kind="papers"}', "'paper'"),
        (
            'receiver={kind="joint"}',
            "no 'joint'; known are auto, coherent, range-doppler, decoding",
        ),
        ('receiver={kind="paper", false_alarm_probability=1e-4}', "false_alarm_probability"),
        ('receiver={kind="range-doppler", greatest_speed="9 m/s"}', "greatest_speed"),
        ("receiver={quantile=0.7}", "quantile"),
    ],
)
def test_a_key_or_kind_that_no_receiver_has_is_refused(chirps, change, message):
    with pytest.raises(InputError, match=message):
        load_study(chirps, overrides=[change])


def test_ramps_that_the_named_receiver_cannot_read_are_refused_before_the_run(chirps):
    changes = ['receiver={kind="range-doppler"}', 'defaults.radar.waveform={kind="triangular"}']
    study = load_study(chirps, overrides=[*changes, 'radars.1.waveform={kind="triangular"}'])
    with pytest.raises(CapabilityError, match=r"radars\.0\.waveform.*differ in slope.*'coherent'"):
        check(study)


def test_chirps_of_one_direction_are_refused_for_the_papers_receiver(chirps):
    study = load_study(chirps, overrides=['receiver={kind="paper"}'])
    with pytest.raises(CapabilityError, match=r"radars\.0\.waveform.*one ramp.*'auto'"):
        check(study)


def test_the_limits_of_the_papers_receiver_are_said_before_the_run():
    """A cell of 0.17 m in 24 ms of equal ramps: 25 km/h; with f/b of 0.08 to 0.2 s less by far."""
    path = ROOT / "studies" / "quickstart.toml"
    for kind, limits in (("triangular", (24, 26)), ("diverse-triangular", (3, 12))):
        changes = ['receiver={kind="paper"}', f'radars.*.waveform={{kind="{kind}"}}']
        with pytest.warns(ModelWarning, match="noise alone exceeds its threshold") as caught:
            check(load_study(path, overrides=changes))
        said = " ".join(str(one.message) for one in caught)
        spread = int(re.search(r"faster than (\d+)", said)[1])
        assert limits[0] <= spread <= limits[1]


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_passes_its_check_and_says_which_receiver_it_has(name, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(template(name), encoding="utf-8")
    found = check(load_study(path))
    expected = "coherent" if name in ("street", "paper") else "range-doppler"
    assert found.radars[0].receiver == expected
    assert found.is_receiver_chosen
    if name != "paper":
        assert len(load_plan(path).points) > 1


@pytest.mark.parametrize(
    ("name", "shipped"), [("street", "quickstart.toml"), ("paper", "paper/street-diverse.toml")]
)
def test_a_template_is_the_shipped_study(name, shipped):
    assert template(name) == (ROOT / "studies" / shipped).read_text(encoding="utf-8")
