r"""Azimuths at the frame's start of targets whose azimuth changes within the frame.

The azimuth of a body that passes at 5 m with 20 m/s changes by 1.5° in 6.5 ms, so that the mean
over a frame of 13 ms is not the azimuth at its start. On a straight path at constant velocity the
lateral coordinate :math:`y = R\sin\theta` is linear in time. With :math:`s = \sin\theta` and its
rate, both at the frame's start, and the time :math:`\Delta` since then,

.. math:: s(t) = s_0\,\frac{R_0 + v\,\Delta}{R(t)} + \dot s_0\,\frac{R_0\,\Delta}{R(t)} .

R₀, v and R(t) are known from the beats and phases, so s₀ and its rate are the only unknowns.
"""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.signal_model.point_signal import LEAST_RANGE_SHARE, path_of

TYPICAL_CROSSING_SPEED = 10.0
"""Standard deviation of the speed across the line of sight, m/s (chosen for streets). Divided by
the range it is the prior's standard deviation of the rate of the azimuth's sine."""

LEAST_RESIDUAL_SHARE = 1e-9
"""Least residual of a fitted wave as a share of the ramp's power. A smaller residual is only a
rounding error, and weights from it would be arbitrary (chosen)."""

LARGEST_SINE_STEP = 0.2
"""Largest change of the azimuth's sine in one step of the fit (chosen: less than 0.5, which is the
beamwidth of four channels at half a wavelength, so that no step leaves the main lobe)."""


def sine_basis(motion: FloatArray, elapsed: FloatArray) -> FloatArray:
    """Factors of s₀ and of its rate in the azimuth's sine on each ramp: ``(2, point, ramp)``.

    Parameters
    ----------
    motion : range, its rate and acceleration at the frame's start (m, s), ``(point, 3)``
    elapsed : s since the frame's start, ``(ramp,)``

    Examples
    --------
    A point at 10 m recedes at 10 m/s. After 1 s its range has doubled, which halves the effect of
    the rate of the sine.

    >>> sine_basis(np.array([[10.0, 10.0, 0.0]]), np.array([1.0]))[:, 0, 0]
    array([1. , 0.5])
    """
    distance, rate = motion[:, 0, None], motion[:, 1, None]
    now = path_of(motion, elapsed)[0]
    share = np.maximum(1.0 + rate / distance * elapsed, LEAST_RANGE_SHARE)
    return np.stack([distance * share / now, distance * elapsed / now])


def ramp_weights(left: FloatArray) -> FloatArray:
    """Weights of the ramps, 0 … 1, from the residual power ``left`` of a fit: ``(point, ramp)``.

    A burst of interference, or another echo in the same cell, leaves a higher residual on some
    ramps. The limit is six times the lower quartile over the ramps: the weight is 1 below it, and
    limit/residual above. Noise alone on four channels exceeds the limit on 0.2 % of the ramps.
    """
    place = 0.25 * (left.shape[1] - 1)
    below, above = int(place), min(int(place) + 1, left.shape[1] - 1)
    ordered = np.partition(left, (below, above), axis=1)
    quartile = ordered[:, below] + (place - below) * (ordered[:, above] - ordered[:, below])
    usual = 6.0 * quartile[:, None]
    return np.asarray(usual / np.maximum(left, usual + 1e-300))


def sines_and_rates(
    snapshots: ComplexArray,
    *,
    motion: FloatArray,
    channel_y: FloatArray,
    frequency: FloatArray,
    elapsed: FloatArray,
) -> FloatArray:
    r"""Sine of every point's azimuth at the frame's start, and its rate, 1/s: ``(point, 2)``.

    The estimate has maximum likelihood for white noise and an unknown amplitude on every ramp,

    .. math:: \max_{s_0, \dot s_0} \sum_k \Big|\sum_m x_{mk}\,
              e^{j2\pi f_k y_m s(t_k)/c}\Big|^2 ,

    with `ramp_weights`, and a Gaussian prior on the rate: mean zero, standard deviation
    ``TYPICAL_CROSSING_SPEED``/R. Four Gauss–Newton steps start from the mean phase between
    neighbouring channels. The noise power is estimated from the residual, which is large where
    several scatterers share a cell, so that the prior prevails there.

    Parameters
    ----------
    snapshots : x, complex, with equal noise power in all, ``(point, channel, ramp)``
    motion : R, v, a at the frame's start, as for `sine_basis`, ``(point, 3)``
    channel_y : m, y of the channels' elements, evenly spaced, ``(channel,)``
    frequency : Hz, radio frequency in the middle of each ramp's snapshot, ``(ramp,)``
    elapsed : s from the frame's start to the middle of the snapshot, ``(ramp,)``
    """
    channels = snapshots.shape[1]
    centred = channel_y - np.mean(channel_y)
    wavenumber = 2.0 * np.pi / SPEED_OF_LIGHT * frequency
    basis = sine_basis(motion, elapsed)
    power = np.sum(np.abs(snapshots) ** 2, axis=1)
    prior = (motion[:, 0] / TYPICAL_CROSSING_SPEED) ** 2
    found = np.zeros((len(motion), 2))
    if channels == 1:
        return found  # the azimuth cannot be measured with one channel
    found[:, 0] = _mean_sines(snapshots, centred[1] - centred[0], float(np.mean(wavenumber)))
    for _ in range(4):
        turned = snapshots * _phasors(np.einsum("pi,ipk->pk", found, basis), centred, wavenumber)
        beam = np.mean(turned, axis=1)
        left = np.maximum(power - channels * np.abs(beam) ** 2, LEAST_RESIDUAL_SHARE * power)
        share = ramp_weights(left)
        noise = np.mean(share * left, axis=1) / (channels - 1) + 1e-300
        ahead = -np.einsum("m,pmk,pk->pk", centred, turned, beam.conj()).imag * wavenumber * share
        weight = np.abs(beam) ** 2 * wavenumber**2 * np.sum(centred**2) * share
        normal = np.einsum("ipk,jpk,pk->pij", basis, basis, weight)
        right = np.einsum("ipk,pk->pi", basis, ahead)
        held = 0.5 * noise * prior
        normal[:, 1, 1] += held
        normal += 1e-300 * np.eye(2)
        right[:, 1] -= held * found[:, 1]
        step = np.linalg.solve(normal, right[..., None])[..., 0]
        most = np.max(np.abs(np.einsum("pi,ipk->pk", step, basis)), axis=1, keepdims=True)
        found += step / np.maximum(1.0, most / LARGEST_SINE_STEP)
    return found


def snapshots_at_start(
    snapshots: ComplexArray,
    *,
    motion: FloatArray,
    channel_y: FloatArray,
    frequency: FloatArray,
    elapsed: FloatArray,
) -> ComplexArray:
    """The snapshots with the phases that they would have at the frame's start; same axes.

    The phases are those at the mean frequency over the ramps. Each snapshot is multiplied by the
    square root of its ramp's weight (`ramp_weights`). For the parameters see `sines_and_rates`.
    """
    found = sines_and_rates(
        snapshots, motion=motion, channel_y=channel_y, frequency=frequency, elapsed=elapsed
    )
    wavenumber = 2.0 * np.pi / SPEED_OF_LIGHT * frequency
    now = np.einsum("pi,ipk->pk", found, sine_basis(motion, elapsed)) * wavenumber
    start = np.broadcast_to(found[:, :1] * np.mean(wavenumber), now.shape)
    centred, one = channel_y - np.mean(channel_y), np.ones_like(wavenumber)
    turned = snapshots * _phasors(now, centred, one)
    left = np.sum(np.abs(turned - np.mean(turned, axis=1, keepdims=True)) ** 2, axis=1)
    left = np.maximum(left, LEAST_RESIDUAL_SHARE * np.sum(np.abs(turned) ** 2, axis=1))
    return turned * _phasors(-start, centred, one) * np.sqrt(ramp_weights(left))[:, None]


def _phasors(sine: FloatArray, channel_y: FloatArray, wavenumber: FloatArray) -> ComplexArray:
    """Phasors that cancel a plane wave's phases at the channels, ``(point, channel, ramp)``."""
    return np.asarray(np.exp(1j * (sine * wavenumber)[:, None] * channel_y[:, None]))


def _mean_sines(snapshots: ComplexArray, spacing: float, wavenumber: float) -> FloatArray:
    """Sines from the mean phase between neighbouring channels, all ramps alike: ``(point,)``."""
    products = np.sum(snapshots[:, 1:] * snapshots[:, :-1].conj(), axis=1)
    power = np.sum(np.abs(snapshots) ** 2, axis=1) + 1e-300
    return np.asarray(-np.angle(np.sum(products / power, axis=1)) / (wavenumber * spacing))
