"""Reading specs: problems have a place and a way out; defaults are merged; nothing is guessed."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from polychirp.config.dump import dump
from polychirp.config.load import build, read_toml, study_of_tables, with_defaults
from polychirp.errors import InputError
from polychirp.model.radar import Radar
from polychirp.spec import Spec
from polychirp.units import Ratio, Seconds
from polychirp.waveform import AnyWaveform, DiverseTriangular, Triangular


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench(Spec):
    """A spec with one of each sort of field."""

    name: str
    waveform: AnyWaveform
    others: tuple[AnyWaveform, ...] = ()
    window: tuple[Seconds, Seconds] | None = None
    gain: Ratio = 1.0
    count: int = 1
    share: float = 0.5
    is_on: bool = False


def refusal(**changes: object) -> list[str]:
    with pytest.raises(InputError) as caught:
        build(Bench, {"name": "b", "waveform": {"kind": "triangular"}, **changes})
    return str(caught.value).splitlines()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"nam": "x"}, "nam: unknown key; did you mean 'name'?"),
        ({"zzz": 1}, "zzz: unknown key; known are name, waveform, others"),
        ({"name": 3}, "name: must be text in quotes, not 3"),
        ({"count": "3"}, "count: must be a whole number, not '3'"),
        ({"count": 1.5}, "count: must be a whole number, not 1.5"),
        ({"count": True}, "count: must be a whole number, not true"),
        ({"share": "half"}, "share: must be a number, not 'half'"),
        ({"is_on": 1}, "is_on: must be true or false, not 1"),
        ({"gain": 3}, "gain: 3 needs a unit; write it like '4.5 dB'"),
        ({"gain": "3 Hz"}, "gain: '3 Hz' is not a value in dB"),
        ({"window": "1 ms"}, "window: must be a list in square brackets, not '1 ms'"),
        ({"window": ["1 ms"]}, "window.1: an entry is missing"),
        ({"window": ["1 ms", "2 ms", "3 ms"]}, "window: has 3 entries; give at most 2"),
        ({"waveform": "triangular"}, "waveform: must be a table, not 'triangular'"),
        ({"waveform": {}}, "waveform.kind: is missing"),
        ({"waveform": {"kind": "triangle"}}, "waveform.kind: there is no 'triangle'; did you mean"),
        ({"waveform": {"kind": 3}}, "waveform.kind: there is no '3'; known are sawtooth"),
        (
            {"waveform": {"kind": "triangular", "idl": "1 s"}},
            "waveform.idl: unknown key; did you mean 'idle'?",
        ),
        (
            # "direction" only shares its ending
            {"waveform": {"kind": "sawtooth", "repetition": "1 ms"}},
            "waveform.repetition: unknown key; known are kind, start_frequency, bandwidth",
        ),
        (
            {"waveform": {"kind": "triangular", "order": "up-frist"}},
            "waveform.order: 'up-frist' is not one of its values; did you mean 'up-first'?",
        ),
        (
            {"others": [{"kind": "sawtooth"}, {"kind": "triangular", "idle": 3}]},
            "others.1.idle: 3 needs a unit",
        ),
    ],
)
def test_a_problem_is_one_sentence_with_its_place(changes, sentence):
    (line,) = refusal(**changes)
    assert line.startswith(sentence)


def test_all_problems_are_told_together():
    lines = refusal(count="3", gain=3, nam=1)
    assert [line.partition(":")[0] for line in lines] == ["gain", "count", "nam"]


def test_a_missing_field_is_told():
    with pytest.raises(InputError, match="waveform: is missing; give it"):
        build(Bench, {"name": "b"})


def test_what_a_constructor_refuses_has_its_place():
    (line,) = refusal(waveform={"kind": "triangular", "bandwidth": "0 Hz"})
    assert line == "waveform: a triangle needs a positive bandwidth, not 0"


def test_a_constructor_further_down_has_its_place_too():
    with pytest.raises(InputError, match=r"^if_filter: an IF filter's pass band"):
        build(Radar, {"name": "front", "if_filter": {"passband": "1 GHz"}})


def test_defaults_fill_what_a_radar_does_not_say():
    data = {
        "defaults": {"radar": {"array": {"num_channels": 8, "spacing": "2 mm"}, "vehicle": "v"}},
        "radars": [{"name": "a", "array": {"num_channels": 2}}, {"name": "b"}],
    }
    assert with_defaults(data)["radars"] == [
        {"name": "a", "array": {"num_channels": 2, "spacing": "2 mm"}, "vehicle": "v"},
        {"name": "b", "array": {"num_channels": 8, "spacing": "2 mm"}, "vehicle": "v"},
    ]


def test_a_radar_with_another_kind_takes_nothing_from_the_default_kind():
    shared = {"waveform": {"kind": "triangular", "order": "down-first"}}
    data = {
        "defaults": {"radar": shared},
        "radars": [{"waveform": {"kind": "sawtooth"}}, {"waveform": {"idle": "1 us"}}],
    }
    sawtooth, triangular = with_defaults(data)["radars"]
    assert sawtooth == {"waveform": {"kind": "sawtooth"}}
    assert triangular == {"waveform": {**shared["waveform"], "idle": "1 us"}}


@pytest.mark.parametrize(
    ("defaults", "sentence"),
    [
        (3, "defaults: must be a table"),
        ({"radr": {}}, "defaults.radr: unknown key"),
        ({"radar": 3}, "defaults.radar: must be a table"),
    ],
)
def test_defaults_of_something_else_are_refused(defaults, sentence):
    with pytest.raises(InputError, match=sentence):
        with_defaults({"defaults": defaults})


def test_a_syntax_error_has_its_line(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text('name = "x"\nseed == 3\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"bad\.toml\n  line 2, column \d+: "):
        read_toml(path)


def test_what_is_dumped_is_read_back():
    bench = Bench(
        name='a "quoted" ☺ \\ name\n',
        waveform=Triangular(ramp_duration=1.234567e-3, order="down-first"),
        others=(DiverseTriangular(random_order=True), Triangular()),
        window=(0.0, 1e-9),
        gain=10.0**1.55,
        share=1e-7,
        is_on=True,
    )
    import tomllib

    assert build(Bench, tomllib.loads(dump(bench))) == bench


def test_a_dump_leaves_out_defaults():
    assert dump(Bench(name="b", waveform=Triangular())).splitlines() == [
        'name = "b"',
        "",
        "[waveform]",
        'kind = "triangular"',
    ]


def test_tables_that_only_a_file_has_are_among_the_known_keys():
    """They are taken out before the study is made."""
    with pytest.raises(InputError, match="montecarlo: unknown key; did you mean 'monte_carlo'"):
        study_of_tables({"name": "x", "montecarlo": {}}, folder=Path())


def test_an_unknown_key_that_is_also_a_kind_keeps_its_place():
    line = refusal(waveform={"kind": "triangular", "triangular": 3})[-1]
    assert line.strip().startswith("waveform.triangular: unknown key; known are kind, ")
