"""Meshes survive a file, and bad files are refused in one sentence."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.mesh import EMPTY_MESH, Mesh
from polychirp.traffic.mesh_file import load_mesh, save_glb
from polychirp.traffic.vehicle import vehicle_mesh

OBJ = """mtllib box.mtl
o flank
usemtl paint
v 0 0 0
v 200 0 0
v 200 100 0
v 0 100 0
f 1 2 3
f 1 3 4
o pane
usemtl glass
v 0 100 0
v 200 100 0
v 200 150 0
f 5 6 7
"""
MTL = "newmtl paint\nKd 0.8 0.1 0.1\nnewmtl glass\nKd 0.1 0.5 0.6\n"


@pytest.fixture
def obj(tmp_path):
    (tmp_path / "box.obj").write_text(OBJ)
    (tmp_path / "box.mtl").write_text(MTL)
    return tmp_path / "box.obj"


def areas(mesh: Mesh) -> dict[tuple[str, str], np.ndarray]:
    """Area vector of every part and material: turns with the faces, blind to their order."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    cross = np.cross(b - a, c - a) / 2
    return {
        (part, material): np.append(
            cross[chosen].sum(axis=0), np.linalg.norm(cross[chosen], axis=1).sum()
        )
        for k, part in enumerate(mesh.parts)
        for m, material in enumerate(mesh.materials)
        if (chosen := (mesh.part == k) & (mesh.material == m)).any()
    }


def test_a_vehicle_comes_back_from_a_glb_file(tmp_path):
    """Vertices are kept in single precision: 2⁻²⁴ of 2.3 m is 0.14 µm."""
    mesh = vehicle_mesh("sedan", max_edge=0.2, coarseness=4.0)
    save_glb(mesh, tmp_path / "car.glb")
    back = load_mesh(tmp_path / "car.glb")
    assert back.num_faces == mesh.num_faces
    assert set(back.parts) == set(mesh.parts)
    assert set(back.materials) == set(mesh.materials)
    assert back.vertex.min(axis=0) == pytest.approx(mesh.vertex.min(axis=0), abs=1e-6)
    assert back.vertex.max(axis=0) == pytest.approx(mesh.vertex.max(axis=0), abs=1e-6)
    before, after = areas(mesh), areas(back)
    assert before.keys() == after.keys()
    for key, area in before.items():
        assert after[key] == pytest.approx(area, abs=1e-5), key


def test_an_obj_file_keeps_its_materials_and_is_scaled_and_turned(obj):
    """y up: height y becomes z, and z (towards the viewer) becomes −y."""
    mesh = load_mesh(obj, materials={"paint": "metal"}, scale=0.01)
    assert set(mesh.materials) == {"metal", "glass"}
    assert mesh.vertex.max(axis=0) == pytest.approx([2.0, 0.0, 1.5])
    found = {material: area for (_, material), area in areas(mesh).items()}
    assert found["metal"] == pytest.approx([0.0, -2.0, 0.0, 2.0])
    assert found["glass"] == pytest.approx([0.0, -0.5, 0.0, 0.5])


def test_a_file_with_z_up_is_taken_as_it_is(obj):
    mesh = load_mesh(obj, materials={"paint": "metal"}, scale=0.01, up_axis="z")
    assert mesh.vertex.max(axis=0) == pytest.approx([2.0, 1.5, 0.0])


@pytest.mark.parametrize(
    ("up_axis", "front_axis", "expected"),
    [
        ("y", "x", [10.0, -3.0, 2.0]),  # y up and x ahead, so that z is to the right
        ("y", "z", [3.0, 10.0, 2.0]),  # glTF: x is to the left
        ("y", "-x", [-10.0, 3.0, 2.0]),
        ("z", "x", [10.0, 2.0, 3.0]),
        ("z", "y", [2.0, -10.0, 3.0]),
        ("z", "-y", [-2.0, 10.0, 3.0]),
    ],
)
def test_a_body_is_turned_to_its_front(tmp_path, up_axis, front_axis, expected):
    """A corner at (10, 2, 3) of the file."""
    path = tmp_path / "body.obj"
    path.write_text("v 0 0 0\nv 10 2 3\nv 0 1 0\nf 1 2 3\n")
    mesh = load_mesh(path, default_material="metal", up_axis=up_axis, front_axis=front_axis)
    assert min(np.linalg.norm(mesh.vertex - expected, axis=1)) == pytest.approx(0.0)
    with pytest.raises(InputError, match=f"front_axis of '-{up_axis}' points up or down"):
        load_mesh(path, default_material="metal", up_axis=up_axis, front_axis=f"-{up_axis}")


def test_long_edges_of_a_file_are_cut(obj):
    mesh = load_mesh(obj, materials={"paint": "metal"}, scale=0.01, max_edge=0.1)
    edges = np.linalg.norm(mesh.corners - np.roll(mesh.corners, 1, axis=1), axis=2)
    assert edges.max() <= 0.1
    assert sum(area[3] for area in areas(mesh).values()) == pytest.approx(2.5)


def test_an_unmapped_material_is_named(obj):
    with pytest.raises(InputError, match="uses the material 'paint', which is not known; map it"):
        load_mesh(obj)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"there is no mesh file '.*car\.glb'; give the path"):
        load_mesh(tmp_path / "car.glb")


@pytest.mark.parametrize("content", [b"", b"glTF but not really"])
def test_a_broken_file_is_refused(tmp_path, content):
    path = tmp_path / "broken.glb"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"broken\.glb' cannot be read as a mesh"):
        load_mesh(path)


def test_a_file_without_triangles_is_refused(tmp_path):
    path = tmp_path / "empty.obj"
    path.write_text("v 0 0 0\nv 1 0 0\n")
    with pytest.raises(InputError, match="holds no triangles"):
        load_mesh(path)


def test_an_empty_mesh_is_not_written(tmp_path):
    with pytest.raises(InputError, match="nothing to write"):
        save_glb(EMPTY_MESH, tmp_path / "empty.glb")


def test_a_scale_that_is_not_positive_is_refused(obj):
    with pytest.raises(InputError, match="scale"):
        load_mesh(obj, scale=0.0)
