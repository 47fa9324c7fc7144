r"""An analog high-pass, applied to samples ramp by ramp.

The poles are those of the analog filter. The zeros are fitted so that the response is the analog
one in the IF filter's pass band, and above it as far as no signal is aliased:

.. math:: \frac{\sum_d w_d z^{-d}}{\prod_i \left(1 - e^{-2\pi f_i/f_s} z^{-1}\right)}
          \approx \prod_i \frac{jf}{f_i + jf}, \qquad z = e^{j2\pi f/f_s}.

(With a corner at a tenth of the sample rate, the bilinear transform is off by 3 % and 5°.) The fit
uses a few later samples; they and all samples since the ramp's start are synthesised besides those
that the converter keeps. The gain of an aliased signal is right to about a fifth only, because two
frequencies of the analog filter share one gain there.
"""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.front_end import HighPass
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import SampleTimes
from polychirp.model.radar import Radar
from polychirp.model.scene import Scene

RESPONSE_TOLERANCE: Final = 5e-3
"""Greatest error, in the fitted band (`_band`), of the response times that of the IF filter: what
the filter has taken away needs no high-pass. Chosen: usual fits reach 1e-3."""

_SAMPLES_AHEAD: Final = 8
_SAMPLES_BEHIND: Final = 16
"""Greatest numbers of samples after and before the output's own that the fit uses; chosen."""


def with_lead(scene: Scene, victim: int) -> Scene:
    """The scene in which the victim also takes the samples that its high-pass needs.

    They cover each ramp from its start, where the filter is at rest, to a little beyond the last
    sample. Without a high-pass the scene is unchanged.
    """
    radar = scene.radars[victim]
    if radar.front_end.high_pass is None:
        return scene
    before, after = _lead(radar)
    step = 1.0 / radar.converter.sample_rate
    wide = replace(
        radar.converter,
        start=max(0.0, radar.converter.start - before * step),
        margin=max(0.0, radar.converter.margin - after * step),
    )
    radars = list(scene.radars)
    radars[victim] = replace(radar, converter=wide)
    return replace(scene, radars=tuple(radars))


def high_passed(radar: Radar, samples: ComplexArray, times: SampleTimes) -> ComplexArray:
    """Samples ``(…, ramp, fast)`` after the high-pass, at ``times``, from those of `with_lead`.

    `InputError` is raised if the converter is too slow, or stops too close to the ramp's end, for
    an accurate fit.
    """
    if radar.front_end.high_pass is None:
        return samples
    from scipy.signal import lfilter

    before, after = _lead(radar)
    zeros, poles = _coefficients_of(radar, radar.front_end.high_pass)
    out = np.zeros((*samples.shape[:-1], times.most_samples), dtype=np.complex128)
    weight = np.ones(samples.shape[-1])
    if before:
        # the first sample stands for the time from the ramp's start to half a step after it
        weight[0] = 0.5 + radar.converter.start * times.rate - before
    for place in np.ndindex(samples.shape[:-2]):
        y = lfilter(zeros, poles, samples[place] * weight, axis=-1)
        kept = y[:, before + after : before + after + times.most_samples]
        out[place] = np.where(times.is_sample, kept, 0.0)
    return out


def refuse_unfollowed(radar: Radar) -> None:
    """Raise the errors of `high_passed` before any long computation."""
    if radar.front_end.high_pass is not None:
        _coefficients_of(radar, radar.front_end.high_pass)


def _coefficients_of(radar: Radar, high_pass: HighPass) -> tuple[FloatArray, FloatArray]:
    rate = radar.converter.sample_rate
    _, ahead = _lead(radar)
    zeros, poles, deviation = coefficients(high_pass, radar.if_filter, rate=rate, ahead=ahead)
    if deviation <= RESPONSE_TOLERANCE:
        return zeros, poles

    def is_enough(faster: float, later: int) -> bool:
        return coefficients(high_pass, radar.if_filter, rate=faster, ahead=later)[2] <= (
            RESPONSE_TOLERANCE
        )

    rates = (factor * rate for factor in (1.1, 1.2, 1.35, 1.5, 2.0, 3.0, 5.0))
    faster = next((one for one in rates if is_enough(one, ahead)), None)
    ways = ["use lower corners" if faster is None else f"sample at {faster / 1e6:.5g} MS/s"]
    if ahead < _SAMPLES_AHEAD and is_enough(rate, _SAMPLES_AHEAD):
        room = _SAMPLES_AHEAD / rate + 0.5 * radar.if_filter.support
        ways.append(f"raise the converter's margin to {math.ceil(room * 1e8) / 100:g} µs")
    raise InputError(
        f"front_end.high_pass: corners of up to {max(high_pass.corners) / 1e3:g} kHz cannot be "
        f"computed from samples at {rate / 1e6:.4g} MS/s: the response would deviate by "
        f"{deviation:.1e} (limit {RESPONSE_TOLERANCE:g}); {', or '.join(ways)}"
    )


@lru_cache(maxsize=128)
def coefficients(
    high_pass: HighPass, if_filter: IfFilter, *, rate: float, ahead: int
) -> tuple[FloatArray, FloatArray, float]:
    """Numerator and denominator in powers of 1/z, ``ahead`` samples late, and the greatest error.

    >>> zeros, poles, error = coefficients(HighPass(corners=(1e5,)), IfFilter(), rate=1e6, ahead=10)
    >>> abs(float(np.sum(zeros))) < 1e-9  # nothing passes at 0 Hz
    True
    """
    # a pole at e^{-2π f_i / f_s} for each corner
    poles = np.poly(np.exp(-2.0 * np.pi * np.array(high_pass.corners) / rate))
    turn = 2.0 * np.pi * np.arange(1025) / 2048
    frequency = turn * rate / (2.0 * np.pi)
    inside = frequency <= _band(if_filter, rate)
    passed = np.where(inside, np.abs(if_filter.response(frequency)), 0.0)
    recursion = np.exp(-1j * np.outer(turn, np.arange(poles.size))) @ poles
    wanted = high_pass.response(frequency)
    wave = np.exp(-1j * np.outer(turn, np.arange(-ahead, _SAMPLES_BEHIND + 1)))

    def fit(importance: FloatArray) -> tuple[FloatArray, float]:
        # a low weight beyond the band keeps the coefficients small; a high one makes 0 Hz vanish
        weight = np.maximum(importance, 1e-3) / np.abs(recursion)
        weight[0] *= 1e3
        matrix, target = wave * weight[:, None], wanted * recursion * weight
        zeros = np.linalg.lstsq(
            np.concatenate([matrix.real, matrix.imag]),
            np.concatenate([target.real, target.imag]),
            rcond=None,
        )[0]
        error = np.abs(wave @ zeros / recursion - wanted) * passed
        return zeros, float(error.max())

    zeros, error = fit(inside.astype(np.float64))
    if error > RESPONSE_TOLERANCE:
        # samples at twice the stop edge: no filter has the analog response at half their rate
        zeros, error = fit(passed)
    return np.asarray(zeros, dtype=np.float64), np.asarray(poles, dtype=np.float64), error


def _band(if_filter: IfFilter, rate: float) -> float:
    """Upper edge of the fitted band, Hz: the pass edge, or higher where no signal is aliased."""
    return max(if_filter.passband, min(if_filter.stopband, rate - if_filter.stopband))


def _lead(radar: Radar) -> tuple[int, int]:
    """Numbers of samples that are added before the converter's first one and after its last one.

    Those after it avoid windows that contain the ramp's end, but are three if the margin has room.
    """
    start, margin = radar.converter.start, radar.converter.margin
    room = np.array([start, margin, margin - 0.5 * radar.if_filter.support])
    before, most, clear = np.floor(room * radar.converter.sample_rate * (1 + 1e-12) + 1e-9).astype(
        int
    )
    return int(before), int(min(most, np.clip(clear, 3, _SAMPLES_AHEAD)))
