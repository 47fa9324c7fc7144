"""``polychirp rcs``: what it prints and writes, and the one sentence of every mistake."""

import csv
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from polychirp.cli.app import main
from polychirp.testing.shapes import mesh_of, plate, sphere
from polychirp.traffic.mesh_file import save_glb


def stl(corners, path):
    """A binary STL file of triangles, m ``(face, corner, xyz)``."""
    faces = b"".join(
        struct.pack("<12fH", 0, 0, 0, *face.astype(np.float32).reshape(-1), 0) for face in corners
    )
    path.write_bytes(bytes(80) + struct.pack("<I", len(corners)) + faces)
    return str(path)


def last_words(capsys):
    return [line for line in capsys.readouterr().err.splitlines() if line.startswith("polychirp:")]


@pytest.fixture
def square(tmp_path):
    """A plate of 0.1 m that faces +x, in millimetres."""
    return stl(1e3 * plate(0.1, 0.05), tmp_path / "square.stl")


def test_a_plate_is_printed_drawn_and_written(square, tmp_path, capsys):
    """Ahead it has 4πA²/λ² = 19.41 dBsm, from behind nothing; the mean is a 36th, 3.85 dBsm."""
    options = ["--scale", "0.001", "--material", "metal", "--far", "--step", "10 deg"]
    assert main(["rcs", square, *options, "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert "square in the far field, elevation 0°, 79 GHz: VV, dBsm" in printed
    (mean,) = [line for line in printed.splitlines() if line.startswith("  mean")]
    assert float(mean.split()[-1]) == pytest.approx(19.41 - 10 * np.log10(36), abs=0.1)
    assert (tmp_path / "out" / "rcs.png").read_bytes().startswith(b"\x89PNG")
    with (tmp_path / "out" / "rcs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["azimuth_deg"]) for row in rows] == list(range(-180, 180, 10))
    ahead = rows[18]
    assert float(ahead["vv_dbsm"]) == pytest.approx(19.41, abs=0.1)
    assert float(ahead["hh_dbsm"]) == pytest.approx(19.41, abs=0.1)
    assert float(ahead["vh_dbsm"]) < -60
    assert float(rows[0]["vv_dbsm"]) == -400
    (median,) = [line for line in printed.splitlines() if line.startswith("  median")]
    assert median.split()[-1] == "none"


def test_a_glb_file_keeps_its_materials_unless_told(tmp_path, capsys):
    """A pane returns 20 log₁₀ 0.5106 = −5.84 dB of metal."""
    path = str(tmp_path / "pane.glb")
    save_glb(mesh_of(plate(0.1, 0.05), "glass"), path)
    options = ["--step", "45 deg", "--range", "20 m", "-o", str(tmp_path)]
    levels = []
    for more in ([], ["--material", "metal"]):
        assert main(["rcs", path, *options, *more]) == 0
        (line,) = [row for row in capsys.readouterr().out.splitlines() if "front median" in row]
        levels.append(float(line.split()[-1]))
    assert levels[1] - levels[0] == pytest.approx(5.84, abs=0.1)


def test_files_may_be_y_up_or_z_up(tmp_path, capsys):
    """A plate that faces up in a z-up file faces to the right where y is up: (x, z, −y)."""
    flat = np.roll(plate(0.1, 0.05), -1, axis=-1)  # faces +z
    path = stl(flat, tmp_path / "flat.stl")
    options = ["--material", "metal", "--step", "45 deg", "-o", str(tmp_path), "--range", "9 m"]
    assert main(["rcs", path, *options, "--up", "y"]) == 0
    assert "side median" in capsys.readouterr().out
    with (tmp_path / "rcs.csv").open() as file:
        level = {float(r["azimuth_deg"]): float(r["vv_dbsm"]) for r in csv.DictReader(file)}
    assert max(level, key=level.__getitem__) == -90.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["bus"], "'bus' is neither a mesh file (.glb, .obj, .stl) nor one of sedan, hatchback"),
        (["nothing.glb"], "there is no mesh file 'nothing.glb'; give the path"),
        (["sedan", "--range", "10"], "--range: '10' is not a value in m; write it like '0.5 m'"),
        (["sedan", "--range", "2 m"], "a radar at 2 m is inside the sphere around the body"),
        (["sedan", "--step", "0 deg"], "--step: use a value above zero"),
        (["sedan", "--step", "90 deg"], "--step: use at most 45 deg"),
        (["sedan", "--elevation", "100 deg"], "--elevation: use -90 deg to 90 deg"),
        (["sedan", "--material", "metl"], "no material 'metl'; there are 'metal', 'glass'"),
        (["sedan", "--material", "metl"], "did you mean 'metal'?"),
        (["sedan", "--range", "9 m", "--far"], "not allowed with argument"),
        (["sedan", "--scale", "0.001"], "--scale: the built-in body 'sedan' does not take it"),
        (["van", "--up", "z"], "--up: the built-in body 'van' does not take it"),
        (["sedan", "--frequency", "1e-300 Hz"], "'1e-300 Hz' is outside of 1 GHz to 1000 GHz"),
    ],
)
def test_a_mistake_is_one_sentence(arguments, sentence, capsys):
    assert main(["rcs", *arguments]) == 2
    (said,) = last_words(capsys)
    assert sentence in said


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ([], "names no materials; name one, as in --material metal"),
        (["--material", "metal", "--scale", "mm"], "--scale: 'mm' is not a number; try 0.001"),
        (
            ["--material", "metal", "--scale", "10"],
            "is 1000 m large; if the file is in mm, add --scale",
        ),
        (["--material", "metal", "--scale", "1e-6"], "is 0.1 mm large, too small"),
        (
            ["--material", "metal", "--scale", "0.001", "--frequency", "10 GHz"],
            "is 100 mm large, too small for physical optics, which needs 5 wavelengths, 150 mm",
        ),
    ],
)
def test_a_mistake_with_a_file_is_one_sentence(square, options, sentence, capsys):
    assert main(["rcs", square, *options]) == 2
    (said,) = last_words(capsys)
    assert sentence in said


def test_a_file_without_faces_is_refused(tmp_path, capsys):
    path = tmp_path / "empty.obj"
    path.write_text("v 0 0 0\nv 1 0 0\n")
    assert main(["rcs", str(path)]) == 2
    (said,) = last_words(capsys)
    assert "holds no triangles" in said


def test_a_body_turned_inside_out_is_refused(tmp_path, capsys):
    path = stl(sphere(0.1, 0.05)[:, ::-1], tmp_path / "ball.stl")
    assert main(["rcs", path, "--material", "metal", "--step", "45 deg"]) == 2
    (said,) = last_words(capsys)
    assert "has no echo" in said
    assert said.endswith("or turn the normals of its faces outwards")


def test_a_plate_that_is_seen_from_its_edge_alone_is_not_said_to_be_inside_out(tmp_path, capsys):
    """It faces up, and its echo is there from above."""
    path = stl(np.roll(plate(0.1, 0.05), -1, axis=-1), tmp_path / "flat.stl")
    options = ["--material", "metal", "--step", "45 deg", "--range", "9 m", "-o", str(tmp_path)]
    assert main(["rcs", path, *options]) == 2
    (said,) = last_words(capsys)
    assert "no face of it may be visible, as of a plate seen from its edge" in said
    assert "choose another --elevation" in said
    assert main(["rcs", path, *options, "--elevation", "80 deg"]) == 0


def test_a_glb_file_without_materials_is_refused_with_the_option_that_helps(tmp_path, capsys):
    path = tmp_path / "box.glb"
    trimesh.Scene([trimesh.creation.box((0.1, 0.1, 0.1))]).export(path)
    assert main(["rcs", str(path)]) == 2
    (said,) = last_words(capsys)
    assert "as in --material metal" in said


def test_a_dollar_in_a_name_is_no_formula(square, tmp_path, capsys):
    """The picture has the name as its title."""
    path = tmp_path / "$x^{$.stl"
    path.write_bytes(Path(square).read_bytes())
    options = ["--scale", "0.001", "--material", "metal", "--step", "45 deg"]
    assert main(["rcs", str(path), *options, "-o", str(tmp_path / "out")]) == 0
    assert "$x^{$" in capsys.readouterr().out


def test_a_folder_that_is_a_file_is_refused_before_the_work(square, capsys):
    assert main(["rcs", square, "--material", "metal", "-o", square]) == 2
    (said,) = last_words(capsys)
    assert "is a file; name a folder" in said


def test_a_file_that_is_not_there_is_said_before_its_materials(tmp_path, capsys):
    assert main(["rcs", str(tmp_path / "none.stl")]) == 2
    assert "there is no mesh file" in last_words(capsys)[0]
