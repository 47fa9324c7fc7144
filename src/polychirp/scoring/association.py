r"""Detections on bodies: the margins of a detection, its distance from a body, one-to-one pairs.

A target body is found if a detection lies on its visible metal. The difference of detection and
place is taken in range, range rate, azimuth and elevation, each in units of its margin in `Gate`.
The largest of the four is the distance from the place, and the least over all places (`Truth`) that
from the body,

.. math:: D = \min_p \max\left(\frac{|R - R_p|}{g_R},\ \frac{|\dot R - \dot R_p|}{g_{\dot R}},\
              \frac{|\varphi - \varphi_p|}{g_\varphi},\
              \frac{|\varepsilon - \varepsilon_p|}{g_\varepsilon}\right),

so that a detection with :math:`D \le 1` lies on the body. An array that does not measure elevation
sees a wave from :math:`(\varphi_p, \varepsilon_p)` as one from :math:`\arcsin(\cos\varepsilon_p
\sin\varphi_p)` in its plane: its detections are compared with that azimuth.
"""

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, Self

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.detection import Detections
from polychirp.model.ramp import RampSchedule
from polychirp.model.truth import Truth
from polychirp.spec import Spec
from polychirp.units import Metres, MetresPerSecond, Radians

SHARE_OF_DISTANCE: Final = 1e-3
"""Share of a squared distance, in margins, by which a pair ranks lower. Chosen: a power that is
greater by 0.004 dB counts as much as all of a margin."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate(Spec):
    """Margins: largest errors, to either side, of a detection of a place.

    The errors are those of the range (m), range rate (m/s), azimuth and elevation (rad); the
    defaults are chosen. A detection without azimuth or elevation (NaN, from an array that does not
    measure it) meets any margin of that angle.
    """

    range: Metres = 0.4
    range_rate: MetresPerSecond = 1.0
    azimuth: Radians = np.pi / 12
    elevation: Radians = np.pi / 12

    @classmethod
    def of(
        cls,
        schedule: RampSchedule,
        array: AntennaArray,
        *,
        usual: Self | None = None,
        band: float | None = None,
    ) -> Self:
        r"""Margins for a radar with this schedule and (virtual) array.

        With the cells of the frame

        .. math:: \Delta R = \frac{c}{2B},\qquad \Delta\dot R = \frac{\lambda}{2T_{frame}},\qquad
                  \Delta\varphi = \frac{\lambda}{M d},\qquad
                  \Delta\varepsilon = \frac{\lambda}{M' d'},

        the margins in range and range rate are the usual ones, or one cell if that is more; the
        margins in azimuth and elevation are the usual ones, or one cell if that is less. B is
        ``band``, Hz, that of all ramps together for a receiver that adds them in phase; if it is
        None, the mean bandwidth of the ramps (`RampSchedule.resolving_bandwidth`). d is the mean
        spacing of the M columns of channels, and d' that of the M' rows. The channels are those of
        the virtual array if several transmitting elements share the frame. ``usual`` are the
        defaults of the class if it is None.
        """
        usual = usual or cls()
        wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
        bandwidth = band or float(np.mean(schedule.resolving_bandwidth))
        end = schedule.start_time + schedule.duration
        frame = float(np.max(end) - np.min(schedule.start_time))
        return cls(
            range=max(usual.range, SPEED_OF_LIGHT / (2.0 * bandwidth)),
            range_rate=max(usual.range_rate, wavelength / (2.0 * frame)),
            azimuth=min(usual.azimuth, wavelength / max(_aperture(schedule, array, "y"), 1e-9)),
            elevation=min(usual.elevation, wavelength / max(_aperture(schedule, array, "z"), 1e-9)),
        )


def _aperture(schedule: RampSchedule, array: AntennaArray, along: Literal["y", "z"]) -> float:
    """Number of places of channels along an axis times their mean spacing, m, once decoded."""
    axis = "xyz".index(along)
    place = array.transmit_position[: schedule.num_elements, None, axis] + array.position[:, axis]
    places = np.unique(np.round(place, 6))
    return float(np.ptp(places)) * places.size / max(places.size - 1, 1)


class Association(NamedTuple):
    """Numbers of the detected targets, and of the detection of each, in the same order."""

    target: IntArray
    detection: IntArray


def distances_from_bodies(detections: Detections, truth: Truth, gate: Gate) -> FloatArray:
    """Distance D of every detection from every target's visible metal, ``(target, detection)``.

    It is infinite for hidden targets.

    Examples
    --------
    A car from 10 m to 14 m, and detections on it, 0.2 m behind it, and beside it:

    >>> car = Truth(time=0.0, name=("car",), range=[10.0], range_rate=[0.0], azimuth=[0.0],
    ...     elevation=[0.0], point=np.zeros((1, 3)), is_visible=[True], place_target=[0, 0, 0],
    ...     place_range=[10.0, 12.0, 14.0], place_range_rate=np.zeros(3), place_azimuth=np.zeros(3),
    ...     place_elevation=np.zeros(3))
    >>> one = np.ones(3)
    >>> found = Detections(time=0.0, range=[12.0, 14.2, 12.0], range_rate=0 * one,
    ...     azimuth=[0.0, 0.0, 0.5], power=one, snr=one)
    >>> distances_from_bodies(found, car, Gate()).round(2)
    array([[0.  , 0.5 , 1.91]])
    """
    out = np.full((len(truth.name), detections.num_detections), np.inf)
    apart = distances(
        detections,
        truth.place_range,
        truth.place_range_rate,
        truth.place_azimuth,
        truth.place_elevation,
        gate,
    )
    np.minimum.at(out, truth.place_target, apart)
    return out


def distances(
    detections: Detections,
    distance: FloatArray,
    range_rate: FloatArray,
    azimuth: FloatArray,
    elevation: FloatArray,
    gate: Gate,
) -> FloatArray:
    """Distance D of every detection from every place, ``(place, detection)``.

    ``distance``, m, ``range_rate``, m/s, ``azimuth`` and ``elevation``, rad, are those of the
    places, ``(place,)``. A NaN for an angle meets any margin.
    """
    measured = detections.azimuth, detections.elevation
    apart: FloatArray = np.maximum.reduce(
        [
            np.abs(detections.range - distance[:, None]) / gate.range,
            np.abs(detections.range_rate - range_rate[:, None]) / gate.range_rate,
            angular_distances(measured, (azimuth[:, None], elevation[:, None]), gate),
        ]
    )
    return apart


def angular_distances(
    measured: tuple[FloatArray, FloatArray], place: tuple[FloatArray, FloatArray], gate: Gate
) -> FloatArray:
    """Distance D by directions alone, between ``measured`` ones and those of places.

    Both are azimuths and elevations, rad; the arrays are broadcast. A NaN meets any margin.
    """
    azimuth, elevation = measured
    seen = seen_azimuths(*place, elevation)
    across = np.abs(np.nan_to_num(azimuth - seen)) / gate.azimuth
    upwards = np.abs(np.nan_to_num(elevation - place[1])) / gate.elevation
    return np.asarray(np.maximum(across, upwards))


def seen_azimuths(azimuth: FloatArray, elevation: FloatArray, measured: FloatArray) -> FloatArray:
    """Azimuths of places as an array sees them that measures the elevations ``measured``, rad.

    Without an elevation (NaN) a place appears at arcsin(cos ε sin φ); one behind the array stays
    behind it. ``azimuth`` and ``elevation``, rad, are those of the places; the arrays are
    broadcast.

    >>> seen_azimuths(np.array([0.5]), np.array([0.3]), np.array([np.nan, 0.3])).round(4)
    array([0.4757, 0.5   ])
    """
    flat = np.arcsin(np.cos(np.nan_to_num(elevation)) * np.sin(azimuth))
    flat = np.where(np.cos(azimuth) < 0.0, np.copysign(np.pi, azimuth) - flat, flat)
    return np.asarray(np.where(np.isnan(measured), flat, azimuth))


def associate(
    detections: Detections, truth: Truth, *, gate: Gate, is_on_body: BoolArray
) -> Association:
    """Pairs of targets and detections, in which each target and each detection occurs once at most.

    A pair must be true in the mask ``is_on_body`` ``(target, detection)``. Of all pairings with
    the greatest number of pairs, one is chosen (Kuhn–Munkres algorithm) in which most detections
    lie within the margins of the target's nearest visible point, and of these the one with the
    greatest sum of powers in dB: the nearest detection would make errors look smaller than they
    are. Targets that are so near to each other that the same detections are on either get those
    that are nearer to them. A target without a detection there gets the one that is nearest to
    that point.
    """
    from scipy.optimize import linear_sum_assignment

    if not np.any(is_on_body):
        return Association(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    apart = distances(
        detections, truth.range, truth.range_rate, truth.azimuth, truth.elevation, gate
    )
    level = np.log(np.maximum(detections.power, 1e-300))
    within = 1e3 + level - level.min() - SHARE_OF_DISTANCE * apart**2
    rank = np.where(apart <= 1.0, within, -np.minimum(apart, 1e3))
    value = np.where(is_on_body, 1e6 + rank, 0.0)
    target, detection = linear_sum_assignment(value, maximize=True)
    kept = is_on_body[target, detection]
    return Association(np.asarray(target[kept]), np.asarray(detection[kept]))
