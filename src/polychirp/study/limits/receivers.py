"""Ramps and arrays that suit a victim's receiver in part only.

Every function yields a sentence for each victim that it concerns.
"""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.angle.ambiguity import SAME_COSINE, ambiguities, beam_of
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.range_doppler.transforms import MOST_UNEVEN
from polychirp.receiver.selection import (
    angle_estimator,
    readable_elements,
    receiver_for,
)
from polychirp.receiver.signal_model.equal_ramps import unequal
from polychirp.receiver.signal_model.transmit_codes import code_blocks
from polychirp.study.spec import Study, victim_indices

GREATEST_GUARD: Final = 0.1
"""Greatest guard of a mitigation, as a share of the shortest ramp, without a warning. Chosen: with
a longer guard on either side, each burst removes more than a fifth of a ramp."""


FEWEST_CELLS: Final = 1.5
"""Least greatest speed of the coherent receiver, in cells λ/2T, with which it detects; measured: it
finds points of single ramps with 1.8 cells, and none with 1.0."""

MOST_TURN: Final = {"in turn": 0.1, "together": 0.02}
"""Phases that motion may add to an echo within the block of a code, in cycles, without a note, for
elements that send in turn and together; measured: with three elements and an SNR of 82 dB, points
have a second detection from 0.2 cycles on in turn, and from 0.05 on together."""


def limits_of_paper_receiver(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    r"""Noise and moving targets that the paper's receiver does not treat as others do.

    A target at range rate v appears :math:`v f/b` away from its range, on ramps of different f/b at
    different places, and moves by v T during the frame. Averaged, it is spread over more than the
    cell c/2B if v exceeds :math:`(c/2B)/(\max f/b - \min f/b + T)`.
    """
    for number in victim_indices(study):
        schedule = schedules[number]
        if not isinstance(receiver_for(study.receiver, schedule), PaperReceiver):
            continue
        coupling = schedule.centre_frequency / np.abs(schedule.slope)
        frame = float(schedule.end_time[-1] - schedule.start_time[0])
        cell = SPEED_OF_LIGHT / (2.0 * float(np.max(schedule.bandwidth)))
        speed = 3.6 * cell / (float(np.ptp(coupling)) + frame)
        yield (
            "the receiver 'paper' serves for comparison: noise alone exceeds its threshold, the "
            "mean of the profile, in every frame, and it spreads a target faster than "
            f"{float(f'{speed:.2g}'):g} km/h over several range cells, as it averages over sweeps; "
            "'coherent' does neither"
        )


def long_guards(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """Guards of the mitigation that take much of a ramp for every burst."""
    mitigation = study.receiver.mitigation
    if not isinstance(mitigation, BurstRepair):
        return
    for number in victim_indices(study):
        radar = study.radars[number]
        shortest = float(schedules[number].duration.min())
        guard = mitigation.guard_time(radar.converter.sample_rate)
        if guard > GREATEST_GUARD * shortest:
            yield (
                f"the guard of the mitigation '{mitigation.kind}' is {1e6 * guard:.3g} µs, and "
                f"the shortest ramp of '{radar.name}' lasts {1e6 * shortest:.3g} µs, so that "
                "each burst takes much of a ramp; set receiver.mitigation.guard to "
                f"'{1e6 * GREATEST_GUARD * shortest:.2g} us' or less"
            )


def ambiguous_arrays(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """Arrays that cannot tell apart directions in their field of view, the elements' 3-dB beam.

    These are the arrays whose `unambiguous_window` does not cover this beam.
    """
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        receiver = receiver_for(study.receiver, schedule)
        elements = readable_elements(receiver, radar.array, schedule)
        half = beam_of(radar.array.pattern)
        lobes = np.abs(ambiguities(elements, estimator=angle_estimator(receiver)))
        inside = lobes[np.all(lobes < 2.0 * np.sin(half) - SAME_COSINE, axis=1)]
        if not len(inside):
            continue
        left, up = inside[np.argmin(np.linalg.norm(inside, axis=1))].round(6)
        yield (
            f"the array of '{radar.name}' cannot tell apart directions in its elements' beam of "
            f"±{np.degrees(half[0]):.3g}° by ±{np.degrees(half[1]):.3g}°, such as two whose sines "
            f"differ by {left:.3g} in azimuth and {up:.3g} in elevation: a target may appear in a "
            "wrong direction; place elements closer together, or unevenly"
        )


def motion_within_blocks(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """Codes whose blocks are decoded as for targets at rest, though targets move within them.

    The last sweep of a block begins T after its first one, over which the phase of an echo grows by
    2vT/λ cycles.
    """
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        receiver = receiver_for(study.receiver, schedule)
        if schedule.num_elements < 2 or not isinstance(receiver, CoherentReceiver):
            continue
        blocks = code_blocks(schedule)
        start = schedule.start_time[blocks.ramps[0, :, 0]]
        length = float(start[-1] - start[0])
        is_shared = np.any(np.count_nonzero(blocks.weight, axis=1) > 1)
        turn = MOST_TURN["together" if is_shared else "in turn"]
        wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
        greatest = 0.5 * turn * wavelength / length
        if receiver.greatest_speed > greatest:
            yield (
                f"the {schedule.num_elements} transmitting elements of '{radar.name}' share blocks "
                f"whose first and last sweeps begin {1e3 * length:.3g} ms apart, and 'coherent' "
                "separates them as if targets were at rest: those faster than "
                f"{float(f'{3.6 * greatest:.2g}'):g} km/h may have several detections of less SNR; "
                "use the receiver 'range-doppler', which needs equal chirps, or one transmitting "
                "element"
            )


def open_speeds(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """Equal ramps that leave the range rate open to the coherent receiver.

    The migration λN/2 over N ramps by which two folds differ is then less than a range cell.
    """
    for number in victim_indices(study):
        schedule = schedules[number]
        receiver = receiver_for(study.receiver, schedule)
        if isinstance(receiver, CoherentReceiver):
            yield from _short_frame(study.radars[number].name, receiver, schedule)
            yield from _open_speeds(study.radars[number].name, receiver, schedule)


def _short_frame(name: str, receiver: CoherentReceiver, schedule: RampSchedule) -> Iterator[str]:
    """A sentence if one point fills all range rates of the map, and so the noise at its range."""
    length = float(schedule.end_time[-1] - schedule.start_time[0])
    cell = 0.5 * SPEED_OF_LIGHT / (float(schedule.centre_frequency[0]) * length)
    if receiver.greatest_speed < FEWEST_CELLS * cell:
        needed = 3.6 * 2.0 * cell
        yield (
            f"the frame of '{name}' lasts {1e3 * length:.3g} ms, which tells range rates "
            f"{3.6 * cell:.3g} km/h apart, and its receiver 'coherent' searches "
            f"±{3.6 * receiver.greatest_speed:.0f} km/h: a target fills all of them and is taken "
            f"for noise; set receiver.greatest_speed to '{needed:.0f} km/h' or more, or use more "
            "ramps"
        )


def _open_speeds(name: str, receiver: CoherentReceiver, schedule: RampSchedule) -> Iterator[str]:
    count, centre = schedule.num_ramps, float(schedule.centre_frequency[0])
    searched = f"±{3.6 * receiver.greatest_speed:.0f} km/h"
    if count == 1:
        shift = receiver.greatest_speed * centre / abs(float(schedule.slope[0]))
        yield (
            f"'{name}' has a single ramp, on which range and range rate have one beat: a "
            f"detection may have any range rate within {searched}, receiver.greatest_speed, "
            f"and a range that is wrong by up to {shift:.3g} m with it; use ramps of two "
            "slopes, or many equal ones"
        )
        return
    interval = np.diff(schedule.start_time)
    is_even = count < 3 or float(np.ptp(interval)) < MOST_UNEVEN * float(interval.mean())
    migrates = count * float(schedule.bandwidth[0]) > centre
    fold = 0.5 * SPEED_OF_LIGHT / (centre * float(interval.mean()))
    if is_even and not unequal(schedule) and not migrates and 0.5 * fold < receiver.greatest_speed:
        yield (
            f"the {count} equal ramps of '{name}' do not tell range rates "
            f"{3.6 * fold:.3g} km/h apart, and its receiver 'coherent' searches {searched}: a "
            "detection may have a wrong one; lower receiver.greatest_speed, or use ramps of "
            "two slopes or drawn intervals"
        )
