"""A bad study is refused before anything is computed: one sentence with its place, exit code 2."""

from pathlib import Path

import pytest

from polychirp.cli.app import main

GOOD = (Path(__file__).parents[2] / "studies" / "quickstart.toml").read_text(encoding="utf-8")


def in_file(old: str, new: str, sentence: str, *, name: str) -> object:
    """The good study with ``old`` replaced, and the start of the line that refuses it."""
    assert old in GOOD, old
    return pytest.param(GOOD.replace(old, new, 1), [], sentence, id=name)


def by_option(*options: str, sentence: str, name: str) -> object:
    """The good study with options that spoil it."""
    return pytest.param(GOOD, list(options), sentence, id=name)


def setting(change: str, sentence: str, *, name: str) -> object:
    """The good study with one value changed by ``--set``."""
    return by_option("--set", change, sentence=sentence, name=name)


WAVEFORM = "radars.0.waveform"
DEFAULT = "defaults.radar"
PLAIN = 'radars.0.waveform={ kind = "triangular", '
UNREADABLE = [
    in_file(
        '"79 GHz" #',
        '"79 ms" #',
        f"{DEFAULT}.waveform.start_frequency: '79 ms' is not a value in Hz",
        name="wrong unit",
    ),
    in_file(
        '"79 GHz" #',
        "79e9 #",
        f"{DEFAULT}.waveform.start_frequency: 79000000000.0 needs a unit",
        name="bare number",
    ),
    in_file(
        '"79 GHz" #',
        '"79" #',
        f"{DEFAULT}.waveform.start_frequency: '79' is not a value in Hz",
        name="number in quotes without a unit",
    ),
    in_file(
        '"1 MS/s"',
        '"1e999 MS/s"',
        f"{DEFAULT}.converter.sample_rate: '1e999 MS/s' is too large",
        name="number that is too large",
    ),
    in_file(
        "num_sweeps",
        "num_sweps",
        "num_sweps: unknown key; did you mean 'num_sweeps'?",
        name="unknown key",
    ),
    in_file(
        "sample_rate",
        "samplerate",
        f"{DEFAULT}.converter.samplerate: unknown key; did you mean",
        name="unknown key deep down",
    ),
    in_file(
        "[defaults.radar.converter]",
        "[defaults.radr.converter]",
        "defaults.radr: unknown key",
        name="defaults of something unknown",
    ),
    in_file(
        '"diverse-triangular"\nstart',
        '"diverse-triangle"\nstart',
        f"{DEFAULT}.waveform.kind: there is no 'diverse-triangle'; did you mean",
        name="misspelt kind",
    ),
    in_file('kind = "composite"', "", "tracer.kind: is missing", name="missing kind"),
    in_file(
        'kind = "composite"',
        'kind = "magic"',
        "tracer.kind: there is no 'magic'",
        name="unknown tracer",
    ),
    in_file(
        '["1 ms", "2 ms"]',
        '["2 ms", "1 ms"]',
        f"{DEFAULT}.waveform: a diverse triangle has limits of ramp_duration in",
        name="inverted limits",
    ),
    in_file(
        '["1 ms", "2 ms"]',
        '"1 ms"',
        f"{DEFAULT}.waveform.ramp_duration: must be a list",
        name="one value for limits",
    ),
    in_file(
        '["1 ms", "2 ms"]',
        '["1 ms"]',
        f"{DEFAULT}.waveform.ramp_duration.1: an entry is missing",
        name="one limit of two",
    ),
    in_file(
        '["800 MHz", "1 GHz"]',
        '["0 Hz", "1 GHz"]',
        f"{DEFAULT}.waveform: a diverse triangle needs a positive lower limit of bandwidth",
        name="zero lower limit",
    ),
    setting(
        PLAIN + 'bandwidth = "0 Hz" }',
        f"{WAVEFORM}: a triangle needs a positive bandwidth",
        name="zero bandwidth",
    ),
    setting(
        PLAIN + 'ramp_duration = "-1 ms" }',
        f"{WAVEFORM}: a triangle needs a positive ramp_duration",
        name="negative duration",
    ),
    setting(
        PLAIN + 'idle = "-1 us" }',
        f"{WAVEFORM}: a triangle cannot have a negative idle",
        name="overlapping ramps",
    ),
    setting(
        PLAIN + 'order = "up" }',
        f"{WAVEFORM}.order: 'up' is not one of its values",
        name="unknown order",
    ),
    setting(
        "radars.0.noise_figure=-4.5 dB",
        "radars.0: radar 'front' has a noise figure below 0 dB",
        name="negative noise figure",
    ),
    in_file(
        '"300 kHz"',
        '"800 kHz"',
        f"{DEFAULT}.if_filter: an IF filter's pass band must be",
        name="pass band above stop band",
    ),
    in_file(
        '"1 MS/s"',
        '"-1 MS/s"',
        f"{DEFAULT}.converter: a converter's sample rate must be",
        name="negative sample rate",
    ),
    in_file(
        "num_channels = 4",
        "num_channels = 0",
        f"{DEFAULT}.array: an array needs at least one",
        name="no channel",
    ),
    in_file(
        "num_channels = 4",
        "num_channels = 4.5",
        f"{DEFAULT}.array.num_channels: must be a whole number, not 4.5",
        name="half a channel",
    ),
    in_file(
        "seed = 1 ",
        'seed = "one" ',
        "seed: must be a whole number, not 'one'",
        name="seed that is text",
    ),
    in_file(
        "seed = 1 ",
        "seed = 1.5 ",
        "seed: must be a whole number, not 1.5",
        name="seed that is a fraction",
    ),
    in_file(
        "seed = 1 ",
        "seed = true ",
        "seed: must be a whole number, not true",
        name="seed that is true",
    ),
    in_file(
        'name = "quickstart"',
        "name = 3",
        "name: must be text in quotes, not 3",
        name="name that is a number",
    ),
    in_file(
        'victims = ["front"]',
        'victims = "front"',
        "victims: must be a list",
        name="victims that are text",
    ),
    in_file(
        'vehicle = "ego"\n', "", "radars.0.vehicle: is missing; give it", name="radar on no vehicle"
    ),
    in_file(
        'clock_offset = "0 ppm"',
        'clock_offset = "5e4 ppm"',
        "radars.1: radar 'other' has a clock offset of 50000 ppm",
        name="absurd clock",
    ),
    in_file(
        "= 1e-6 ",
        "= 2.0 ",
        "receiver: a receiver's false-alarm probability must lie",
        name="false-alarm probability above one",
    ),
    in_file(
        'kind = "blanking"',
        'kind = "blankng"',
        "receiver.mitigation.kind: ",
        name="misspelt mitigation",
    ),
    setting("radars.0.mount=3", "radars.0.mount: must be a table, not 3", name="mount as number"),
    setting(
        "radars.7.start_time=1 ms",
        "radars.7 does not exist; radars has 2 entries",
        name="--set of a radar that is not there",
    ),
    setting("seed.x=1", "seed is a value; it has no 'x'", name="--set through a value"),
    setting("seed", "'seed' is not PATH=VALUE; write it like", name="--set without a value"),
    by_option(
        "--seed",
        "one",
        sentence="seed: must be a whole number, not 'one'",
        name="--seed that is text",
    ),
    in_file("num_sweeps = 8", "num_sweeps == 8", "line 11, column 13: ", name="TOML syntax error"),
    in_file("num_sweeps = 8", "seed = 2", "line 11, column 9: ", name="key given twice"),
    in_file("[tracer]", "[tracer", "line 19, column 8: ", name="open bracket"),
    in_file(
        'name = "ahead"',
        'name = "ego"',
        "street: two things on the street are called 'ego'",
        name="two vehicles of one name",
    ),
    in_file(
        'x = "14 m"',
        'x = "2 m"',
        "street: vehicle 'ego' and vehicle 'ahead' overlap; move one of them",
        name="vehicle in a vehicle",
    ),
    in_file(
        'body = "van"',
        'body = "vam"',
        "street.vehicles.2.body: 'vam' is not one of its values; did you mean 'van'?",
        name="unknown body",
    ),
    in_file(
        'rcs = "0 dBsm"', 'rcs = "0 dB"', "street.points.0.rcs: '0 dB' is not", name="rcs in dB"
    ),
]

IMPOSSIBLE = [
    in_file(
        'name = "other"',
        'name = "front"',
        "radars.1.name: another radar has the name 'front'",
        name="two radars of one name",
    ),
    in_file(
        'vehicle = "ego"',
        'vehicle = "egp"',
        "radars.0.vehicle: there is no vehicle 'egp'; did you mean 'ego'?",
        name="radar on an unknown vehicle",
    ),
    in_file(
        'victims = ["front"]',
        'victims = ["frnt"]',
        "victims.0: there is no radar 'frnt'; did you mean 'front'?",
        name="unknown victim",
    ),
    in_file(
        'victims = ["front"]',
        'victims = ["front", "front"]',
        "victims.1: the list already has the name 'front'",
        name="victim named twice",
    ),
    in_file(
        "targets = []",
        'targets = ["truck"]',
        "targets.0: there is no vehicle or point 'truck'; known are ego",
        name="unknown target",
    ),
    setting(
        "radars=[]", "radars: there is none; write at least one [[radars]] table", name="no radars"
    ),
    in_file(
        "num_sweeps = 8",
        "num_sweeps = 0",
        "num_sweeps: is 0, so the frame is empty",
        name="empty frame",
    ),
    in_file("seed = 1 ", "seed = -1 ", "seed: is -1; use 0 or more", name="negative seed"),
    setting(
        "refresh_interval=0 s",
        "refresh_interval: is 0 s; use more than 0 s",
        name="scene never refreshed",
    ),
    setting("name=a/b", "name: must have a character, and no slash", name="name with a slash"),
    setting(
        PLAIN + 'ramp_duration = "15 us" }',
        f"{WAVEFORM}: ramp 0 lasts 15 µs, shorter than its converter's start (10 µs) and "
        "margin (10 µs) and two samples; lengthen the ramp or shorten them",
        name="ramp shorter than its ADC window",
    ),
    setting(
        "radars.0.converter.start=3 ms",
        f"{WAVEFORM}: ramp 12 lasts 1122 µs, shorter",
        name="window that starts after its ramp's end",
    ),
    setting(
        'radars.0.mount={ x = "0 m", z = "0.7 m" }',
        "radars.0.mount: radar 'front' is inside 'ego'; move its mount outwards",
        name="radar inside its own body",
    ),
    setting(
        "radars.0.mount.x=14 m",
        "radars.0.mount: radar 'front' is inside 'ahead'; move its mount outwards",
        name="radar inside another body",
    ),
    setting(
        "radars.0.mount.z=-1 m",
        "radars.0.mount: radar 'front' is below 'road'",
        name="radar below the road",
    ),
    setting(
        "street.vehicles.2.mesh=no/such.glb",
        "street.vehicles.2.mesh: there is no mesh file '",
        name="missing mesh file",
    ),
    setting(
        "street.road.material=tar",
        "street: 'road' cannot be traced: there is no material",
        name="unknown material",
    ),
]


def refuse(path: Path, options: list[str], capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Lines that `polychirp check` refuses a file with."""
    assert main(["check", str(path), *options]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    return shown.err.splitlines()


@pytest.mark.parametrize(("text", "options", "sentence"), UNREADABLE)
def test_a_study_that_cannot_be_read_is_one_sentence(tmp_path, capsys, text, options, sentence):
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    header, line = refuse(path, options, capsys)
    assert header == f"polychirp: this study cannot be read: {path}"
    assert line.startswith(f"  {sentence}")


@pytest.mark.parametrize(("text", "options", "sentence"), IMPOSSIBLE)
def test_a_study_that_cannot_run_is_one_sentence(tmp_path, capsys, text, options, sentence):
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    header, line = refuse(path, options, capsys)
    assert header.startswith("polychirp: this study cannot run: ")
    assert line.startswith(f"  {sentence}")


def test_a_file_that_is_not_there_is_one_sentence(tmp_path, capsys):
    (line,) = refuse(tmp_path / "none.toml", [], capsys)
    assert line.startswith(f"polychirp: there is no file '{tmp_path / 'none.toml'}'")


def test_a_folder_is_one_sentence(tmp_path, capsys):
    (line,) = refuse(tmp_path, [], capsys)
    assert line.endswith("is a folder; name the study file in it")


def test_bytes_that_are_no_text_are_one_sentence(tmp_path, capsys):
    path = tmp_path / "bad.toml"
    path.write_bytes(b"\xff\xfe\x00")
    (line,) = refuse(path, [], capsys)
    assert line.endswith("is not a text file in UTF-8; a study is TOML text")


def test_a_mesh_file_is_looked_for_beside_the_study(tmp_path, capsys):
    path = tmp_path / "deep" / "bad.toml"
    path.parent.mkdir()
    path.write_text(GOOD.replace('body = "van"', 'mesh = "no.glb"'), encoding="utf-8")
    _, line = refuse(path, [], capsys)
    assert f"there is no mesh file '{tmp_path / 'deep' / 'no.glb'}'" in line


def test_all_problems_of_a_file_come_together(tmp_path, capsys):
    path = tmp_path / "bad.toml"
    path.write_text(GOOD.replace("seed = 1 ", "sed = 1 ").replace('"20 m"', '"20 s"'), "utf-8")
    _, *lines = refuse(path, [], capsys)
    assert [line.partition(":")[0].strip() for line in lines] == ["street.vehicles.1.x", "sed"]


def test_a_receiver_that_asks_for_what_its_radar_cannot_sample_is_refused_by_physics(
    tmp_path, capsys
):
    """On a ramp of 1 GHz/ms, echoes from 300 m beat at 2 MHz: beyond a converter of 1 MS/s."""
    path = tmp_path / "bad.toml"
    path.write_text(GOOD, encoding="utf-8")
    assert main(["check", str(path), "--set", "receiver.greatest_range=300 m"]) == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("polychirp: radars.0: echoes from 300 m")


def test_run_refuses_before_it_computes(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("bad.toml").write_text(GOOD.replace('vehicle = "ego"', 'vehicle = "egp"'), "utf-8")
    assert main(["run", "bad.toml"]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]
    assert "did you mean 'ego'?" in capsys.readouterr().err
