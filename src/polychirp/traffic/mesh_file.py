"""Reading of meshes from GLB, OBJ and STL files, and writing of meshes to GLB files."""

import logging
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.model.mesh import Mesh
from polychirp.traffic.mesh_check import NoOtherFiles, checked_content, plausible_scale
from polychirp.traffic.surface import subdivided

if TYPE_CHECKING:
    import trimesh

TABLE_MATERIALS: Final = ("metal", "glass", "rubber", "plastic", "asphalt", "brick", "wood", "leaf")
"""Names of materials that need no mapping: those of the paper's table 1."""

Axis = Literal["x", "-x", "y", "-y", "z", "-z"]
"""Axis of a file, and its direction."""

FARTHEST_VERTEX: Final = 1e6
"""Largest magnitude of a vertex's coordinate, m. Chosen: beyond it, edges of 1 cm lose digits."""

_MATERIAL_COLOUR: Final = {
    "metal": (140, 155, 190, 255),
    "glass": (90, 190, 215, 120),
    "rubber": (30, 30, 30, 255),
    "plastic": (65, 65, 70, 255),
}


def load_mesh(
    path: str | Path,
    *,
    materials: Mapping[str, str] | None = None,
    default_material: str | None = None,
    scale: float = 1.0,
    up_axis: Literal["y", "z"] = "y",
    front_axis: Axis = "x",
    max_edge: float = math.inf,
) -> Mesh:
    """A mesh from a GLB, OBJ or STL file; the names of its objects become parts.

    `save_glb` writes a mesh, and `cross_sections` computes its radar cross section.

    Parameters
    ----------
    path : of the file
    materials : material of polychirp by material name in the file; names of table 1 such as
        "metal" need no entry
    default_material : material of polychirp for all others; an STL file names no materials
    scale : metres per unit of the file
    up_axis : "y" or "z", as in polychirp; the system is right-handed
    front_axis : axis of the file that points to the front of the body; "z" in bodies that keep to
        the convention of glTF
    max_edge : m; edges that are longer are halved until none is

    Raises
    ------
    InputError
        The file is missing, cannot be read, refers to other files, has no triangles or corners
        that are no numbers, a material is not mapped, or the front points up or down.
    """
    import trimesh

    file = Path(path)
    plausible_scale(scale)
    content = checked_content(file)
    other_files: Any = NoOtherFiles(file.name, content)
    try:
        with np.errstate(all="ignore"), _quiet():
            scene = trimesh.load_scene(
                BytesIO(content),
                file_type=file.suffix[1:].lower(),
                resolver=other_files,
                process=False,
            )
            pieces = [
                (part, _material_name(geometry), geometry)
                for part, geometry in _placed(scene, trimesh)
                if len(geometry.faces)
            ]
    except ImportError:  # after a failure trimesh tries a reader that is not installed
        raise InputError(
            f"'{file}' cannot be read as a mesh; it is damaged, or not what its name says"
        ) from None
    except Exception as error:  # trimesh raises whatever its parsers raise
        reason = str(error).partition("\n")[0][:200]
        raise InputError(f"'{file}' cannot be read as a mesh: {reason}") from error
    if not pieces:
        raise InputError(f"'{file}' holds no triangles; export the body as a mesh")
    known = {name: name for name in TABLE_MATERIALS} | dict(materials or {})
    unknown = sorted({name for _, name, _ in pieces} - set(known))
    if default_material is not None:
        known |= dict.fromkeys(unknown, default_material)
    elif unknown:
        raise InputError(
            f"'{file}' uses the material '{unknown[0]}', which is not known; "
            f"map it to one of {', '.join(TABLE_MATERIALS)}"
        )
    try:
        mesh = _joined([(part, known[name], geometry) for part, name, geometry in pieces])
    except (InputError, ValueError, TypeError):  # faces of vertices that are not there
        raise InputError(
            f"'{file}' cannot be read as a mesh: a face has a vertex that is not there"
        ) from None
    vertex = scale * _in_own_frame(mesh.vertex, up_axis=up_axis, front_axis=front_axis)
    _check_vertices(file, vertex, mesh.face)
    mesh = replace(mesh, vertex=vertex)
    return mesh if math.isinf(max_edge) else subdivided(mesh, max_edge)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep trimesh from logging the tracebacks of errors from which it recovers."""
    log = logging.getLogger("trimesh")
    before = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(before)


def _check_vertices(file: Path, vertex: FloatArray, face: IntArray) -> None:
    """Refuse vertices beyond `FARTHEST_VERTEX` or NaN, and meshes whose triangles have no area."""
    is_bad = ~np.all(np.abs(vertex[face]) <= FARTHEST_VERTEX, axis=(1, 2))  # NaN as well
    if np.any(is_bad):
        raise InputError(
            f"'{file}' has {np.sum(is_bad)} triangles with corners that are not numbers or beyond "
            f"{FARTHEST_VERTEX / 1e3:g} km, the first is number {int(np.argmax(is_bad))}; export "
            "it again, or give the metres per unit of the file as its scale"
        )
    a, b, c = np.moveaxis(vertex[face], 1, 0)
    if not np.any(np.cross(b - a, c - a)):
        raise InputError(f"'{file}' has no triangle with an area; export the body as a mesh")


def save_glb(mesh: Mesh, path: str | Path) -> None:
    """Write a mesh as GLB, y up as in glTF; parts become nodes, materials keep their names.

    A part of several materials becomes one node for each; vertices are single precision.
    `InputError` is raised if the mesh is empty.

    `load_mesh` reads it again.
    """
    if mesh.num_faces == 0:
        raise InputError(f"there is nothing to write to '{path}': the mesh has no faces")
    import trimesh as library

    trimesh: Any = library  # its visuals are not typed
    scene = trimesh.Scene()
    looks = {
        name: trimesh.visual.material.PBRMaterial(
            name=name, baseColorFactor=_MATERIAL_COLOUR.get(name, (160, 140, 110, 255))
        )
        for name in mesh.materials
    }
    for part, name in enumerate(mesh.parts):
        for material in np.unique(mesh.material[mesh.part == part]):
            chosen = (mesh.part == part) & (mesh.material == material)
            used, face = np.unique(mesh.face[chosen], return_inverse=True)
            label = mesh.materials[material]
            geometry = trimesh.Trimesh(
                vertices=_to_y_up(mesh.vertex[used]),
                faces=face.reshape(-1, 3),
                visual=trimesh.visual.TextureVisuals(material=looks[label]),
                process=False,
            )
            title = f"{name}{_NAME_SEPARATOR}{label}"
            scene.add_geometry(geometry, node_name=title, geom_name=title)
    Path(path).write_bytes(scene.export(file_type="glb"))


_NAME_SEPARATOR: Final = "·"


def _placed(scene: "trimesh.Scene", library: Any) -> list[tuple[str, Any]]:
    """Part name and geometry, in the scene's frame, of every node that has triangles."""
    found = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, library.Trimesh):
            placed = geometry.copy()
            placed.apply_transform(transform)
            found.append((str(node).partition(_NAME_SEPARATOR)[0], placed))
    return found


def _material_name(geometry: Any) -> str:
    return str(getattr(getattr(geometry.visual, "material", None), "name", None) or "unnamed")


def _joined(pieces: list[tuple[str, str, Any]]) -> Mesh:
    """One mesh from (part, material, geometry)."""
    parts = tuple(dict.fromkeys(part for part, _, _ in pieces))
    materials = tuple(dict.fromkeys(material for _, material, _ in pieces))
    counts = [len(geometry.faces) for _, _, geometry in pieces]
    starts = np.cumsum([0, *(len(geometry.vertices) for _, _, geometry in pieces)])
    return Mesh(
        vertex=np.concatenate([np.asarray(geometry.vertices) for _, _, geometry in pieces]),
        face=np.concatenate(
            [
                np.asarray(geometry.faces) + start
                for (_, _, geometry), start in zip(pieces, starts, strict=False)
            ]
        ),
        material=np.repeat([materials.index(material) for _, material, _ in pieces], counts),
        part=np.repeat([parts.index(part) for part, _, _ in pieces], counts),
        materials=materials,
        parts=parts,
    )


def _to_y_up(vertex: FloatArray) -> FloatArray:
    """(x forward, y left, z up) as (x, z, −y)."""
    return np.column_stack([vertex[:, 0], vertex[:, 2], -vertex[:, 1]])


def _in_own_frame(vertex: FloatArray, *, up_axis: str, front_axis: str) -> FloatArray:
    """Vertices ``(vertex, xyz)`` with x to the front, y to the left and z up."""
    up, front = _unit(up_axis), _unit(front_axis)
    if up @ front:
        raise InputError(
            f"a front_axis of '{front_axis}' points up or down with the up_axis '{up_axis}'; name "
            "one that is horizontal"
        )
    # each axis is one of the file's, so that a corner at infinity stays there alone
    axes = [front, np.cross(up, front), up]
    return np.column_stack([vertex[:, np.argmax(np.abs(one))] * one.sum() for one in axes])


def _unit(axis: str) -> FloatArray:
    """Unit vector of an axis such as "-z"."""
    vector = np.zeros(3)
    vector["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return vector
