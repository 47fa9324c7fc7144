"""`Score`: one radar's detections against the truth."""

from dataclasses import dataclass
from typing import Annotated

from polychirp.axes import Axes, BoolArray, PerDetection, PerTarget, Sealed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Score(Sealed):
    """Result for every target, and nature of every detection.

    Parameters
    ----------
    is_detected : true for a target that has a detection, ``(target,)``
    range_error, range_rate_error, azimuth_error, elevation_error : m, m/s, rad, rad, found minus
        true, ``(target,)``; zero also where ``is_detected`` is false, and NaN where the radar does
        not measure the angle
    sinr : power ratio of the own echo to all other parts at the target's detection, ``(target,)``;
        zero where ``is_detected`` is false
    snr, inr : power ratio of the own echo, and of interference, to noise in the cell of every
        target before mitigation, ``(target,)`` (`TargetLevels`)
    mitigated_sinr : power ratio of the own echo to all other parts in the cell of every target
        after mitigation, ``(target,)``
    nature : nature of every detection: "target", "echo" (a real echo of another body), or the kind
        of ghost: "multipath", "direct", "indirect", "front-end", "unexplained"
    power : power of every detection, W, ``(detection,)``
    target_detection : number of the detection of each detected target, in the order of the targets
    num_missed : number of visible targets without a detection
    floor_rise : power ratio of the range spectra's floor to the floor of noise alone
    """

    is_detected: Annotated[BoolArray, Axes("target", dtype=bool)]
    range_error: PerTarget
    range_rate_error: PerTarget
    azimuth_error: PerTarget
    elevation_error: PerTarget
    sinr: PerTarget
    snr: PerTarget
    inr: PerTarget
    mitigated_sinr: PerTarget
    nature: tuple[str, ...]
    power: PerDetection
    target_detection: tuple[int, ...]
    num_missed: int
    floor_rise: float

    def numbers(self, nature: str) -> tuple[int, ...]:
        """Numbers of the detections of one nature."""
        return tuple(n for n, what in enumerate(self.nature) if what == nature)

    @property
    def ghosts(self) -> tuple[int, ...]:
        """Numbers of the detections at which there is no body."""
        return tuple(n for n, what in enumerate(self.nature) if what not in ("target", "echo"))
