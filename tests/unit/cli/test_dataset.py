"""The command ``polychirp dataset``."""

import hashlib
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zarr

from polychirp.cli.app import main
from polychirp.config.load import load_study
from polychirp.study.mitigation.dataset import ARRAYS, PRESETS, DatasetPlan, frame_arrays
from polychirp.study.mitigation.published import ARIM_GRID
from polychirp.study.mitigation.street_frames import STREETS
from polychirp.waveform.coding import TimeDivision
from tests.support.small_study import SMALL_STUDY

ROOT = Path(__file__).parents[3]


def digests(folder):
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def made(folder, *options, source="tu-delft"):
    return main(["dataset", source, *options, "--out", str(folder)])


def test_an_interrupted_dataset_continues_to_the_same_bytes(tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert made(whole, "--frames", "3", "--workers", "1") == 0
    assert made(broken, "--frames", "2", "--workers", "1") == 0
    shutil.rmtree(broken / "frame-000000.zarr")
    (broken / "frame-000001.unfinished").mkdir()
    assert made(broken, "--frames", "3", "--workers", "1") == 0
    shutil.rmtree(broken / "frame-000001.unfinished")
    assert digests(broken) == digests(whole)


def test_a_call_for_fewer_frames_tells_of_all_that_are_there(tmp_path, capsys):
    made(tmp_path / "out", "--frames", "3", "--workers", "1")
    made(tmp_path / "out", "--frames", "1", "--workers", "1")
    assert "0 frames written, 3 in all" in capsys.readouterr().err
    assert "\n3 frames of" in (tmp_path / "out" / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_the_number_of_workers(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    assert made(one, "--frames", "3", "--workers", "1") == 0
    assert made(two, "--frames", "3", "--workers", "2") == 0
    assert digests(one) == digests(two)


@pytest.mark.parametrize(
    "preset",
    [pytest.param(name, marks=[pytest.mark.slow] if name in STREETS else []) for name in PRESETS],
)
def test_the_parts_of_a_presets_frame_sum_to_it(preset):
    arrays = frame_arrays(DatasetPlan(source=preset, seed=3, num_frames=1), 0)
    whole = arrays["interfered"]
    error = np.abs(arrays["clean"] + arrays["interference"] - whole).max()
    assert error < 1e-5 * np.abs(whole).max()
    assert arrays["hit"].shape == whole.shape[1:]
    quiet = np.abs(arrays["interference"])[:, ~arrays["hit"]]
    loud = np.abs(arrays["interference"])[:, arrays["hit"]]
    assert quiet.size == 0 or loud.size == 0 or np.median(quiet) < np.median(loud)
    for name in arrays:
        assert arrays[name].ndim == len(ARRAYS[name][0])


def test_a_targets_place_is_that_of_its_beat():
    """The strongest line of the noise-free samples lies at 2 b R/c, in the same cell."""
    arrays = frame_arrays(DatasetPlan(source="toth", seed=5, num_frames=1), 0)
    line = np.abs(np.fft.fft(arrays["noise_free"][0, 0] * np.hanning(960)))
    cell = 299_792_458.0 * 20e6 / (2 * arrays["slope"][0] * 960)
    start = arrays["target_range"] - arrays["target_range_rate"] * 32 * 60e-6
    assert np.abs(start - line[:480].argmax() * cell).min() < 0.6 * cell


def test_a_targets_range_rate_is_not_folded():
    """The strongest echo turns by 2 v T/λ cycles from ramp to ramp; points have up to 25 m/s, of
    which λ/4T = 16 m/s are unambiguous."""
    greatest = 0.0
    for number in range(4):
        arrays = frame_arrays(DatasetPlan(source="toth", seed=5, num_frames=4), number)
        assert arrays["target_range_rate"].size == 3
        windows = np.hanning(64)[:, None] * np.hanning(960)
        power = np.abs(np.fft.fft2(arrays["noise_free"][0] * windows)) ** 2
        row, column = np.unravel_index(power[:, :480].argmax(), (64, 480))
        cell = 299_792_458.0 * 20e6 / (2 * arrays["slope"][0] * 960)
        cycles = 2 * arrays["target_range_rate"] * 76.5e9 / 299_792_458.0 * 60e-6
        off = np.mod(cycles - row / 64 + 0.5, 1.0) - 0.5
        near = np.abs(arrays["target_range"] - column * cell) < 1.5 * cell
        assert np.abs(off[near]).min() < 1 / 64
        greatest = max(greatest, np.abs(arrays["target_range_rate"]).max())
    assert greatest > 17.0


def test_echoes_of_arim_beyond_half_the_sample_rate_have_labels():
    """2 b R/c is half of 40 MHz at 48 m. Every strong line of the echoes is a label's."""
    cell = 299_792_458.0 * 40e6 / (2 * 6.25e13 * 1024)
    far = 0
    for number in range(8):
        arrays = frame_arrays(DatasetPlan(source="arim", seed=2, num_frames=8), number)
        line = np.abs(np.fft.fft(arrays["noise_free"][0, 0] * np.hanning(1024)))
        strong = np.flatnonzero(line > 0.3 * line.max()) * cell
        assert np.abs(strong[:, None] - arrays["target_range"]).min(axis=1).max() < 2.0 * cell
        assert arrays["target_range"].min() > 2.0
        far += np.count_nonzero(arrays["target_range"] > 48.0)
    assert far > 4


def test_the_grid_of_arim_has_its_960_cells_in_turn():
    """8 SNRs, SIRs from −5 dB to 5 dB above the SNR in steps of 5, 16 slopes: 60 times 16."""
    assert len(ARIM_GRID) == len(set(ARIM_GRID)) == 960
    plan = DatasetPlan(source="arim-grid", seed=1, num_frames=1)
    for number in (0, 17, 959, 960):
        arrays = frame_arrays(plan, number)
        assert tuple(arrays["cell"]) == pytest.approx(ARIM_GRID[number % 960])
        noise = np.mean(np.abs(arrays["clean"] - arrays["noise_free"]) ** 2)
        assert 10 * np.log10(1.0 / noise) == pytest.approx(arrays["cell"][0], abs=0.6)


def test_phases_of_the_channels_are_those_of_their_places():
    """The beat of the strongest target lags by 2π y sin φ cos ε/λ at an element y further left."""
    arrays = frame_arrays(DatasetPlan(source="direct", seed=2, num_frames=1), 0)
    place = arrays["receiver_position"]
    assert place.shape == (len(arrays["noise_free"]), 3)
    assert arrays["transmitter_position"].shape == (1, 3)
    fast = arrays["noise_free"].shape[-1]
    line = np.fft.fft(arrays["noise_free"][:, 0] * np.hanning(fast))[:, : fast // 2]
    peak = np.abs(line).sum(axis=0).argmax()
    cell = 299_792_458.0 * arrays["sample_rate"][0] / (2 * abs(arrays["slope"][0]) * fast)
    target = np.abs(arrays["target_range"] - peak * cell).argmin()
    azimuth, elevation = (arrays[f"target_{name}"][target] for name in ("azimuth", "elevation"))
    left = np.sin(azimuth) * np.cos(elevation)
    wavelength = 299_792_458.0 / (arrays["start_frequency"][0] + 0.5 * 400e6)
    expected = -2 * np.pi * np.diff(place[:, 1]) * left / wavelength
    turned = np.angle(line[1:, peak] / line[:-1, peak])
    assert np.angle(np.exp(1j * (turned - expected))) == pytest.approx(0.0, abs=0.3)


def test_roads_know_the_places_of_their_bodies():
    """The strongest line of the channels' noise-free sum is at a target's range, to a cell."""
    arrays = frame_arrays(DatasetPlan(source="direct", seed=2, num_frames=1), 0)
    fast = arrays["noise_free"].shape[-1]
    line = np.abs(np.fft.fft(arrays["noise_free"][:, 0] * np.hanning(fast))).sum(axis=0)
    cell = 299_792_458.0 * 20e6 / (2 * abs(arrays["slope"][0]) * fast)
    found = line[: fast // 2].argmax() * cell
    assert np.abs(arrays["target_range"] - found).min() < cell
    assert np.ptp(arrays["target_azimuth"]) > 0.0
    assert arrays["path_delay"].size >= arrays["target_range"].size


def test_ramps_of_others_cross_where_samples_are_hit():
    """Where direct interference is strong, the other radar's frequency is within the IF band."""
    arrays = frame_arrays(DatasetPlan(source="direct", seed=2, num_frames=1), 0)
    rate = 20e6
    line_of_sight = arrays["path_delay"][arrays["path_transmitter"] != 0].min()
    strong = np.abs(arrays["interference"]).max(axis=0)
    ramp, fast = np.nonzero(strong > 0.3 * strong.max())
    assert ramp.size > 10
    time = arrays["first"][ramp] + fast / rate
    own = arrays["start_frequency"] - arrays["slope"] * arrays["start_time"]
    since = (time - line_of_sight)[:, None] - arrays["other_start_time"]
    other = arrays["other_start_frequency"] + arrays["other_slope"] * since
    other[(since < 0) | (since > arrays["other_duration"])] = np.nan
    apart = np.abs(other - (own[ramp] + arrays["slope"][ramp] * time)[:, None])
    assert np.nanmin(apart, axis=1).max() < rate


def test_each_ramp_has_the_weights_of_its_transmitting_elements(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(SMALL_STUDY, encoding="utf-8")
    study = load_study(path)
    own = study.radars[0]
    coded = replace(own, array=replace(own.array, num_transmitters=2), coding=TimeDivision())
    study = replace(study, radars=(coded, *study.radars[1:]))
    weight = frame_arrays(DatasetPlan(source=study, seed=1, num_frames=1), 0)["transmit_weight"]
    sweep = np.arange(len(weight)) // 2
    assert np.array_equal(weight, np.eye(2)[sweep % 2])


def test_a_study_gives_truth_and_paths(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(SMALL_STUDY, encoding="utf-8")
    assert made(tmp_path / "out", "--frames", "1", "--workers", "1", source=str(study)) == 0
    frame = zarr.open_group(tmp_path / "out" / "frame-000000.zarr", mode="r")
    assert set(frame.array_keys()) == set(ARRAYS) - {"cell"}
    assert frame["target_range"].size >= 1
    assert frame["path_delay"].size >= 1
    card = (tmp_path / "out" / "README.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in card for name in ARRAYS)
    header = json.loads((tmp_path / "out" / "dataset.json").read_text(encoding="utf-8"))
    assert header["study"]["radars"]


def test_exports_have_the_same_numbers(tmp_path):
    from scipy.io import loadmat

    h5py = pytest.importorskip("h5py")
    out = tmp_path / "out"
    assert made(out, "--frames", "1", "--workers", "1", "--to", "mat") == 0
    assert made(out, "--frames", "1", "--workers", "1", "--to", "hdf5") == 0
    stored = zarr.open_group(out / "frame-000000.zarr", mode="r")["interfered"][...]
    assert np.array_equal(loadmat(out / "frame-000000.mat")["interfered"], stored)
    assert (out / "dataset.h5").read_bytes()[8] == 2  # the layout of HDF5 1.8, for MATLAB
    with h5py.File(out / "dataset.h5") as file:
        assert np.array_equal(file["frame-000000/interfered"][...], stored)
        assert file["frame-000000/interfered"].attrs["units"] == "V"


@pytest.mark.parametrize("form", ["mat", "hdf5"])
def test_a_full_disk_leaves_no_part_of_an_export(tmp_path, form):
    """In a process of its own, since HDF5's library ended it with a segmentation fault."""
    out = tmp_path / "out"
    assert made(out, "--frames", "1", "--workers", "1") == 0
    before = sorted(out.iterdir())
    program = (
        "import pathlib; from polychirp.exchange.dataset_files import export_dataset; "
        f"export_dataset(pathlib.Path({str(out)!r}), to={form!r})"
    )
    done = subprocess.run(
        ["sh", "-c", 'ulimit -f 2; exec "$@"', "sh", sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=False,
    )
    assert f"RunError: '{out}' cannot be written: File too large" in done.stderr
    assert sorted(out.iterdir()) == before


def test_the_reader_of_the_page_gives_pairs(tmp_path):
    """The twenty lines of docs/how-to/dataset.md, as they are printed there."""
    page = (ROOT / "docs/how-to/dataset.md").read_text(encoding="utf-8")
    program = re.search(r"```python\n(.*?)```", page, re.DOTALL).group(1)
    assert len(program.splitlines()) <= 25
    names = {}
    exec(program, names)
    assert made(tmp_path / "out", "--frames", "2", "--workers", "1") == 0
    frames = names["Frames"](tmp_path / "out")
    assert len(frames) == 2
    interfered, clean = frames[1]
    assert interfered.shape == clean.shape == (2, 1, 1, 4160)
    assert interfered.dtype == np.float32
    assert np.mean(np.sum(interfered**2, axis=0)) == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize(
    ("source", "options", "sentence"),
    [
        ("tuh-delft", [], "did you mean 'tu-delft'"),
        ("tu-delft", ["--frames", "0"], "use 1 or more"),
        ("tu-delft", ["--seed", "-1"], "use 0 or more"),
    ],
)
def test_what_it_cannot_use_is_refused(source, options, sentence, tmp_path, capsys):
    assert made(tmp_path / "out", *options, source=source) == 2
    assert sentence in capsys.readouterr().err


def test_a_folder_of_another_dataset_or_of_other_files_is_kept(tmp_path, capsys):
    out = tmp_path / "out"
    assert made(out, "--frames", "1", "--workers", "1") == 0
    assert made(out, "--frames", "1", "--workers", "1", "--seed", "2") == 2
    assert "another source, seed" in capsys.readouterr().err
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    assert made(tmp_path, "--frames", "1", "--workers", "1") == 2
    assert "other files" in capsys.readouterr().err
