"""Results of `polychirp paper`, and the paper's statements, in the units of the report."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal

from polychirp.axes import Axes, FloatArray, Sealed
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.study.section_v.cases import CorrelationResults

Scenario = Literal["A", "B", "C", "all"]
"""Scenarios of §VII of the paper: A without, B with indirect, C with direct interference; and ours,
"all", in which all four radars of the street transmit."""

WaveformKind = Literal["conventional", "diverse", "fixed-per-radar"]
Mitigation = Literal["none", "blanking"]
Antenna = Literal["table 2", "consistent"]
"""Gain of all antennas: 27 dBi as printed in table 2, or the 11 dBi of a beam of ±80° × ±10°."""

GhostKind = Literal["direct", "indirect", "multipath", "front-end", "unexplained"]

Situation = Literal["alone", "interfered", "blanked"]
"""Situation of the victim: no interferers; interferers; interferers, and the victim blanks."""

Interval = tuple[float, float, float]
"""An estimate and its 95 % interval: value, lower and upper limit."""

PAPER_TARGETS: Final = 10
"""Number of targets for which the paper states the accuracy of figure 13."""

PAPER_ACCURACY: Final = {
    "range_rmse_m": 0.13,
    "azimuth_rmse_deg": 0.12,
    "speed_rmse_kmh": 0.1,
}
"""Accuracy in the paper at `PAPER_TARGETS` targets, by the field of `StatisticsRow`: m, °, km/h."""

INTERFERENCE_GHOSTS: Final = ("direct", "indirect")
"""Kinds of ghosts that come from another radar; the paper speaks of no others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetRow:
    """One target: its truth, and the errors (detected − true) and SINR (``snr_db``) if detected."""

    name: str
    range_m: float
    closing_speed_mps: float
    azimuth_deg: float
    detected: bool
    range_error_m: float | None = None
    speed_error_mps: float | None = None
    azimuth_error_deg: float | None = None
    snr_db: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class GhostRow:
    """One ghost: a detection at a place without a body.

    Its power is relative to that of the strongest detected target; NaN if no target was detected.
    ``radar`` is the name of the radar whose signal it is; None if it is no other radar's.
    """

    kind: GhostKind
    range_m: float
    closing_speed_mps: float
    azimuth_deg: float
    power_over_strongest_target_db: float
    radar: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RowMap(Sealed):
    """Range-rate map of a row, with few cells, and what is in it at the same instant.

    The rows of tables may refer to another instant of the frame; the marks in this map are at the
    places of their peaks.

    Parameters
    ----------
    range, range_rate : m and m/s (positive = away), means of the pooled cells
    power_db : dBm per channel at the converter, greatest of the pooled cells,
        ``(range_rate, range)``
    detection_range, detection_range_rate, detection_power_db : m, m/s and dBm, ``(detection,)``
    detection_cause : cause of every detection, as ``nature`` of `Score`
    detection_origin : body or radar that every detection comes from, as ``origin`` of `Score`
    target_range, target_range_rate : m and m/s, in the order of the row's targets, ``(target,)``
    """

    range: Annotated[FloatArray, Axes("range")]
    range_rate: Annotated[FloatArray, Axes("range_rate")]
    power_db: Annotated[FloatArray, Axes("range_rate", "range")]
    detection_range: Annotated[FloatArray, Axes("detection")]
    detection_range_rate: Annotated[FloatArray, Axes("detection")]
    detection_power_db: Annotated[FloatArray, Axes("detection")]
    detection_cause: tuple[str, ...]
    detection_origin: tuple[str, ...]
    target_range: Annotated[FloatArray, Axes("target")]
    target_range_rate: Annotated[FloatArray, Axes("target")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaperRow(Sealed):
    """Result of one frame of one victim, with one waveform, timing and mitigation.

    Ranges are those at the start of the frame, where the street has the paper's distances.

    Parameters
    ----------
    radar : name of the victim
    synchronous : True if all radars start together, the worst case of the paper
    missed : number of targets in sight that were not detected
    floor_rise_db : dB, floor of the range spectra over that of thermal noise alone
    other_echoes : number of detections that are echoes of walls, road, trees or further bodies
    profile_range : m, ``(range,)``
    profile_power_db : power over range, dBm per channel at the converter, ``(range,)``: geometric
        mean over ramps, greatest of all beams and range rates
    noise_floor_db : dBm, the same for thermal noise alone, mean over range
    mean_threshold_db : dBm, the paper's threshold, equation (12), computed from this profile
    detection_range, detection_power_db : m and dBm, ``(detection,)``, of all detections
    paper_detections, paper_found : number of detections of the paper's receiver (`PaperReceiver`)
        in the same samples, and number of targets among them
    antenna : antenna of all radars
    map : range-rate map, of the variants of scenarios A, B and C only
    """

    scenario: Scenario
    radar: str
    waveform: WaveformKind
    synchronous: bool
    mitigation: Mitigation
    targets: tuple[TargetRow, ...]
    ghosts: tuple[GhostRow, ...]
    missed: int
    floor_rise_db: float
    other_echoes: int
    profile_range: Annotated[FloatArray, Axes("range")]
    profile_power_db: Annotated[FloatArray, Axes("range")]
    noise_floor_db: float
    mean_threshold_db: float
    detection_range: Annotated[FloatArray, Axes("detection")]
    detection_power_db: Annotated[FloatArray, Axes("detection")]
    paper_detections: int = 0
    paper_found: int = 0
    antenna: Antenna = "table 2"
    map: RowMap | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperClaim:
    """Statement of the paper about one panel of its figures 9 to 11.

    Parameters
    ----------
    figure : the panel, such as "11a"
    text : the statement in a few words
    target_ranges_m : ranges of the targets that the paper says are found
    num_ghosts : number of false targets that the panel shows
    ghost_ranges_m : ranges of these false targets, if the paper states them
    is_ghost_strongest : True if the paper says that a ghost is stronger than the targets
    """

    figure: str
    scenario: Scenario
    radar: str
    waveform: WaveformKind
    text: str
    target_ranges_m: tuple[float, ...]
    num_ghosts: int = 0
    ghost_ranges_m: tuple[float, ...] = ()
    is_ghost_strongest: bool = False


def paper_claims(*, radar_1: str, radar_2: str) -> tuple[PaperClaim, ...]:
    """Statements about the six panels of figures 9 to 11, with our names of radars 1 and 2.

    >>> [claim.figure for claim in paper_claims(radar_1="v1", radar_2="v2")]
    ['9a', '9b', '10a', '10b', '11a', '11b']
    """
    texts = {
        "9a": "targets 3 and 4 found at 9.15 m and 6.5 m",
        "9b": "target 2 and vehicle 4 found at 12.6 m and 13.65 m",
        "10a": "two targets and two false targets, made by radar 3",
        "10b": "two targets, no false target",
        "11a": "two targets, and a false one at 6.6 m that is stronger than both",
        "11b": "two targets at 12.6 m and 13.65 m, no false target",
    }

    def claim(figure: str, scenario: Scenario, waveform: WaveformKind) -> PaperClaim:
        is_first = figure in ("9a", "10a", "10b")
        return PaperClaim(
            figure=figure,
            scenario=scenario,
            radar=radar_1 if is_first else radar_2,
            waveform=waveform,
            text=texts[figure],
            target_ranges_m=(6.5, 9.15) if is_first else (12.6, 13.65),
        )

    return (
        claim("9a", "A", "conventional"),
        claim("9b", "A", "conventional"),
        replace(claim("10a", "B", "conventional"), num_ghosts=2),
        claim("10b", "B", "diverse"),
        replace(
            claim("11a", "C", "conventional"),
            num_ghosts=1,
            ghost_ranges_m=(6.6,),
            is_ghost_strongest=True,
        ),
        claim("11b", "C", "diverse"),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class StatisticsRow:
    """One point of the curves of figures 12 and 13, in the units of the report.

    Parameters
    ----------
    waveform : waveform of all radars
    situation : interference at the victim, and blanking
    num_targets, num_trials : number of targets on the street, and of trials
    detection : probability that a target in sight is detected
    ghosts, unexplained : mean number in a frame: all ghosts; those that no path explains
    range_rmse_m, azimuth_rmse_deg, speed_rmse_kmh : rms errors of detected targets
    range_median_m, azimuth_median_deg, speed_median_kmh : medians of the absolute errors; a few
        targets that share a cell with another one contribute most of an rms error, but not of these
    floor_rise_db : median over trials
    detection_gain, ghosts_gain : detection probability and ghosts minus those of the conventional
        waveform in the same situation, of the same trials; None for the conventional waveform
    """

    waveform: WaveformKind
    situation: Situation
    num_targets: int
    num_trials: int
    detection: Interval
    ghosts: Interval
    unexplained: Interval
    range_rmse_m: Interval
    azimuth_rmse_deg: Interval
    speed_rmse_kmh: Interval
    range_median_m: float
    azimuth_median_deg: float
    speed_median_kmh: float
    floor_rise_db: float
    detection_gain: Interval | None = None
    ghosts_gain: Interval | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredStatistics:
    """Points of figures 12 and 13 that were computed earlier.

    Parameters
    ----------
    measured : date on which they were computed, as in ISO 8601
    version : of polychirp that computed them
    seed : of the trials
    rows : one for every curve and number of targets
    """

    measured: str
    version: str
    seed: int
    rows: tuple[StatisticsRow, ...]

    @property
    def num_trials(self) -> int:
        """Number of trials of every point; the least if they differ."""
        return min(row.num_trials for row in self.rows)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaperResults:
    """All results that `polychirp paper` shows.

    Parameters
    ----------
    versions : versions of polychirp and of its libraries, by name
    wall_time_s : duration of the computation
    rows : one for each variant of scenarios A, B and C
    everyone : one for each radar and waveform, with all four radars transmitting
    consistent : radar 2 in scenarios A and C with the antenna gain that the beam allows
    claims : statements of the paper, from `paper_claims`
    conventional, diverse : one frame's ramps of radar 1 with each waveform, for figure 4
    scene : the street at time 0, for figure 8
    notes : remarks without which the numbers may be misunderstood
    correlation : results of section V, if it was run
    statistics : points of figures 12 and 13 at the greatest number of targets, if they were run
    stored : the same and others, computed earlier with more trials; None if they are not shown
    traced : the same on ray-traced vehicles, computed earlier; None if they are not shown
    """

    seed: int
    versions: Mapping[str, str]
    wall_time_s: float
    rows: tuple[PaperRow, ...]
    everyone: tuple[PaperRow, ...] = ()
    consistent: tuple[PaperRow, ...] = ()
    claims: tuple[PaperClaim, ...]
    conventional: RampSchedule
    diverse: RampSchedule
    scene: Scene
    notes: tuple[str, ...] = ()
    correlation: CorrelationResults | None = None
    statistics: tuple[StatisticsRow, ...] = ()
    stored: StoredStatistics | None = None
    traced: StoredStatistics | None = None
