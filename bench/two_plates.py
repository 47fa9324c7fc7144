"""Errors of bounces from plate to plate, near specular and off it, beside a quadrature.

    OPENBLAS_NUM_THREADS=1 python -m bench.two_plates

The quadrature in two steps knows no rays (`tests.support.references.two_steps`). Plates are drawn
by `tests.support.two_plates`; only those within 40 dB of two mirrors count. The last line is of
plates of many sizes, distances and angles.
"""

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.units import to_db
from tests.support.references.two_steps import scattered_twice
from tests.support.two_plates import any_plates, drawn_plates

FREQUENCY = 79e9
COUNT = 24
LEAST_LEVEL = -40.0


def errors(pairs):
    """dB of the power of all polarisations together, of the pairs of plates that count."""
    found = []
    for plates in pairs:
        ends = plates.transmitter, plates.receiver
        right = np.linalg.norm(scattered_twice(*plates.rectangles, *ends, FREQUENCY))
        mirrors = np.sqrt(2) * SPEED_OF_LIGHT / FREQUENCY / (4 * np.pi * plates.length)
        if right and to_db((right / mirrors) ** 2) > LEAST_LEVEL:
            found.append(to_db((np.linalg.norm(plates.traced(FREQUENCY)) / right) ** 2))
    return np.array(found)


def report(name, pairs):
    """Print a line about some pairs of plates."""
    found = errors(pairs)
    worst = found[np.argmax(np.abs(found))]
    print(
        f"{name}: {len(found)} pairs, median |error| {np.median(np.abs(found)):.2f}, "
        f"rms {np.sqrt(np.mean(found**2)):.2f}, worst {worst:+.2f} dB",
        flush=True,
    )


def main():
    for degrees in (0.0, 0.5, 1.5, 5.0):
        report(f"{degrees:g}° off", drawn_plates(COUNT, np.radians(degrees), seed=11))
    report("0.1 to 0.5 m, 0° to 5° off", (pair for _, pair in any_plates(2 * COUNT, seed=12)))


if __name__ == "__main__":
    main()
