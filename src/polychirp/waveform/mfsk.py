"""`Mfsk`: two interleaved sequences of steps of constant frequency."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Seconds
from polychirp.waveform.base import need_not_negative, need_positive, need_sweeps
from polychirp.waveform.chirps import chirps, starts

LEAST_STEPS = 8
"""Least number of steps of a sequence. Chosen: the spectrum of fewer has no cells beside a peak."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mfsk(Spec):
    r"""Multiple frequency-shift keying: steps of two sequences A and B in turn, A₁ B₁ A₂ B₂ ….

    Step n of A has the frequency :math:`f_A + n\,f_{incr}`, and B is shifted from A by
    :math:`f_{shift}` (Meinecke and Rohling, "Combination of LFMCW and FSK modulation principles for
    automotive radar systems", German Radar Symposium 2000). The beat along the steps and the phase
    between A and B together give range and range rate of a target in one sweep: see
    `receiver.stepped`, whose receiver reads frames of one sweep.

    Every step is a ramp of slope zero. Until the echo of a step arrives, the mixer receives the
    step before, and its product is :math:`f_{shift}` or more away: the converter's ``start`` of the
    radar must be at least the delay of the farthest echo, and half the length of the IF filter's
    response longer for the filter to settle.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of all steps
    bandwidth : Hz, B, number of steps of a sequence times :math:`f_{incr}`; a range cell is c/2B
    num_steps : N, number of steps of each sequence in a sweep
    step_duration : s, of each step
    shift : Hz, :math:`f_{shift}`, of B from A; None for :math:`-f_{incr}/2`
    idle : s, silence after every step

    Raises
    ------
    InputError
        A sequence has too few steps, a frequency or duration is not positive, the idle time is
        negative, or B is on the line of A, so that the phase says no more than the beat.

    Examples
    --------
    >>> waveform = Mfsk(start_frequency=76e9, bandwidth=256e6, num_steps=256)
    >>> ramps = waveform.schedule(num_sweeps=1, streams=Streams(seed=1))
    >>> (ramps.start_frequency[:4] - 76e9) / 1e6, ramps.slope[:2]
    (array([0.5, 0. , 1.5, 1. ]), array([0., 0.]))
    """

    kind: Literal["mfsk"] = "mfsk"
    start_frequency: Hertz = 76.2e9
    bandwidth: Hertz = 600e6
    num_steps: Annotated[int, Between(greatest=1_000_000)] = 512
    step_duration: Seconds = 10e-6
    shift: Hertz | None = None
    idle: Seconds = 0.0

    def __post_init__(self) -> None:
        owner = "an MFSK waveform"
        need_positive(
            owner,
            start_frequency=self.start_frequency,
            bandwidth=self.bandwidth,
            step_duration=self.step_duration,
        )
        need_not_negative(owner, idle=self.idle)
        if self.num_steps < LEAST_STEPS:
            raise InputError(
                f"{owner} of {self.num_steps} steps has too few for a spectrum; use "
                f"{LEAST_STEPS} or more"
            )
        if abs(self.shift_of_b - 0.5 * self.increment) < 1e-3 * self.increment:
            raise InputError(
                f"{owner} with a shift of half the increment, {0.5e-3 * self.increment:.6g} kHz, "
                "has one line of steps, whose phases cannot tell range from range rate; use a "
                f"shift of '{-0.5e-3 * self.increment:.6g} kHz'"
            )

    @property
    def increment(self) -> float:
        """Frequency from step to step of one sequence, Hz."""
        return self.bandwidth / self.num_steps

    @property
    def shift_of_b(self) -> float:
        """Frequency of sequence B less that of sequence A, Hz."""
        return -0.5 * self.increment if self.shift is None else self.shift

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Steps of ``num_sweeps`` sweeps, without random numbers."""
        del streams
        need_sweeps(num_sweeps)
        of_sequence = np.array([0.0, self.shift_of_b])
        steps = np.add.outer(self.increment * np.arange(self.num_steps), of_sequence).ravel()
        frequency = np.tile(self.start_frequency + steps - steps.min(), num_sweeps)
        duration = np.full(frequency.size, self.step_duration)
        return chirps(
            start_time=starts(duration + self.idle),
            duration=duration,
            lowest=frequency,
            bandwidth=np.zeros(frequency.size),
            is_up=np.ones(frequency.size, dtype=np.bool_),
            sweep=np.repeat(np.arange(num_sweeps), steps.size),
        )
