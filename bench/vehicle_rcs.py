"""The cross sections of the sedan in docs/validation/vehicles.md, as rows of its table.

    python bench/vehicle_rcs.py

takes some minutes.
"""

import numpy as np

from polychirp.channel.rcs import cross_sections, far_distance
from polychirp.channel.tracers.composite import Composite
from polychirp.model.mesh import Mesh
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import to_db

TRACER = Composite(max_bounces=1, diffuse=False)
CAR = vehicle_mesh("sedan")
ALL = tuple(CAR.materials)

SECTORS = {"all": (0.0, 181.0), "front": (0.0, 10.0), "side": (90.0, 10.0), "rear": (180.0, 10.0)}
"""Middle and half width of the sectors, degrees."""


def relabelled(metal=(), taken_off=()):
    """The sedan with some materials replaced by metal, or removed."""
    kept = ~np.isin(CAR.material, [CAR.materials.index(name) for name in taken_off])
    made = [CAR.materials.index("metal" if name in metal else name) for name in CAR.materials]
    return Mesh(
        vertex=CAR.vertex,
        face=CAR.face[kept],
        material=np.array(made)[CAR.material[kept]],
        part=CAR.part[kept],
        materials=CAR.materials,
        parts=CAR.parts,
    )


def row(name, mesh, *, distance=10.0, height=0.5, step=1.0):
    """Print mean, median and greatest RCS of every sector; ``height`` None: at mid-height."""
    corners = mesh.corners.reshape(-1, 3)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    elevation = 0.0 if height is None else np.arcsin((height - middle[2]) / distance)
    degrees = np.arange(-180.0, 180.0, step)
    found = cross_sections(
        mesh, np.radians(degrees), tracer=TRACER, distance=distance, elevation=elevation
    ).rcs[:, 0, 0]
    cells = [name]
    for sector, (at, half) in SECTORS.items():
        here = found[np.abs(np.abs(degrees) - at) <= half + 1e-9]
        levels = [np.mean(here), np.median(here), np.max(here)]
        texts = [f"{to_db(level):.1f}".replace("-", "−") for level in levels]
        cells += texts[:2] if sector == "all" else [" / ".join(texts)]
    print(f"| {' | '.join(cells)} |", flush=True)


def main():
    """All rows."""
    metal = relabelled(metal=ALL)
    row("as it is", CAR)
    row("bumpers metal", relabelled(metal=("plastic",)))
    row("windows metal", relabelled(metal=("glass",)))
    row("all metal", metal)
    row("bumpers taken off", relabelled(taken_off=("plastic",)))
    row("radar at 0.3 m (steps of 0.5°)", CAR, height=0.3, step=0.5)
    row("radar at 1.0 m (steps of 0.5°)", CAR, height=1.0, step=0.5)
    row("at 30 m", CAR, distance=30.0)
    row("at 30 m, all metal", metal, distance=30.0)
    for name, mesh in (("", CAR), (", all metal", metal)):
        far = far_distance(mesh, TRACER.frequency)
        row(f"far field, elevation 0°{name}", mesh, distance=far, height=None)


if __name__ == "__main__":
    main()
