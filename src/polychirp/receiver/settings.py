"""`ReceiverSettings`: what all receivers share; `SearchSettings`: those of a search for points."""

from dataclasses import dataclass
from typing import Annotated

from polychirp.errors import InputError
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
    false_alarm_probability : probability that noise alone crosses the threshold, per cell of the
        map over range and range rate
    least_range, greatest_range : m, limits of the map
    angle : estimator of azimuths and elevations: root-MUSIC (elements on a line), ESPRIT (an array
        that contains a part and its shifted copy), or Bartlett's or Capon's beams (any array)
    grouping : limits within which several points are merged into one detection of a body; None
        for one detection per point
    """

    mitigation: AnyMitigation | None = None
    false_alarm_probability: float = 1e-6
    least_range: Metres = 0.5
    greatest_range: Metres = 30.0
    angle: AngleEstimator = "root-music"
    grouping: Body | None = None

    def __post_init__(self) -> None:
        if not 1e-12 <= self.false_alarm_probability < 0.1:
            raise InputError("a receiver's false-alarm probability must lie between 1e-12 and 0.1")
        if not 0 < self.least_range < self.greatest_range:
            raise InputError("a receiver's least range must be positive and below its greatest")
        if self.angle not in ESTIMATORS:
            raise InputError(
                f"a receiver's angle '{self.angle}' is not one of {', '.join(ESTIMATORS)}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings(ReceiverSettings):
    """Settings of a search for points in the range-rate map of ramps of any slopes.

    Parameters
    ----------
    greatest_speed : m/s, greatest magnitude of the range rates of the map
    most_detections : number of points at which the search stops
    """

    greatest_speed: MetresPerSecond = 32.0
    most_detections: Annotated[int, Between(greatest=100_000)] = 150

    def __post_init__(self) -> None:
        super(SearchSettings, self).__post_init__()
        if not (self.greatest_speed > 0 and self.most_detections > 0):
            raise InputError(
                "a receiver's greatest speed and number of detections must be positive"
            )


def need_dynamic_range(dynamic_range: Ratio | None) -> None:
    """Refuse, with an `InputError`, a ratio of the strongest to the weakest peak of 1 or less."""
    if dynamic_range is not None and not dynamic_range > 1.0:
        raise InputError("a receiver's dynamic range must be above 0 dB")
