"""``--set a.b.0.c=value``."""

import pytest

from polychirp.config.override import apply_override, read_value
from polychirp.errors import InputError


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3", 3),
        (" true ", True),
        ('"20 us"', "20 us"),
        ("20 us", "20 us"),
        ('["1 ms", "2 ms"]', ["1 ms", "2 ms"]),
        ("front", "front"),
        ("", ""),
        ("1\nseed = 2", "1\nseed = 2"),
        ('{ kind = "free-space" }', {"kind": "free-space"}),
    ],
)
def test_a_value_is_toml_where_it_can_be_and_text_otherwise(text, value):
    assert read_value(text) == value


def test_a_value_goes_where_its_path_leads():
    data = {"radars": [{"name": "a"}, {"name": "b", "converter": {"start": "1 us"}}]}
    apply_override(data, "radars.1.converter.start=20 us")
    apply_override(data, "radars.0.waveform.kind=triangular")
    assert data["radars"][1]["converter"] == {"start": "20 us"}
    assert data["radars"][0]["waveform"] == {"kind": "triangular"}


def test_an_entry_of_a_list_can_be_replaced():
    data = {"victims": ["a", "b"]}
    apply_override(data, "victims.1=c")
    assert data == {"victims": ["a", "c"]}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("seed", "is not PATH=VALUE; write it like"),
        ("=3", "is not PATH=VALUE; write it like"),
        ("a..b=3", "is not PATH=VALUE; write it like"),
        ("radars.2.name=x", "radars.2 does not exist; radars has 1 entries"),
        ("radars.frnt.name=x", "radars.frnt does not exist"),
        ("radars.1=x", "radars.1 does not exist"),
        ("seed.x=1", "seed is a value; it has no 'x'"),
        ("seed.x.y=1", "seed is a value; it has no 'x'"),
    ],
)
def test_a_change_that_leads_nowhere_is_refused(change, sentence):
    with pytest.raises(InputError, match=sentence):
        apply_override({"seed": 1, "radars": [{"name": "front"}]}, change)


@pytest.mark.parametrize(
    ("value", "example"),
    [("{kind=blanking}", 'as in {kind="blanking"}'), (" [1 ms, 2 ms]", 'as in ["1 ms", "2 ms"]')],
)
def test_what_begins_like_a_table_or_a_list_but_is_none_is_refused(value, example):
    """As text it would only be said not to be a table."""
    with pytest.raises(InputError, match=r"^receiver.mitigation: '.*' is not TOML \(") as told:
        apply_override({}, f"receiver.mitigation={value}")
    assert example in str(told.value)
