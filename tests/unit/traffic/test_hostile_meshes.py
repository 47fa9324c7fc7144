"""Mesh files of strangers: no other file is opened, nothing hangs, and the reason is right."""

import json
import struct
import time
from contextlib import suppress

import numpy as np
import pytest

from polychirp.channel.rcs import num_aspects
from polychirp.errors import InputError
from polychirp.traffic.mesh_check import checked_content
from polychirp.traffic.mesh_file import load_mesh, save_glb
from polychirp.traffic.surface import Fineness, subdivided
from polychirp.traffic.vehicle import vehicle_mesh

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
CAR = vehicle_mesh("sedan", max_edge=0.3, coarseness=6.0)


def as_metal(path):
    return load_mesh(path, default_material="metal")


@pytest.fixture
def glb(tmp_path):
    save_glb(CAR, tmp_path / "car.glb")
    return tmp_path / "car.glb"


def described(path) -> tuple[dict, bytes]:
    """Description and the rest of a GLB file."""
    content = path.read_bytes()
    length = int.from_bytes(content[12:16], "little")
    return json.loads(content[20 : 20 + length]), content[20 + length :]


def rewrite(path, description: object, rest: bytes, *, text: bytes = b"") -> None:
    text = text or json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    size = 20 + len(text) + len(rest)
    path.write_bytes(b"glTF" + struct.pack("<II", 2, size) + struct.pack("<I", len(text)) + b"JSON")
    with path.open("ab") as file:
        file.write(text + rest)


def test_a_file_that_is_not_touched_reads_after_it_is_rewritten(glb):
    rewrite(glb, *described(glb))
    assert load_mesh(glb).num_faces == CAR.num_faces


@pytest.mark.parametrize("suffix", [".zip", ".gltf", ".ply", ".toml", ""])
def test_only_glb_obj_and_stl_are_meshes(tmp_path, suffix):
    path = tmp_path / f"car{suffix}"
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(InputError, match=r"is not a mesh file; give one of \.glb, \.obj, \.stl"):
        as_metal(path)


@pytest.mark.parametrize("what", ["buffers", "images"])
@pytest.mark.parametrize("uri", ["../secret.bin", "/etc/passwd", "http://host/x", "car.bin"])
def test_a_glb_file_opens_no_other_file(glb, what, uri):
    description, rest = described(glb)
    description.setdefault(what, []).append({"uri": uri, "byteLength": 4})
    rewrite(glb, description, rest)
    with pytest.raises(InputError, match="are in other files, which are not opened"):
        as_metal(glb)


def test_an_obj_file_opens_no_other_file(tmp_path):
    """Its materials have the names that the file itself gives, though the .mtl file has others."""
    (tmp_path / "box.obj").write_text(f"mtllib box.mtl\nusemtl glass\n{TRIANGLE}")
    (tmp_path / "box.mtl").write_text("newmtl secret\nmap_Kd ../secret.png\n")
    assert load_mesh(tmp_path / "box.obj").materials == ("glass",)


@pytest.mark.parametrize(
    "links", [{0: [0]}, {0: [1], 1: [0]}, {0: [2], 1: [2]}, {0: [10**9]}, {0: ["x"]}, {0: {}}]
)
def test_nodes_that_are_no_tree_are_refused(glb, links):
    description, rest = described(glb)
    for node in description["nodes"]:
        node.pop("children", None)
    for node, children in links.items():
        description["nodes"][node]["children"] = children
    rewrite(glb, description, rest)
    with pytest.raises(InputError, match=r"cannot be read as a mesh: (its nodes|it refers|one of)"):
        as_metal(glb)


@pytest.mark.parametrize("links", [{0: [*range(1, 50_000)]}, {0: [1], 1: 200_000 * [1]}])
def test_many_nodes_are_checked_in_a_time_that_grows_no_faster_than_they_do(glb, links):
    """Once, these took a minute and more, or filled the memory."""
    description, rest = described(glb)
    nodes = [{} for _ in range(50_000)]
    for node, children in links.items():
        nodes[node]["children"] = children
    rewrite(glb, {**description, "nodes": nodes, "scenes": []}, rest)
    start = time.monotonic()
    with suppress(InputError):
        checked_content(glb)
    assert time.monotonic() - start < 10.0


@pytest.mark.parametrize("count", [-1, 2**60, 1.5, "many", None])
def test_a_table_of_no_plausible_length_is_refused(glb, count):
    description, rest = described(glb)
    description["accessors"][0]["count"] = count
    rewrite(glb, description, rest)
    with pytest.raises(InputError, match="no plausible length"):
        as_metal(glb)


@pytest.mark.parametrize("text", [b"[1]", b"{", b"[" * 100_000, b"9" * 5000, b"\xff\xff"])
def test_a_description_that_is_no_object_is_refused(glb, text):
    _, rest = described(glb)
    rewrite(glb, None, rest, text=text)
    with pytest.raises(InputError, match="cannot be read as a mesh"):
        as_metal(glb)


@pytest.mark.parametrize("keep", [0, 4, 19, 30, 2000, -10])
def test_a_glb_file_that_was_cut_off_is_refused(glb, keep):
    glb.write_bytes(glb.read_bytes()[:keep])
    with pytest.raises(InputError, match="cannot be read as a mesh"):
        as_metal(glb)


def stl(path, *, announced: int, there: int, value: float = 1.0):
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, value, 0, 0, 0, value, 0, 0)
    path.write_bytes(bytes(80) + struct.pack("<I", announced) + there * triangle)
    return path


def test_a_cut_stl_file_says_so(tmp_path):
    assert as_metal(stl(tmp_path / "a.stl", announced=3, there=3)).num_faces == 3
    with pytest.raises(
        InputError, match="announces 30 triangles, 1584 bytes, and has 234; copy it"
    ):
        as_metal(stl(tmp_path / "b.stl", announced=30, there=3))
    (tmp_path / "c.stl").write_text("solid x\nfacet normal 0 0 1\n outer loop\n vertex 0 0 0\n")
    with pytest.raises(InputError, match="was cut off before its 'endsolid'"):
        as_metal(tmp_path / "c.stl")


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
def test_corners_that_are_no_places_are_refused(tmp_path, value):
    with pytest.raises(InputError, match=r"has 2 triangles with corners that are not numbers or"):
        as_metal(stl(tmp_path / "a.stl", announced=2, there=2, value=value))


@pytest.mark.parametrize("corners", ["v 0 0 0\nv 1 0 0\nv 2 0 0\n", "v 1 1 1\n" * 3])
def test_triangles_that_are_all_lines_are_refused(tmp_path, corners):
    (tmp_path / "a.obj").write_text(f"{corners}f 1 2 3\n")
    with pytest.raises(InputError, match="no triangle with an area"):
        as_metal(tmp_path / "a.obj")


@pytest.mark.parametrize("face", ["0 1 2", "1 2 0", "1/1/1 0/1/1 2/1/1", "1 00 3"])
def test_the_vertex_0_of_an_obj_file_is_refused(tmp_path, face):
    (tmp_path / "a.obj").write_text(f"{TRIANGLE}f {face}\n")
    with pytest.raises(InputError, match="a face has the vertex 0, but vertices count from 1"):
        as_metal(tmp_path / "a.obj")


@pytest.mark.parametrize("face", ["1 2 30", "1 2 10 20", "10 20 30"])
def test_a_vertex_that_is_not_there_is_refused(tmp_path, face):
    (tmp_path / "a.obj").write_text(f"{TRIANGLE}f {face}\n")
    with pytest.raises(InputError, match="cannot be read as a mesh"):
        as_metal(tmp_path / "a.obj")


@pytest.mark.parametrize("scale", [np.nan, np.inf, 1e300, 1e-300, -1.0])
def test_a_scale_that_is_no_scale_is_refused(glb, scale):
    with pytest.raises(InputError, match="scale"):
        load_mesh(glb, scale=scale)


@pytest.mark.parametrize("max_edge", [1e-300, 1e-9, 1e-4])
def test_edges_that_would_fill_the_memory_are_refused(glb, max_edge):
    with pytest.raises(InputError, match="use a longer max_edge"):
        subdivided(CAR, max_edge)
    with pytest.raises(InputError, match="use a longer max_edge"):
        load_mesh(glb, max_edge=max_edge)
    with pytest.raises(InputError, match=r"too many facets; use at least 5 mm and 0\.1"):
        Fineness(max_edge=max_edge)


def test_a_step_that_gives_too_many_aspects_is_refused():
    with pytest.raises(InputError, match=r"gives 3.6e.11 aspects, more than 1000000; use a larger"):
        num_aspects(np.radians(1e-9))
