r"""Two points in one cell of range and range rate, separated by their phases.

The beats of single ramps separate points that are a cell apart, 0.15 m or 1 to 2 m/s. The phases
over a frame of length T separate points from λ/2T on, 4 cm/s at T = 48 ms. A cell with two points
has one beat on every ramp, but two phase histories:

.. math:: a_{mk} = \sum_{i=1}^{2} A_i(t_k)\,H_{ik}\,
          e^{j4\pi f_k\,\delta R_i(t_k)/c - j2\pi f_k y_m s_i(t_k)/c}

Point i has on ramp k, at :math:`t_k` and frequency :math:`f_k`, the amplitude :math:`A_i`, the high
pass's response H, the range :math:`\delta R_i` relative to the cell's motion, and the sine of the
azimuth :math:`s_i`; channel m is at :math:`y_m`. If one history explains too little of the power,
`two_histories` searches for two. Then each point is measured with the other subtracted, in turn
(RELAX, Li and Stoica 1996), like an isolated point, but its amplitude is a line in time. The two
replace the point if they explain at least `LEAST_PAIR_SHARE` of its power.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.estimation.azimuth_rate import ramp_weights, sine_basis, sines_and_rates
from polychirp.receiver.estimation.coherence_test import correction_phasors
from polychirp.receiver.estimation.phase_refinement import ONE_POINT_SHARE, Readings, coherent_steps
from polychirp.receiver.signal_model.frame_model import FrameModel
from polychirp.receiver.signal_model.spectral_fit import BINS_PER_CELL, FIT_REACH, Band

WIDEST_RATE = 1.3
"""Largest difference of a history's range rate from the cell's, m/s. Chosen to cover a cell."""

WIDEST_ACCELERATION = 12.0
"""Largest difference of a history's acceleration from the cell's, m/s². Chosen: above braking's."""

LEAST_SHARE_TO_REFINE = 0.7
"""Share of a point's power that two phase histories must explain before they are refined. Chosen:
with a lower share, more pairs are fitted that then fail `LEAST_PAIR_SHARE`."""

LEAST_PAIR_SHARE = 0.97
"""Share of the power less noise that two refined points must explain to be accepted. Chosen."""

LARGEST_OFFSETS = (0.3, 1.3)
"""Largest differences in range, m, and range rate, m/s, of both points from the one that they
replace. Chosen: an echo farther away belongs to another cell."""

SEARCHES_PER_HISTORY = 3
"""Number of searches for one history with the other removed, alternately. Chosen."""

MOST_ROUNDS = 6
"""Largest number of rounds; a round measures both points once. Chosen to limit the time."""

LEAST_SHARE_TO_GO_ON = 0.8
"""Share of the power explained after a round, below which no further round follows. Chosen."""

LEAST_RELATIVE_GAIN = 0.05
"""Least increase of the share in a round, relative to the rest 1 − share, to go on. Chosen."""

LEAST_ALIAS_CORRELATION = 0.9
"""Correlation of two histories from which on their phases do not separate them. Chosen."""

LEAST_ALIAS_DISTANCE = 0.5
"""Difference of rates, m/s, below which similar histories are neighbours, not aliases. Chosen."""

PAIR_BY_NOISE = 1e-4
"""Probability that noise makes two points of one that is tried as a pair. Chosen: far below one
per frame."""

ROUNDS_OF_ONE_POINT = 3
"""Number of times that the single point is measured with which a pair is compared. Chosen: the
phases converge in two."""

HANN_BINS_PER_POWER = 1.5 * BINS_PER_CELL
"""Power in all bins of a tone's spectrum under Hann's window, as a ratio to its peak's."""

MOST_GROUPS = 4
"""Most groups of points tried as pairs, least coherent first. Chosen to limit the time."""

MOST_REFUSED_PEAKS = 8
"""Most refused peaks tried as pairs, highest first. Chosen to limit the time."""

HANN_MEAN_SQUARE_TIME = 1.0 / 12.0 - 0.5 / np.pi**2
"""Mean square time from the middle, weighted by Hann's window, over the window's length squared."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pair:
    """Two points in one cell.

    Parameters
    ----------
    motion : R, v, a in m, m/s, m/s², ``(2, 3)``
    amplitude : of each point, as of one wave from one direction, ``(2, channel, ramp)``
    share : share of the power near their beats, less noise, that the two explain
    floor : local floor of the residual map at their cell
    """

    motion: FloatArray
    amplitude: ComplexArray
    share: float
    floor: float


class RefusedPeak(NamedTuple):
    """A peak that is not coherent enough for one point: height over the floor, R, v, a, floor."""

    height: float
    motion: FloatArray
    floor: float


class Histories(NamedTuple):
    """Rates and accelerations ``(history, 2)``; phasors ``(history, ramp)`` that remove them."""

    correction: FloatArray
    phasors: NDArray[np.complex64]


class Pairs:
    """The pairs of one frame.

    Attributes
    ----------
    found : accepted pairs, in the order of acceptance
    refused : peaks that are not single points and may be pairs
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
        """Store a peak that is not a single point, for `of_refused`."""
        self.refused.append(RefusedPeak(height, motion, floor))

    def isolated(
        self, residual: FloatArray, motion: FloatArray, amplitude: ComplexArray
    ) -> FloatArray:
        """Spectra in which only these points remain: they are added to the residual."""
        return self.band.subtract(residual, self.model.phases(motion), -amplitude)

    def of_point(
        self, spectra: FloatArray, *, motion: FloatArray, noise: FloatArray, floor: float
    ) -> Pair | None:
        """The two points that were fitted as one, or None if there are no two.

        Parameters
        ----------
        spectra : with all but this point subtracted, ``(part, ramp, channel, bin)``
        motion : R, v, a of the point, ``(3,)``
        noise : power per bin, ``(ramp,)``
        floor : local floor of the residual map at the point
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
            if (
                pair.share >= LEAST_PAIR_SHARE
                and np.all(apart <= LARGEST_OFFSETS)
                and self._is_better_than_one(spectra, pair, noise)
            ):
                self.found.append(pair)
                self.refused.clear()  # peaks that remain without the pair will be refused again
                return pair
        return None

    def _is_better_than_one(self, spectra: FloatArray, pair: Pair, noise: FloatArray) -> bool:
        r"""True if a pair explains more than its stronger point alone would with noise.

        The stronger point is measured again without the other. What the pair explains beyond it, in
        units of the noise of one amplitude, is on noise alone the power of four more complex
        parameters, the greatest over all H histories: it exceeds :math:`\tau` with the probability
        :math:`H\,Q(4, \tau)` at most, which is `PAIR_BY_NOISE`.
        """
        stronger = int(np.argmax(np.sum(np.abs(pair.amplitude) ** 2, axis=(1, 2))))
        one, wave = pair.motion[stronger], pair.amplitude[stronger]
        for _ in range(ROUNDS_OF_ONE_POINT):
            one, wave = self._measured(spectra, one, noise)
        alone = self.band.subtract(spectra, self.model.phases(one[None]), wave[None])
        left = self.band.subtract(spectra, self.model.phases(pair.motion), pair.amplitude)
        bins = self._bins_near(pair.motion)
        gain = np.sum((_powers(alone, bins) - _powers(left, bins)) / noise)
        return bool(gain > HANN_BINS_PER_POWER * self._least_gain)

    @cached_property
    def _least_gain(self) -> float:
        """Least gain of a pair over one point, in units of the noise of one amplitude."""
        from scipy.special import gammainccinv

        return float(gammainccinv(4.0, PAIR_BY_NOISE / len(self._histories.correction)))

    def _bins_near(self, motion: FloatArray) -> IntArray:
        """Bins within `FIT_REACH` of the points' mean beat on each ramp, ``(ramp, bin)``."""
        band = self.band
        beats = np.mean(self.model.beats(motion[:, 0], motion[:, 1]), axis=0)
        place = np.rint(beats * band.size / band.rate).astype(np.int64) - band.first
        reach = round(FIT_REACH * BINS_PER_CELL)
        bins = np.clip(place[:, None] + np.arange(-reach, reach + 1), 0, band.num_bins - 1)
        return np.asarray(bins)

    def _aliases(self, history: int) -> list[int]:
        """The history, and its alias at another rate if regular ramp intervals cause one."""
        phasors = self._histories.phasors
        shared = np.abs(phasors @ phasors[history].conj()) / self.middle.size
        rate = self._histories.correction[:, 0]
        shared[np.abs(rate - rate[history]) < LEAST_ALIAS_DISTANCE] = 0.0
        other = int(np.argmax(shared))
        return [history, other] if shared[other] > LEAST_ALIAS_CORRELATION else [history]

    def of_refused(self, residual: FloatArray, noise: FloatArray) -> Pair | None:
        """The first accepted pair at the highest refused peaks, or None; the others are dropped.

        Two points may have the same beat on some ramps only. The rate from their beats is then
        wrong by up to 1 m/s; the search starts from the single history with the most power.
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
        """The motion plus rates and accelerations ``(…, 2)`` that hold at the frame's middle."""
        offset = float(np.mean(self.middle)) - self.model.time
        rate, acceleration = correction.T
        way = 0.5 * acceleration * offset**2 - rate * offset
        step = np.stack([way, rate - acceleration * offset, acceleration], axis=-1)
        return np.asarray(motion + step)

    def fit(self, spectra: FloatArray, start: Pair, noise: FloatArray) -> Pair:
        """The pair after rounds from ``start`` on that measure each point without the other.

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
        """Amplitude ``(channel, ramp)`` of a wave from one direction, as a line in time."""
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
        """Share of the power within `FIT_REACH` of the beats, less noise, that both explain."""
        bins = self._bins_near(motion)
        every, rest = _powers(spectra, bins), _powers(left, bins)
        own = noise * spectra.shape[2] * bins.shape[1]
        weight = ramp_weights(rest[None])[0]
        return float(1.0 - np.sum(weight * (rest - own)) / np.sum(weight * (every - own)))


def _powers(spectra: FloatArray, bins: IntArray) -> FloatArray:
    """Power in ``bins`` of each ramp, summed over channels: ``(ramp,)``."""
    ramp = np.arange(len(bins))[:, None]
    return np.asarray(np.sum(np.moveaxis(spectra, 2, -1)[:, ramp, bins] ** 2, axis=(0, 2, 3)))


def two_histories(amplitude: ComplexArray, phasors: NDArray[np.complex64]) -> list[int] | None:
    """Numbers of the two histories that a point has, or None.

    None means that one history explains `ONE_POINT_SHARE` of the power, or that two explain less
    than `LEAST_SHARE_TO_REFINE`. Both histories have a separate amplitude on every channel.

    Parameters
    ----------
    amplitude : relative to the point's own motion, ``(channel, ramp)``
    phasors : factors that remove each history's phase, ``(history, ramp)``
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
    """Histories in steps of 1/2 cycle over the frame (rate), 1/6 cycle over half (acceleration)."""
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
    """Values ``(ramp,)`` of a line in time fitted to the amplitudes, with `ramp_weights`."""
    centred = elapsed - np.mean(elapsed)
    shape = np.stack([np.ones_like(centred), centred / (np.ptp(centred) or 1.0)], axis=-1)
    robust, fitted = weight, amplitude
    for _ in range(3):
        root = np.sqrt(robust)
        line = np.linalg.lstsq(shape * root[:, None], amplitude * root, rcond=None)[0]
        fitted = shape @ line
        robust = weight * ramp_weights((np.abs(amplitude - fitted) ** 2 * weight)[None])[0]
    return np.asarray(fitted)
