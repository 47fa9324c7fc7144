"""``polychirp rcs`` — compute the radar cross section of a body over aspect."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.terminal import (
    add_option,
    figure_text,
    positive_value,
    printable,
    say,
    si_value,
    usable_folder,
)
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError, no_such

if TYPE_CHECKING:
    from polychirp.channel.rcs import CrossSections
    from polychirp.model.mesh import Mesh

BODIES: Final = ("sedan", "hatchback", "van", "truck", "articulated-truck")
SUFFIXES: Final = (".glb", ".obj", ".stl")
"""Names of the built-in bodies, and suffixes of the mesh files that can be read."""

LARGEST_BODY: Final = 100.0
"""Greatest size of a body from a file, m. Chosen: a larger one is taken for a wrong unit."""

SMALLEST_BODY: Final = 5.0
"""Least size of a body from a file, wavelengths, for physical optics to hold. Chosen."""

FREQUENCIES: Final = ("1 GHz", "1000 GHz")
"""Least and greatest frequency. Chosen: below, bodies are too small for physical optics; the upper
limit is that of study files."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``rcs``."""
    parser = subparsers.add_parser(
        "rcs",
        help="compute the radar cross section of a mesh over aspect",
        description="Trace the monostatic echo of a body from all around, and print and plot its "
        "radar cross section: what the radar equation reads at that range. MESH is a file "
        "(.glb, .obj, .stl) or one of sedan, hatchback, van, truck, articulated-truck. Range, "
        "azimuth (0 = front, positive left) and elevation count from the middle of the mesh's "
        "bounding box.",
    )
    parser.add_argument("mesh", metavar="MESH", help="a mesh file or a built-in body")
    where = parser.add_mutually_exclusive_group()
    add_option(where, "--range", "R", "10 m", "range of the radar from the middle of the body")
    where.add_argument(
        "--far", action="store_true", help="compute the far field (plane waves) instead"
    )
    add_option(parser, "--elevation", "A", "0 deg", "elevation of the radar, positive up")
    add_option(parser, "--step", "A", "0.5 deg", "step of azimuth")
    add_option(parser, "--frequency", "F", "79 GHz", "frequency")
    parser.add_argument(
        "--polarisation",
        choices=("VV", "VH", "HV", "HH"),
        default="VV",
        help="received, then transmitted polarisation of what is printed and drawn; the CSV file "
        "has all four (default: VV)",
    )
    parser.add_argument(
        "--fittings",
        action="store_true",
        help="give a built-in body its number plates, bumper beams, lamps and open rims",
    )
    parser.add_argument("--material", metavar="NAME", help="material of the whole body")
    add_option(parser, "--bounces", "N", 1, "greatest number of surfaces that a path meets")
    add_option(parser, "--max-edge", "L", "5 cm", "longest edge of a facet")
    smooth = "half the width of the running median over azimuth"
    add_option(parser, "--smooth", "A", "2 deg", smooth)
    parser.add_argument(
        "--scale",
        metavar="X",
        help="metres per unit of the mesh file: 0.001 if it is in mm (default: 1)",
    )
    parser.add_argument(
        "--up", choices=("y", "z"), help="upward axis of the mesh file (default: y; z for STL)"
    )
    parser.add_argument(
        "--front",
        choices=("x", "-x", "y", "-y", "z", "-z"),
        help="axis of the mesh file to its front (default: x; glTF's convention is z)",
    )
    parser.add_argument(
        "-o", "--out", metavar="DIR", help="folder of the results (default: out/rcs-NAME)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Trace the body at all aspects, print and plot its cross sections."""
    import numpy as np

    from polychirp.channel.rcs import cross_sections, far_distance, num_aspects
    from polychirp.channel.tracers.composite import Composite
    from polychirp.cli.progress import progress_bar
    from polychirp.study.kernel_parts import compile_parts, parts_of_rcs

    step = positive_value(arguments, "step", "rad")
    window = positive_value(arguments, "smooth", "rad")
    if not step <= math.radians(45.0):
        raise InputError("--step: use at most 45 deg; cross sections change within a degree")
    elevation = si_value(arguments, "elevation", "rad")
    if abs(elevation) > math.pi / 2:
        raise InputError("--elevation: use -90 deg to 90 deg")
    frequency = si_value(arguments, "frequency", "Hz", bounds=FREQUENCIES)
    tracer = Composite(frequency=frequency, max_bounces=arguments.bounces)
    distance = positive_value(arguments, "range", "m")
    folder = usable_folder(arguments.out or Path("out") / f"rcs-{Path(arguments.mesh).stem}")
    mesh = _mesh(arguments, smallest=SMALLEST_BODY * SPEED_OF_LIGHT / frequency)
    if arguments.far:
        distance = far_distance(mesh, tracer.carrier)
    count = num_aspects(step)
    with progress_bar("rcs") as show:
        compile_parts(parts_of_rcs(max_bounces=tracer.max_bounces), progress=show)
        found = cross_sections(
            mesh,
            np.asarray((np.arange(count) - count // 2) * (2 * math.pi / count), dtype=np.float64),
            tracer=tracer,
            distance=distance,
            elevation=elevation,
            progress=lambda done, total: show("aspects", done, total),
        )
    if not np.any(found.rcs):
        raise InputError(
            f"'{arguments.mesh}' has no echo: from these directions no face of it may be visible, "
            "as of a plate seen from its edge, or its faces are turned inwards; choose another "
            "--elevation, or turn the normals of its faces outwards"
        )
    _report(arguments, mesh, found, window, folder)
    return 0


def _mesh(arguments: argparse.Namespace, *, smallest: float) -> Mesh:
    """Mesh of the body with edges of ``--max-edge`` or less; a file's must have ``smallest`` m."""
    from dataclasses import replace

    from polychirp.channel.materials.library import known_materials
    from polychirp.traffic.fittings import Fittings
    from polychirp.traffic.surface import subdivided
    from polychirp.traffic.vehicle import vehicle_mesh

    known = known_materials()
    if arguments.material is not None and arguments.material not in known:
        raise InputError(f"--material: {no_such('material', arguments.material, known)}")
    longest = positive_value(arguments, "max_edge", "m")
    if arguments.mesh in BODIES:
        for option in ("scale", "up", "front"):
            if getattr(arguments, option) is not None:
                raise InputError(
                    f"--{option}: the built-in body '{arguments.mesh}' does not take it, but the "
                    "mesh of a file does"
                )
        fittings = Fittings() if arguments.fittings else None
        mesh = vehicle_mesh(arguments.mesh, max_edge=longest, fittings=fittings)
    elif arguments.fittings:
        raise InputError("--fittings: only built-in bodies take it; a mesh file has its own parts")
    else:
        mesh = _from_file(arguments)
        _check_size(arguments.mesh, mesh, smallest=smallest)
        mesh = subdivided(mesh, longest)
    if arguments.material is None:
        return mesh
    return replace(mesh, materials=(arguments.material,) * len(mesh.materials))


def _from_file(arguments: argparse.Namespace) -> Mesh:
    from polychirp.channel.materials.library import known_materials
    from polychirp.traffic.mesh_file import load_mesh

    name, path = arguments.mesh, Path(arguments.mesh)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"'{name}' is neither a mesh file ({', '.join(SUFFIXES)}) nor one of "
            f"{', '.join(BODIES)}"
        )
    if not path.exists():
        raise InputError(f"there is no mesh file '{name}'; give the path")
    is_stl = path.suffix.lower() == ".stl"
    if is_stl and arguments.material is None:
        raise InputError(f"'{name}' names no materials; name one, as in --material metal")
    try:
        scale = 1.0 if arguments.scale is None else float(arguments.scale)
    except ValueError:
        raise InputError(f"--scale: '{arguments.scale}' is not a number; try 0.001") from None
    try:
        return load_mesh(
            path,
            materials={known: known for known in known_materials()},
            default_material=arguments.material,
            scale=scale,
            up_axis=arguments.up or ("z" if is_stl else "y"),
            front_axis=arguments.front or "x",
        )
    except InputError as error:
        if arguments.material is None and "material" in str(error):
            raise InputError(
                f"{error}; or name one for the whole body, as in --material metal"
            ) from None
        raise


def _check_size(name: str, mesh: Mesh, *, smallest: float) -> None:
    """Refuse a size that is probably one of millimetres read as metres, or the reverse."""
    corners = mesh.corners.reshape(-1, 3)
    size = float((corners.max(axis=0) - corners.min(axis=0)).max())
    if size > LARGEST_BODY:
        raise InputError(f"'{name}' is {size:.4g} m large; if the file is in mm, add --scale 0.001")
    if size < smallest:
        raise InputError(
            f"'{name}' is {1e3 * size:.3g} mm large, too small for physical optics, which needs "
            f"{SMALLEST_BODY:g} wavelengths, {1e3 * smallest:.3g} mm; give the metres per unit of "
            "the file with --scale, or use a higher --frequency"
        )


def _lobe_width(mesh: Mesh, frequency: float) -> float:
    """Least width of a lobe over azimuth, degrees: λ/2D of the mesh's horizontal diagonal D."""
    corners = mesh.corners.reshape(-1, 3)[:, :2]
    diagonal = math.dist(corners.min(axis=0), corners.max(axis=0))
    return math.degrees(SPEED_OF_LIGHT / frequency / (2.0 * diagonal))


def _report(
    arguments: argparse.Namespace, mesh: Mesh, found: CrossSections, window: float, folder: Path
) -> None:
    """Print the table; write picture and data."""
    from polychirp.report.figures.rcs import level_text, of_polarisation, rcs_picture, statistics

    name = Path(arguments.mesh).stem
    frequency = si_value(arguments, "frequency", "Hz")
    place = "in the far field" if arguments.far else f"at {found.distance:.4g} m"
    place += f", elevation {math.degrees(found.elevation):g}°, {frequency / 1e9:g} GHz"
    middle = ", ".join(f"{x + 0.0:.2f}" for x in found.centre)
    count = found.azimuth.size
    note = (
        f"{mesh.num_faces} facets, {count} aspects about ({middle}) m; free space, no edge "
        "currents."
    )
    drawing = rcs_picture(
        found,
        polarisation=arguments.polarisation,
        window=window,
        title=figure_text(f"{name} {place}"),
        note=note,
    )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rcs.png").write_bytes(drawing.png())
    (folder / "rcs.csv").write_text(drawing.csv(), encoding="utf-8")
    print(printable(f"{name} {place}: {arguments.polarisation}, dBsm"))
    shown = of_polarisation(found, arguments.polarisation)
    for what, value in statistics(shown, found.azimuth).items():
        print(f"  {what:<14}{level_text(value):>7}")
    print(note)
    print(
        f"Aspects are {360.0 / count:.3g}° apart; the body's lobes are "
        f"{_lobe_width(mesh, frequency):.2g}° wide or more."
    )
    say(f"stored in {folder}")
