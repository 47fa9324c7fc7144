"""Rejection of peaks that strong points cause: cross-pairing ridges and residual side lobes."""

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame


def without_cross_pairs(beats: FloatArray, resolution: FloatArray) -> list[int]:
    """Row numbers of the candidates that share their beats with no stronger candidate kept here.

    The beats of a strong point on the up-ramps form a ridge in the map, and so do those on the
    down-ramps. Where the up-ridge of one point crosses the down-ridge of another there is a false
    peak, often stronger than weak targets. Its beats are those of the first point on all up-ramps.
    The caller searches the map again after it has subtracted the candidates kept: a false peak has
    then vanished, and a target is found. Two candidates share beats if these differ by less than
    3 resolutions on at least 20 % of the ramps (both limits are chosen).

    ``beats`` is Hz, ``(candidate, ramp)``, strongest candidate first; ``resolution``, Hz
    ``(ramp,)``, is 1 over the length of the sampling window.
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
    """Numbers of the points, strongest first, that are no side lobe of a stronger point.

    An extended body is subtracted as a few points, which leaves a few per cent of its echo in the
    cells around it. A point is rejected as such a residue if it is at least 20 dB weaker than a
    kept point within one range cell, c/2B, and two Doppler cells of a single ramp, λ/2T each (B is
    the greatest bandwidth, T the shortest duration of a ramp). The three limits are chosen.
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
