"""The paper's receiver as its section VII describes it, for comparison."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.alternatives.triangular_pairing import range_and_rate, refuse_unpaired
from polychirp.receiver.angle.beamform import beamform, orthogonal_sines, steering
from polychirp.receiver.angle.doa import azimuths
from polychirp.receiver.clustering import merged
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.settings import ReceiverSettings, need_speed, range_axis
from polychirp.receiver.signal_model.equal_ramps import refuse_code, refuse_steps
from polychirp.receiver.signal_model.point_signal import hann_weights
from polychirp.receiver.signal_model.power_spectra import spectrum_size
from polychirp.units import MetresPerSecond

PADDING = 4
"""Length of the spectra over `spectrum_size`. Chosen: there are eight bins or more per resolution
cell, so that the nearest bin of a beat has its amplitude to 0.3 %."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperReceiver(ReceiverSettings):
    """Receiver that averages range profiles over sweeps, and pairs peaks above their mean (eq. 12).

    It reads triangles: an up- and a down-ramp of one slope in every sweep. The steps: a beam for
    every channel, spectra of all ramps, their magnitudes averaged over the up-ramps and over the
    down-ramps, peaks above the mean of the profile, pairs of an up- and a down-peak of similar
    strength, range and range rate by eqs 9 and 10, azimuth by root-MUSIC.

    The weaknesses of the paper's receiver are kept: profiles of different slopes are averaged
    without correction of speed, so that diverse slopes smear a moving target (errata 10); the
    threshold has no set false-alarm probability, and noise alone exceeds it in every frame
    (errata 4); peaks are paired by strength. Mitigation and grouping, which the other receivers
    have as well, are not of the paper; by default there are none.

    `AutoReceiver` never chooses it.

    Parameters
    ----------
    greatest_speed : m/s, greatest magnitude of the range rate of a pair of peaks
    """

    greatest_speed: MetresPerSecond = 32.0
    kind: Literal["paper"] = "paper"

    def __post_init__(self) -> None:
        super(PaperReceiver, self).__post_init__()
        need_speed(self.greatest_speed)

    def detect(self, frame: IfFrame) -> Detections:
        """Detections from pairs of peaks, strongest first; ranges at the first ramp's start.

        The averaged profile shows the range in the middle of the frame. The range at the start is
        computed from it by the range rate.

        Raises
        ------
        CapabilityError
            A sweep is not an up- and a down-ramp of one slope, or has a code.
        """
        refuse_code(frame.schedule, "the receiver 'paper' does not remove")
        refuse_steps(frame.schedule, self.kind)
        refuse_unpaired(frame.schedule)
        cleaned = mitigated(self.mitigation, frame)
        ranges = range_axis(self, frame.schedule)
        spectra = range_spectra(frame.with_samples(cleaned.samples), ranges, weight=cleaned.weight)
        rising = frame.schedule.slope > 0
        beams = beamform(spectra, self._beams(frame))
        profiles = [np.mean(np.abs(beams[:, which]), axis=1) for which in (rising, ~rising)]
        strongest = [profile.max(axis=0) for profile in profiles]
        up, down = (peaks_above(line, mean_threshold(line)) for line in strongest)
        pairs = self._pairs(frame, ranges, up, down, strongest)
        found = self._detections(frame, ranges, pairs, strongest, spectra[:, rising])
        return found if self.grouping is None else merged(found, self.grouping)

    def combined_power(self, amplitude: ComplexArray, schedule: RampSchedule) -> FloatArray:
        """Power, W, of amplitudes ``(…, ramp)``: magnitudes averaged over up- and over down-ramps.

        It is the mean of the squares of both averages, as the power of a pair of peaks.
        """
        rising = schedule.slope > 0
        up, down = (np.mean(np.abs(amplitude[..., which]), axis=-1) for which in (rising, ~rising))
        return np.asarray(0.5 * (up**2 + down**2))

    def _beams(self, frame: IfFrame) -> ComplexArray:
        return steering(
            frame.array,
            frequency=float(np.mean(frame.schedule.centre_frequency)),
            sine=orthogonal_sines(frame.array.num_channels),
        )

    def _pairs(
        self,
        frame: IfFrame,
        ranges: FloatArray,
        up: IntArray,
        down: IntArray,
        lines: list[FloatArray],
    ) -> list[tuple[int, int]]:
        """Pairs of up- and down-peaks of similar strength whose distance is a possible speed."""
        reach = self.greatest_speed * _coupling(frame)
        left, pairs = list(down), []
        for u in sorted(up, key=lambda n: -lines[0][n]):
            near = [d for d in left if abs(ranges[u] - ranges[d]) <= 2.0 * reach]
            if near:
                best = min(near, key=lambda d: abs(np.log(lines[1][d] / lines[0][u])))
                left.remove(best)
                pairs.append((int(u), int(best)))
        return pairs

    def _detections(
        self,
        frame: IfFrame,
        ranges: FloatArray,
        pairs: list[tuple[int, int]],
        lines: list[FloatArray],
        rising: ComplexArray,
    ) -> Detections:
        slope = float(np.mean(np.abs(frame.schedule.slope)))
        up, down = (np.array([pair[n] for pair in pairs], dtype=np.int64) for n in (0, 1))
        beat = 2.0 * slope / SPEED_OF_LIGHT
        distance, rate = range_and_rate(
            up_beat=beat * ranges[up],
            down_beat=beat * ranges[down],
            slope=slope,
            turning_frequency=float(frame.schedule.start_frequency[0]),
        )
        start = float(frame.schedule.start_time[0])
        middle = 0.5 * float(frame.schedule.end_time[-1] - start)
        snapshots = np.moveaxis(rising[:, :, up], 2, 0)  # (detection, channel, ramp)
        frequency = float(np.mean(frame.schedule.centre_frequency))
        azimuth = azimuths(
            snapshots,
            spacing=frame.array.spacing * frequency / SPEED_OF_LIGHT,
            estimator="root-music",
        )
        power = 0.5 * (lines[0][up] ** 2 + lines[1][down] ** 2) / frame.array.num_channels
        order = np.argsort(-power, kind="stable")
        threshold = mean_threshold(lines[0])
        return Detections(
            time=start,
            range=np.asarray(distance - rate * middle)[order],
            range_rate=np.asarray(rate)[order],
            azimuth=azimuth[order],
            power=power[order],
            snr=((lines[0][up] / threshold) ** 2)[order],
        )


def range_spectra(
    frame: IfFrame, ranges: FloatArray, *, weight: FloatArray | None = None
) -> ComplexArray:
    r"""Amplitude at the beats of ``ranges`` (m) on every ramp: V, ``(channel, ramp, range)``.

    .. math:: X_k(R) = \frac{1}{\sum w}\sum_n w_n y_{kn} e^{-j2\pi (2 b_k R/c) n/f_s}

    All slopes have one common range axis; amplitudes are those of the nearest bin of a transform
    zero-padded to eight bins per resolution cell or more. Speed is not corrected: the echo of a
    target that recedes at v appears :math:`v f/b_k` too far on an up-ramp, too near on a down-ramp.
    The window w is Hann's times ``weight`` ``(ramp, fast)``; None for all samples alike.
    """
    window = hann_weights(frame.times.is_sample if weight is None else weight)
    size = PADDING * spectrum_size(frame.times)
    total = np.maximum(np.sum(window, axis=1)[:, None], 1e-300)  # 0 on a ramp without a sample
    spectra = np.fft.fft(frame.samples * (window / total), size, axis=-1)
    beats = 2.0 * frame.schedule.slope[:, None] * ranges / SPEED_OF_LIGHT
    index = np.round(beats * size / frame.times.rate).astype(np.int64) % size
    return np.asarray(np.take_along_axis(spectra, index[None], axis=-1))


def mean_threshold(profile: FloatArray) -> float:
    r"""The paper's threshold (eq. 12): the mean of the profile.

    On noise alone a Rayleigh amplitude exceeds its mean with probability
    :math:`e^{-\pi/4} = 45.6\,\%`, an exponential power with :math:`1/e = 36.8\,\%`: more than
    a third of all noise cells exceed it. This threshold is for comparison only.
    """
    return float(np.mean(profile))


def peaks_above(line: FloatArray, threshold: float) -> IntArray:
    """Numbers of the local maxima of ``line`` above ``threshold``."""
    inner = line[1:-1]
    is_peak: BoolArray = (inner > line[:-2]) & (inner >= line[2:]) & (inner > threshold)
    return np.asarray(np.flatnonzero(is_peak) + 1)


def _coupling(frame: IfFrame) -> float:
    """Shift f/b of the apparent range per range rate, m per m/s, f and b being means over ramps."""
    slope = float(np.mean(np.abs(frame.schedule.slope)))
    return float(np.mean(frame.schedule.centre_frequency)) / slope
