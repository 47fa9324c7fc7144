r"""The part of an echo that moves as its target does.

With the phases of the target removed, its own echo on ramp k is :math:`g_k s_k`: the sum
:math:`g_k` of what the transmitting elements send towards it, times something slow. The echo of a
body at the same range whose range rate differs by v turns by :math:`2v/\lambda` cycles per second.
The slow part is therefore the least-squares fit of tones up to :math:`2V/\lambda`, with V of
`SAME_RATE`, half a cell 1/T of the frame apart, under a window that falls to zero at the frame's
ends, as other tones leak into the fit otherwise. Near the ends, where the window hides the echo,
the slow part goes on with its mean frequency. The main lobe of the window is three cells wide to
either side, so that echoes count as others from three cells beyond V on.

The fit is that of the echoes before mitigation, which leaves more of some ramps than of others.
What mitigation takes from the echoes of a cell on one ramp, it takes from the own echo too.

An echo whose power under the window is nearly all in its slow part is left as it is. A frame of few
ramps does not tell such tones apart, and on unequal ramps the phases of a body's scatterers change
with the frequency: every echo then counts as the target's own.
"""

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import direction_of
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.signal_model.equal_ramps import unequal

SAME_RATE: Final = 2.0
"""Greatest difference, m/s, between the range rate of a target and of its own echo. Chosen: the
trunk and the thighs of a walker stay within it, and so does a body that passes at 25 m/s
5 m away, whose range rate changes by up to 1 m/s to either side of the middle of a 16-ms frame."""

WINDOW_POWER: Final = 4
"""Power of the sine that is the window over the ramps. Chosen: a body 40 dB stronger at a range
rate 3.5 m/s away changes the power of the fit by less than 0.1 dB over 256 chirps in 13 ms."""

HIDDEN: Final = 0.03
"""Value of the window below which the fit tells nothing; chosen."""

ALL_OWN: Final = 0.9
"""Share of the power from which on an echo counts as the target's own as a whole; chosen: that is
0.5 dB."""

_LEAST_TOLD: Final = 0.01
"""Least eigenvalue, relative to the greatest one, of tones that windowed ramps tell apart; chosen:
combinations of tones with less are mostly signals of other range rates."""

_TINY: Final = 1e-300


def tells_rates_apart(schedule: RampSchedule) -> bool:
    """True if the ramps tell echoes of other range rates from a target's own.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Sawtooth, Triangular
    >>> chirps = Sawtooth(start_frequency=77e9, bandwidth=3e8, ramp_duration=5e-5)
    >>> [tells_rates_apart(waveform.schedule(num_sweeps=256, streams=Streams(1)))
    ...     for waveform in (chirps, Triangular())]
    [True, False]
    """
    return _num_tones(schedule) < schedule.num_ramps and not unequal(schedule)


def own_echoes(
    left: ComplexArray, whole: ComplexArray, frame: IfFrame, cells: Detections
) -> ComplexArray:
    """The own parts of echoes that mitigation has left in cells, V ``(cell, ramp)``.

    Where other echoes are taken out, the slow part has a constant modulus, the rms of the fit.

    Parameters
    ----------
    left, whole : amplitudes of all echoes after and before mitigation, V ``(cell, ramp)``, of which
        the phases of a point in the cell are removed
    """
    schedule = frame.schedule
    if not tells_rates_apart(schedule):
        return left
    time = schedule.start_time - schedule.start_time[0]
    window = _window(time)
    shown = np.flatnonzero(window > HIDDEN)
    if shown.size < 2:  # two groups of ramps, far apart
        return left
    highest = _highest_tone(schedule)
    frequency = np.linspace(-highest, highest, _num_tones(schedule))
    tones = np.exp(2j * np.pi * np.outer(time, frequency))
    patterns = _patterns(frame, cells)
    counted = window * np.abs(patterns) ** 2
    num_kinds = 1 if schedule.num_elements == 1 else len(patterns)  # one element: all are alike
    inverse = [_inverse(tones, some) for some in counted[:num_kinds]]
    own = left.copy()
    for n, pattern in enumerate(patterns):
        seen = window * pattern.conj() * whole[n]
        slow = tones @ (inverse[min(n, num_kinds - 1)] @ (tones.conj().T @ seen))
        power = float(counted[n] @ np.abs(slow) ** 2)
        if power < ALL_OWN * float(window @ np.abs(whole[n]) ** 2):
            rms = math.sqrt(power / max(float(np.sum(counted[n])), _TINY))
            alone = pattern * rms * _extended(np.exp(1j * np.angle(slow)), time, shown)
            own[n] = alone * _shares_left(left[n], whole[n])
    return own


def _shares_left(left: ComplexArray, whole: ComplexArray) -> ComplexArray:
    """Factors ``(ramp,)`` of mitigation, which is linear; of a modulus of 1 at most."""
    factor = left * whole.conj() / np.maximum(np.abs(whole) ** 2, _TINY)
    return np.asarray(factor / np.maximum(np.abs(factor), 1.0))


def _highest_tone(schedule: RampSchedule) -> float:
    """Frequency of the echo of a body that is `SAME_RATE` faster than the target, Hz."""
    return 2.0 * SAME_RATE * float(np.mean(schedule.centre_frequency)) / SPEED_OF_LIGHT


def _num_tones(schedule: RampSchedule) -> int:
    """Number of tones up to the highest one, of both signs, half a cell apart."""
    length = float(schedule.start_time[-1] - schedule.start_time[0])
    return math.ceil(4.0 * _highest_tone(schedule) * length) + 1


def _window(time: FloatArray) -> FloatArray:
    """Power of a sine over the frame, ``(ramp,)``, that is not quite zero at its ends."""
    margin = 1.0 / time.size
    return np.asarray(
        np.sin(np.pi * (time / time[-1] + margin) / (1.0 + 2.0 * margin)) ** WINDOW_POWER
    )


def _patterns(frame: IfFrame, cells: Detections) -> ComplexArray:
    r"""Sum of the elements' signals towards each cell, ``(cell, ramp)``.

    An element at y to the left and z up with the response r adds
    :math:`\overline{r w_{kl}}e^{-2\pi jf(yu+zw)/c}` to the beat of ramp k.
    """
    schedule = frame.schedule
    if schedule.num_elements == 1:
        return np.ones((cells.num_detections, schedule.num_ramps), dtype=np.complex128)
    place = frame.array.transmit_position[: schedule.num_elements, 1:]
    across = direction_of(np.nan_to_num(cells.azimuth), np.nan_to_num(cells.elevation))[:, 1:]
    cycles = float(np.mean(schedule.centre_frequency)) / SPEED_OF_LIGHT * across @ place.T
    sent = frame.array.transmitter_response[: schedule.num_elements] * schedule.transmit_weight
    return np.asarray(np.exp(-2j * np.pi * cycles) @ sent.conj().T)


def _inverse(tones: ComplexArray, weight: FloatArray) -> ComplexArray:
    """Inverse ``(tone, tone)`` of weighted products of tones, of those that ramps tell apart."""
    value, vector = np.linalg.eigh(tones.conj().T @ (weight[:, None] * tones))
    is_told = value > _LEAST_TOLD * value[-1]
    kept = vector[:, is_told]
    return np.asarray(kept / value[is_told] @ kept.conj().T)


def _extended(phase: ComplexArray, time: FloatArray, shown: IntArray) -> ComplexArray:
    """Phase factors ``(ramp,)`` that go on with their mean frequency beyond the ``shown`` ramps."""
    turn = np.angle(phase[shown[1:]] * phase[shown[:-1]].conj())
    speed = np.sum(turn) / (time[shown[-1]] - time[shown[0]])
    nearest = np.clip(np.arange(time.size), shown[0], shown[-1])
    return np.asarray(phase[nearest] * np.exp(1j * speed * (time - time[nearest])))
