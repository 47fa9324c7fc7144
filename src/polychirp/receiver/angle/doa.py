r"""Azimuths from the phases along a uniform linear array: root-MUSIC, ESPRIT and the beamformers.

**Sign.** Element m is at :math:`y_m`, which grows to the left. A wave from azimuth :math:`\theta`
(positive left) reaches an element further left earlier, by :math:`y_m\sin\theta/c`. The element
receives :math:`s_{rx,m}(t) = s(t - \tau + y_m\sin\theta/c)`, whose phase is *ahead* by
:math:`2\pi y_m \sin\theta/\lambda`. The mixer conjugates it, :math:`y = s_{tx}\overline{s_{rx}}`,
so the beat's phase **falls** from channel to channel for an arrival from the left:

.. math:: a_m(\theta) = e^{-j 2\pi m (d/\lambda) \sin\theta}

with channel 0 the rightmost element (`polychirp.model.antenna.AntennaArray`).
"""

from typing import Final, Literal

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.angle.esprit import esprit


def covariance(snapshots: ComplexArray, *, subarray: int | None = None) -> ComplexArray:
    r"""Forward–backward averaged covariance ``(detection, element, element)``.

    .. math:: R = \tfrac12\left(\hat R + J \hat R^* J\right), \qquad
              \hat R = \frac1{LS}\sum_{l,s} x_{l,s} x_{l,s}^H

    over snapshots l and, if ``subarray`` is given, over the shifted subarrays s (Pillai and Kwon
    1989). Several coherent sources, as in a single snapshot, need subarrays: each must have more
    elements than there are sources, and twice the number of subarrays must be at least that of
    sources.

    Parameters
    ----------
    snapshots : ``(detection, channel, snapshot)``
    subarray : number of elements of a subarray; by default all channels
    """
    snapshots = np.asarray(snapshots, dtype=np.complex128)
    if snapshots.ndim != 3:
        raise InputError(
            f"snapshots have {snapshots.ndim} axes; they need (detection, channel, snapshot)"
        )
    num_channels = snapshots.shape[1]
    size = num_channels if subarray is None else subarray
    if not 2 <= size <= num_channels:
        raise InputError(
            f"a subarray of {size} elements is not between 2 and the array's {num_channels}"
        )
    shifted = [snapshots[:, s : s + size] for s in range(num_channels - size + 1)]
    stacked = np.concatenate(shifted, axis=2)
    forward = stacked @ stacked.conj().swapaxes(1, 2) / stacked.shape[2]
    return np.asarray(0.5 * (forward + forward[:, ::-1, ::-1].conj()))


def root_music(snapshots: ComplexArray, *, spacing: float) -> FloatArray:
    """Sine of the azimuth of the single source in every detection, ``(detection,)``.

    Parameters
    ----------
    snapshots : ``(detection, channel, snapshot)``, e.g. the amplitudes of a target on all ramps
    spacing : distance of neighbouring elements, in wavelengths

    Raises
    ------
    InputError
        The number of axes is wrong, the array has one element, or the spacing is not positive.

    Examples
    --------
    A wave from 30° left, half-wave spacing: the phase falls by a quarter turn per channel.

    >>> wave = np.exp(-0.5j * np.pi * np.arange(4))
    >>> root_music(wave[None, :, None], spacing=0.5)
    array([0.5...])
    """
    matrices = covariance(snapshots)
    return sines_of_sources(matrices, num_sources=1, spacing=spacing)[:, 0]


def bartlett(snapshots: ComplexArray, *, spacing: float) -> FloatArray:
    r"""Sine s of the azimuth at which the channels' sum is strongest, ``(detection,)``.

    .. math:: \max_s\; a(s)^H R\,a(s)

    This is Bartlett's beamformer, the maximum-likelihood estimator of one source in white noise.
    Its beamwidth depends on the array alone. Parameters and errors are those of `root_music`.
    """
    return _strongest(covariance(snapshots), spacing)


def capon(snapshots: ComplexArray, *, spacing: float) -> FloatArray:
    r"""Sine s of the azimuth at which a distortionless beam is strongest, ``(detection,)``.

    .. math:: \max_s\; \frac{1}{a(s)^H R^{-1} a(s)}

    This is Capon's beamformer (1969). Diagonal loading with a millionth of the mean power (chosen)
    makes R invertible with fewer snapshots than elements. Of a single snapshot, the maximum is
    Bartlett's; forward–backward averaging would give its noise the weight of the wave. Parameters
    and errors: see `root_music`.
    """
    if np.shape(snapshots)[-1] == 1:
        return bartlett(snapshots, spacing=spacing)
    matrices = covariance(snapshots)
    size = matrices.shape[-1]
    load = 1e-6 * np.trace(matrices, axis1=1, axis2=2).real / size + 1e-300
    return _strongest(-np.linalg.inv(matrices + load[:, None, None] * np.eye(size)), spacing)


def esprit_sines(snapshots: ComplexArray, *, spacing: float) -> FloatArray:
    """Sine of the azimuth of the single source, ``(detection,)``, by `esprit.esprit`.

    Parameters and errors are those of `root_music`.

    >>> wave = np.exp(-0.5j * np.pi * np.arange(4))
    >>> esprit_sines(wave[None, :, None], spacing=0.5).round(9)
    array([0.5])
    """
    if not spacing > 0:
        raise InputError("the spacing of an array must be positive, in wavelengths")
    along = spacing * np.arange(np.shape(snapshots)[1])
    elements = Elements(place=np.stack([along, 0.0 * along], axis=-1))
    return esprit(snapshots, elements, num_waves=1)[:, 0, 0]


ESTIMATORS: Final = {
    "root-music": root_music,
    "bartlett": bartlett,
    "capon": capon,
    "esprit": esprit_sines,
}
"""Estimators of the azimuth of one source, by the names that a study file gives them."""

AngleEstimator = Literal["root-music", "bartlett", "capon", "esprit"]


def azimuths(snapshots: ComplexArray, *, spacing: float, estimator: AngleEstimator) -> FloatArray:
    """Azimuth of the single source of each detection, rad; NaN from one channel, which has none.

    Parameters
    ----------
    snapshots : ``(detection, channel, snapshot)``
    spacing : distance of neighbouring elements, in wavelengths
    """
    if snapshots.shape[1] < 2:
        return np.full(snapshots.shape[0], np.nan)
    sines = ESTIMATORS[estimator](snapshots, spacing=spacing)
    return np.asarray(np.arcsin(np.clip(sines, -1.0, 1.0)))


def _strongest(matrices: ComplexArray, spacing: float) -> FloatArray:
    """Sines s with the greatest a(s)^H M a(s), found on a grid and refined by Newton's method."""
    if not spacing > 0:
        raise InputError("the spacing of an array must be positive, in wavelengths")
    size = matrices.shape[-1]
    # a(s)^H M a(s) is a trigonometric polynomial in s; sums along M's diagonals are coefficients
    order = np.arange(1, size)
    terms = np.stack([np.trace(matrices, offset=-n, axis1=1, axis2=2) for n in order], axis=1)
    phase = 2.0 * np.pi * spacing * order
    widest = min(1.0, 0.5 / spacing)
    sines = np.linspace(-widest, widest, 64 * size + 1)
    value = (terms @ np.exp(1j * np.outer(phase, sines))).real
    found = sines[np.argmax(value, axis=1)]
    for _ in range(3):
        turned = terms * np.exp(1j * found[:, None] * phase)
        slope = np.sum(-turned.imag * phase, axis=1)
        bend = np.sum(-turned.real * phase**2, axis=1)
        step = np.where(bend < 0, -slope / np.where(bend < 0, bend, -1.0), 0.0)
        found = found + np.clip(step, sines[0] - sines[1], sines[1] - sines[0])
    return np.asarray(found)


def sines_of_sources(
    covariances: ComplexArray,
    *,
    num_sources: int,
    spacing: float,
    index: IntArray | None = None,
) -> FloatArray:
    r"""Sines of the azimuths of several sources, ``(detection, source)``, from right to left.

    The elements may be at any multiples n of one distance.

    Root-MUSIC (Barabell 1983): the sources are the roots nearest to the unit circle, from inside,
    of :math:`\sum_l z^l \sum_{n-m=l} (E_n E_n^H)_{mn}`, where :math:`E_n` spans the noise
    subspace. Elements closer than half a wavelength can give a sine beyond 1, which no plane wave
    has; the caller must handle it.

    Parameters
    ----------
    covariances : ``(detection, element, element)``
    spacing : distance of neighbouring elements, in wavelengths
    index : n, place of every element in multiples of ``spacing``, ``(element,)``; by default
        0, 1, 2 …

    Raises
    ------
    InputError
        There is no source, or as many as elements or more, or the spacing is not positive.
    """
    covariances = np.asarray(covariances, dtype=np.complex128)
    _check_sources(num_sources, covariances.shape[-1], spacing)
    polynomial = _null_polynomial(covariances, num_sources, index)
    return _sines_of_roots(_roots(polynomial), num_sources, spacing)


def _null_polynomial(
    covariances: ComplexArray, num_sources: int, index: IntArray | None
) -> ComplexArray:
    """Coefficients of the polynomial, ``(detection, 2·place − 1)``, highest power first."""
    size = covariances.shape[-1]
    _, vector = np.linalg.eigh(covariances)
    noise = vector[:, :, : size - num_sources]
    if index is not None:  # places without an element add nothing
        is_at = (index == np.arange(index.max() + 1)[:, None]).astype(np.float64)
        noise, size = is_at @ noise, len(is_at)
    projector = noise @ noise.conj().swapaxes(1, 2)
    diagonals = [
        np.trace(projector, offset=offset, axis1=1, axis2=2)
        for offset in range(size - 1, -size, -1)
    ]
    return np.stack(diagonals, axis=1)


def _roots(polynomial: ComplexArray) -> ComplexArray:
    """Roots ``(detection, root)`` of all polynomials at once: eigenvalues of companion matrices.

    A compiled Ehrlich–Aberth iteration was tried and is slower up to eight elements.
    """
    count, degree = polynomial.shape[0], polynomial.shape[1] - 1
    # if the first coefficient vanishes, the limit (chosen) gives a far root, which is not used
    first = np.where(np.abs(polynomial[:, :1]) < 1e-14, 1e-14, polynomial[:, :1])
    companion = np.zeros((count, degree, degree), dtype=np.complex128)
    companion[:, 1:, :-1] = np.eye(degree - 1)
    companion[:, 0] = -polynomial[:, 1:] / first
    return np.asarray(np.linalg.eigvals(companion), dtype=np.complex128)


def _sines_of_roots(root: ComplexArray, num_sources: int, spacing: float) -> FloatArray:
    """Sines of the root pairs z, 1/z* that are nearest to the unit circle, in growing order.

    Without noise a pair is a double root on the circle. Rounding splits it by the square root of
    the machine precision, along the circle or across, so that both may lie inside. The second root
    is therefore searched as the partner of the first; the mean of their directions is exact.
    """
    distance = np.abs(np.log(np.abs(root)))
    sines = np.empty((root.shape[0], num_sources))
    detection = np.arange(root.shape[0])
    for k in range(num_sources):
        nearest = np.argmin(distance, axis=1)
        z = root[detection, nearest]
        distance[detection, nearest] = np.inf
        apart = np.abs(root - (1.0 / z.conj())[:, None])
        partner = np.argmin(np.where(np.isinf(distance), np.inf, apart), axis=1)
        other = root[detection, partner]
        distance[detection, partner] = np.inf
        direction = z / np.abs(z) + other / np.abs(other)
        sines[:, k] = -np.angle(direction) / (2.0 * np.pi * spacing)
    return np.sort(sines, axis=1)


def _check_sources(num_sources: int, num_elements: int, spacing: float) -> None:
    if not 1 <= num_sources < num_elements:
        raise InputError(
            f"{num_elements} elements separate 1 to {num_elements - 1} sources, not {num_sources}"
        )
    if not spacing > 0:
        raise InputError("the spacing of an array must be positive, in wavelengths")
