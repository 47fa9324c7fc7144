r"""Two points in one cell of range and range rate, told apart by their phases.

Beats tell points apart that are a cell of one ramp away from each other, 0.15 m or 1 to 2 m/s;
phases over a frame do so from λ/2T = 4 cm/s on. A cell with two points in it has one beat on every
ramp, but two phase histories:

.. math:: a_{mk} = \sum_{i=1}^{2} A_i(t_k)\,H_{ik}\,
          e^{j4\pi f_k\,\delta R_i(t_k)/c - j2\pi f_k y_m s_i(t_k)/c}

Two such are looked for (`two_histories`) where one does not explain what is there; then each is
measured with the other taken out, by turns (RELAX, Li and Stoica 1996), as points are that stand
alone, but for one amplitude for the whole frame. They replace the claim if they explain it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.estimation.bearing_rate import courses, sines_and_rates, trust
from polychirp.receiver.estimation.coherence_test import turns_back
from polychirp.receiver.estimation.phase_refinement import ONE_POINT, Readings, coherent_steps
from polychirp.receiver.signal_model.frame_model import Waves
from polychirp.receiver.signal_model.spectral_fit import BINS, NEAR, Band

WIDEST = (1.3, 12.0)
"""m/s and m/s², from the claim's own: where the two are looked for."""

LIKELY = 0.7
"""Share of a claim's power that two phase histories must explain, before they are refined."""

TWO_POINTS = 0.97
"""Share, without noise, that two points must explain in the end."""

FARTHEST = (0.3, 1.3)
"""m and m/s from the claim: what goes further is another claim's business."""

SEARCHES = 3
"""Of each history beside the other."""

ROUNDS = 6
"""Of measuring one after the other, at most."""

HOPELESS = 0.8
"""Share after a round, below which no more are made."""

SETTLED = 0.05
"""Of what is not explained: a round that gains less is the last."""

ALIKE = 0.9
"""Of two histories' correlation: above it phases do not tell them apart, and beats must."""

ALIASES_FROM = 0.5
"""m/s: nearer histories are neighbours."""

MOST_CLAIMS = 4
"""Groups of claims that are looked at, the least coherent, before a search goes on or ends."""

MOST_REFUSED = 8
"""Refused peaks that are looked at, the strongest."""

SPREAD = 1.0 / 12.0 - 0.5 / np.pi**2
"""Mean square time under Hann's window from its middle, in squares of its length."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pair:
    """Two points and the share of the power there, without noise, that they explain.

    Parameters
    ----------
    motion : R, v, a, ``(2, 3)``
    amplitude : as one wave each has it, ``(2, channel, ramp)``
    share : 0 … 1
    floor : of the map under the claim
    """

    motion: FloatArray
    amplitude: ComplexArray
    share: float
    floor: float


class Pairs:
    """The pairs of one frame.

    Attributes
    ----------
    found : in the order in which they were found
    refused : peaks that are no points, to be looked at: height, R, v, a and floor of each
    """

    def __init__(self, *, waves: Waves, band: Band) -> None:
        self.waves, self.band = waves, band
        self.found: list[Pair] = []
        self.refused: list[tuple[float, FloatArray, float]] = []
        self.middle = waves.times.first + 0.5 * (band.length - 1) / band.rate

    @cached_property
    def _histories(self) -> tuple[FloatArray, NDArray[np.complex64]]:
        return _histories(self.waves.schedule.centre_frequency, self.middle)

    @property
    def _tried(self) -> FloatArray:
        return self._histories[0]

    @property
    def _turns(self) -> NDArray[np.complex64]:
        return self._histories[1]

    def alone(
        self, residual: FloatArray, motion: FloatArray, amplitude: ComplexArray
    ) -> FloatArray:
        """Spectra with everything taken out but these points."""
        return self.band.without(residual, self.waves.phases(motion), -amplitude)

    def of_claim(
        self, spectra: FloatArray, *, motion: FloatArray, noise: FloatArray, floor: float
    ) -> Pair | None:
        """The two points that a claim is, or None where it is not two.

        Parameters
        ----------
        spectra : with all but this claim taken out, ``(part, ramp, channel, bin)``
        motion : its R, v, a, ``(3,)``
        noise : power per bin, ``(ramp,)``
        floor : of the map under it
        """
        value = self.band.match(spectra, self.waves.phases(motion[None]))
        both = two_histories((value * self.waves.turned_back(motion[None]))[0], self._turns)
        if both is None:
            return None
        for one, other in product(self._alike(both[0]), self._alike(both[1])):
            guess = self._corrected(motion, self._tried[[one, other]])
            value = self.band.match(spectra, self.waves.phases(guess))
            wave = [self._one_wave(*point) for point in zip(value, guess, strict=True)]
            start = Pair(motion=guess, amplitude=np.stack(wave), share=0.0, floor=floor)
            pair = self.fit(spectra, start, noise)
            apart = np.abs(pair.motion[:, :2] - motion[:2])
            if pair.share >= TWO_POINTS and np.all(apart <= FARTHEST):
                self.found.append(pair)
                self.refused.clear()  # where it stood; what is still there will be refused again
                return pair
        return None

    def _alike(self, history: int) -> list[int]:
        """Histories that phases do not tell from one, of ramps at even distances: itself first."""
        shared = np.abs(self._turns @ self._turns[history].conj()) / self.middle.size
        rate = self._tried[:, 0]
        shared[np.abs(rate - rate[history]) < ALIASES_FROM] = 0.0
        other = int(np.argmax(shared))
        return [history, other] if shared[other] > ALIKE else [history]

    def of_refused(self, residual: FloatArray, noise: FloatArray) -> Pair | None:
        """The first pair behind the strongest peaks that were refused; they are then forgotten.

        Where two points beat alike on some ramps only, beats mislead by up to a metre per second,
        and no history near is found: phases say where to look.
        """
        self.refused.sort(key=lambda peak: -peak[0])
        peaks, self.refused = self.refused[:MOST_REFUSED], []
        for _, peak, floor in peaks:
            value = self.band.match(residual, self.waves.phases(peak[None]))
            value = value * self.waves.turned_back(peak[None])
            best = np.argmax(_power(self._turns, _scaled(value[0])))
            motion = self._corrected(peak, self._tried[best, None])
            pair = self.of_claim(residual, motion=motion[0], noise=noise, floor=floor)
            if pair is not None:
                return pair
        return None

    def _corrected(self, motion: FloatArray, correction: FloatArray) -> FloatArray:
        """Motions with rates and accelerations ``(…, 2)`` about the frame's middle added."""
        offset = float(np.mean(self.middle)) - self.waves.time
        rate, acceleration = correction.T
        way = 0.5 * acceleration * offset**2 - rate * offset
        step = np.stack([way, rate - acceleration * offset, acceleration], axis=-1)
        return np.asarray(motion + step)

    def fit(self, spectra: FloatArray, start: Pair, noise: FloatArray) -> Pair:
        """Both points measured by turns, each with the other taken out, from ``start`` on.

        Parameters
        ----------
        spectra : with all but the two taken out, ``(part, ramp, channel, bin)``
        noise : power per bin, ``(ramp,)``
        """
        motion, amplitude, share = start.motion.copy(), start.amplitude.copy(), -np.inf
        for _ in range(ROUNDS):
            for i in (0, 1):
                other = self.waves.phases(motion[1 - i, None])
                alone = self.band.without(spectra, other, amplitude[1 - i, None])
                motion[i], amplitude[i] = self._measured(alone, motion[i], noise)
            left = self.band.without(spectra, self.waves.phases(motion), amplitude)
            before, share = share, self._share(spectra, left, motion, noise)
            if share < HOPELESS or share - before < SETTLED * (1.0 - share):
                break
        return replace(start, motion=motion, amplitude=amplitude, share=share)

    def _measured(
        self, spectra: FloatArray, motion: FloatArray, noise: FloatArray
    ) -> tuple[FloatArray, ComplexArray]:
        """A point's motion by its beats and phases, and its amplitude as of one wave."""
        waves, band = self.waves, self.band
        phases = waves.phases(motion[None])
        value, left = band.fit(spectra, phases, np.sqrt(noise))
        spread = SPREAD * (band.length / band.rate) ** 2
        readings = Readings(
            value=value,
            slope=2j * np.pi * spread * band.tilts(left, phases),
            count=band.noise_gain,
            spread=spread,
            middle=self.middle,
        )
        steps, _ = coherent_steps(
            readings.turned(waves.turned_back(motion[None])),
            waves.schedule,
            waves.times,
            motion=motion[None],
            time=waves.time,
            noise=float(np.median(noise)),
        )
        motion = motion + steps[0]
        value = band.match(spectra, waves.phases(motion[None]))
        return motion, self._one_wave(value[0], motion)

    def _one_wave(self, value: ComplexArray, motion: FloatArray) -> ComplexArray:
        """A point's amplitude on every channel and ramp, ``(channel, ramp)``, as of one wave.

        Its loudness changes linearly over the frame.
        """
        waves, schedule = self.waves, self.waves.schedule
        frequency = schedule.start_frequency + schedule.slope * (self.middle - schedule.start_time)
        elapsed = self.middle - waves.time
        straight = value * waves.turned_back(motion[None])[0]
        sine = sines_and_rates(
            (straight * np.sqrt(self.band.noise_gain))[None],
            motion=motion[None],
            along=waves.along,
            frequency=frequency,
            elapsed=elapsed,
        )[0]
        course = sine @ courses(motion[None], elapsed)[:, 0]
        cycles = frequency / SPEED_OF_LIGHT * course * waves.along[:, None]
        wave = np.exp(-2j * np.pi * cycles) * waves.response(motion[None])[0]
        size = np.sum(np.abs(wave) ** 2, axis=0) + 1e-300
        loudness = np.sum(wave.conj() * value, axis=0) / size
        return np.asarray(wave * _straight_line(loudness, elapsed, size * self.band.noise_gain))

    def _share(
        self, spectra: FloatArray, left: FloatArray, motion: FloatArray, noise: FloatArray
    ) -> float:
        """Power near the two that they explain over what is there, both without noise."""
        band = self.band
        beats = np.mean(self.waves.beats(motion[:, 0], motion[:, 1]), axis=0)
        place = np.rint(beats * band.size / band.rate).astype(np.int64) - band.first
        reach = round(NEAR * BINS)
        bins = np.clip(place[:, None] + np.arange(-reach, reach + 1), 0, band.num_bins - 1)
        ramp = np.arange(place.size)[:, None]
        every, rest = (
            np.sum(np.moveaxis(some, 2, -1)[:, ramp, bins] ** 2, axis=(0, 2, 3))
            for some in (spectra, left)
        )
        own = noise * spectra.shape[2] * bins.shape[1]
        weight = trust(rest[None])[0]
        return float(1.0 - np.sum(weight * (rest - own)) / np.sum(weight * (every - own)))


def two_histories(amplitude: ComplexArray, turns: NDArray[np.complex64]) -> list[int] | None:
    """Numbers of the two histories that a claim has, or None.

    None where one explains the claim, or two do not. Both have a phase and loudness of their own
    on every channel.

    Parameters
    ----------
    amplitude : relative to the claim's own motion, ``(channel, ramp)``
    turns : what takes the histories that are tried back, ``(history, ramp)``
    """
    ramps = turns.shape[1]
    scaled = _scaled(amplitude)
    power = _power(turns, scaled) / ramps
    first = second = int(np.argmax(power))
    if power[first] > ONE_POINT:
        return None
    explained = 0.0
    for _ in range(SEARCHES):
        history = turns[first]
        left = scaled - np.outer(scaled @ history, history.conj()) / ramps
        shared = np.abs(turns @ history.conj()) ** 2 / ramps**2
        gained = np.where(shared < 0.5, _power(turns, left) / (1.0 - np.minimum(shared, 0.5)), 0.0)
        first, second = int(np.argmax(gained)), first
        both = turns[[first, second]].conj().T
        found = np.linalg.lstsq(both, scaled.T, rcond=None)[0]
        explained = float(np.linalg.norm(both @ found) ** 2)
        if explained < LIKELY - 0.2:
            return None
    return [first, second] if explained >= LIKELY else None


def _scaled(amplitude: ComplexArray) -> NDArray[np.complex64]:
    return np.asarray(amplitude / np.linalg.norm(amplitude), dtype=np.complex64)


def _power(turns: NDArray[np.complex64], amplitude: NDArray[np.complex64]) -> NDArray[np.float32]:
    total = turns @ amplitude.T
    return np.asarray(np.sum(total.real**2 + total.imag**2, axis=1))


def _histories(
    frequency: FloatArray, elapsed: FloatArray
) -> tuple[FloatArray, NDArray[np.complex64]]:
    """The corrections that are tried, ``(correction, 2)``, and what takes them back, ``(…, ramp)``.

    A half of a cycle apart over the frame, or a sixth of one for accelerations.
    """
    span = float(np.ptp(elapsed)) or 1.0
    wavelength = SPEED_OF_LIGHT / float(np.mean(frequency))
    rate = _around_zero(WIDEST[0], wavelength / (4.0 * span))
    acceleration = _around_zero(WIDEST[1], wavelength / (1.5 * span**2))
    tried = np.stack(np.meshgrid(rate, acceleration, indexing="ij"), axis=-1).reshape(-1, 2)
    return tried, turns_back(rate, acceleration, frequency=frequency, elapsed=elapsed)


def _around_zero(widest: float, step: float) -> FloatArray:
    count = int(np.ceil(widest / step))
    return step * np.arange(-count, count + 1, dtype=np.float64)


def _straight_line(loudness: ComplexArray, elapsed: FloatArray, weight: FloatArray) -> ComplexArray:
    """Loudness on every ramp as of a line through it; ramps that stand out count less."""
    centred = elapsed - np.mean(elapsed)
    shape = np.stack([np.ones_like(centred), centred / (np.ptp(centred) or 1.0)], axis=-1)
    trusted = weight
    fitted = loudness
    for _ in range(3):
        root = np.sqrt(trusted)
        line = np.linalg.lstsq(shape * root[:, None], loudness * root, rcond=None)[0]
        fitted = shape @ line
        trusted = weight * trust((np.abs(loudness - fitted) ** 2 * weight)[None])[0]
    return np.asarray(fitted)
