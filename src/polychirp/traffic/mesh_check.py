"""Checks of the bytes of an untrusted mesh file before it is read as a mesh."""

import json
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from polychirp.bounded_text import json_value
from polychirp.errors import InputError
from polychirp.traffic.surface import MOST_FACES

SUFFIXES: Final = (".glb", ".obj", ".stl")
"""Suffixes of mesh files that are read; archives and other formats are refused."""

LARGEST_FILE: Final = 256 << 20
"""Greatest size of a mesh file, bytes; chosen: binary STL of `MOST_FACES` faces takes 150 MB."""

_ZERO_INDEX: Final = re.compile(rb"(?m)^[ \t]*f[ \t](?:[^\n]*[ \t])?[+-]?0+(?:[/ \t\r]|$)")
"""Line of an OBJ file that makes a face of the vertex 0."""
_MATERIAL: Final = re.compile(rb"(?m)^[ \t]*usemtl[ \t]+([^\r\n]+)")
"""Line of an OBJ file that names a material."""
_TRIANGLES: Final = 4
"""Mode of a glTF primitive that consists of separate triangles: glTF's default."""


class NoOtherFiles:
    """Resolver that a mesh reader asks for other files; it opens none.

    Asked for the ``.mtl`` file of an OBJ file, it gives a table of the materials that the OBJ file
    names, so that materials keep their names whether the ``.mtl`` file exists or not.
    """

    def __init__(self, name: str, content: bytes) -> None:
        self.file_name = name
        self._content = content

    def get(self, key: str) -> bytes:
        """Content that stands for the file called ``key``."""
        if self.file_name.lower().endswith(".obj") and key.lower().endswith(".mtl"):
            names = dict.fromkeys(match.strip() for match in _MATERIAL.findall(self._content))
            return b"".join(b"newmtl " + name + b"\n" for name in names)
        raise FileNotFoundError(key)

    def __getitem__(self, key: str) -> bytes:
        return self.get(key)

    def keys(self) -> tuple[str, ...]:
        """Names of the files that can be read: none."""
        return ()


def checked_content(file: Path) -> bytes:
    """Bytes of a mesh file that is safe to read.

    `InputError` is raised if the file is missing, of another kind, too large, cut off, or refers to
    others or to itself.
    """
    suffix = file.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"'{file}' is not a mesh file; give one of {', '.join(SUFFIXES)}")
    if not file.is_file():
        raise InputError(f"there is no mesh file '{file}'; give the path of a GLB, OBJ or STL file")
    try:
        with file.open("rb") as opened:
            content = opened.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"'{file}' cannot be read as a mesh: {error.strerror}") from None
    if len(content) > LARGEST_FILE:
        raise InputError(f"'{file}' is larger than {LARGEST_FILE >> 20} MiB; export a coarser mesh")
    try:
        {".glb": _check_glb, ".obj": _check_obj, ".stl": _check_stl}[suffix](content)
    except InputError as error:
        raise InputError(f"'{file}' cannot be read as a mesh: {error}") from None
    return content


def _check_obj(content: bytes) -> None:
    if _ZERO_INDEX.search(content):
        raise InputError("a face has the vertex 0, but vertices count from 1; export it again")


def _check_stl(content: bytes) -> None:
    """Refuse a text file without an end, or a binary one of another length than its triangles."""
    if content[:5].lower() == b"solid" and b"facet" in content[:2000]:
        if b"endsolid" not in content[-2000:]:
            raise InputError("it was cut off before its 'endsolid'; copy it again")
        return
    if len(content) < 84:
        raise InputError(
            f"it has {len(content)} bytes, less than the header of an STL file; copy it again"
        )
    count = int.from_bytes(content[80:84], "little")
    if len(content) != 84 + 50 * count:
        raise InputError(
            f"it announces {count} triangles, {84 + 50 * count} bytes, and has {len(content)}; "
            "copy it again"
        )


def _check_glb(content: bytes) -> None:
    """Refuse a glTF scene that refers to other files or to itself, or has too many faces."""
    if len(content) < 20 or content[:4] != b"glTF" or content[16:20] != b"JSON":
        raise InputError("it is not a GLB file; export it again")
    length = int.from_bytes(content[12:16], "little")
    if 20 + length > len(content):
        raise InputError("it was cut off; copy it again")
    try:
        scene = json_value(content[20 : 20 + length].decode("utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError):
        raise InputError("its description is not JSON; export it again") from None
    if not isinstance(scene, dict):
        raise InputError("its description is not a JSON object; export it again")
    for what in ("buffers", "images"):
        for entry in _entries(scene, what):
            if not str(entry.get("uri", "data:")).startswith("data:"):
                raise InputError(
                    f"its {what} are in other files, which are not opened; export it as one file"
                )
    for accessor in _entries(scene, "accessors"):
        _count(accessor, greatest=6 * MOST_FACES)
    _check_nodes(scene)


def _check_nodes(scene: Mapping[str, Any]) -> None:
    """Refuse nodes that do not form trees, and more faces than `MOST_FACES`."""
    nodes = _entries(scene, "nodes")
    children = [list(_numbers(node.get("children", []), len(nodes))) for node in nodes]
    inner = [child for own in children for child in own]
    below = set(inner)
    waiting = [number for number in range(len(nodes)) if number not in below]
    num_met = 0
    # with two parents of one node, the walk could take for ever
    while waiting and len(below) == len(inner):
        num_met += 1
        waiting += children[waiting.pop()]
    if num_met != len(nodes):
        raise InputError("its nodes do not form a tree; export it again")
    for entry in _entries(scene, "scenes"):
        list(_numbers(entry.get("nodes", []), len(nodes)))
    meshes, accessors = _entries(scene, "meshes"), _entries(scene, "accessors")
    faces = [sum(_num_corners(one, accessors) for one in _entries(m, "primitives")) for m in meshes]
    used = [number for node in nodes for number in _numbers([node.get("mesh", [])], len(meshes))]
    total = sum(faces[number] for number in used) // 3
    if total > MOST_FACES:
        raise InputError(f"it has {total} faces, more than {MOST_FACES}; export a coarser mesh")


def _num_corners(primitive: Mapping[str, Any], accessors: list[dict[str, Any]]) -> int:
    """Bound on the corners of a primitive's triangles: a strip or fan has up to 3 per vertex."""
    attributes = primitive.get("attributes")
    place = attributes.get("POSITION") if isinstance(attributes, dict) else None
    place = primitive.get("indices", place)
    if place is None:
        return 0
    (number,) = _numbers([place], len(accessors))
    is_strip = primitive.get("mode", _TRIANGLES) != _TRIANGLES
    return (3 if is_strip else 1) * _count(accessors[number], greatest=6 * MOST_FACES)


def _count(accessor: Mapping[str, Any], *, greatest: int) -> int:
    count = accessor.get("count")
    if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count <= greatest:
        raise InputError("one of its tables has no plausible length; export it again")
    return count


def _entries(table: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    """The objects in the list ``key`` of the description; none if there is no such list."""
    found = table.get(key, [])
    if not (isinstance(found, list) and all(isinstance(entry, dict) for entry in found)):
        raise InputError(f"its {key} are not a list of objects; export it again")
    return found


def _numbers(told: object, limit: int) -> Iterator[int]:
    """Numbers of entries, each below ``limit``; an empty list in place of a number is left out."""
    if not isinstance(told, list):
        raise InputError("one of its lists of entry numbers is not a list; export it again")
    for number in told:
        if number == []:
            continue
        if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < limit:
            raise InputError("it refers to an entry that is not there; export it again")
        yield number


def plausible_scale(scale: float) -> None:
    """Refuse a scale, m per unit of the file, that is not positive or outside of 1e-9 to 1e9."""
    if not scale > 0:
        raise InputError("the scale of a mesh file must be positive")
    if not (math.isfinite(scale) and 1e-9 <= scale <= 1e9):
        raise InputError(
            f"a scale of {scale:g} m per unit of the mesh file is not plausible; use 0.001 for mm"
        )
