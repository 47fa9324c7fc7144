r"""Azimuth and elevation by any estimator from any array that it can read.

The direction cosines u and w (`elements`) give :math:`\varepsilon = \arcsin w` and
:math:`\varphi = \arcsin(u/\cos\varepsilon)`. A horizontal line measures u alone, and takes the
elevation as zero: of a target at the elevation ε it reports
:math:`\arcsin(\cos\varepsilon\sin\varphi)`.
"""

from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.errors import CapabilityError, InputError
from polychirp.receiver.angle.ambiguity import HALF_SPACE, Beam, nearest_to_boresight
from polychirp.receiver.angle.beams import capon_factors, strongest_directions, too_large
from polychirp.receiver.angle.doa import ESTIMATORS, AngleEstimator, sines_of_sources
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.angle.esprit import esprit, shift_along


class Directions(NamedTuple):
    """Azimuth and elevation, rad ``(detection,)``; NaN where the array does not measure them."""

    azimuth: FloatArray
    elevation: FloatArray


def directions(
    snapshots: ComplexArray,
    elements: Elements,
    *,
    estimator: AngleEstimator,
    beam: Beam = HALF_SPACE,
) -> Directions:
    """Azimuth and elevation of the single wave of each detection.

    Parameters
    ----------
    snapshots : ``(detection, channel, snapshot)``
    beam : rad, to either side, of the elements; of directions with equal phases, the one in the
        window that covers most of it is taken (`ambiguity.unambiguous_window`)

    Raises
    ------
    CapabilityError
        The estimator cannot read the array: see `unfit`.

    Examples
    --------
    A wave from 20° left and 10° up on two rows of four elements:

    >>> place = [(0.5 * left, 0.5 * up) for up in range(2) for left in range(4)]
    >>> elements = Elements(place=place)
    >>> azimuth, elevation = np.radians([20.0, 10.0])
    >>> wave = elements.steering(
    ...     np.array([np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]))
    >>> found = directions(wave[None, :, None], elements, estimator="esprit")
    >>> np.degrees(found.azimuth).round(6), np.degrees(found.elevation).round(6)
    (array([20.]), array([10.]))
    """
    cosines = cosines_of_waves(snapshots, elements, num_waves=1, estimator=estimator, beam=beam)[
        :, 0
    ]
    known = [axis in elements.axes for axis in range(2)]
    left, up = np.where(known, cosines, np.nan).T
    return angles_of(left, up)


def angles_of(left: FloatArray, up: FloatArray) -> Directions:
    """Azimuths and elevations of direction cosines ``(detection,)``, NaN where these are NaN.

    An azimuth without an elevation is that at the elevation zero.
    """
    elevation = np.arcsin(np.clip(up, -1.0, 1.0))
    # a wave from the side may be found a little beyond ±90°
    level = np.maximum(np.cos(np.nan_to_num(elevation)), 1e-12)
    return Directions(np.arcsin(np.clip(left / level, -1.0, 1.0)), elevation)


def cosines_of_waves(
    snapshots: ComplexArray,
    elements: Elements,
    *,
    num_waves: int,
    estimator: AngleEstimator,
    beam: Beam = HALF_SPACE,
) -> FloatArray:
    """Direction cosines of several waves, ``(detection, wave, 2)``; zero where not measured.

    Bartlett's and Capon's waves are sorted from strong to weak; the others are in no order.

    Parameters
    ----------
    snapshots : ``(detection, channel, snapshot)``; several waves need several snapshots in which
        their phases differ, such as frames, or ramps if their range rates differ
    beam : rad, to either side, of the elements, as in `directions`

    Raises
    ------
    CapabilityError
        The estimator cannot read the array: see `unfit`.
    """
    snapshots = np.asarray(snapshots, dtype=np.complex128)
    if snapshots.ndim != 3:
        raise InputError(
            f"snapshots have {snapshots.ndim} axes; they need (detection, channel, snapshot)"
        )
    reason = unfit(elements, estimator)
    if reason:
        raise CapabilityError(reason)
    if not elements.axes:
        return np.zeros((len(snapshots), num_waves, 2))
    line = elements.line()
    if line is not None and line.is_uniform and num_waves == 1:
        sines = ESTIMATORS[estimator](snapshots, spacing=line.step)[:, None]
        return _on_axis(line.axis, sines)
    if line is not None and estimator == "root-music":
        both = elements.both_ways(snapshots)
        covariances = both @ both.conj().swapaxes(1, 2) / both.shape[2]
        sines = sines_of_sources(
            covariances, num_sources=num_waves, spacing=line.step, index=line.steps
        )
        return _on_axis(line.axis, sines)
    if estimator == "esprit":
        found = esprit(snapshots, elements, num_waves=num_waves)
    else:
        factors = snapshots if estimator == "bartlett" else capon_factors(snapshots)
        found = strongest_directions(factors, elements, num_waves=num_waves)
    return nearest_to_boresight(found, elements, estimator=estimator, beam=beam)


def unfit(elements: Elements, estimator: AngleEstimator) -> str:
    """Sentence that says why an estimator cannot read an array; empty if it can.

    >>> unfit(Elements(place=[[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]]), "root-music")
    "the estimator 'root-music' needs all elements on one horizontal or vertical line, at \
multiples of one distance; set receiver.angle to 'bartlett'"
    """
    if elements.is_slanted_line:
        return (
            "all elements are on one slanted line, which measures neither azimuth nor elevation; "
            "move one of them off the line"
        )
    line = elements.line()
    is_uniform = line is not None and line.is_uniform
    if too_large(elements) and (estimator == "esprit" or not is_uniform):
        return too_large(elements)
    if estimator == "root-music" and elements.axes and line is None:
        return (
            "the estimator 'root-music' needs all elements on one horizontal or vertical line, at "
            "multiples of one distance; set receiver.angle to 'bartlett'"
        )
    if estimator == "esprit" and any(shift_along(elements, axis) is None for axis in elements.axes):
        return (
            "the estimator 'esprit' needs a third of the elements, or more, to repeat others one "
            "shift to the side, and one shift up if there are several rows; set receiver.angle "
            "to 'bartlett'"
        )
    return ""


def _on_axis(axis: int, sines: FloatArray) -> FloatArray:
    """Direction cosines ``(…, 2)`` of sines ``(…)`` along one axis."""
    return np.stack([sines, 0.0 * sines] if axis == 0 else [0.0 * sines, sines], axis=-1)
