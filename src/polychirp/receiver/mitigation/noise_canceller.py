"""Adaptive noise canceller: frequencies without echoes predict the interference in the others."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.errors import CapabilityError, InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import Mitigated, refuse_frame
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.units import Between, Ratio, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseCanceller(BurstRepair):
    r"""Subtract from the frequencies of echoes what the opposite frequencies predict of them.

    With :math:`y = s_{tx}\,\overline{s_{rx}}` echoes have beats of one sign, that of the slope.
    The spectrum P of these frequencies is the primary input, and the conjugate Q of the opposite
    ones the reference of a normalised least-mean-squares filter along frequency,

    .. math:: E_f = P_f - w_f^T q_f, \qquad
              w_{f+1} = w_f + \mu \frac{E_f\,\overline{q_f}}{|q_f|^2 + \epsilon}, \qquad
              q_f = (Q_f, Q_{f-1}, \dots, Q_{f-L+1})

    (Jin and Cao 2019); the filtered E replaces P. It assumes that interference at f and at −f are
    conjugates: so it is for a burst that is much shorter than the reciprocal of the band, an
    impulse, and for no other, since a chirp has a phase that is even in f.

    It refuses what breaks the assumption. Of real samples both halves are one and the same signal,
    echoes included, so that the reference would remove the echoes too. A ramp on which the filter
    does not lower the median power of P by ``least_gain`` is left as it is; so is a ramp without
    bursts. Filters, once chosen, are kept for the parts of the frame; as Q is a conjugate, `repair`
    is additive, and linear for real factors alone. It takes 8 log₂ N + 8 L real multiplications per
    sample and channel. `Blanking` assumes nothing of the kind.

    Parameters
    ----------
    taps : L, length of the filter, frequencies
    step : μ, 0 … 2
    least_gain : power ratio; 0 dB or less to repair all ramps with bursts, whatever comes of it
    """

    kind: Literal["noise-canceller"] = "noise-canceller"
    taps: Annotated[int, Between(greatest=1024)] = 8
    step: float = 0.05
    least_gain: Ratio = from_db(3.0)

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.taps < 1 or not 0.0 < self.step < 2.0:
            raise InputError("a noise canceller needs 1 tap or more, and a step between 0 and 2")

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse samples that it cannot repair.

        Raises
        ------
        CapabilityError
            The samples are real.
        """
        del schedule, times, num_channels
        if is_real:
            raise CapabilityError(
                "the mitigation 'noise-canceller' needs complex samples: of real ones the "
                "frequencies without echoes are a copy of those with echoes, so that it would "
                "remove the echoes; set converter.sampling to 'complex', or use 'blanking'"
            )

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without what the frequencies without echoes predict."""
        from scipy import fft

        refuse_frame(self, frame)
        hit, present = self.hit(frame), frame.times.is_sample
        filters: list[tuple[int, int, float, ComplexArray]] = []
        for k in np.flatnonzero(hit.any(axis=1)):
            length, sign = int(frame.times.num_samples[k]), np.sign(frame.schedule.slope[k])
            spectrum = fft.fft(frame.samples[:, k, :length], axis=-1)
            primary, reference = _halves(spectrum, sign, self.taps)
            error, weights = self._adapted(primary, reference)
            before, after = (np.median(np.abs(part) ** 2) for part in (primary, error))
            if after * self.least_gain <= before or self.least_gain <= 1.0:
                filters.append((int(k), length, float(sign), weights))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, length, sign, weights in filters:
                spectrum = fft.fft(out[..., k, :length], axis=-1)
                primary, reference = _halves(spectrum, sign, self.taps)
                error = primary - np.einsum("cfl,...cfl->...cf", weights, reference)
                spectrum[..., _echo_bins(length, sign)] = error
                out[..., k, :length] = fft.ifft(spectrum, axis=-1)
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def _adapted(
        self, primary: ComplexArray, reference: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Errors ``(channel, frequency)`` and filters ``(channel, frequency, tap)``."""
        weights = np.zeros_like(reference)
        error = np.zeros_like(primary)
        now = np.zeros_like(reference[:, 0])
        floor = 1e-12 * float(np.mean(np.abs(reference) ** 2)) * self.taps + 1e-300
        for f in range(primary.shape[1]):
            weights[:, f] = now
            error[:, f] = primary[:, f] - np.sum(now * reference[:, f], axis=1)
            power = np.sum(np.abs(reference[:, f]) ** 2, axis=1) + floor
            now = now + self.step * (error[:, f] / power)[:, None] * reference[:, f].conj()
        return error, weights


def _echo_bins(length: int, sign: float) -> slice:
    """Bins of the beats of echoes; the opposite ones follow from `_halves`."""
    half = (length - 1) // 2
    return slice(1, half + 1) if sign > 0 else slice(length - 1, length - 1 - half, -1)


def _halves(spectrum: ComplexArray, sign: float, taps: int) -> tuple[ComplexArray, ComplexArray]:
    """Primary ``(…, frequency)`` and reference ``(…, frequency, tap)``."""
    length = spectrum.shape[-1]
    primary = spectrum[..., _echo_bins(length, sign)]
    opposite = spectrum[..., _echo_bins(length, -sign)].conj()
    padded = np.pad(opposite, [(0, 0)] * (opposite.ndim - 1) + [(taps - 1, 0)])
    windows = np.lib.stride_tricks.sliding_window_view(padded, taps, axis=-1)
    return primary, windows[..., ::-1]
