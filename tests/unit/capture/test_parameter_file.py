import math
import re
from dataclasses import fields
from pathlib import Path

import pytest

from polychirp.capture.parameter_file import TEMPLATE, parameters_from, read_parameters
from polychirp.capture.parameters import CaptureParameters
from polychirp.errors import InputError

STUDIES = Path(__file__).parents[3] / "studies" / "captures"


def table(**changes: object) -> dict[str, object]:
    """A file's keys and values, some of them changed."""
    return {
        "start_frequency": "77 GHz",
        "slope": "30 MHz/us",
        "idle_time": "10 us",
        "ramp_end_time": "40 us",
        "adc_start": "6 us",
        "num_ramps": 128,
        "sample_rate": "10 MS/s",
        "num_samples": 256,
        **changes,
    }


def test_values_are_read_in_si():
    read = parameters_from(table(spacing="2 mm", axes=["ramp", "fast"]), name="x.toml")
    assert read.slope == 30e12
    assert read.adc_start == pytest.approx(6e-6, rel=1e-15)
    assert read.spacing == pytest.approx(2e-3)
    assert read.axes == ("ramp", "fast")


def test_a_file_of_another_kind_has_the_known_keys_listed_once():
    """All its unknown keys are named, each on its line."""
    with pytest.raises(InputError) as caught:
        parameters_from(table(name="study", victims=[], slop=1, street={}), name="study.toml")
    said = str(caught.value)
    assert said.count("known are start_frequency, slope") == 1
    assert said.splitlines()[1:] == [
        "study.toml: victims: unknown key",
        "study.toml: slop: unknown key; did you mean 'slope'?",
        "study.toml: street: unknown key",
    ]


def test_the_template_reads(tmp_path: Path):
    path = tmp_path / "walk.toml"
    path.write_text(TEMPLATE, encoding="utf-8")
    assert read_parameters(path).num_transmitters == 2


def test_the_template_names_every_key_and_shows_the_defaults(tmp_path: Path):
    """With every comment mark before a key taken away, the values are what they are without."""
    path = tmp_path / "walk.toml"
    path.write_text(TEMPLATE, encoding="utf-8")
    plain = read_parameters(path)
    path.write_text(re.sub(r"(?m)^#(\w+ = )", r"\1", TEMPLATE), encoding="utf-8")
    full = read_parameters(path)
    named = set(re.findall(r"(?m)^#?(\w+) = ", TEMPLATE))
    assert named == {field.name for field in fields(CaptureParameters)}
    derived = {"highest_beat", "spacing", "num_frames", "device", "full_scale"}
    for name in named - derived:
        assert getattr(full, name) == getattr(plain, name), name
    assert full.highest_beat == pytest.approx(plain.usable_beat)
    assert full.full_scale == plain.stored_full_scale
    assert full.spacing == pytest.approx(plain.array.spacing, rel=0.01)


@pytest.mark.parametrize("path", sorted(STUDIES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_parameter_file_of_the_repository_reads(path: Path):
    assert read_parameters(path).range_resolution > 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"slope": 3e13}, "x.toml: slope: 30000000000000.0 needs a unit; write it like"),
        ({"slope": "30 us"}, "x.toml: slope: '30 us' is not a value in Hz/s"),
        ({"slope": "-30 MHz/us"}, "x.toml: slope: must be positive"),
        ({"slope": "30 MHz/s"}, "x.toml: slope: 3e-05 MHz/us is outside of 0.001 to 1000 MHz/us"),
        ({"slope": "1e4 MHz/us"}, "x.toml: slope: 1e+04 MHz/us is outside of 0.001 to 1000"),
        ({"spacing": "2 m"}, "x.toml: spacing: 2 m is more than 100 wavelengths, 0.3"),
        ({"slop": "30 MHz/us"}, "x.toml: slop: unknown key; did you mean 'slope'?"),
        ({"num_ramps": 12.5}, "x.toml: num_ramps: must be a whole number, not 12.5"),
        ({"num_ramps": True}, "x.toml: num_ramps: must be a whole number, not True"),
        ({"num_ramps": 1}, "x.toml: num_ramps: a frame needs at least two ramps"),
        ({"num_samples": 1}, "x.toml: num_samples: a ramp needs at least 2 samples"),
        ({"num_samples": 0}, "x.toml: num_samples: must be at least 1"),
        (
            {"num_ramps": 127, "num_transmitters": 2},
            "x.toml: num_ramps: 127 ramps cannot be shared",
        ),
        ({"conjugate": "yes"}, "x.toml: conjugate: must be true or false"),
        ({"full_scale": "1"}, "x.toml: full_scale: must be a number"),
        ({"sampling": "komplex"}, "x.toml: sampling: 'komplex' is not one of its values; did you"),
        ({"axes": "fast"}, "x.toml: axes: must be a list in square brackets"),
        ({"axes": ["ramp", "slow"]}, "x.toml: axes: 'slow' is not one of its values"),
        ({"axes": ["ramp"]}, "x.toml: axes: 'fast' is missing"),
        ({"axes": ["sweep", "fast"], "num_transmitters": 2}, "x.toml: axes: 'transmitter' is miss"),
        ({"axes": ["ramp", "fast"], "num_receivers": 4}, "x.toml: axes: 'receiver' is missing"),
        ({"axes": ["ramp", "sweep", "fast"]}, "x.toml: axes: 'sweep' is named twice"),
        ({"ramp_end_time": "30 us"}, "x.toml: ramp_end_time: the converter's last sample comes"),
        ({"adc_start": "-1 us"}, "x.toml: adc_start: cannot be negative"),
        ({"highest_beat": "0 Hz"}, "x.toml: highest_beat: must be positive"),
        ({"highest_beat": "1 Hz"}, "x.toml: highest_beat: 0.001 kHz is not more than half"),
        ({"full_scale": math.nan}, "x.toml: full_scale: is not a number; write one"),
        ({"sampling": "real", "conjugate": True}, "x.toml: conjugate: has no effect"),
        ({"channel_positions": [[0, 0], [1, 0]]}, "x.toml: channel_positions: an array of 1 chan"),
        ({"channel_positions": [[0, 0, 0]]}, "x.toml: channel_positions: every position is a pa"),
        ({"channel_positions": [[0, "1 m"]]}, "x.toml: channel_positions: must be a number"),
        ({"channel_positions": [[0, 1e9]]}, "x.toml: channel_positions: 1000000000.0 is too lar"),
        (
            {"channel_positions": [[0, 0]], "first_receiver": "left"},
            "x.toml: first_receiver: has no effect beside channel_positions",
        ),
    ],
)
def test_a_wrong_value_is_refused_with_its_place(changes: dict[str, object], message: str):
    with pytest.raises(InputError, match=re.escape(message)):
        parameters_from(table(**changes), name="x.toml")


def test_all_problems_come_at_once():
    with pytest.raises(InputError) as caught:
        parameters_from({"slope": 1}, name="x.toml")
    lines = str(caught.value).splitlines()
    assert lines[0].startswith("x.toml: slope: ")
    assert 'x.toml: start_frequency: is missing; give it, as in "79 GHz"' in lines
    assert "x.toml: num_ramps: is missing; give it" in lines


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"slope = ", "walk.toml: is not TOML"), (b"\xff\xfe", "walk.toml: is not text in UTF-8")],
)
def test_a_file_that_is_no_toml_is_refused(tmp_path: Path, content: bytes, message: str):
    path = tmp_path / "walk.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_parameters(path)


def test_a_missing_file_says_how_to_get_one(tmp_path: Path):
    with pytest.raises(InputError, match="--describe"):
        read_parameters(tmp_path / "walk.toml")


def test_what_the_ramps_resolve_follows_from_their_definition():
    """c/2B with B = slope · samples / rate; λ/2T; edge of the pass band at 0.9 of the rate."""
    read = parameters_from(table(num_transmitters=2), name="x.toml")
    bandwidth = 30e12 * 256 / 10e6
    assert read.range_resolution == pytest.approx(299_792_458 / (2 * bandwidth))
    assert read.greatest_range == pytest.approx(9e6 * 299_792_458 / (2 * 30e12))
    middle = 77e9 + 30e12 * (6e-6 + 12.75e-6)
    assert read.speed_span == pytest.approx(299_792_458 / middle / (2 * 100e-6))
    assert read.speed_resolution == pytest.approx(read.speed_span / 64)
