"""The cross sections of the sedan in docs/validation/vehicles.md, as rows of its tables.

    python bench/vehicle_rcs.py            # the shell, its materials, and every fitting
    python bench/vehicle_rcs.py bounces    # with waves of three reflections
    python bench/vehicle_rcs.py heights    # other heights and ranges of the radar

Each takes a minute or two of one core. Every row has the mean, the median and the maximum in dBsm.
"""

import sys
from dataclasses import fields

import numpy as np

from polychirp.channel.point_vehicles.scattering_points import lobe_points
from polychirp.channel.rcs import cross_sections, far_distance
from polychirp.channel.tracers.composite import Composite
from polychirp.model.mesh import Mesh
from polychirp.traffic.fittings import Fittings
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import to_db

SECTORS = {
    "all": (0.0, 181.0),
    "front": (0.0, 10.0),
    "side": (90.0, 10.0),
    "rear": (180.0, 10.0),
    "front corner": (45.0, 20.0),
    "rear corner": (135.0, 20.0),
}
"""Middle and half width of the sectors, degrees."""

ALL_OFF = {f.name: False for f in fields(Fittings) if f.type in ("bool", bool)}
"""Every fitting switched off."""


def only(name):
    """The sedan with one kind of fitting."""
    return vehicle_mesh("sedan", fittings=Fittings(**{**ALL_OFF, name: True}))


def relabelled(metal=(), taken_off=()):
    """The smooth sedan with some materials replaced by metal, or removed."""
    car = vehicle_mesh("sedan")
    kept = ~np.isin(car.material, [car.materials.index(name) for name in taken_off])
    made = [car.materials.index("metal" if name in metal else name) for name in car.materials]
    return Mesh(
        vertex=car.vertex,
        face=car.face[kept],
        material=np.array(made)[car.material[kept]],
        part=car.part[kept],
        materials=car.materials,
        parts=car.parts,
    )


def printed(name, degrees, found):
    """Print one row."""
    cells = [name]
    for at, half in SECTORS.values():
        here = found[np.abs(np.abs(degrees) - at) <= half + 1e-9]
        levels = [np.mean(here), np.median(here), np.max(here)]
        cells.append(" / ".join(f"{to_db(level):.1f}".replace("-", "−") for level in levels))
    print(f"| {' | '.join(cells)} |", flush=True)


def row(name, mesh, *, distance=10.0, height=0.5, step=1.0, bounces=1):
    """Trace and print one row; ``height`` None: at mid-height."""
    corners = mesh.corners.reshape(-1, 3)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    elevation = 0.0 if height is None else np.arcsin((height - middle[2]) / distance)
    degrees = np.arange(-180.0, 180.0, step)
    tracer = Composite(max_bounces=bounces, diffuse=False)
    found = cross_sections(
        mesh, np.radians(degrees), tracer=tracer, distance=distance, elevation=elevation
    )
    printed(name, degrees, found.rcs[:, 0, 0])


def standard():
    """Print the row of 3GPP TR 38.901 at the horizon, where radars of cars look from."""
    degrees = np.arange(-180.0, 180.0, 0.5)
    turn = np.radians(degrees)
    towards = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    point = np.zeros(turn.size, dtype=int)
    printed(
        "3GPP TR 38.901 at the horizon",
        degrees,
        lobe_points("one").cross_section(point, towards, towards),
    )


def shells():
    """Shell, materials and single fittings, one bounce."""
    row("smooth", vehicle_mesh("sedan"))
    row("smooth, all metal", relabelled(metal=tuple(vehicle_mesh("sedan").materials)))
    for name in ALL_OFF:
        row(f"smooth and {name}", only(name))
    row("fittings", vehicle_mesh("sedan", fittings=Fittings()))


def bounces():
    """Three reflections."""
    row("smooth, 3 bounces", vehicle_mesh("sedan"), bounces=3)
    for name in ("lamps", "open_rims"):
        row(f"smooth and {name}, 3 bounces", only(name), bounces=3)
    row("fittings, 3 bounces", vehicle_mesh("sedan", fittings=Fittings()), bounces=3)


def heights():
    """Other heights and ranges, one bounce."""
    car = vehicle_mesh("sedan", fittings=Fittings())
    row("fittings, radar at 0.3 m", car, height=0.3)
    row("fittings, radar at 1.0 m", car, height=1.0)
    row("fittings, at 30 m", car, distance=30.0)
    far = far_distance(car, 79e9)
    row("fittings, far field, elevation 0°", car, distance=far, height=None)
    plain = far_distance(vehicle_mesh("sedan"), 79e9)
    row("smooth, far field", vehicle_mesh("sedan"), distance=plain, height=None)


if __name__ == "__main__":
    standard()
    {"bounces": bounces, "heights": heights}.get(sys.argv[-1], shells)()
