"""Errors of bounces from bent panel to bent panel, near specular and off it, beside a quadrature.

    OPENBLAS_NUM_THREADS=1 python -m bench.two_panels [COUNT]

The quadrature in two steps knows no rays (`tests.support.references.two_steps`), and takes a minute
for a pair. Panels are drawn by `tests.support.two_panels`. Each line has the power over that of the
quadrature, and the field's error over its field, with all tubes 2.5 mm wide.
"""

import sys

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.units import to_db
from tests.support.references.two_steps import scattered_twice
from tests.support.two_panels import drawn_panels

FREQUENCY = 79e9
TUBE = 2.5e-3


def main(count):
    for degrees in (0.0, 5.0):
        found = []
        for number, one in enumerate(drawn_panels(count, np.radians(degrees), seed=21)):
            right = scattered_twice(one.first, one.last, one.transmitter, one.receiver, FREQUENCY)
            mirrors = np.sqrt(2) * SPEED_OF_LIGHT / FREQUENCY / (4 * np.pi * one.length)
            level, size = np.linalg.norm(right) / mirrors, np.linalg.norm(right)
            traced = one.traced(TUBE)
            found.append(to_db((np.linalg.norm(traced) / size) ** 2))
            wrong = to_db((np.linalg.norm(traced - right) / size) ** 2)
            print(
                f"{degrees:g}° off, draw {number}: {to_db(level**2):.1f} dB of two mirrors, power "
                f"{found[-1]:+.2f} dB, field {wrong:+.1f} dB",
                flush=True,
            )
        worst = found[int(np.argmax(np.abs(found)))]
        print(f"{degrees:g}° off: median {np.median(np.abs(found)):.2f}, worst {worst:+.2f} dB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 12)
