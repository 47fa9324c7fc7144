"""A front end in a study file, and front ends that are refused."""

import tomllib

import pytest

from polychirp.config.dump import dump
from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.model.front_end import (
    Digitiser,
    FrontEnd,
    GainControl,
    HighPass,
    IqImbalance,
    Offset,
)
from polychirp.model.if_frame import parts_of
from polychirp.model.leakage import Bumper, Leakage
from polychirp.model.radar import Radar
from polychirp.units import from_db

WRITTEN = """
name = "front"

[front_end]
high_pass = {corners = ["175 kHz", "350 kHz"]}
imbalance = {gain = "0.5 dB", phase = "1 deg"}
offset = {power = "-60 dBm"}

[front_end.digitiser]
full_scale = "-10 dBm"
bits = 12
gain_control = {step = "2 dB", greatest = "30 dB"}

[[leakage]]
isolation = "35 dB"
delay = "0.3 ns"

[bumper]
distance = "5 cm"
reflection = "-15 dB"
"""


def test_a_study_file_says_what_a_front_end_does():
    radar = build(Radar, tomllib.loads(WRITTEN))
    assert radar.front_end.high_pass == HighPass(corners=(175e3, 350e3))
    assert radar.front_end.imbalance.gain == pytest.approx(from_db(0.5))
    assert radar.front_end.offset.power == pytest.approx(1e-9)
    assert radar.front_end.digitiser.bits == 12
    assert radar.front_end.digitiser.full_scale == pytest.approx(1e-4)
    assert radar.front_end.digitiser.gain_control.greatest == pytest.approx(1e3)
    assert radar.leakage == (Leakage(isolation=from_db(35.0), delay=0.3e-9),)
    assert radar.bumper == Bumper(distance=0.05, reflection=from_db(-15.0))


def test_what_is_written_reads_back():
    radar = build(Radar, tomllib.loads(WRITTEN))
    assert build(Radar, tomllib.loads(dump(radar))) == radar
    assert dump(Radar(name="front")) == 'name = "front"'


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        ({}, ()),
        ({"leakage": (Leakage(isolation=1e3),)}, ("leakage",)),
        ({"bumper": Bumper(distance=0.05)}, ("leakage",)),
        ({"front_end": FrontEnd(high_pass=HighPass(corners=(1e5,)))}, ()),
        ({"front_end": FrontEnd(imbalance=IqImbalance(phase=0.1))}, ()),
        ({"front_end": FrontEnd(offset=Offset(power=1e-9))}, ("distortion",)),
        ({"front_end": FrontEnd(digitiser=Digitiser(full_scale=1e-3))}, ("distortion",)),
    ],
)
def test_a_part_is_there_only_where_something_makes_it(fields, parts):
    always = ("echo", "multipath", "direct", "indirect", "noise")
    assert parts_of(Radar(name="front", **fields)) == (*always, *parts)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HighPass(corners=()), "one or two corners"),
        (lambda: HighPass(corners=(1e5, 2e5, 3e5)), "one or two corners"),
        (lambda: HighPass(corners=(0.0,)), "positive frequency"),
        (lambda: IqImbalance(gain=0.0), "positive gain"),
        (lambda: IqImbalance(phase=1.6), "less than 90°"),
        (lambda: Offset(power=0.0), "leave it out"),
        (lambda: GainControl(step=1.0), "step must be above 0 dB"),
        (lambda: GainControl(least=10.0, greatest=1.0), "must not exceed"),
        (lambda: GainControl(back_off=0.5), "cannot be below 0 dB"),
        (lambda: GainControl(num_ramps=0), "one former ramp or more"),
        (lambda: Digitiser(full_scale=0.0), "positive full scale"),
        (lambda: Digitiser(full_scale=1.0, bits=1), "give it 2 to 32"),
        (lambda: Digitiser(full_scale=1.0, softness=0.0), "1 is soft"),
    ],
)
def test_nonsense_is_refused_with_what_would_work(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_a_study_file_is_told_of_nonsense_with_its_place():
    with pytest.raises(InputError, match=r"front_end\.digitiser.*give it 2 to 32"):
        build(
            Radar,
            {"name": "a", "front_end": {"digitiser": {"full_scale": "0 dBm", "bits": 64}}},
        )
    with pytest.raises(InputError, match=r"front_end\.high_pass\.corners\.0: 3 needs a unit"):
        build(Radar, {"name": "a", "front_end": {"high_pass": {"corners": [3]}}})
