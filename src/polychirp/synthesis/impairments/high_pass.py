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
"""Greatest error of the response in the fitted band (`_band`); chosen: usual fits reach 1e-3."""

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
    return coefficients(high_pass, rate=rate, band=_band(radar.if_filter, rate), ahead=ahead)


@lru_cache(maxsize=32)
def coefficients(
    high_pass: HighPass, *, rate: float, band: float, ahead: int
) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator in powers of 1/z, fitted to ``band`` Hz, ``ahead`` samples late.

    >>> zeros, poles = coefficients(HighPass(corners=(1e5,)), rate=1e6, band=3e5, ahead=10)
    >>> abs(float(np.sum(zeros))) < 1e-9  # nothing passes at 0 Hz
    True
    """
    # a pole at e^{-2π f_i / f_s} for each corner
    poles = np.poly(np.exp(-2.0 * np.pi * np.array(high_pass.corners) / rate))
    turn = 2.0 * np.pi * np.arange(1025) / 2048
    inside = turn <= 2.0 * np.pi * band / rate
    recursion = np.exp(-1j * np.outer(turn, np.arange(poles.size))) @ poles
    wanted = high_pass.response(turn * rate / (2.0 * np.pi))
    # a low weight beyond the band keeps the coefficients small; a high one makes 0 Hz vanish
    weight = np.where(inside, 1.0, 1e-3) / np.abs(recursion)
    weight[0] *= 1e3
    wave = np.exp(-1j * np.outer(turn, np.arange(-ahead, _SAMPLES_BEHIND + 1)))
    matrix, target = wave * weight[:, None], wanted * recursion * weight
    zeros = np.linalg.lstsq(
        np.concatenate([matrix.real, matrix.imag]),
        np.concatenate([target.real, target.imag]),
        rcond=None,
    )[0]
    deviation = np.abs(wave @ zeros / recursion - wanted)[inside].max()
    if deviation > RESPONSE_TOLERANCE:
        raise InputError(
            f"a high-pass at {max(high_pass.corners) / 1e3:.4g} kHz cannot be computed from "
            f"samples at {rate / 1e6:.4g} MS/s: its response deviates by {deviation:.1e} (limit "
            f"{RESPONSE_TOLERANCE:g}) within {band / 1e3:.4g} kHz; sample faster, or raise the "
            f"converter's margin to {_SAMPLES_AHEAD / rate * 1e6:.4g} µs"
        )
    return np.asarray(zeros, dtype=np.float64), np.asarray(poles, dtype=np.float64)


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
