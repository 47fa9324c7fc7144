"""Convergence of the sedan's echo with its mesh: data and figure of docs/validation.

    python bench/convergence.py docs/images

writes convergence.png, and convergence.json beside it; some minutes and 2 GB.
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

from polychirp.channel.rcs import cross_sections
from polychirp.channel.tracers.composite import Composite
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import to_db
from tools.figures.convergence import MeshError, convergence_picture

REFERENCE = (0.012, 0.3)
"""Longest edge on flats (m) and coarseness of the reference mesh."""

MESHES = (
    *((0.05, coarseness) for coarseness in (0.5, 0.7, 1.0, 1.5, 2.0, 3.0)),
    *((edge, 1.0) for edge in (0.02, 0.03, 0.1)),
    (0.02, 0.5),
)
"""Longest edge on flats (m) and coarseness of the compared meshes."""


TRACER = Composite(max_bounces=1, diffuse=False)


def levels(max_edge, coarseness, azimuth):
    """Vertically polarised RCS of the sedan at 10 m, dBsm, and its number of facets."""
    mesh = vehicle_mesh("sedan", max_edge=max_edge, coarseness=coarseness)
    found = cross_sections(mesh, azimuth, tracer=TRACER, distance=10.0, elevation=-0.022)
    return to_db(found.rcs[:, 0, 0]), mesh.num_faces


def convergence(azimuth):
    """Errors of all meshes relative to the reference, over the same azimuths (rad)."""
    reference, _ = levels(*REFERENCE, azimuth)
    rows = []
    for max_edge, coarseness in MESHES:
        level, facets = levels(max_edge, coarseness, azimuth)
        error = np.abs(level - reference)
        rows.append(
            MeshError(
                max_edge=max_edge,
                coarseness=coarseness,
                facets=facets,
                median=round(float(np.median(error)), 3),
                ninth_decile=round(float(np.quantile(error, 0.9)), 3),
            )
        )
        print(rows[-1])
    return rows


def main(folder):
    azimuth = np.random.default_rng(1).uniform(-np.pi, np.pi, 80)
    rows = convergence(azimuth)
    note = "Sedan at 10 m, V, 80 random aspects, beside 0.3, 1.2 cm; marks: coarseness, edge"
    text = json.dumps([asdict(row) for row in rows], indent=1) + "\n"
    (folder / "convergence.json").write_text(text, encoding="utf-8")
    (folder / "convergence.png").write_bytes(convergence_picture(rows, note=note).png())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
