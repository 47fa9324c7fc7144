"""``polychirp process``: a point written as a capture, a real capture, and captures that fail."""

import csv
import errno
import json
import os
from pathlib import Path

import numpy as np
import pytest
import zarr

from polychirp.capture.parameter_file import TEMPLATE, read_parameters
from polychirp.capture.recording import open_numpy
from polychirp.cli.app import main
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.range_doppler.chain import RangeDoppler
from tests.support.dca1000 import write_raw

ROOT = Path(__file__).parents[2]
REAL = ROOT / ".." / "shared" / "data" / "openradar" / "doppler_example_1.npy"
REAL_PARAMETERS = ROOT / "studies" / "captures" / "openradar-doppler-example-1.toml"

DISTANCE, RANGE_RATE = 14.0, -4.0

needs_real = pytest.mark.skipif(
    not REAL.exists(), reason="the recording doppler_example_1.npy of OpenRadar is not here"
)


def point(frames: int) -> np.ndarray:
    """Frames ``(frame, receiver, ramp, fast)`` of a point straight ahead, by the template's ramps.

    y = tx · conj(rx), with the phase of the delay at the time of each sample; range refers to the
    middle of the frame.
    """
    ramp, fast = np.arange(128)[:, None], np.arange(256)
    elapsed = 6e-6 + fast / 10e6
    time = ramp * 50e-6 + elapsed
    delay = 2 * (DISTANCE + RANGE_RATE * (time - 64 * 50e-6)) / SPEED_OF_LIGHT
    samples = 300 * np.exp(2j * np.pi * (77e9 + 30e12 * (elapsed - delay / 2)) * delay)
    random = np.random.default_rng(1)
    noise = random.normal(scale=100, size=(2, frames, 4, 128, 256))
    return samples + noise[0] + 1j * noise[1]


@pytest.fixture
def raw(tmp_path: Path) -> Path:
    """A raw capture of two frames with its parameters."""
    write_raw(tmp_path / "walk.bin", point(2), device="xwr16xx", is_complex=True)
    text = TEMPLATE.replace('#device = "xwr16xx"', 'device = "xwr16xx"')
    (tmp_path / "walk.toml").write_text(text, encoding="utf-8")
    return tmp_path / "walk.bin"


def test_a_point_written_by_the_ti_writer_is_found(raw: Path, capsys: pytest.CaptureFixture[str]):
    out = raw.parent / "results"
    assert main(["process", str(raw), "--out", str(out), "--pfa", "1e-8", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record == json.loads((out / "results.json").read_text(encoding="utf-8"))
    assert record["ground_truth"] is None
    assert [frame["frame"] for frame in record["frames"]] == [0, 1]
    for frame in record["frames"]:
        (found,) = frame["detections"]
        assert found["range_m"] == pytest.approx(DISTANCE, abs=0.01)
        assert found["range_rate_m_per_s"] == pytest.approx(RANGE_RATE, abs=0.01)
        assert found["azimuth_rad"] == pytest.approx(0.0, abs=0.005)
        assert (out / frame["picture"]).read_bytes().startswith(b"\x89PNG")
        assert (out / frame["map"]).read_text(encoding="utf-8").startswith("range_m,")
    with (out / "detections.csv").open(encoding="utf-8") as file:
        assert [float(row["range_m"]) for row in csv.DictReader(file)] == [
            frame["detections"][0]["range_m"] for frame in record["frames"]
        ]


PROFILE = """\
dfeDataOutputMode 1
channelCfg 15 5 0
adcCfg 2 1
profileCfg 0 77 10 6 40 0 0 30 0 256 10000 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 4
frameCfg 0 1 64 0 40 1 0
"""
"""Commands of the mmWave SDK for the ramps of the template."""


def test_a_profile_of_tis_tools_gives_what_the_same_parameters_give(
    raw: Path, capsys: pytest.CaptureFixture[str]
):
    """The template's ramps; 0.9 of 10 MS/s is its highest beat."""
    profile = raw.parent / "radar.cfg"
    profile.write_text(PROFILE, encoding="utf-8")
    options = ["process", str(raw), "--pfa", "1e-8", "--json", "--out", str(raw.parent / "results")]
    assert main(options) == 0
    expected = json.loads(capsys.readouterr().out)
    given = ["--params", str(profile), "--set", "device=xwr16xx"]
    assert main([*options, *given]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out) == expected
    assert "where the 2 transmitters are" in printed.err
    assert main([*options, *given, "--set", "transmitter_positions=[[0, 0], [4, 0]]"]) == 0
    placed = capsys.readouterr()
    assert "note" not in placed.err
    (found,) = json.loads(placed.out)["frames"][0]["detections"]
    assert found["range_m"] == pytest.approx(DISTANCE, abs=0.01)


def test_azimuths_of_two_receivers_of_a_board_need_the_places_of_its_transmitters(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """Transmitters of a board are four receivers apart, also if only two receivers are on."""
    turn = np.exp(-1j * np.pi * 0.3 * np.array([0, 1]))[:, None, None]  # of a sine of 0.3
    taken = np.exp(-1j * np.pi * 0.3 * 4 * (np.arange(128) % 2))[:, None]
    write_raw(
        tmp_path / "walk.bin",
        point(1)[:, :2] * turn * taken,
        device="xwr16xx",
        is_complex=True,
    )
    profile = tmp_path / "radar.cfg"
    profile.write_text(PROFILE.replace("channelCfg 15", "channelCfg 3"), encoding="utf-8")
    options = ["process", str(tmp_path / "walk.bin"), "--params", str(profile), "--pfa", "1e-8"]
    options += ["--set", "device=xwr16xx", "--json", "--out", str(tmp_path / "results")]
    assert main(options) == 0
    note = "need --set transmitter_positions=[[0,0],[4,0]], and azimuths are wrong without it"
    assert note in capsys.readouterr().err
    assert main([*options, "--set", "transmitter_positions=[[0,0],[4,0]]"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["frames"][0]["detections"]
    assert np.sin(found["azimuth_rad"]) == pytest.approx(0.3, abs=0.01)


def test_a_profile_that_sends_q_first_is_obeyed_and_told(
    raw: Path, capsys: pytest.CaptureFixture[str]
):
    """Q and I change places in the recording; read in the other order, the point is elsewhere."""
    swapped = point(2).imag + 1j * point(2).real
    write_raw(raw, swapped, device="xwr16xx", is_complex=True)
    profile = raw.parent / "radar.cfg"
    profile.write_text(PROFILE + "adcbufCfg -1 0 1 1 1\n", encoding="utf-8")
    options = ["process", str(raw), "--pfa", "1e-8", "--json", "--out", str(raw.parent / "results")]
    options += ["--params", str(profile), "--set", "device=xwr16xx"]
    assert main(options) == 0
    printed = capsys.readouterr()
    assert "radar.cfg says that Q was sent before I" in printed.err
    (found,) = json.loads(printed.out)["frames"][0]["detections"]
    assert found["range_m"] == pytest.approx(DISTANCE, abs=0.01)
    assert found["range_rate_m_per_s"] == pytest.approx(RANGE_RATE, abs=0.01)
    assert main([*options, "--set", "conjugate=false"]) == 0
    printed = capsys.readouterr()
    assert "Q was sent" not in printed.err
    for found in json.loads(printed.out)["frames"][0]["detections"]:
        assert abs(found["range_m"] - DISTANCE) > 1.0


@pytest.mark.parametrize(
    ("old", "new", "options", "message"),
    [
        ("", "", [], "name no device"),
        (
            " 0 1\n",
            " 0 1\nlvdsStreamCfg -1 1 1 0\n",
            [],
            "radar.cfg: lvdsStreamCfg: enableHeader: with 1",
        ),
        ("77 10", "77 ten", [], "radar.cfg: line 4, profileCfg: 'ten' is not a number"),
        (" 0 0 0 0 4\n", " 0 0 5 0 4\n", [], "radar.cfg: idleTime: the chirps 0 and 1"),
        (" 0 4\n", " 0 5\n", [], "radar.cfg: txEnable"),
        (" 0 1\n", " 0 5\n", ["--set", "x"], "'x' is not PATH=VALUE"),
        ("", "", ["--set", "devise=xwr16xx"], "--set: devise: unknown key; did you mean 'device'"),
        ("", "", ["--set", "slope=3"], "--set: slope: 3 needs a unit"),
        ("", "", ["--set", "num_ramps=5"], "--set: num_ramps: 5 ramps cannot be shared"),
        ("frameCfg 0 1 64 0 40 1 0", "frameCfg 0", [], "radar.cfg: frameCfg: chirpEndIdx"),
    ],
)
def test_a_profile_that_does_not_fit_a_recording_is_refused_with_its_place(
    raw: Path, capsys: pytest.CaptureFixture[str], old, new, options, message
):
    profile = raw.parent / "radar.cfg"
    profile.write_text(PROFILE.replace(old, new), encoding="utf-8")
    assert main(["process", str(raw), "--params", str(profile), *options]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("command", ["ddmPhaseShiftAntOrder 0 2", "bpmCfg -1 1 0 1"])
def test_a_profile_with_a_code_of_phases_is_refused(
    raw: Path, capsys: pytest.CaptureFixture[str], command: str
):
    profile = raw.parent / "radar.cfg"
    together = PROFILE.replace(" 0 1\n", " 0 5\n").replace(" 0 4\n", " 0 5\n")
    profile.write_text(together + command + "\n", encoding="utf-8")
    assert main(["process", str(raw), "--params", str(profile)]) == 2
    assert "code of phases" in capsys.readouterr().err


def test_people_read_what_the_ramps_resolve_and_that_there_is_no_truth(
    raw: Path, capsys: pytest.CaptureFixture[str]
):
    """c/2B of 768 MHz is 0.195 m, λ/2T of 100 µs ± 9.7 m/s."""
    out = raw.parent / "results"
    arguments = ["process", str(raw), "--out", str(out), "--frames", "1", "--pfa", "1e-8"]
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert "cells of 0.195 m to 44.97 m" in text
    assert "unambiguous within ±9.66 m/s\n" in text
    assert "m/s\n            faster targets are folded, with wrong angles and" in text
    assert "frame 1: 1 detections" in text
    assert " 14.00 m    -4.00 m/s" in text
    assert "no ground truth" in text
    assert [path.name for path in sorted(out.glob("*.png"))] == ["range_rate_0001.png"]
    assert main([*arguments, "--set", "num_transmitters=1"]) == 0
    text = capsys.readouterr().out
    assert "unambiguous within ±19.3 m/s" in text
    assert "(one transmitter × 4 receivers)" in text
    assert "wrong angles" not in text


def test_a_capture_that_was_cut_off_is_processed_as_far_as_it_goes(
    raw: Path, capsys: pytest.CaptureFixture[str]
):
    os.truncate(raw, raw.stat().st_size - 1000)
    out = str(raw.parent / "results")
    assert main(["process", str(raw), "--out", out]) == 2
    message = capsys.readouterr().err
    assert "1000 bytes are missing" in message
    assert "--frames 0" in message
    assert main(["process", str(raw), "--out", out, "--frames", "0", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["frames"]) == 1


def test_a_board_with_a_raised_transmitter_measures_elevations(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """The phases of a point 12° left and 9° up at the places that the parameter file gives."""
    second = np.arange(128) % 2  # the transmitter of every other ramp is 1 further left and 2 up
    left, up = np.array([0, 2, 4, 6])[:, None] + second, 2 * second
    azimuth, elevation = np.radians([12.0, 9.0])
    half_turns = left * np.cos(elevation) * np.sin(azimuth) + up * np.sin(elevation)
    samples = point(1) * np.exp(-1j * np.pi * half_turns)[..., None]
    np.save(tmp_path / "walk.npy", samples.transpose(0, 2, 1, 3))
    text = TEMPLATE
    for name, places in (
        ("channel_positions", "[[0, 0], [2, 0], [4, 0], [6, 0]]"),
        ("transmitter_positions", "[[0, 0], [1, 2]]"),
    ):
        text = text.replace(f"#{name} = []", f"{name} = {places}")
    (tmp_path / "walk.toml").write_text(text, encoding="utf-8")
    arguments = ["process", str(tmp_path / "walk.npy"), "--pfa", "1e-8", "--out"]
    assert main([*arguments, str(tmp_path / "out"), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["frames"][0]["detections"]
    assert np.degrees(found["azimuth_rad"]) == pytest.approx(12.0, abs=0.3)
    assert np.degrees(found["elevation_rad"]) == pytest.approx(9.0, abs=0.3)
    assert main([*arguments, str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert "azimuth   elevation" in printed
    assert "+12." in printed


@pytest.mark.parametrize("form", ["npy", "zarr", "zarr/victim-0/samples"])
def test_numpy_and_zarr_arrays_are_processed_alike(
    tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]
):
    array = point(1).transpose(0, 2, 1, 3)  # the template's axes
    path = tmp_path / f"walk.{form}"
    if form == "npy":
        np.save(path, array)
    else:
        zarr = pytest.importorskip("zarr")
        zarr.save_array(path, array)
    path.with_suffix(".toml").write_text(TEMPLATE, encoding="utf-8")
    assert (
        main(["process", str(path), "--out", str(tmp_path / "o"), "--pfa", "1e-8", "--json"]) == 0
    )
    (found,) = json.loads(capsys.readouterr().out)["frames"][0]["detections"]
    assert found["range_m"] == pytest.approx(DISTANCE, abs=0.01)


def test_describe_writes_a_parameter_file(capsys: pytest.CaptureFixture[str]):
    assert main(["process", "--describe"]) == 0
    assert capsys.readouterr().out == TEMPLATE


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["process"], "no recording is given; name one"),
        (["process", "walk.npy"], "there is no recording 'walk.npy'"),
        (["process", "walk.zarr", "--params", "gone.toml"], "there is no parameter file 'gone.t"),
        (["process", "walk.sigmf-meta"], "'walk.sigmf-meta' is no recording; its name must end"),
        (["process", "walk.bin", "--pfa", "1"], "not between 0 and 1"),
        (["process", "walk.bin", "--pfa", "often"], "'often' is not a number"),
        (["process", "walk.bin", "--frames", "3-1"], "ends before it begins"),
        (["process", "walk.bin", "--frames", "all"], "not the number of a frame or a range"),
        (
            ["process", "walk.wav", "--params", "walk.toml"],
            "'walk.wav' is no recording; its name must end in .npy",
        ),
        (["process", "gone.zarr", "--params", "walk.toml"], "there is no recording"),
        (["process", "walk.zarr", "--params", "walk.toml"], "cannot be read as one Zarr array"),
    ],
)
def test_what_cannot_be_processed_is_refused_in_one_sentence(
    raw: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
):
    monkeypatch.chdir(raw.parent)
    raw.with_suffix(".toml").rename("walk.toml")
    Path("walk.zarr").mkdir()
    if "walk.npy" in arguments:
        Path("walk.toml").unlink()
    assert main(arguments) == 2
    assert message in capsys.readouterr().err


# ── the real one ──────────────────────────────────────────────────────────────


@needs_real
def test_the_noise_of_the_real_capture_ends_where_the_converters_filter_ends():
    """Complex sampling at f_s passes 0 … 0.9 f_s: the noise has its gap at the top, not below.

    Were the samples conjugated, the gap would be at the lowest beats. Noise is taken from range
    rates of more than 2.5 m/s, where nobody walks.
    """
    parameters = read_parameters(REAL_PARAMETERS)
    receiver = RangeDoppler(greatest_range=1e4)
    map_ = receiver.spectra(open_numpy(REAL, parameters).frame(0)).mean_power
    noise = np.median(map_.power[np.abs(map_.range_rate) > 2.5], axis=0)
    inside = np.median(noise[10:110])
    assert noise[120:126].mean() < inside / 4
    assert noise[2:8].mean() > inside / 4


@needs_real
def test_the_real_capture_shows_a_still_room_and_people_who_walk():
    """What needs no ground truth: most power at rest, a few bodies at walking speed in between."""
    parameters = read_parameters(REAL_PARAMETERS)
    frame = open_numpy(REAL, parameters).frame(0)
    receiver = RangeDoppler(greatest_range=parameters.greatest_range, unfolds=False)
    spectra = receiver.spectra(frame)
    found = receiver.detect_in(spectra, frame)
    by_rate = spectra.mean_power.power.sum(axis=1)
    assert spectra.mean_power.range_rate[np.argmax(by_rate)] == 0.0
    strong = found.snr > 100.0
    walking = strong & (np.abs(found.range_rate) > 0.3)
    assert np.any(found.range_rate[walking] > 0.3)
    assert np.any(found.range_rate[walking] < -0.3)
    assert np.all(np.abs(found.range_rate[walking]) < 1.5)
    assert np.all((found.range[walking] > 2.5) & (found.range[walking] < 4.0))
    # two persons: who recedes is to the right of who approaches
    receding = found.azimuth[walking & (found.range_rate > 0) & (found.range < 3.2)]
    approaching = found.azimuth[walking & (found.range_rate < 0) & (found.range < 3.2)]
    assert receding.max() < approaching.min()


@needs_real
def test_the_real_capture_is_processed_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    arguments = ["process", str(REAL), "--params", str(REAL_PARAMETERS), "--out", str(tmp_path)]
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert "cells of 0.0488 m to 5.62 m" in text
    assert "8 (2 transmitters in turns × 4 receivers)" in text
    assert (tmp_path / "range_rate_0000.png").stat().st_size > 50_000


def test_a_dollar_in_the_name_of_a_recording_is_no_formula(raw: Path):
    odd = raw.with_name("$x^{$.bin")
    odd.write_bytes(raw.read_bytes())
    parameters = ["--params", str(raw.with_suffix(".toml"))]
    options = ["--frames", "0", "--out", str(raw.parent / "results")]
    assert main(["process", str(odd), *parameters, *options]) == 0


def test_results_that_cannot_be_written_are_one_sentence(raw: Path, capsys, monkeypatch):
    assert main(["process", str(raw), "--out", str(raw)]) == 2
    assert "is a file; name a folder" in capsys.readouterr().err

    def full(path, *_):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    out = raw.parent / "results"
    assert main(["process", str(raw), "--out", str(out)]) == 4
    said = capsys.readouterr().err
    assert f"'{out}/range_rate_0000.png': No space left on device" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("part", ["", "run.zarr", "run.zarr/victim-1"])
def test_a_stored_run_names_its_samples(part: str, tmp_path: Path, capsys):
    """The group has two radars with an array of samples each, and is no recording itself."""
    root = zarr.create_group(store=tmp_path / "run.zarr", zarr_format=3)
    for number in range(2):
        group = root.create_group(f"victim-{number}")
        group.create_array("samples", data=np.ones((4, 2, 8), dtype=np.complex64))
    assert main(["process", str(tmp_path / part)]) == 2
    message = capsys.readouterr().err
    assert "is a stored run or a part of one, and no recording" in message
    assert f"'{tmp_path}/run.zarr/victim-1/samples', and a file of their parameters" in message


def test_the_samples_of_a_stored_run_are_asked_for_their_parameters(tmp_path: Path, capsys):
    samples = tmp_path / "run.zarr" / "victim-0" / "samples"
    zarr.save_array(samples, np.ones((4, 2, 8), dtype=np.complex64))
    assert main(["process", str(samples)]) == 2
    assert "samples.toml" in capsys.readouterr().err
