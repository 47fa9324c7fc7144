"""`Score`: one radar's detections against the truth."""

from dataclasses import dataclass
from typing import Annotated

from polychirp.axes import Axes, BoolArray, PerDetection, PerTarget, seal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Score:
    """Result for every target, and nature of every detection.

    A `VictimResult` has it.

    Parameters
    ----------
    is_detected : true for a target that has a detection, ``(target,)``
    range_error, range_rate_error, azimuth_error, elevation_error : m, m/s, rad, rad, found minus
        true, ``(target,)``; NaN where ``is_detected`` is false, or the radar does not measure the
        angle. The true azimuth of a radar that measures no elevation is arcsin(cos ε sin φ)
    detection_sinr : power ratio of the own echo to all other parts at the target's detection,
        ``(target,)``; NaN where ``is_detected`` is false
    echo_snr : coherent SNR of each body's echo, its energy in all samples and channels over the
        noise power of a sample, ``(target,)``
    is_in_sight : true for a target that a receiver could find, ``(target,)`` (`scoring.sight`)
    snr, inr : power ratio of the own echo, and of interference, to noise in the cell of every
        target before mitigation, ``(target,)`` (`TargetLevels`)
    mitigated_sinr : power ratio of the own echo to all other parts in the cell of every target
        after mitigation, ``(target,)``
    num_points : number of detections on every target, ``(target,)``
    length, width, range_rate_span : extent of these detections along range, m, across, m, and in
        range rate, m/s, ``(target,)`` (`Extent`); zero where ``is_detected`` is false
    nature : nature of every detection: "target", "body" (an echo of another body), "clutter",
        "folded" (an echo with another range rate, `scoring.causes`), or the kind of ghost:
        "multipath", "direct", "indirect", "front-end", "unexplained"
    body : name of the body whose echo every detection is; None for ghosts
    radar : name of the radar whose signal causes each "direct" or "indirect" detection; None for
        all others, and, as by default, if it was not determined
    power : power of every detection, W, ``(detection,)``
    target_detection : number of the detection that gives the errors of each detected target, in
        the order of the targets
    num_missed : number of targets in sight without a detection
    num_unresolved : number of detections left out by the receiver, as of `Detections`
    floor_rise : power ratio of the range spectra's floor to the floor of noise alone
    """

    is_detected: Annotated[BoolArray, Axes("target", dtype=bool)]
    range_error: PerTarget
    range_rate_error: PerTarget
    azimuth_error: PerTarget
    elevation_error: PerTarget
    detection_sinr: PerTarget
    echo_snr: PerTarget
    is_in_sight: Annotated[BoolArray, Axes("target", dtype=bool)]
    snr: PerTarget
    inr: PerTarget
    mitigated_sinr: PerTarget
    num_points: PerTarget
    length: PerTarget
    width: PerTarget
    range_rate_span: PerTarget
    nature: tuple[str, ...]
    body: tuple[str | None, ...]
    power: PerDetection
    target_detection: tuple[int, ...]
    num_missed: int
    floor_rise: float
    num_unresolved: int = 0
    radar: tuple[str | None, ...] = ()

    def __post_init__(self) -> None:
        if not self.radar:
            object.__setattr__(self, "radar", (None,) * len(self.nature))
        seal(self)

    def numbers(self, nature: str) -> tuple[int, ...]:
        """Numbers of the detections of one nature."""
        return tuple(n for n, what in enumerate(self.nature) if what == nature)

    @property
    def other_echoes(self) -> tuple[int, ...]:
        """Numbers of the detections that are echoes of other bodies or clutter."""
        return tuple(
            n for n, what in enumerate(self.nature) if what in ("body", "clutter", "folded")
        )

    @property
    def ghosts(self) -> tuple[int, ...]:
        """Numbers of the detections at which there is no body."""
        return tuple(n for n, body in enumerate(self.body) if body is None)

    @property
    def origin(self) -> tuple[str, ...]:
        """Source of each detection: the name of a body, "radar" and a name, or empty."""
        pairs = zip(self.body, self.radar, strict=True)
        return tuple(body or (f"radar {radar}" if radar else "") for body, radar in pairs)
