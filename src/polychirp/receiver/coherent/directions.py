"""Azimuths of points, two where the channels of one show two plane waves."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.receiver.angle.doa import AngleEstimator, azimuths
from polychirp.receiver.angle.two_waves import two_waves
from polychirp.receiver.coherent.points import Points

GREATEST_EIGENVALUE = 2.0
"""Greatest eigenvalue of the noise covariance over its mean up to which noise counts as white;
chosen: in white noise it is some per cent above 1."""

SINES_PER_ELEMENT = 256
"""Number of sines per element among which the azimuth in noise from one direction is looked for;
chosen: steps are 1/64 of a beam or less."""


def directions(
    points: Points, mixing: ComplexArray, *, spacing: float, estimator: AngleEstimator
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Point, azimuth, rad, and share of the point's power of every detection, ``(detection,)``.

    Parameters
    ----------
    mixing : matrix that makes the channels' noise white, ``(channel, channel)``. If it is not
        white, ``estimator`` gives way to the azimuth of most likelihood
    spacing : distance of neighbouring channels, in wavelengths
    """
    worst = 1.0 / float(np.min(np.linalg.svd(mixing, compute_uv=False))) ** 2
    if worst <= GREATEST_EIGENVALUE:
        azimuth = azimuths(points.amplitude[:, :, None], spacing=spacing, estimator=estimator)
    else:
        azimuth = np.arcsin(_likeliest(points.amplitude, mixing, spacing))
    found = [(n, float(angle), 1.0) for n, angle in enumerate(azimuth)]
    for n, amplitude in enumerate(points.amplitude):
        white = float(np.sum(np.abs(mixing @ amplitude) ** 2))
        # noise of unit power or less from any direction
        snapshot = amplitude * np.sqrt(points.power[n] / white / max(worst, 1.0))
        waves = two_waves(snapshot, spacing=spacing)
        if waves is not None:
            angles = np.arcsin(np.clip(waves.sine, -1.0, 1.0))
            shares = np.abs(waves.amplitude) ** 2 * amplitude.size
            shares /= np.sum(np.abs(snapshot) ** 2)
            found[n] = (n, float(angles[0]), float(shares[0]))
            found.append((n, float(angles[1]), float(shares[1])))
    number, angle, share = np.array(found).reshape(-1, 3).T
    return number.astype(np.int64), angle, share


def _likeliest(amplitude: ComplexArray, mixing: ComplexArray, spacing: float) -> FloatArray:
    """Sines of the waves that fit best in noise of this kind, ``(point,)`` (Van Trees 2002, 8).

    A parabola through the best of some sines and its neighbours gives the sine between them.
    """
    count = amplitude.shape[1]
    widest = min(1.0, 0.5 / spacing)
    sine = np.linspace(-widest, widest, SINES_PER_ELEMENT * count)
    steering = np.exp(-2j * np.pi * spacing * np.outer(np.arange(count), sine))
    white = mixing @ steering
    matched = np.abs((amplitude @ mixing.T) @ white.conj()) ** 2
    fit = matched / np.sum(np.abs(white) ** 2, axis=0)
    best = np.clip(np.argmax(fit, axis=1), 1, sine.size - 2)
    below, top, above = (fit[np.arange(len(fit)), best + step] for step in (-1, 0, 1))
    bend = np.minimum(below - 2.0 * top + above, -1e-300)
    between = np.clip(0.5 * (below - above) / bend, -1.0, 1.0)
    return np.asarray(sine[best] + between * (sine[1] - sine[0]))
