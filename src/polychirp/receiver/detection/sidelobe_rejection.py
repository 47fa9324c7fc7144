"""Rejection of peaks that strong points cause: cross-pairing ridges and residual side lobes."""

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame


def without_cross_pairs(beats: FloatArray, resolution: FloatArray) -> list[int]:
    """Numbers of the candidates, strongest first, that share beats with no stronger one.

    The up-beats of a strong point form a ridge in the map, and so do its down-beats. Where the
    up-ridge of one point crosses the down-ridge of another there is a false peak, stronger than
    weak targets. It has the beats of the first on all up-ramps: such a candidate is tried again
    after the stronger ones are subtracted, and has then vanished.

    ``beats`` is Hz, ``(candidate, ramp)``, ``resolution`` Hz, ``(ramp,)``.
    """
    apart = np.abs(beats[:, None] - beats) < 3.0 * resolution
    is_related = np.mean(apart, axis=-1) >= 0.2
    taken: list[int] = []
    for n in range(len(beats)):
        if not np.any(is_related[n, taken]):
            taken.append(n)
    return taken


def reject_sidelobes(
    frame: IfFrame, *, distance: FloatArray, range_rate: FloatArray, power: FloatArray
) -> IntArray:
    """Numbers of the points, strongest first, that are no side lobe of a stronger one.

    The subtraction of a body as points leaves a few per cent of its echo in the cells around it. A
    point more than 20 dB below a stronger one, within one range cell and two Doppler cells of it,
    is taken for such a residue.
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
