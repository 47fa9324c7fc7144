"""A stored run comes back, names its axes and units, and is the same every time."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import zarr

from polychirp.axes import axes_of
from polychirp.errors import InputError, RunError
from polychirp.exchange.columns import tables_of
from polychirp.model.front_end import HighPass
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import PARTS, IfParts
from polychirp.model.paths import PropagationPaths
from polychirp.model.placement import Placement
from polychirp.model.ramp_code import RampCode
from polychirp.study.provenance import canonical_json, provenance
from polychirp.study.store.layout import FOLDERS
from polychirp.study.store.load import load_run, stored_hash
from polychirp.study.store.save import save_run
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import DiverseTriangular
from tests.support.runs import ARRAY, BOTH, ORIGIN, PLACED, STUDY, trial, victim

PARTS_AXES = ("part", "channel", "ramp", "fast")


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    path = tmp_path / "results" / "run.zarr"
    save_run(path, BOTH, provenance=ORIGIN)
    return path


def files(path: Path) -> dict[str, bytes]:
    return {
        str(file.relative_to(path)): file.read_bytes()
        for file in sorted(path.rglob("*"))
        if file.is_file()
    }


def test_a_run_comes_back(stored):
    run = load_run(stored)
    assert run.provenance == ORIGIN
    assert [v.name for v in run.victims] == ["front", "rear"]
    expected, found = victim("front"), run.victim("front")
    # single precision keeps 24 bits
    np.testing.assert_allclose(found.frame.samples, expected.frame.samples, rtol=1e-6)
    np.testing.assert_allclose(found.parts.samples, expected.parts.samples, rtol=1e-6)
    assert found.frame.array == ARRAY
    assert found.frame.times.rate == expected.frame.times.rate
    for name in ("start_time", "duration", "start_frequency", "slope", "start_phase", "sweep"):
        np.testing.assert_array_equal(
            getattr(found.frame.schedule, name), getattr(expected.frame.schedule, name)
        )
    np.testing.assert_array_equal(found.detections.range, expected.detections.range)
    assert (found.detections.time, found.truth.time) == (0.5, 0.25)
    assert found.truth.name == ("car", "van")
    np.testing.assert_array_equal(found.truth.is_visible, [True, False])
    np.testing.assert_array_equal(found.score.range_error, [0.1, 0.0])
    assert (found.score.ghosts, found.score.target_detection) == ((0, 1, 2), (0,))
    assert (found.score.num_missed, found.score.floor_rise) == (1, 2.5)


def test_the_places_of_radar_and_bodies_come_back(stored):
    found, expected = load_run(stored).victim("front").placement, PLACED
    assert (found.time, found.name, found.carrier) == (0.0, ("car", "van", "ego"), 2)
    for name in axes_of(Placement):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_the_radars_of_ghosts_come_back_and_are_unknown_in_older_runs(tmp_path):
    whole = victim("front")
    score = replace(whole.score, radar=("rear", None, "rear"))
    path = tmp_path / "run.zarr"
    save_run(path, trial(replace(whole, score=score)), provenance=ORIGIN)
    found = load_run(path).victims[0].score
    assert (found.radar, found.origin) == (score.radar, ("radar rear", "", "radar rear"))
    attributes = path / "victim-0" / "score" / "zarr.json"
    content = json.loads(attributes.read_text(encoding="utf-8"))
    del content["attributes"]["radar"]
    attributes.write_text(json.dumps(content), encoding="utf-8")
    assert load_run(path).victims[0].score.radar == (None, None, None)


def test_a_run_keeps_which_parts_there_are_and_what_was_left_out(tmp_path):
    whole = victim("front")
    names = (*PARTS[:5], "distortion")
    chosen = [PARTS.index(part) for part in names]
    few = IfParts(samples=whole.parts.samples[chosen], names=names, neglected=2e-9)
    save_run(tmp_path / "run.zarr", trial(replace(whole, parts=few)), provenance=ORIGIN)
    found = load_run(tmp_path / "run.zarr").victims[0].parts
    assert (found.names, found.neglected) == (names, 2e-9)
    np.testing.assert_allclose(found["distortion"], whole.parts["distortion"], rtol=1e-6)
    assert not found["leakage"].any()


def test_a_run_keeps_the_filters_that_its_samples_went_through(tmp_path):
    whole = victim("front")
    narrow = IfFilter(passband=1.5e6, stopband=2e6)
    frame = replace(whole.frame, high_pass=HighPass(corners=(50e3, 175e3)), if_filter=narrow)
    save_run(tmp_path / "run.zarr", trial(replace(whole, frame=frame)), provenance=ORIGIN)
    stored = load_run(tmp_path / "run.zarr").victims[0].frame
    assert stored.high_pass == frame.high_pass
    assert stored.if_filter == narrow


def test_a_frame_without_detections_comes_back(stored):
    assert load_run(stored).victim("rear").detections.num_detections == 0


def test_the_same_run_gives_the_same_bytes(stored, tmp_path):
    again = tmp_path / "again.zarr"
    save_run(again, BOTH, provenance=ORIGIN)
    assert files(again) == files(stored)


def test_a_code_of_the_ramps_is_stored(tmp_path):
    victim = BOTH.victims[0]
    count = victim.frame.schedule.num_ramps
    code = RampCode(
        value=[[1, -1, 1j]], row=[0] * count, chip_duration=victim.frame.schedule.duration / 3
    )
    schedule = replace(victim.frame.schedule, code=code)
    coded = replace(victim, frame=replace(victim.frame, schedule=schedule))
    save_run(tmp_path / "coded.zarr", replace(BOTH, victims=(coded,)), provenance=ORIGIN)
    again = load_run(tmp_path / "coded.zarr").victims[0]
    ramps = tables_of(again)["ramps"]
    np.testing.assert_array_equal(ramps["chip_duration_s"], code.chip_duration)
    np.testing.assert_array_equal(ramps["row"], code.row)
    read = again.frame.schedule.code
    for field in ("value", "row", "chip_duration"):
        np.testing.assert_array_equal(getattr(read, field), getattr(code, field))


def test_every_array_names_its_axes_and_its_unit(stored):
    group = zarr.open_group(store=stored, mode="r")["victim-0"]
    arrays = dict(group.members(max_depth=None))
    found = {
        name: (array.metadata.dimension_names, array.attrs["units"])
        for name, array in arrays.items()
        if isinstance(array, zarr.Array)
    }
    assert {name for name in found if "/" not in name} == {"samples", "parts", *PARTS_AXES}
    assert not any(name.startswith(FOLDERS[RampCode]) for name in found)  # its ramps have no code
    for noun, folder in FOLDERS.items():
        if noun is RampCode:
            continue
        assert {f"{folder}/{field}" for field in axes_of(noun)} <= set(found)
    assert found["samples"] == (("channel", "ramp", "fast"), "V")
    assert found["parts"] == (("part", "channel", "ramp", "fast"), "V")
    assert found["schedule/slope"] == (("ramp",), "Hz/s")
    assert found["truth/point"] == (("target", "xyz"), "m")
    assert found["paths/transfer"] == (("path", "receiving", "transmitting"), "1")
    assert group.attrs["part"] == list(PARTS)


def test_xarray_opens_a_run_with_coordinates_and_without_warnings(stored):
    tree = xr.open_datatree(stored, engine="zarr")
    front, expected = tree["victim-0"], BOTH.victim("front")
    frame = expected.frame
    assert front["parts"].dims == PARTS_AXES
    assert front["part"].to_numpy().tolist() == list(PARTS)
    np.testing.assert_array_equal(
        front["fast"], np.arange(frame.times.most_samples) / frame.times.rate
    )
    np.testing.assert_allclose(
        front["parts"].sel(part="direct"), expected.parts["direct"], rtol=1e-6
    )
    assert front["truth/range"].sel(target="van") == 2.0
    assert front["score/nature"].to_numpy().tolist() == ["direct"] * 3
    assert float(front["paths/transfer"].sel(path=0, receiving="V", transmitting="V").real) > 0.0
    for group in tree.subtree:
        assert set(group.dataset.dims) <= set(group.coords)


def test_a_run_keeps_the_paths_to_its_victims(stored):
    run = load_run(stored)
    assert (run.radars, run.actors) == (("front",), ("car", "van"))
    found, expected = run.victim("front").paths, BOTH.victim("front").paths
    assert (found.reference_time, found.frequency) == (expected.reference_time, expected.frequency)
    for name in axes_of(PropagationPaths):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_storing_again_replaces_and_leaves_nothing_unfinished(stored):
    save_run(stored, trial(victim("other")), provenance=ORIGIN)
    assert [v.name for v in load_run(stored).victims] == ["other"]
    assert [path.name for path in stored.parent.iterdir()] == ["run.zarr"]


def test_a_run_that_fails_while_it_is_stored_leaves_the_old_one(stored):
    with pytest.raises(AttributeError):
        save_run(stored, trial(victim("new"), None), provenance=ORIGIN)  # type: ignore[arg-type]
    assert [v.name for v in load_run(stored).victims] == ["front", "rear"]


def test_of_a_run_that_cannot_be_replaced_old_and_new_are_kept(stored, monkeypatch):
    """The new folder cannot get its name after the old one has lost it."""
    rename = Path.rename

    def renamed(path, target):
        if path.name.endswith(".unfinished"):
            raise PermissionError(13, "Permission denied")
        return rename(path, target)

    before = files(stored)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", renamed)
        with pytest.raises(RunError, match="written: Permission denied; the new run is kept"):
            save_run(stored, trial(victim("other")), provenance=ORIGIN)
    assert files(stored) == before
    kept = load_run(stored.with_name("run.zarr.unfinished"))
    assert [one.name for one in kept.victims] == ["other"]


def test_what_a_crash_left_of_a_replacement_goes_with_the_next_one(stored):
    """The crash came after the old run had lost its name."""
    stored.rename(stored.with_name("run.zarr.replaced"))
    save_run(stored, trial(victim("other")), provenance=ORIGIN)
    assert [path.name for path in stored.parent.iterdir()] == ["run.zarr"]


def test_the_hash_of_a_stored_study_is_read_without_its_arrays(stored, tmp_path):
    assert stored_hash(stored) == ORIGIN.study_hash
    assert stored_hash(tmp_path / "nothing") is None


def test_a_run_is_found_in_the_folder_of_its_command(stored):
    """``run`` stores ``run.zarr`` in its folder, and users name the folder."""
    assert [one.name for one in load_run(stored.parent).victims] == [
        one.name for one in load_run(stored).victims
    ]


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(InputError, match="there is no run in"):
        load_run(tmp_path / "nothing")
    zarr.create_group(store=tmp_path / "other.zarr", zarr_format=3)
    with pytest.raises(InputError, match="is not a run of polychirp"):
        load_run(tmp_path / "other.zarr")


def test_a_run_of_another_version_is_refused(stored):
    zarr.open_group(store=stored, mode="a").attrs["format_version"] = 99
    with pytest.raises(InputError, match="format version 99"):
        load_run(stored)


def test_a_damaged_run_is_refused(stored):
    (stored / "victim-1" / "schedule" / "slope" / "zarr.json").unlink()
    with pytest.raises(InputError, match="damaged"):
        load_run(stored)


def test_a_lost_chunk_is_not_read_as_zeros(stored):
    """Coordinates repeat what is stored elsewhere and are not read."""
    arrays = ["samples", "parts"]
    arrays += [f"{folder}/{field}" for noun, folder in FOLDERS.items() for field in axes_of(noun)]
    folders = [stored / f"victim-{n}" / array / "c" for n in range(2) for array in arrays]
    chunks = [path for folder in folders for path in folder.rglob("*") if path.is_file()]
    assert chunks
    for lost in chunks[::10]:
        content = lost.read_bytes()
        lost.unlink()
        with pytest.raises(InputError, match=r"damaged \(.*chunk c/.* is missing"):
            load_run(stored)
        lost.write_bytes(content)


def test_a_radar_that_is_not_stored_is_refused(stored):
    with pytest.raises(InputError, match="no radar 'side'; there are 'front', 'rear'"):
        load_run(stored).victim("side")


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(RunError, match="cannot be written"):
        save_run(tmp_path / "file" / "run.zarr", trial(), provenance=ORIGIN)


def test_equal_studies_have_equal_hashes_and_others_have_others():
    assert provenance(replace(STUDY)) == ORIGIN
    assert provenance(replace(STUDY, num_sweeps=3)).study_hash != ORIGIN.study_hash


def test_a_mesh_file_counts_by_what_it_holds_and_not_by_where_it_is(tmp_path):
    def hash_with(content: bytes, folder: str) -> str:
        path = tmp_path / folder / "car.glb"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
        car = Vehicle(name="car", x=0.0, y=0.0, mesh=str(path))
        return provenance(replace(STUDY, street=Street(vehicles=(car,)))).study_hash

    assert hash_with(b"mesh", "here") == hash_with(b"mesh", "there")
    assert hash_with(b"mesh", "here") != hash_with(b"other", "here")


def test_canonical_text_keeps_every_digit():
    """Python writes the shortest text that reads back as the same double."""
    text = canonical_json(DiverseTriangular(idle=0.1 + 0.2))
    assert '"idle": 0.30000000000000004' in text
