"""What strong points leave in the map beside themselves, and what is not to be taken for it."""

from __future__ import annotations

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame


def unrelated(beats: FloatArray, resolution: FloatArray) -> list[int]:
    """Numbers of the candidates, strongest first, that share beats with none taken before.

    Strong points cross the map as arms, and where the up-arm of one meets the down-arm of another
    stands a false peak, stronger than weak true ones. It beats like the first on all up-ramps:
    such a candidate waits until those before it are taken out, and is gone then.

    ``beats`` is Hz, ``(candidate, ramp)``, ``resolution`` Hz, ``(ramp,)``.
    """
    apart = np.abs(beats[:, None] - beats) < 3.0 * resolution
    is_related = np.mean(apart, axis=-1) >= 0.2
    taken: list[int] = []
    for n in range(len(beats)):
        if not np.any(is_related[n, taken]):
            taken.append(n)
    return taken


def resolved(
    frame: IfFrame, *, distance: FloatArray, range_rate: FloatArray, power: FloatArray
) -> IntArray:
    """Numbers of the points, strongest first, that a stronger one's skirt does not explain.

    Taking out a body's echo as points leaves a few per cent of it in the cells around; what is
    found there more than 20 dB below, within one range cell and two Doppler cells, is not a
    target of its own.
    """
    cell = SPEED_OF_LIGHT / (2.0 * float(np.max(frame.schedule.bandwidth)))
    wavelength = SPEED_OF_LIGHT / float(np.mean(frame.schedule.centre_frequency))
    doppler = wavelength / (2.0 * float(np.min(frame.schedule.duration)))
    kept: list[int] = []
    for n in np.argsort(power)[::-1]:
        near = [
            power[m]
            for m in kept
            if abs(distance[m] - distance[n]) < cell
            and abs(range_rate[m] - range_rate[n]) < 2.0 * doppler
        ]
        if not near or power[n] > 0.01 * max(near):
            kept.append(int(n))
    return np.array(kept, dtype=np.int64)
