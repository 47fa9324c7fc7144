"""Names, units and version of what is stored of a run."""

from collections.abc import Mapping
from typing import Final

from polychirp.axes import axes_of
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame, IfParts, SampleTimes
from polychirp.model.paths import PropagationPaths
from polychirp.model.placement import Placement
from polychirp.model.ramp import RampSchedule
from polychirp.model.ramp_code import RampCode
from polychirp.model.score import Score
from polychirp.model.truth import Truth

FORMAT: Final = "polychirp run"
FORMAT_VERSION: Final = 11

UNITS: Final[Mapping[type, Mapping[str, str]]] = {
    IfFrame: {"samples": "V"},
    IfParts: {"samples": "V"},
    SampleTimes: {"first": "s", "num_samples": "1"},
    RampSchedule: {
        "start_time": "s",
        "duration": "s",
        "start_frequency": "Hz",
        "slope": "Hz/s",
        "start_phase": "cycle",
        "sweep": "1",
        "transmit_weight": "1",
    },
    RampCode: {"value": "1", "row": "1", "chip_duration": "s"},
    PropagationPaths: {
        "transmitter": "1",
        "receiver": "1",
        "delay": "s",
        "delay_rate": "s/s",
        "delay_acceleration": "1/s",
        "coherence_time": "s",
        "transfer": "1",
        "transfer_drift": "1/s",
        "departure": "1",
        "departure_rate": "1/s",
        "arrival": "1",
        "arrival_rate": "1/s",
        "bounce_start": "1",
        "bounce_actor": "1",
        "bounce_kind": "1",
        "bounce_point": "m",
    },
    Detections: {
        "range": "m",
        "range_rate": "m/s",
        "azimuth": "rad",
        "elevation": "rad",
        "power": "W",
        "snr": "1",
        "num_points": "1",
        "length": "m",
        "width": "m",
        "range_rate_span": "m/s",
    },
    Score: {
        "is_detected": "1",
        "range_error": "m",
        "range_rate_error": "m/s",
        "azimuth_error": "rad",
        "elevation_error": "rad",
        "detection_sinr": "1",
        "echo_snr": "1",
        "is_in_sight": "1",
        "snr": "1",
        "inr": "1",
        "mitigated_sinr": "1",
        "num_points": "1",
        "length": "m",
        "width": "m",
        "range_rate_span": "m/s",
        "power": "W",
    },
    Truth: {
        "range": "m",
        "range_rate": "m/s",
        "azimuth": "rad",
        "elevation": "rad",
        "point": "m",
        "is_visible": "1",
        "visible_share": "1",
        "place_target": "1",
        "place_range": "m",
        "place_range_rate": "m/s",
        "place_azimuth": "rad",
        "place_elevation": "rad",
    },
    Placement: {
        "radar_position": "m",
        "radar_orientation": "rad",
        "rear_axle": "m",
        "box_centre": "m",
        "box_size": "m",
        "box_orientation": "rad",
        "velocity": "m/s",
    },
}
"""Unit of every stored array, by data type and field; "1" for numbers, ratios and masks."""

FOLDERS: Final[Mapping[type, str]] = {
    SampleTimes: "times",
    RampSchedule: "schedule",
    RampCode: "code",
    PropagationPaths: "paths",
    Detections: "detections",
    Truth: "truth",
    Score: "score",
    Placement: "placement",
}
"""Name of the group of each data type, within the group of a victim. A schedule without
a code has no group of its code."""

AXIS_NAMES: Final = {"3": "xyz"}
"""Stored names of axes that are named by their length in the data types."""

POLARISATION_AXES: Final = ("receiving", "transmitting")
"""Stored names of the two axes of a path's ``transfer``."""

UNIT_OF_NAMES: Final = "name"
"""Attribute ``units`` of arrays of names."""


def stored_axes(noun: type, field: str) -> tuple[str, ...]:
    """Names of the axes of a stored array.

    >>> stored_axes(PropagationPaths, "transfer")
    ('path', 'receiving', 'transmitting')
    """
    if (noun, field) == (PropagationPaths, "transfer"):
        return ("path", *POLARISATION_AXES)
    return tuple(AXIS_NAMES.get(axis, axis) for axis in axes_of(noun)[field])
