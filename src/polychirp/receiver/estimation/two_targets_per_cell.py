r"""Two points in one cell of range and range rate, separated by their phases.

Beats separate points that are a cell of one ramp apart, 0.15 m or 1 to 2 m/s; phases over a frame
do so from λ/2T = 4 cm/s on. A cell with two points has one beat on every ramp, but two phase
histories:

.. math:: a_{mk} = \sum_{i=1}^{2} A_i(t_k)\,H_{ik}\,
          e^{j4\pi f_k\,\delta R_i(t_k)/c - j2\pi f_k y_m s_i(t_k)/c}

Where one history does not explain the power, `two_histories` searches for two. Then each point is
measured with the other subtracted, in turn (RELAX, Li and Stoica 1996), like an isolated point but
with one amplitude for the whole frame. The two replace the point if they explain its power.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.estimation.azimuth_rate import ramp_weights, sine_basis, sines_and_rates
from polychirp.receiver.estimation.coherence_test import correction_phasors
from polychirp.receiver.estimation.phase_refinement import ONE_POINT_SHARE, Readings, coherent_steps
from polychirp.receiver.signal_model.frame_model import FrameModel
from polychirp.receiver.signal_model.spectral_fit import BINS_PER_CELL, FIT_REACH, Band

WIDEST_RATE = 1.3
"""Range rate to either side of the point's own in which the two are searched, m/s. Chosen."""

WIDEST_ACCELERATION = 12.0
"""The same for the acceleration, m/s². Chosen."""

LEAST_SHARE_TO_REFINE = 0.7
"""Share of a point's power that two phase histories must explain before they are refined. Chosen:
a lower one costs fits of pairs that fail `LEAST_PAIR_SHARE`."""

LEAST_PAIR_SHARE = 0.97
"""Share of the power, without noise, that the two refined points must explain. Chosen."""

LARGEST_OFFSETS = (0.3, 1.3)
"""Range, m, and range rate, m/s, from the point within which both must stay: what lies farther
away belongs to another point. Chosen."""

SEARCHES_PER_HISTORY = 3
"""Number of searches of each history beside the other. Chosen."""

MOST_ROUNDS = 6
"""Greatest number of rounds in which the two are measured in turn. Chosen."""

LEAST_SHARE_TO_GO_ON = 0.8
"""Share of the power explained after a round, below which the pair is given up. Chosen."""

LEAST_RELATIVE_GAIN = 0.05
"""Gain of a round, as a share of the power not yet explained; a smaller one ends the rounds."""

LEAST_ALIAS_CORRELATION = 0.9
"""Correlation of two histories above which only beats, and not phases, separate them."""

LEAST_ALIAS_DISTANCE = 0.5
"""Difference of rates, m/s, below which two histories are neighbours and no aliases."""

MOST_GROUPS = 4
"""Number of groups of points that are tried as pairs, least coherent first. Chosen: time."""

MOST_REFUSED_PEAKS = 8
"""Number of refused peaks that are tried as pairs, highest first. Chosen: time."""

HANN_MEAN_SQUARE_TIME = 1.0 / 12.0 - 0.5 / np.pi**2
"""Mean square time under Hann's window from its middle, in squares of its length."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pair:
    """Two points in one cell.

    Parameters
    ----------
    motion : R, v, a, ``(2, 3)``
    amplitude : each that of a single wave, ``(2, channel, ramp)``
    share : of the power there, without noise, that the two explain, 0 … 1
    floor : of the map at that cell
    """

    motion: FloatArray
    amplitude: ComplexArray
    share: float
    floor: float


class RefusedPeak(NamedTuple):
    """A peak that is no single point: its height above the floor, R, v, a, and that floor."""

    height: float
    motion: FloatArray
    floor: float


class Histories(NamedTuple):
    """Corrections of rate and acceleration ``(history, 2)``, and phasors that apply them."""

    correction: FloatArray
    phasors: NDArray[np.complex64]


class Pairs:
    """The pairs of one frame.

    Attributes
    ----------
    found : in the order in which they were found
    refused : peaks that are no single points, and may be pairs
    """

    def __init__(self, *, model: FrameModel, band: Band) -> None:
        self.model, self.band = model, band
        self.found: list[Pair] = []
        self.refused: list[RefusedPeak] = []
        self.middle = model.times.first + 0.5 * (band.length - 1) / band.rate

    @cached_property
    def _histories(self) -> Histories:
        return _histories(self.model.schedule.centre_frequency, self.middle)

    def refuse(self, height: float, motion: FloatArray, floor: float) -> None:
        """Note a peak that is no single point."""
        self.refused.append(RefusedPeak(height, motion, floor))

    def isolated(
        self, residual: FloatArray, motion: FloatArray, amplitude: ComplexArray
    ) -> FloatArray:
        """Spectra with everything subtracted but these points."""
        return self.band.subtract(residual, self.model.phases(motion), -amplitude)

    def of_point(
        self, spectra: FloatArray, *, motion: FloatArray, noise: FloatArray, floor: float
    ) -> Pair | None:
        """The two points that were fitted as one, or None if there are no two.

        Parameters
        ----------
        spectra : with all but this point subtracted, ``(part, ramp, channel, bin)``
        motion : its R, v, a, ``(3,)``
        noise : power per bin, ``(ramp,)``
        floor : of the map at the point
        """
        value = self.band.match(spectra, self.model.phases(motion[None]))
        straight = (value * self.model.high_pass_correction(motion[None]))[0]
        both = two_histories(straight, self._histories.phasors)
        if both is None:
            return None
        for one, other in product(self._aliases(both[0]), self._aliases(both[1])):
            guess = self._corrected(motion, self._histories.correction[[one, other]])
            value = self.band.match(spectra, self.model.phases(guess))
            wave = [self._one_wave(*point) for point in zip(value, guess, strict=True)]
            start = Pair(motion=guess, amplitude=np.stack(wave), share=0.0, floor=floor)
            pair = self.fit(spectra, start, noise)
            apart = np.abs(pair.motion[:, :2] - motion[:2])
            if pair.share >= LEAST_PAIR_SHARE and np.all(apart <= LARGEST_OFFSETS):
                self.found.append(pair)
                self.refused.clear()  # peaks that remain without the pair will be refused again
                return pair
        return None

    def _aliases(self, history: int) -> list[int]:
        """The history itself, and its alias where even ramp intervals give it one."""
        phasors = self._histories.phasors
        shared = np.abs(phasors @ phasors[history].conj()) / self.middle.size
        rate = self._histories.correction[:, 0]
        shared[np.abs(rate - rate[history]) < LEAST_ALIAS_DISTANCE] = 0.0
        other = int(np.argmax(shared))
        return [history, other] if shared[other] > LEAST_ALIAS_CORRELATION else [history]

    def of_refused(self, residual: FloatArray, noise: FloatArray) -> Pair | None:
        """The first pair at the highest refused peaks, or None; the list of them is then empty.

        Two points may have the same beat on some ramps only. The rate from their beats is then
        wrong by up to 1 m/s, and the search starts at the rate that most phases agree with.
        """
        self.refused.sort(key=lambda peak: -peak.height)
        peaks, self.refused = self.refused[:MOST_REFUSED_PEAKS], []
        for peak in peaks:
            value = self.band.match(residual, self.model.phases(peak.motion[None]))
            value = value * self.model.high_pass_correction(peak.motion[None])
            best = np.argmax(_power(self._histories.phasors, _scaled(value[0])))
            motion = self._corrected(peak.motion, self._histories.correction[best, None])
            pair = self.of_point(residual, motion=motion[0], noise=noise, floor=peak.floor)
            if pair is not None:
                return pair
        return None

    def _corrected(self, motion: FloatArray, correction: FloatArray) -> FloatArray:
        """The motion with rates and accelerations ``(…, 2)`` at the frame's middle added."""
        offset = float(np.mean(self.middle)) - self.model.time
        rate, acceleration = correction.T
        way = 0.5 * acceleration * offset**2 - rate * offset
        step = np.stack([way, rate - acceleration * offset, acceleration], axis=-1)
        return np.asarray(motion + step)

    def fit(self, spectra: FloatArray, start: Pair, noise: FloatArray) -> Pair:
        """Both points measured in turn, each with the other subtracted, from ``start`` on.

        Parameters
        ----------
        spectra : with all but the two subtracted, ``(part, ramp, channel, bin)``
        noise : power per bin, ``(ramp,)``
        """
        motion, amplitude, share = start.motion.copy(), start.amplitude.copy(), -np.inf
        for _ in range(MOST_ROUNDS):
            for i in (0, 1):
                other = self.model.phases(motion[1 - i, None])
                alone = self.band.subtract(spectra, other, amplitude[1 - i, None])
                motion[i], amplitude[i] = self._measured(alone, motion[i], noise)
            left = self.band.subtract(spectra, self.model.phases(motion), amplitude)
            before, share = share, self._share(spectra, left, motion, noise)
            if share < LEAST_SHARE_TO_GO_ON or share - before < LEAST_RELATIVE_GAIN * (1.0 - share):
                break
        return replace(start, motion=motion, amplitude=amplitude, share=share)

    def _measured(
        self, spectra: FloatArray, motion: FloatArray, noise: FloatArray
    ) -> tuple[FloatArray, ComplexArray]:
        """A point's motion by its beats and phases, and its amplitude as that of one wave."""
        model, band = self.model, self.band
        phases = model.phases(motion[None])
        value, left = band.fit(spectra, phases, np.sqrt(noise))
        spread = HANN_MEAN_SQUARE_TIME * (band.length / band.rate) ** 2
        readings = Readings(
            value=value,
            slope=2j * np.pi * spread * band.tilts(left, phases),
            count=band.noise_gain,
            spread=spread,
            middle=self.middle,
        )
        noise_power = float(np.median(noise))
        steps, _ = coherent_steps(readings, model, motion=motion[None], noise=noise_power)
        motion = motion + steps[0]
        value = band.match(spectra, model.phases(motion[None]))
        return motion, self._one_wave(value[0], motion)

    def _one_wave(self, value: ComplexArray, motion: FloatArray) -> ComplexArray:
        """Amplitude ``(channel, ramp)`` of a single wave whose amplitude is linear in time."""
        model, schedule = self.model, self.model.schedule
        frequency = schedule.start_frequency + schedule.slope * (self.middle - schedule.start_time)
        elapsed = self.middle - model.time
        straight = value * model.high_pass_correction(motion[None])[0]
        sine = sines_and_rates(
            (straight * np.sqrt(self.band.noise_gain))[None],
            motion=motion[None],
            channel_y=model.channel_y,
            frequency=frequency,
            elapsed=elapsed,
        )[0]
        sines = sine @ sine_basis(motion[None], elapsed)[:, 0]
        cycles = frequency / SPEED_OF_LIGHT * sines * model.channel_y[:, None]
        wave = np.exp(-2j * np.pi * cycles) * model.response(motion[None])[0]
        size = np.sum(np.abs(wave) ** 2, axis=0) + 1e-300
        amplitude = np.sum(wave.conj() * value, axis=0) / size
        return np.asarray(wave * _straight_line(amplitude, elapsed, size * self.band.noise_gain))

    def _share(
        self, spectra: FloatArray, left: FloatArray, motion: FloatArray, noise: FloatArray
    ) -> float:
        """Share of the power near the two that they explain, without noise."""
        band = self.band
        beats = np.mean(self.model.beats(motion[:, 0], motion[:, 1]), axis=0)
        place = np.rint(beats * band.size / band.rate).astype(np.int64) - band.first
        reach = round(FIT_REACH * BINS_PER_CELL)
        bins = np.clip(place[:, None] + np.arange(-reach, reach + 1), 0, band.num_bins - 1)
        ramp = np.arange(place.size)[:, None]
        every, rest = (
            np.sum(np.moveaxis(some, 2, -1)[:, ramp, bins] ** 2, axis=(0, 2, 3))
            for some in (spectra, left)
        )
        own = noise * spectra.shape[2] * bins.shape[1]
        weight = ramp_weights(rest[None])[0]
        return float(1.0 - np.sum(weight * (rest - own)) / np.sum(weight * (every - own)))


def two_histories(amplitude: ComplexArray, phasors: NDArray[np.complex64]) -> list[int] | None:
    """Numbers of the two histories that a point has, or None.

    None where one history explains the point, or two do not. On every channel both have an
    amplitude of their own.

    Parameters
    ----------
    amplitude : relative to the point's own motion, ``(channel, ramp)``
    phasors : compensation of each history, ``(history, ramp)``
    """
    ramps = phasors.shape[1]
    scaled = _scaled(amplitude)
    power = _power(phasors, scaled) / ramps
    first = second = int(np.argmax(power))
    if power[first] > ONE_POINT_SHARE:
        return None
    explained = 0.0
    for _ in range(SEARCHES_PER_HISTORY):
        history = phasors[first]
        left = scaled - np.outer(scaled @ history, history.conj()) / ramps
        shared = np.abs(phasors @ history.conj()) ** 2 / ramps**2
        gained = np.where(
            shared < 0.5, _power(phasors, left) / (1.0 - np.minimum(shared, 0.5)), 0.0
        )
        first, second = int(np.argmax(gained)), first
        both = phasors[[first, second]].conj().T
        found = np.linalg.lstsq(both, scaled.T, rcond=None)[0]
        explained = float(np.linalg.norm(both @ found) ** 2)
        if explained < LEAST_SHARE_TO_REFINE - 0.2:
            return None
    return [first, second] if explained >= LEAST_SHARE_TO_REFINE else None


def _scaled(amplitude: ComplexArray) -> NDArray[np.complex64]:
    return np.asarray(amplitude / np.linalg.norm(amplitude), dtype=np.complex64)


def _power(phasors: NDArray[np.complex64], amplitude: NDArray[np.complex64]) -> NDArray[np.float32]:
    total = phasors @ amplitude.T
    return np.asarray(np.sum(total.real**2 + total.imag**2, axis=1))


def _histories(frequency: FloatArray, elapsed: FloatArray) -> Histories:
    """Histories half a cycle apart over the frame, or a sixth of one for accelerations."""
    span = float(np.ptp(elapsed)) or 1.0
    wavelength = SPEED_OF_LIGHT / float(np.mean(frequency))
    rate = _around_zero(WIDEST_RATE, wavelength / (4.0 * span))
    acceleration = _around_zero(WIDEST_ACCELERATION, wavelength / (1.5 * span**2))
    tried = np.stack(np.meshgrid(rate, acceleration, indexing="ij"), axis=-1).reshape(-1, 2)
    phasors = correction_phasors(rate, acceleration, frequency=frequency, elapsed=elapsed)
    return Histories(tried, phasors)


def _around_zero(widest: float, step: float) -> FloatArray:
    count = int(np.ceil(widest / step))
    return step * np.arange(-count, count + 1, dtype=np.float64)


def _straight_line(
    amplitude: ComplexArray, elapsed: FloatArray, weight: FloatArray
) -> ComplexArray:
    """Line in time through the amplitudes ``(ramp,)``; ramps far from it count less."""
    centred = elapsed - np.mean(elapsed)
    shape = np.stack([np.ones_like(centred), centred / (np.ptp(centred) or 1.0)], axis=-1)
    robust, fitted = weight, amplitude
    for _ in range(3):
        root = np.sqrt(robust)
        line = np.linalg.lstsq(shape * root[:, None], amplitude * root, rcond=None)[0]
        fitted = shape @ line
        robust = weight * ramp_weights((np.abs(amplitude - fitted) ** 2 * weight)[None])[0]
    return np.asarray(fitted)
