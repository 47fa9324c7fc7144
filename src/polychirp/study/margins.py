"""Margins within which a study's detections are on a target: one rule for all receivers."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AnyReceiver, receiver_for
from polychirp.scoring.association import Gate
from polychirp.scoring.echoes import Folds
from polychirp.study.limits.bands import joint_band
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import Study, schedules_of, victim_indices

PAPER_GATE: Final = Gate(range=0.4, range_rate=2.0, azimuth=math.radians(15.0))
"""Least margins of the paper's receiver; chosen: that in range rate is a cell of the paper's
shortest ramp, 1.9 m/s at 1 ms."""


def gate_for(
    receiver: AnyReceiver, schedule: RampSchedule, times: SampleTimes, array: AntennaArray
) -> Gate:
    """Margins of a radar's detections, at least a cell of what its receiver adds in phase.

    They are those of `Gate.of`, whose cell in range rate is that of the frame, and in range that of
    all ramps together if the receiver adds them in phase (`limits.bands`). The paper's receiver
    adds in phase the samples of one ramp only, and has the cell λ/2T of the shortest one, or
    `PAPER_GATE` if that is more.
    """
    chosen = receiver_for(receiver, schedule)
    if not isinstance(chosen, PaperReceiver):
        return Gate.of(schedule, array, band=joint_band(chosen, schedule, times))
    gate = Gate.of(schedule, array, usual=PAPER_GATE)
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    cell = wavelength / (2.0 * float(np.min(schedule.duration)))
    return replace(gate, range_rate=max(gate.range_rate, cell))


def folds_of(receiver: AnyReceiver, schedule: RampSchedule, array: AntennaArray) -> Folds:
    """Places of echoes whose range rate is beyond the span that a receiver of chirps tells apart.

    A carrier with a code has no slope, and its ranges do not depend on the range rate. Other
    receivers search to a greatest speed, and fold nothing within it.
    """
    receiver = receiver_for(receiver, schedule)
    if isinstance(receiver, Decoding):
        receiver = receiver.reader()
    if not isinstance(receiver, RangeDoppler):
        return Folds()
    span = receiver.unambiguous_span(schedule, array)
    slope = float(schedule.slope[0])
    if slope == 0.0:
        return Folds(span=span)
    return Folds(span=span, shift=span * float(schedule.centre_frequency[0]) / slope)


def gates_of(study: Study) -> dict[str, Gate]:
    """Margins of each victim of a study, by the names of the radars."""
    study = sample_street(study)
    schedules = schedules_of(study)
    gates = {}
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        times = sample_times(schedule, radar.converter)
        gates[radar.name] = gate_for(study.receiver, schedule, times, radar.array)
    return gates
