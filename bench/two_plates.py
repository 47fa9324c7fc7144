"""Errors of bounces from plate to plate, near specular and off it, beside a quadrature.

    OPENBLAS_NUM_THREADS=1 python -m bench.two_plates

The quadrature in two steps knows no rays (`tests.support.references.two_steps`). Plates are drawn
by `tests.support.two_plates`; only those within 40 dB of two mirrors count.
"""

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.units import to_db
from tests.support.references.two_steps import scattered_twice
from tests.support.two_plates import drawn_plates

FREQUENCY = 79e9
COUNT = 24
LEAST_LEVEL = -40.0


def errors(off):
    """dB of the power of all polarisations together, of plates turned by ``off`` rad."""
    found = []
    for plates in drawn_plates(COUNT, off, seed=11):
        ends = plates.transmitter, plates.receiver
        right = np.linalg.norm(scattered_twice(*plates.rectangles, *ends, FREQUENCY))
        mirrors = np.sqrt(2) * SPEED_OF_LIGHT / FREQUENCY / (4 * np.pi * plates.length)
        if right and to_db((right / mirrors) ** 2) > LEAST_LEVEL:
            found.append(to_db((np.linalg.norm(plates.traced(FREQUENCY)) / right) ** 2))
    return np.array(found)


def main():
    for degrees in (0.0, 0.5, 1.5, 5.0):
        found = errors(np.radians(degrees))
        worst = found[np.argmax(np.abs(found))]
        print(
            f"{degrees:g}° off: {len(found)} pairs, median |error| {np.median(np.abs(found)):.2f}, "
            f"rms {np.sqrt(np.mean(found**2)):.1f}, worst {worst:+.1f} dB",
            flush=True,
        )


if __name__ == "__main__":
    main()
