"""`ReceiverSettings`: what all receivers share; others add to them.

- `DetectorSettings`: of a receiver with a false-alarm probability.
- `SearchSettings`: of a search for points on ramps of any slopes.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.doa import ESTIMATORS, AngleEstimator
from polychirp.receiver.clustering import Body
from polychirp.receiver.mitigation import AnyMitigation
from polychirp.spec import Spec
from polychirp.units import Between, Metres, MetresPerSecond, Ratio


@dataclass(frozen=True, slots=True, kw_only=True)
class ReceiverSettings(Spec):
    """Settings that all receivers share.

    Parameters
    ----------
    mitigation : method that cleans the samples first; None for none
    least_range, greatest_range : m, limits of the map
    grouping : limits within which several points are merged into one detection of a body; None
        for one detection per point
    """

    mitigation: AnyMitigation | None = None
    least_range: Metres = 0.5
    greatest_range: Metres = 30.0
    grouping: Body | None = None

    def __post_init__(self) -> None:
        if not 0 < self.least_range < self.greatest_range:
            raise InputError("a receiver's least range must be positive and below its greatest")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorSettings(ReceiverSettings):
    """Settings of a receiver whose threshold has a given false-alarm probability.

    Parameters
    ----------
    false_alarm_probability : probability that noise alone crosses the threshold, per cell of the
        map over range and range rate
    angle : estimator of azimuths and elevations: root-MUSIC (elements on a line), ESPRIT (an array
        that contains a part and its shifted copy), or Bartlett's or Capon's beams (any array)
    """

    false_alarm_probability: float = 1e-6
    angle: AngleEstimator = "root-music"

    def __post_init__(self) -> None:
        super(DetectorSettings, self).__post_init__()
        if not 1e-12 <= self.false_alarm_probability < 0.1:
            raise InputError("a receiver's false-alarm probability must lie between 1e-12 and 0.1")
        if self.angle not in ESTIMATORS:
            raise InputError(
                f"a receiver's angle '{self.angle}' is not one of {', '.join(ESTIMATORS)}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings(DetectorSettings):
    """Settings of a search for points on ramps of any slopes.

    Parameters
    ----------
    greatest_speed : m/s, greatest magnitude of the range rates of the map
    most_detections : number of points at which the search stops
    """

    greatest_speed: MetresPerSecond = 32.0
    most_detections: Annotated[int, Between(greatest=100_000)] = 150

    def __post_init__(self) -> None:
        super(SearchSettings, self).__post_init__()
        need_speed(self.greatest_speed)
        if not self.most_detections > 0:
            raise InputError("a receiver's greatest number of detections must be positive")


def need_speed(greatest_speed: float) -> None:
    """Refuse, with an `InputError`, a greatest speed of the range rates that is not positive."""
    if not greatest_speed > 0:
        raise InputError("a receiver's greatest speed must be positive")


def need_dynamic_range(dynamic_range: Ratio | None) -> None:
    """Refuse, with an `InputError`, a ratio of the strongest to the weakest peak of 1 or less."""
    if dynamic_range is not None and not dynamic_range > 1.0:
        raise InputError("a receiver's dynamic range must be above 0 dB")


def range_axis(receiver: ReceiverSettings, schedule: RampSchedule) -> FloatArray:
    """Range axis between the receiver's limits, m, in steps of half the cell of the largest band.

    Raises
    ------
    InputError
        The receiver's limits leave no range cell between them.
    """
    cell = SPEED_OF_LIGHT / (2.0 * float(np.max(schedule.bandwidth)))
    distance = np.arange(receiver.least_range, receiver.greatest_range, 0.5 * cell)
    if distance.size < 2:
        raise InputError(
            f"the receiver's map reaches from {receiver.least_range:g} m to "
            f"{receiver.greatest_range:g} m, less than half a range cell of {cell:.3g} m; lower "
            "its least range or raise its greatest range"
        )
    return distance
