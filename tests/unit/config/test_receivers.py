"""Receivers in study files: a kind may be named, and is "auto" if none is."""

import tomllib
from pathlib import Path

import pytest

from polychirp.cli.init import TEMPLATES, template
from polychirp.config.dump import dump
from polychirp.config.load import load_study, study_of_tables
from polychirp.config.monte_carlo import load_plan
from polychirp.errors import CapabilityError, InputError
from polychirp.receiver.chain import Receiver
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
        ('receiver={kind="joint"}', Receiver()),
        ('receiver={kind="range-doppler", quantile=0.7}', RangeDoppler(quantile=0.7)),
        (
            'receiver={kind="coherent", dynamic_range="50 dB"}',
            CoherentReceiver(dynamic_range=1e5),
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
        ('receiver={kind="paper"}', "auto"),
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
    with pytest.raises(CapabilityError, match=r"radars\.0\.waveform.*differ in slope.*'joint'"):
        check(study)


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_passes_its_check_and_says_which_receiver_it_has(name, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(template(name), encoding="utf-8")
    found = check(load_study(path))
    expected = "joint" if name in ("street", "paper") else "range-doppler"
    assert found.radars[0].receiver == expected
    assert found.is_receiver_chosen
    if name != "paper":
        assert len(load_plan(path).points) > 1


@pytest.mark.parametrize(
    ("name", "shipped"), [("street", "quickstart.toml"), ("paper", "paper/street-diverse.toml")]
)
def test_a_template_is_the_shipped_study(name, shipped):
    assert template(name) == (ROOT / "studies" / shipped).read_text(encoding="utf-8")
