r"""Range and range rate from the beat and the phase of two sequences of steps.

A sample is :math:`y = s_{tx}\overline{s_{rx}}`. On a step of the constant frequency f, a target at
:math:`R + vt` has the phase :math:`2\pi f\tau` with :math:`\tau = 2(R + vt)/c`. Step n of sequence
A has the frequency :math:`f_A + n f_{incr}` at the time nT, so that its phase, as a function of
the time t from the middle of the sequence, is

.. math:: \frac{\Phi_A}{2\pi} = \frac2c\,(f_{A,m} + bt)(R_A + vt)
          = \frac2c\left[f_{A,m}R_A + (bR_A + f_{A,m}v)\,t + bv\,t^2\right],
          \qquad b = \frac{f_{incr}}T .

The second sequence is :math:`T_s` later and :math:`f_{shift}` higher. With f, the mean of both
middle frequencies, and R, the range in the middle of the frame, the mean of both beats and the
difference of both phases in the middle of the sequences are

.. math:: F = \frac2c\,(bR + fv), \qquad
          \delta = \frac{\Phi_B - \Phi_A}{2\pi} = \frac2c\,(f_{shift}R + fT_s v)

without an approximation: the products of half the shift and half the delay cancel. The solution is

.. math:: R = \frac c2\,\frac{FT_s - \delta}{bT_s - f_{shift}}, \qquad
          v = \frac c{2f}\,\frac{b\delta - f_{shift}F}{bT_s - f_{shift}} .

With :math:`f_{shift} = -f_{incr}/2`, :math:`T_s = T/2`, the cells ΔR = c/2B and Δv = λ/2NT, and
κ = FNT this is R/ΔR = κ/2 − Nδ and v/Δv = κ/2 + Nδ. These are the equations of Meinecke and Rohling
(German Radar Symposium 2000; Rohling and Meinecke, "Waveform design principles for automotive radar
systems", CIE International Conference on Radar 2001), with three differences: the paper's samples
are the conjugate ones, so that its phases from range have the other sign; its κ grows with the
speed and falls with the range; and its N − 1 is N here, since B = N f_incr.

**Ambiguity.** F repeats after 1/T, and δ after one cycle. `alike` has the pairs of range and range
rate that cannot be told apart.

**Two targets with one beat** have one phase, that of their sum: neither is measured.
"""

from typing import NamedTuple

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.stepped.staircase import Staircase


class Motion(NamedTuple):
    """Range, m, and range rate, m/s, in the middle of the frame, of equal shapes."""

    range: FloatArray
    range_rate: FloatArray


def beat_and_phase(
    steps: Staircase, *, distance: FloatArray | float, range_rate: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Beat F, Hz, and phase δ of B from A, cycles, of targets, not reduced to one period.

    >>> one = Staircase(num_steps=256, interval=2e-5, late=1e-5, increment=1e6, shift=-5e5,
    ...     frequency=76.5e9)
    >>> beat, phase = beat_and_phase(one, distance=30.0, range_rate=10.0)
    >>> round(float(beat)), round(float(phase), 4)
    (15110, -0.049)
    """
    slope, scale = steps.increment / steps.interval, 2.0 / SPEED_OF_LIGHT
    beat = scale * (slope * np.asarray(distance) + steps.frequency * np.asarray(range_rate))
    phase = scale * (
        steps.shift * np.asarray(distance) + steps.frequency * steps.late * np.asarray(range_rate)
    )
    return np.asarray(beat), np.asarray(phase)


def solved(steps: Staircase, *, beat: FloatArray | float, phase: FloatArray | float) -> Motion:
    """Range and range rate of beats F, Hz, and phases δ, cycles, as they are: without ambiguity.

    >>> one = Staircase(num_steps=256, interval=2e-5, late=1e-5, increment=1e6, shift=-5e5,
    ...     frequency=76.5e9)
    >>> beat, phase = beat_and_phase(one, distance=30.0, range_rate=10.0)
    >>> found = solved(one, beat=beat, phase=phase)
    >>> round(float(found.range), 9), round(float(found.range_rate), 9)
    (30.0, 10.0)
    """
    beat, phase = np.asarray(beat), np.asarray(phase)
    slope = steps.increment / steps.interval
    divisor = 2.0 * (slope * steps.late - steps.shift) / SPEED_OF_LIGHT
    return Motion(
        range=np.asarray((beat * steps.late - phase) / divisor),
        range_rate=np.asarray((slope * phase - steps.shift * beat) / (divisor * steps.frequency)),
    )


def alike(steps: Staircase, *, span: float, greatest_speed: float) -> Motion:
    """Differences of range and range rate of targets with equal beats and phases, ``(pair,)``.

    They are those up to ``span``, m, and to twice ``greatest_speed``, m/s, the one of zero
    included.
    """
    beat, phase = beat_and_phase(
        steps,
        distance=np.array([span, span]),
        range_rate=np.array([2.0, -2.0]) * greatest_speed,
    )
    # these two corners of the rectangle, and their opposites, have the greatest beats and phases
    most = [int(np.max(np.abs(x))) for x in (beat * steps.interval, phase)]
    turns, cycles = (np.arange(-count, count + 1.0) for count in most)
    beats, phases = np.meshgrid(turns / steps.interval, cycles, indexing="ij")
    every = solved(steps, beat=beats.ravel(), phase=phases.ravel())
    slack = 1.0 + 1e-9
    near = (np.abs(every.range) <= span * slack) & (
        np.abs(every.range_rate) <= 2.0 * greatest_speed * slack
    )
    return Motion(every.range[near], every.range_rate[near])


def unambiguous_speed(
    steps: Staircase, *, least_range: float, greatest_range: float, greatest_speed: float
) -> float:
    """Speed up to which no two targets within the ranges look alike, at most ``greatest_speed``.

    It is 0 if targets of one range rate and different ranges look alike.

    >>> one = Staircase(num_steps=256, interval=2e-5, late=1e-5, increment=1e6, shift=-5e5,
    ...     frequency=76.5e9)
    >>> speed = unambiguous_speed(one, least_range=1.0, greatest_range=60.0, greatest_speed=200.0)
    >>> round(speed, 1), round(one.num_steps * one.rate_cell, 1)  # c/4f_incr is 75 m
    (98.0, 98.0)
    """
    pairs = alike(steps, span=greatest_range - least_range, greatest_speed=greatest_speed)
    other = (pairs.range != 0.0) | (pairs.range_rate != 0.0)
    return float(np.min(0.5 * np.abs(pairs.range_rate[other]), initial=greatest_speed))


def slowest(
    steps: Staircase,
    *,
    beat: FloatArray,
    phase: FloatArray,
    least_range: float,
    greatest_range: float,
    greatest_speed: float,
) -> Motion:
    """The slowest motion within the limits that has each beat and phase, ``(detection,)``.

    Range and range rate are NaN if there is none.
    """
    first = solved(steps, beat=beat, phase=phase)
    # moves every first solution, of a beat and a phase near zero, to all within the limits
    reach = float(np.max(np.abs(first.range), initial=0.0)) + greatest_range
    speed = float(np.max(np.abs(first.range_rate), initial=0.0)) + greatest_speed
    moves = alike(steps, span=reach, greatest_speed=0.5 * speed)
    distance = first.range[:, None] + moves.range
    rate = first.range_rate[:, None] + moves.range_rate
    inside = (distance >= least_range) & (distance <= greatest_range)
    inside &= np.abs(rate) <= greatest_speed
    best = np.argmin(np.where(inside, np.abs(rate), np.inf), axis=1)
    chosen = np.arange(len(distance)), best
    known = inside[chosen]
    return Motion(np.where(known, distance[chosen], np.nan), np.where(known, rate[chosen], np.nan))
