"""What is exported comes back from readers that other people wrote."""

import csv
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat

from polychirp.cli.app import main
from polychirp.errors import CapabilityError, InputError
from polychirp.exchange import formats
from polychirp.exchange.formats import FORMATS, writer_of
from polychirp.exchange.rosbag import FIELDS
from polychirp.model.front_end import HighPass
from polychirp.model.if_filter import IfFilter
from polychirp.study.store.load import StoredRun, load_run
from polychirp.study.store.save import save_run
from polychirp.traffic.vehicle import vehicle_size
from tests.support.runs import BOTH, ORIGIN
from tests.support.snippets import blocks_of

GUIDE = Path(__file__).parents[3] / "docs" / "how-to" / "export.md"


@pytest.fixture
def run(tmp_path: Path) -> StoredRun:
    save_run(tmp_path / "run.zarr", BOTH, provenance=ORIGIN)
    return load_run(tmp_path / "run.zarr")


def test_scipy_reads_the_matlab_file(run, tmp_path):
    (path,) = writer_of("mat")(run, tmp_path)
    content = loadmat(path, simplify_cells=True)
    front, expected = content["victims"][0], run.victim("front")
    assert json.loads(content["study"])["name"] == "alone"
    assert content["actors"].tolist() == ["car", "van"]
    assert front["name"] == "front"
    np.testing.assert_array_equal(front["samples"], expected.frame.samples.astype(np.complex64))
    np.testing.assert_array_equal(
        front["parts"]["direct"], expected.parts["direct"].astype(np.complex64)
    )
    np.testing.assert_array_equal(front["detections"]["range"], expected.detections.range)
    assert front["score"]["nature"].tolist() == ["direct"] * 3
    np.testing.assert_array_equal(front["paths"]["transfer"], expected.paths.transfer)
    assert front["units"]["truth"]["range_rate"] == "m/s"
    assert content["victims"][1]["detections"]["range"].size == 0


def test_files_of_samples_have_what_a_receiver_needs_beside_the_ramps(tmp_path):
    """Azimuths need the places of the elements, and ramps of other slopes the filter's phase."""
    filtered = HighPass(corners=(1e5, 2e5))
    front = BOTH.victims[0]
    front = replace(front, frame=replace(front.frame, high_pass=filtered))
    save_run(tmp_path / "run.zarr", replace(BOTH, victims=(front,)), provenance=ORIGIN)
    run = load_run(tmp_path / "run.zarr")
    (path,) = writer_of("mat")(run, tmp_path)
    (found,) = np.atleast_1d(loadmat(path, simplify_cells=True)["victims"])
    np.testing.assert_array_equal(found["array"]["channel_position"], front.frame.array.position)
    expected = np.squeeze(front.frame.array.transmit_position)
    np.testing.assert_array_equal(found["array"]["transmit_position"], expected)
    assert (tuple(found["high_pass"]), found["units"]["high_pass"]) == (filtered.corners, "Hz")
    meta, _ = writer_of("sigmf")(run, tmp_path)
    told = json.loads(meta.read_text(encoding="utf-8"))["global"]
    assert tuple(told["polychirp:high_pass"]) == filtered.corners


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="GNU Octave is not installed")
def test_octave_runs_the_lines_of_the_guide(run, tmp_path):
    (path,) = writer_of("mat")(run, tmp_path)
    (guide,) = (block.text for block in blocks_of(GUIDE) if block.language == "matlab")
    lines = [line for line in guide.splitlines() if not line.startswith("imagesc")]
    script = "\n".join(
        [*lines, "printf('%d %d %.9g %s', size(map), abs(x(2, 3)), v.truth.name{2})"]
    )
    done = subprocess.run(
        ["octave-cli", "--no-gui", "--norc", "--eval", script],
        capture_output=True,
        text=True,
        check=True,
        cwd=path.parent,
    )
    samples = run.victim("front").frame.samples[0]
    rows, columns, value, name = done.stdout.split()
    assert (int(rows), int(columns)) == samples.shape
    assert float(value) == pytest.approx(abs(samples[1, 2]), rel=1e-6)
    assert name == "van"


def test_victims_beyond_the_limit_of_a_matlab_variable_are_refused(run, tmp_path, monkeypatch):
    """All victims are in one variable, so that the sum of their arrays counts."""
    largest = max(8 * victim.parts.samples.size for victim in run.victims)
    assert len(run.victims) > 1
    monkeypatch.setattr("polychirp.exchange.matlab.LARGEST_VARIABLE", largest)
    with pytest.raises(CapabilityError, match=r"the victims of this run need .*export to hdf5"):
        writer_of("mat")(run, tmp_path)


def names_in_mat(path: Path) -> set[str]:
    """Names of a victim's quantities in a MATLAB file, as ``group/name``."""
    victim = np.atleast_1d(loadmat(path, simplify_cells=True)["victims"])[0]
    own = {name for name in victim if name not in ("units", "fast")}
    groups = {name for name in own if isinstance(victim[name], dict) and name not in MAT_STRUCTURES}
    inner = {f"{group}/{name}" for group in groups for name in victim[group]}
    return (own - groups) | inner


def names_in_netcdf(path: Path) -> set[str]:
    """Names of a victim's quantities in a NetCDF file; the axes' coordinates are not among them."""
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        found = {
            f"{node.relative_to(tree['victim-0'])}/{name}".removeprefix("./")
            for node in tree["victim-0"].subtree
            for name in (*node.data_vars, *node.attrs)
        }
    return {name.removesuffix("_imag").removesuffix("_real") for name in found} - AXES


def names_in_hdf5(path: Path) -> set[str]:
    """Names of a victim's quantities in an HDF5 file; the axes' coordinates are not among them."""
    found: set[str] = set()

    def visit(place: str, node: h5py.Group | h5py.Dataset) -> None:
        if isinstance(node, h5py.Dataset):
            if not node.is_scale:
                found.add(place)
            return
        found.update(f"{place}/{name}".removeprefix("/") for name in node.attrs)

    with h5py.File(path) as file:
        visit("", file["victim-0"])
        file["victim-0"].visititems(visit)
    return found - AXES


AXES = {"part"}
"""Names of the parts: the fields of the structure ``parts`` in a MATLAB file."""

MAT_STRUCTURES = ("parts", "array", "if_filter")
"""Quantities that are structures in a MATLAB file; in others they have an axis or are text."""


def test_formats_with_all_arrays_hold_the_same_quantities(tmp_path):
    """A reader finds in each what a receiver needs: filters, elements and their gains."""
    array = replace(BOTH.victims[0].frame.array, channel_gains=(1.0, 2.0))
    frame = replace(BOTH.victims[0].frame, array=array, if_filter=IfFilter(stopband=8e5))
    front = replace(BOTH.victims[0], frame=frame)
    save_run(tmp_path / "run.zarr", replace(BOTH, victims=(front,)), provenance=ORIGIN)
    run = load_run(tmp_path / "run.zarr")
    paths = {name: writer_of(name)(run, tmp_path)[0] for name in ("mat", "netcdf", "hdf5")}
    expected = names_in_hdf5(paths["hdf5"])
    assert {"samples", "if_filter", "array", "neglected", "truth/range"} <= expected
    assert names_in_netcdf(paths["netcdf"]) == expected
    assert names_in_mat(paths["mat"]) == expected
    with h5py.File(paths["hdf5"]) as file:
        elements = json.loads(file["victim-0"].attrs["array"])
    (found,) = np.atleast_1d(loadmat(paths["mat"], simplify_cells=True)["victims"])
    assert elements.keys() <= found["array"].keys()
    assert found["array"]["channel_gains"].tolist() == elements["channel_gains"]
    assert found["array"]["pattern"] == pytest.approx(elements["pattern"])
    assert found["if_filter"] == {"passband": 3e5, "stopband": 8e5, "attenuation": 1e9}
    assert found["units"]["if_filter"] == {"passband": "Hz", "stopband": "Hz", "attenuation": "1"}
    assert found["units"]["array"]["channel_gains"] == "1"
    assert found["units"]["array"]["pattern"]["azimuth_beamwidth"] == "rad"


def test_xarray_reads_the_netcdf_file(run, tmp_path):
    (path,) = writer_of("netcdf")(run, tmp_path)
    tree = xr.open_datatree(path, engine="h5netcdf")
    front, expected = tree["victim-0"], run.victim("front")
    found = front["parts_real"] + 1j * front["parts_imag"]
    np.testing.assert_allclose(found.sel(part="noise"), expected.parts["noise"], rtol=1e-6)
    assert float(front["truth/range"].sel(target="van")) == 2.0
    assert front["truth/range"].attrs["units"] == "m"
    assert front["truth/is_visible"].to_numpy().tolist() == [1, 0]
    tree.close()


def test_lists_of_the_netcdf_file_have_one_type_whatever_they_hold(run, tmp_path):
    """A list of one name came back as text, one with None as an expression of Python."""
    front = run.victims[0]
    score = replace(front.score, body=("car", None, None))
    one = replace(run, radars=("front",), victims=(replace(front, score=score),))
    (path,) = writer_of("netcdf")(one, tmp_path)
    tree = xr.open_datatree(path, engine="h5netcdf")
    assert json.loads(tree.attrs["radars"]) == ["front"]
    assert json.loads(tree.attrs["actors"]) == list(run.actors)
    assert json.loads(tree["victim-0/score"].attrs["body"]) == ["car", None, None]
    assert json.loads(tree["victim-0"].attrs["high_pass"]) is None
    assert json.loads(tree["victim-0"].attrs["part"]) == list(front.parts.names)
    assert float(tree["victim-0/truth"].attrs["time"]) == front.truth.time
    tree.close()


def test_h5py_reads_the_hdf5_file(run, tmp_path):
    (path,) = writer_of("hdf5")(run, tmp_path)
    expected = run.victim("front")
    with h5py.File(path) as file:
        samples = file["victim-0/samples"]
        np.testing.assert_array_equal(samples[...], expected.frame.samples.astype(np.complex64))
        assert [axis.label for axis in samples.dims] == ["channel", "ramp", "fast"]
        np.testing.assert_array_equal(
            samples.dims[2][0][...], np.arange(samples.shape[2]) / expected.frame.times.rate
        )
        assert file["victim-0/score/nature"].asstr()[...].tolist() == ["direct"] * 3
        assert file["victim-0/truth/range"].attrs["units"] == "m"


def test_the_hdf5_file_has_the_layout_of_hdf5_1_8(run, tmp_path):
    """HDF5 1.14, which MATLAB has, cannot read the newest layout of HDF5 2.0."""
    (path,) = writer_of("hdf5")(run, tmp_path)
    assert path.read_bytes()[8] == 2  # version of the superblock; 3 since HDF5 1.10


def test_the_sigmf_package_reads_the_samples(run, tmp_path):
    from sigmf import sigmffile

    meta, *_ = writer_of("sigmf")(run, tmp_path)
    recording = sigmffile.fromfile(str(meta))
    recording.validate()
    frame = run.victim("front").frame
    captures = recording.get_captures()
    ramp = 2
    first, count = captures[ramp]["core:sample_start"], int(frame.times.num_samples[ramp])
    found = recording.read_samples(start_index=first, count=count)
    np.testing.assert_allclose(found.T, frame.samples[:, ramp, :count], rtol=1e-6)
    assert captures[ramp]["polychirp:start_time"] == frame.times.first[ramp]
    told = recording.get_global_info()
    weight = told["polychirp:transmit_weight"]
    found = np.array(weight["real"]) + 1j * np.array(weight["imag"])
    np.testing.assert_array_equal(found, frame.schedule.transmit_weight)
    np.testing.assert_array_equal(told["polychirp:channel_position"], frame.array.position)
    np.testing.assert_array_equal(
        told["polychirp:transmit_position"], frame.array.transmit_position
    )


def contents(folder: Path) -> dict[str, bytes | None]:
    """Content of every file, and None of every folder, by path."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


@pytest.mark.parametrize("name", FORMATS)
def test_a_full_disk_leaves_the_former_files(run, tmp_path, name):
    """In a process of its own, since HDF5's library ended it with a segmentation fault."""
    folder = tmp_path / "out"
    folder.mkdir()
    writer_of(name)(replace(run, victims=run.victims[:1]), folder)
    before = contents(folder)
    command = [sys.executable, "-m", "polychirp", "export", str(tmp_path), "--to", name]
    done = subprocess.run(
        ["sh", "-c", 'ulimit -f 1; exec "$@"', "sh", *command, "--out", str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 4
    assert f"'{folder}' cannot be written: File too large" in done.stderr
    assert contents(folder) == before


@pytest.mark.parametrize("name", FORMATS)
def test_a_second_export_replaces_the_first(run, tmp_path, name):
    for folder in (tmp_path / "once", tmp_path / "twice"):
        folder.mkdir()
    writer_of(name)(replace(run, victims=run.victims[:1]), tmp_path / "twice")
    for folder in (tmp_path / "once", tmp_path / "twice"):
        assert all(path.exists() for path in writer_of(name)(run, folder))
    assert contents(tmp_path / "twice").keys() == contents(tmp_path / "once").keys()


@pytest.mark.parametrize("name", ["csv", "sigmf"])
def test_a_second_export_leaves_no_victim_of_the_first(run, tmp_path, name):
    """Otherwise the folder has a radar that the run does not have."""
    first = writer_of(name)(run, tmp_path)
    assert any("victim-1" in str(path.relative_to(tmp_path)) for path in first)
    own = tmp_path / "victim-1" / "own.csv", tmp_path / "victim-7.sigmf-notes"
    for path in own:
        path.parent.mkdir(exist_ok=True)
        path.touch()
    second = writer_of(name)(replace(run, victims=run.victims[:1]), tmp_path)
    left = {path for path in tmp_path.rglob("*") if path.is_file() and "run.zarr" not in path.parts}
    assert left == {*second, *own}
    (tmp_path / "victim-1" / "own.csv").unlink()
    writer_of(name)(run, tmp_path)
    writer_of(name)(replace(run, victims=run.victims[:1]), tmp_path)
    assert name != "csv" or not (tmp_path / "victim-1").exists()


def test_tables_have_all_digits(run, tmp_path):
    writer_of("csv")(run, tmp_path)
    expected = run.victim("front")
    found = _table(tmp_path / "victim-0" / "detections.csv")
    assert [float(value) for value in found["range_m"]] == expected.detections.range.tolist()
    assert found["nature"] == ["direct"] * 3
    targets = _table(tmp_path / "victim-0" / "targets.csv")
    assert targets["target"] == ["car", "van"]
    assert targets["is_visible"] == ["1", "0"]
    assert [float(value) for value in targets["point_z_m"]] == [0.0, 0.0]
    paths = _table(tmp_path / "victim-0" / "paths.csv")
    assert [float(value) for value in paths["transfer_V_V_real"]] == [1.0, 1.0]
    assert len(_table(tmp_path / "victim-0" / "ramps.csv")["slope_hz_per_s"]) == 4
    assert _table(tmp_path / "victim-1" / "detections.csv")["range_m"] == []


def test_betterosi_reads_detections_and_targets(run, tmp_path):
    import betterosi

    (path,) = writer_of("osi")(run, tmp_path)
    messages = {
        topic: list(betterosi.read(path, mcap_topics=[topic]))
        for topic in ("victim-0/sensor_data", "victim-0/ground_truth")
    }
    (sensed,), (truth,) = messages.values()
    expected = run.victim("front")
    (radar,) = sensed.feature_data.radar_sensor
    assert [one.position.distance for one in radar.detection] == pytest.approx(
        expected.detections.range
    )
    # OSI 3.8, RadarDetection: "positive in direction to the sensor"
    assert [one.radial_velocity for one in radar.detection] == pytest.approx(
        -expected.detections.range_rate
    )
    assert [
        (one.source_reference[0].type, *one.source_reference[0].identifier)
        for one in truth.moving_object
    ] == [("target", "car"), ("target", "van"), ("vehicle", "ego")]


def test_the_mounting_position_of_osi_leads_to_the_radar(run, tmp_path):
    """The chain of OSI 3.8 gives the radar's pose in the world. The vehicle's origin is position +
    R bbcenter_to_rear of the host (osi_sensordata.proto), the middle of the rear axle; the sensor's
    is the mounting position from there. Orientations turn by yaw about z, then by pitch about the
    new y, then by roll about the new x, each by the right-hand rule (osi_common.proto)."""
    import betterosi
    from scipy.spatial.transform import Rotation

    def vector(one):
        return np.array([one.x, one.y, one.z])

    def turn(one):
        return Rotation.from_euler("ZYX", [one.yaw, one.pitch, one.roll])

    (path,) = writer_of("osi")(run, tmp_path)
    (sensed,) = betterosi.read(path, mcap_topics=["victim-0/sensor_data"])
    (truth,) = betterosi.read(path, mcap_topics=["victim-0/ground_truth"])
    (host,) = [one for one in truth.moving_object if one.id.value == truth.host_vehicle_id.value]
    mount = sensed.mounting_position
    rear = vector(host.base.position) + turn(host.base.orientation).apply(
        vector(host.vehicle_attributes.bbcenter_to_rear)
    )
    # a sedan that heads along y; its rear wheels, of 0.32 m radius, are 1.34 m behind its middle
    np.testing.assert_allclose(rear, [5.0, -2.0 - 1.34, 0.32], atol=1e-9)
    np.testing.assert_allclose(vector(mount.position), [2.0 + 1.34, 0.3, 0.6 - 0.32], atol=1e-9)
    place = rear + turn(host.base.orientation).apply(vector(mount.position))
    np.testing.assert_allclose(place, [5.0 - 0.3, -2.0 + 2.0, 0.6], atol=1e-9)
    ahead = turn(host.base.orientation).apply(turn(mount.orientation).apply([1.0, 0.0, 0.0]))
    level, azimuth = np.cos(0.1), np.pi / 2 + 0.2
    expected = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(0.1)]
    np.testing.assert_allclose(ahead, expected, atol=1e-9)
    assert sensed.feature_data.radar_sensor[0].header.mounting_position == mount


def test_objects_of_osi_are_boxes_that_stand_on_the_ground(run, tmp_path):
    """Size of a built-in sedan: 4.6 m by 1.8 m; the middle of its box is above its origin."""
    import betterosi

    (path,) = writer_of("osi")(run, tmp_path)
    (truth,) = betterosi.read(path, mcap_topics=["victim-0/ground_truth"])
    car, van, ego = (one.base for one in truth.moving_object)
    length, width = vehicle_size("sedan")
    for one in (car, ego):
        assert one.dimension.length == pytest.approx(length, abs=0.02)
        assert one.dimension.width == pytest.approx(width, abs=0.02)
        assert one.position.z == pytest.approx(one.dimension.height / 2, abs=1e-9)
    assert (car.position.x, car.position.y) == pytest.approx((5.0, 20.0), abs=0.02)
    assert (van.position.x, van.position.y) == pytest.approx((40.0, 0.0), abs=0.02)
    assert van.dimension.height > car.dimension.height
    assert abs(car.orientation.yaw) == pytest.approx(np.pi)
    assert (ego.velocity.x, ego.velocity.y) == pytest.approx((0.0, 7.0), abs=1e-9)


def test_tables_and_bags_have_the_pose_of_the_radar(run, tmp_path):
    from rosbags.highlevel import AnyReader
    from scipy.spatial.transform import Rotation

    writer_of("csv")(run, tmp_path)
    radar = _table(tmp_path / "victim-0" / "radar.csv")
    assert (radar["radar"], radar["vehicle"]) == (["front"], ["ego"])
    place = [float(radar[f"radar_position_{axis}_m"][0]) for axis in "xyz"]
    assert place == pytest.approx([4.7, 0.0, 0.6], abs=1e-9)
    assert float(radar["radar_orientation_yaw_rad"][0]) == pytest.approx(np.pi / 2 + 0.2)
    assert float(radar["radar_orientation_pitch_rad"][0]) == pytest.approx(0.1)
    bodies = _table(tmp_path / "victim-0" / "bodies.csv")
    assert bodies["body"] == ["car", "van", "ego"]
    assert float(bodies["box_centre_x_m"][1]) == pytest.approx(40.0, abs=0.02)

    (path,) = writer_of("rosbag")(run, tmp_path)
    with AnyReader([path]) as reader:
        chosen = [one for one in reader.connections if one.topic == "/tf"]
        poses = [
            reader.deserialize(data, connection.msgtype).transforms[0]
            for connection, _, data in reader.messages(connections=chosen)
        ]
    front, moved = poses[0], poses[0].transform.translation
    assert (front.header.frame_id, front.child_frame_id) == ("world", "front")
    assert [one.child_frame_id for one in poses] == ["front", "rear"]
    assert [moved.x, moved.y, moved.z] == pytest.approx(place)
    turned = front.transform.rotation
    ahead = Rotation.from_quat([turned.x, turned.y, turned.z, turned.w]).apply([1.0, 0.0, 0.0])
    level, azimuth = np.cos(0.1), np.pi / 2 + 0.2
    expected = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(0.1)]
    np.testing.assert_allclose(ahead, expected, atol=1e-9)


def test_rosbags_reads_the_point_clouds(run, tmp_path):
    from rosbags.highlevel import AnyReader

    (path,) = writer_of("rosbag")(run, tmp_path)
    with AnyReader([path]) as reader:
        clouds = {
            connection.topic: reader.deserialize(data, connection.msgtype)
            for connection, _, data in reader.messages()
        }
    assert sorted(clouds) == ["/tf", "/victim_0/detections", "/victim_1/detections"]
    cloud, found = clouds["/victim_0/detections"], run.victim("front").detections
    points = cloud.data.view("<f4").reshape(-1, len(FIELDS))
    np.testing.assert_allclose(points[:, FIELDS.index("range")], found.range, rtol=1e-6)
    np.testing.assert_allclose(
        np.linalg.norm(points[:, :3], axis=1), np.abs(found.range), rtol=1e-5
    )
    np.testing.assert_allclose(
        points[:, 1], found.range * np.sin(found.azimuth), rtol=1e-5, atol=1e-6
    )
    assert points[:, FIELDS.index("is_ghost")].tolist() == [1.0, 1.0, 1.0]
    assert clouds["/victim_1/detections"].width == 0


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "osi"])
def test_equal_runs_give_equal_files(run, tmp_path, name):
    """A file of OSI holds the time at which it was made, as its standard wants."""
    contents = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        folder.mkdir()
        writer_of(name)(run, folder)
        contents.append(
            {
                path.relative_to(folder): path.read_bytes()
                for path in sorted(folder.rglob("*"))
                if path.is_file()
            }
        )
    assert contents[0] == contents[1]


def test_what_cannot_be_exported_is_told(run, tmp_path, monkeypatch):
    with pytest.raises(InputError, match="no format 'matlb'; there are 'mat'"):
        writer_of("matlb")
    monkeypatch.setattr(formats, "find_spec", lambda _: None)
    with pytest.raises(CapabilityError, match=r"needs the package 'h5py' .*polychirp\[exchange\]"):
        writer_of("hdf5")


def test_the_command_exports_a_run_beside_it_or_elsewhere(run, tmp_path, capsys):
    assert main(["export", str(tmp_path), "--to", "csv", "--to", "mat"]) == 0
    shown = capsys.readouterr()
    assert str(tmp_path / "run.mat") in shown.out.splitlines()
    assert "victim-1 is the radar 'rear'" in shown.err
    elsewhere = tmp_path / "new" / "folder"
    assert main(["export", str(tmp_path / "run.zarr"), "--to", "mat", "--out", str(elsewhere)]) == 0
    assert [path.name for path in elsewhere.iterdir()] == ["run.mat"]
    assert main(["export", str(tmp_path / "nothing"), "--to", "mat"]) == 2
    assert "there is no run in" in capsys.readouterr().err


def test_one_format_that_is_refused_keeps_no_other_from_being_written(
    run, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr("polychirp.exchange.matlab.LARGEST_VARIABLE", 1)
    monkeypatch.setattr(formats, "find_spec", lambda name: None if name == "h5py" else 1)
    wanted = [word for name in ("mat", "hdf5", "csv", "sigmf") for word in ("--to", name)]
    assert main(["export", str(tmp_path), *wanted]) == CapabilityError.exit_code
    shown = capsys.readouterr()
    assert str(tmp_path / "victim-0" / "detections.csv") in shown.out.splitlines()
    assert "sigmf-meta" in shown.out
    told = " ".join(shown.err.split())
    assert "formats that were not written: 2 of 4 mat: the victims of this run need" in told
    assert "hdf5: the format 'hdf5' needs the package 'h5py'" in told
    assert not (tmp_path / "run.mat").exists()
    assert main(["export", str(tmp_path), "--to", "csv", "--to", "matlb"]) == 2
    assert "polychirp: there is no format 'matlb'" in capsys.readouterr().err


def test_a_name_is_never_a_formula_and_a_number_stays_one(run, tmp_path):
    front = run.victims[0]
    bodies = replace(front.placement, name=("=1+1", *front.placement.name[1:]))
    closing = replace(front.truth, range_rate=[-1.5, -2.5])
    odd = replace(run, victims=(replace(front, placement=bodies, truth=closing),))
    writer_of("csv")(odd, tmp_path)
    found = _table(tmp_path / "victim-0" / "bodies.csv")
    assert found["body"] == ["'=1+1", *front.placement.name[1:]]
    targets = _table(tmp_path / "victim-0" / "targets.csv")
    assert targets["range_rate_m_per_s"] == ["-1.5", "-2.5"]


def _table(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    return {name: [row[n] for row in rows[1:]] for n, name in enumerate(rows[0])}
