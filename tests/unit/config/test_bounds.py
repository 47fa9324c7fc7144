"""Absurd studies are refused where they are read or checked, in one sentence, before any work."""

import time
import tomllib
from pathlib import Path

import pytest

from polychirp.bounded_text import toml_tables
from polychirp.config.load import load_study
from polychirp.config.monte_carlo import load_plan
from polychirp.errors import InputError, PolychirpError
from polychirp.study.check import check
from polychirp.units import Between, Unit

GOOD = """
name = "small"
num_sweeps = 4
[tracer]
kind = "free-space"
[[street.vehicles]]
name = "ego"
x = "0 m"
y = "-1.75 m"
coarseness = 4.0
max_edge = "0.2 m"
[[street.points]]
name = "post"
x = "12 m"
y = "1 m"
z = "0.5 m"
rcs = "10 dBsm"
[[radars]]
name = "front"
vehicle = "ego"
mount = { x = "2.4 m", z = "0.5 m" }
waveform = { kind = "triangular", bandwidth = "1 GHz", ramp_duration = "1 ms" }
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "small.toml").write_text(GOOD, encoding="utf-8")
    return tmp_path / "small.toml"


def refusal(path: Path, *changes: str) -> str:
    """Sentence with which a study is refused, within some seconds."""
    start = time.monotonic()
    with pytest.raises(PolychirpError) as raised:
        check(load_study(path, overrides=changes))
    assert time.monotonic() - start < 20.0
    text = str(raised.value)
    assert len(text) < 600
    return text


def test_the_study_itself_is_fine(path):
    assert check(load_study(path)).victims == ("front",)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("street.vehicles.0.speed=1e9 m/s", "outside of -300 m/s to 300 m/s; give a value between"),
        ("street.points.0.velocity=['0 m/s', '4e5 km/h', '0 m/s']", "outside of -300 m/s"),
        ("receiver.greatest_speed=1e300 m/s", "outside of -300 m/s to 300 m/s"),
        ("radars.0.mount.x=1e300 m", "outside of -1000 km to 1000 km"),
        ("radars.0.transmit_power=3000 dBm", "outside of 0 W to 90 dBm"),
        ("radars.0.noise_figure=5000 dB", "'5000 dB' is too large to be a number"),
        ("radars.0.start_time=1e300 s", "outside of -1000 s to 1000 s"),
        ("radars.0.converter.sample_rate=1e300 S/s", "outside of -1000 GS/s to 1000 GS/s"),
        ("radars.0.if_filter.passband=1e-300 kHz", "outside of 1 Hz to 1000 GHz"),
        ("radars.0.array.num_transmitters=1000000", "1000000 is too large; use at most 1024"),
        ("radars.0.array.num_channels=1000000", "1000000 is too large; use at most 1024"),
        ("num_sweeps=" + "1" + 30 * "0", "num_sweeps: 1" + 30 * "0" + " is too large"),
        ("seed=" + 4000 * "9", "seed: a number of 13288 bits is too large"),
        ("receiver.most_detections=1000000000", "is too large; use at most 100000"),
        ("receiver.mitigation={ kind = 'blanking', guard = '1e300 s' }", "outside of -1000 s"),
        ("receiver.mitigation={ kind = 'imat', iterations = 1000000000 }", "is too large"),
        ("receiver.mitigation={ kind = 'chirp-subtraction', least_sweep = 1e300 }", "is too large"),
        ("radars.0.waveform={ kind = 'pmcw', periods = 1000000000 }", "use at most 10000"),
        ("radars.0.waveform={ kind = 'noise', periods = 1000000000 }", "use at most 10000"),
        ("radars.0.coding={ kind = 'doppler-division', num_bands = 1000000000 }", "at most 1024"),
        ("street.vehicles.0.max_edge=1e-300 m", "too many facets; use at least 5 mm"),
        ("street.vehicles.0.coarseness=1e-9", "too many facets"),
        (
            "street.trees=[{name='t', x='9 m', y='9 m', height='3 km', crown_radius='1 km'}]",
            "100 m",
        ),
        ("street.road={ length = '1e4 km', width = '7 m' }", "outside of 0 m to 10 km"),
        ("name=" + 20 * "[" + "1" + 20 * "]", "name: must be text"),
        ("name=" + 5000 * "[" + 5000 * "]", "nested more than 32 levels"),
        ("traffic={ seen_from = 'ego', num_targets = 1000000000 }", "use at most 1000"),
        ("traffic={ seen_from = 'ego', num_targets = 1000 }", "there is no room for 1000 targets"),
    ],
)
def test_an_absurd_value_is_refused_with_its_bound(path, change, sentence):
    assert sentence in refusal(path, change)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("receiver.least_range=29.9999 m", "less than half a range cell"),
        ("receiver.false_alarm_probability=1e-300", "must lie between 1e-12 and 0.1"),
        (
            "radars.0.if_filter={ passband = '300 kHz', stopband = '300.0000001 kHz' }",
            "its response lasts",
        ),
        ("refresh_interval=1e-300 s", r"times in .* s, more than 20000; use a longer one"),
        ("num_sweeps=1000000", "the range-rate map of .* takes .* GiB of memory.*fewer sweeps"),
        ("radars.0.converter.sample_rate=1000 GS/s", "the frame of 'front' takes"),
    ],
)
def test_what_run_cannot_do_is_refused_by_check(path, change, sentence):
    import re

    assert re.search(sentence, refusal(path, change))


def test_a_negative_seed_is_refused_with_traffic_too(path):
    text = refusal(path, "seed=-1", "traffic={ seen_from = 'ego', num_targets = 2 }")
    assert "seed: is -1; use 0 or more" in text


@pytest.mark.parametrize("frequency", ["0 Hz", "-1 GHz"])
def test_a_tracer_without_a_positive_frequency_is_refused(path, frequency):
    """It ended with a division by zero or a logarithm of a negative number."""
    assert "tracer.frequency: is " in refusal(path, f"tracer.frequency={frequency}")


@pytest.mark.parametrize(
    "key", [".".join(10_000 * "a"), '"a"' + 10_000 * '."a"', 5000 * "a . " + "a"]
)
@pytest.mark.parametrize("form", ["{} = 1\n", "[{}]\n", "[[{}]]\n", "x = {{ {} = 1 }}\n"])
def test_keys_of_many_parts_are_refused_at_once(path, key, form):
    path.write_text(form.format(key) + GOOD, encoding="utf-8")
    assert "nested more than 32 levels deep" in refusal(path)


@pytest.mark.parametrize(
    "line",
    [
        "# {0}",
        'text = "{0}"',
        'text = "\\"{0}"',
        "text = '{0}'",
        'text = """\n{0}"""""',
        "text = '''\n{0}'''''",
        'text = "# {0}" # {0}',
    ],
)
def test_many_parts_in_a_comment_or_text_are_no_key(line):
    text = line.format(".".join(40 * "a"))
    assert toml_tables(text) == tomllib.loads(text)


@pytest.mark.parametrize(
    "line",
    [
        'text = "#"\n{0} = 1',
        'text = """a"""""\n{0} = 1',
        'x = {{ text = """a"""", {0} = 1, more = "" }}',
        "x = {{ text = '''a'''', {0} = 1, more = '' }}",
        '"\\"".{0} = 1',
        "# it's\n{0} = 1",
    ],
)
def test_texts_and_comments_hide_no_key_of_many_parts(line):
    with pytest.raises(InputError, match="nested more than 32 levels deep"):
        toml_tables(line.format(".".join(40 * "a")))


def test_a_file_that_is_no_study_by_its_size_is_refused(path):
    path.write_text(GOOD + 20_000_000 * "#", encoding="utf-8")
    assert "is larger than 16 MiB" in refusal(path)


@pytest.mark.parametrize(
    "change", ["²=1", "radars.²=1", f"radars.{5000 * '9'}=1", 3000 * "a." + "a=1"]
)
def test_a_path_that_is_none_is_refused(path, change):
    assert "is not a path of keys; write it like" in refusal(path, change)


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        (f"trials = {2**63}", "is too large; use at most 1000000"),
        ("trials = 1000000\ngrid = { seed_of_street = [1] }", "unknown key"),
        ("trials = 1000000\ngrid = { num_sweeps = [" + "4," * 11 + "] }", "twice"),
        (
            "trials = 1000000\ngrid = { num_sweeps = [4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14] }",
            "1000000 at every point are 11000000 trials, more than 10000000",
        ),
        (
            "trials = 1\ngrid = { "
            + ", ".join(f"{axis} = {[*range(10)]}" for axis in "abcdefghij")
            + " }",
            "the grid has 1e.10 points, more than 10000",
        ),
    ],
)
def test_too_many_trials_or_points_are_refused(path, table, sentence):
    path.write_text(GOOD + f"[monte_carlo]\n{table}\n", encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        load_plan(path)


def test_the_bounds_of_every_unit_are_values_of_it():
    from polychirp.units import _PLAUSIBLE, _READERS

    assert _PLAUSIBLE.keys() == _READERS.keys()
    for symbol in _PLAUSIBLE:
        unit = Unit(symbol)
        assert unit.parse(unit.bounds[0]) < unit.parse(unit.example) < unit.parse(unit.bounds[1])


def test_a_number_below_its_bound_is_refused():
    with pytest.raises(InputError, match=r"0\.1 is too small; use at least 1"):
        Between(least=1, greatest=2).checked(0.1)
