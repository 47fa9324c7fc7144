r"""Fits of point echoes to the spectra of ramps, where a windowed beat is a few bins wide.

With Hann's window w a point of amplitude a, beat f and curvature b contributes to the spectrum of a
ramp of L samples

.. math:: S(f_m) = a\,e^{j\varphi}\,g\,K(x, c), \qquad
          K(x, c) = \int w(u)\,e^{-j2\pi x u + j\pi c u^2}\,du

where :math:`x = (f_m - f) L/f_s` is the distance from the beat in resolution cells,
:math:`c = b (L/f_s)^2` is the curvature in cycles over the ramp, φ the phase in the middle of the
ramp, and :math:`g = L/\sqrt{\sum w^2}` keeps the power of white noise. For c = 0, K is 1/2 at its
peak and falls as :math:`1/2\pi |x|^3`, so that sums over a thousand samples become sums over a
dozen bins, two per cell. Its dependence on c is the series
:math:`\sum_q (j\pi c)^q/q!\,M_{2q}(x)` in the window's even moments, cut after q = 5: the error is
below −110 dB up to c = 1 (a car at 32 m/s, 1 GHz, 2 ms: 0.85). Each ramp with blanked samples
has its own moments, which do not fall with x. The reference in the time domain is
`polychirp.receiver.signal_model.point_signal`.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.jit import compiled, inner, reordered
from polychirp.model.if_frame import SampleTimes
from polychirp.receiver.signal_model.point_signal import hann_weights

NUM_MOMENTS = 6
"""Number of terms, q = 0 … 5, of the series in the curvature in the module's text."""

TABLE_POINTS_PER_CELL = 16
"""Points of a moment's table per resolution cell. Chosen: cubic interpolation between them has an
error of −115 dB."""

BINS_PER_CELL = 2
"""Bins of the spectra per resolution cell: every transform is twice as long as its window."""

FIT_REACH = 3.0
"""Resolution cells on either side of a beat in which its amplitude and its frequency error are
fitted. Chosen: the main lobe of Hann's window reaches 2 cells."""

COUPLING_REACH = 9.0
"""Distance of two points in resolution cells up to which the normal equations couple them fully.
Chosen: the kernel is 1/(2π 9³) = −73 dB there, and the second pass of `_fit` corrects the rest."""

REMOVAL_LIMIT = 0.03
"""Share of the noise's rms down to which a point's side lobes are subtracted. Chosen."""

REGULARISATION = 1e-7
"""Share of a point's own energy added to the normal equations, as in `fit_amplitudes`."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Band:
    """The bins of every ramp's spectrum that hold the beats of a map's points.

    Real and imaginary parts are separate, ``(part, …)``, so that compilers vectorise loops.

    Parameters
    ----------
    first : number of the first bin, ``(ramp,)``; may be negative
    num_bins : number of bins, the same for every ramp
    rate : sample rate, 1/s
    length : L, samples under the window, ``(ramp,)``; a bin is ``rate/(BINS_PER_CELL·length)``
    gain : L/√Σw², ``(ramp,)``
    weight : the window over √Σw², zero for samples that are not used, ``(ramp, fast)``
    is_whole : true if no sample under the window is missing, ``(ramp,)``
    moments : M_2q, one table for all whole ramps and one for each other ramp, ``(table, part,
        phase, moment, place)``; ``place`` counts bins from −``farthest`` cells on, ``phase`` the
        table's points between two bins
    table : number of each ramp's table of moments, ``(ramp,)``
    farthest : resolution cells that the tables reach on either side of a beat
    """

    first: IntArray
    num_bins: int
    rate: float
    length: IntArray
    gain: FloatArray
    weight: FloatArray
    is_whole: BoolArray
    moments: FloatArray
    table: IntArray
    farthest: int

    @property
    def size(self) -> IntArray:
        """Length of each ramp's transform, ``(ramp,)``."""
        return BINS_PER_CELL * self.length

    @property
    def noise_gain(self) -> FloatArray:
        """(Σw)²/Σw², ``(ramp,)``: signal-to-noise ratio in a point's peak over that in a sample."""
        return np.asarray(np.sum(self.weight, axis=1) ** 2)

    def spectra(self, samples: ComplexArray) -> FloatArray:
        """Spectra ``(part, ramp, channel, bin)`` of samples ``(channel, ramp, fast)``.

        Their phase refers to the middle of each ramp's window; white noise keeps its power.
        """
        channels, ramps, _ = samples.shape
        out = np.empty((2, ramps, channels, self.num_bins))
        for k in range(ramps):
            length = int(self.length[k])
            windowed = samples[:, k, :length] * self.weight[k, :length]
            spectrum = np.fft.fft(windowed, BINS_PER_CELL * length, axis=-1)
            bins = self.first[k] + np.arange(self.num_bins)
            turn = np.exp(1j * np.pi * bins * ((length - 1) / (BINS_PER_CELL * length)))
            shown = spectrum[:, bins % (BINS_PER_CELL * length)] * turn
            out[0, k], out[1, k] = shown.real, shown.imag
        return out

    def places(self, phases: FloatArray) -> FloatArray:
        """From `beat_phase`: phase at mid-window (cycles), bin, c (cycles); in the same shape."""
        centre = 0.5 * (self.length - 1) / self.rate
        value, slope, bend = phases[..., 0], phases[..., 1], phases[..., 2]
        beat = slope + bend * centre
        return np.stack(
            [
                (value + slope * centre + 0.5 * bend * centre**2) % 1.0,
                beat * self.size / self.rate - self.first,
                bend * (self.length / self.rate) ** 2,
            ],
            axis=-1,
        )

    def match(self, spectra: FloatArray, phases: FloatArray) -> ComplexArray:
        """Amplitude of every point if no other were present, ``(point, channel, ramp)``."""
        return np.asarray(_match(spectra, self.places(phases), *self._kernel()))

    def fit(
        self, spectra: FloatArray, phases: FloatArray, noise: FloatArray
    ) -> tuple[ComplexArray, FloatArray]:
        r"""Amplitudes of several points at once, and the residual of the spectra.

        For every point p the residual is orthogonal to its kernel :math:`V_p` within ``FIT_REACH``
        cells: :math:`\langle V_p, S - \sum_q a_q K_q\rangle = 0`. The
        amplitudes are exact for spectra that are sums of these points.

        Parameters
        ----------
        spectra : ``(part, ramp, channel, bin)``
        phases : `beat_phase`, ``(point, ramp, 3)``
        noise : rms of the noise in a bin, ``(ramp,)``; side lobes below
            `REMOVAL_LIMIT` times this are not removed

        Returns
        -------
        amplitude : ``(point, channel, ramp)``
        residual : the spectra without the points, in the shape of ``spectra``
        """
        _, ramps, channels, _ = spectra.shape
        if len(phases) == 0:
            return np.zeros((0, channels, ramps), dtype=np.complex128), spectra.copy()
        amplitude, residual = _fit(spectra, self.places(phases), noise, *self._kernel())
        return amplitude, residual

    def beat_errors(
        self, residual: FloatArray, phases: FloatArray, amplitude: ComplexArray
    ) -> FloatArray:
        """Error of each point's beat, estimated from the residual: Hz ``(point, ramp)``."""
        above = np.sum((self.tilts(residual, phases) * amplitude.conj()).real, axis=1)
        strength = np.sum(np.abs(amplitude) ** 2, axis=1)
        return np.asarray(above / np.maximum(strength, 1e-300))

    def tilts(self, residual: FloatArray, phases: FloatArray) -> ComplexArray:
        """Beat errors times amplitudes, from the residual: ``(point, channel, ramp)``, Hz·V."""
        cells = _tilts(residual, self.places(phases), *self._kernel())
        return np.asarray(cells * (self.rate / self.length))

    def subtract(
        self, spectra: FloatArray, phases: FloatArray, amplitude: ComplexArray
    ) -> FloatArray:
        """Spectra without points of known amplitudes ``(point, channel, ramp)``."""
        out = spectra.copy()
        if len(phases):
            _subtract(out, self.places(phases), amplitude, *self._kernel())
        return out

    def _kernel(self) -> tuple[Any, ...]:
        return self.moments, self.table, self.farthest, self.gain, self.is_whole


def band_of(
    presence: BoolArray | FloatArray, times: SampleTimes, *, lowest: FloatArray, highest: FloatArray
) -> Band:
    """The band from beat ``lowest`` to ``highest``, Hz, ``(ramp,)``, with a margin of eight cells.

    Windows have a length that is fast to transform, a per cent shorter than the ramp at most; this
    costs almost no energy, because the window is almost zero at the end of the ramp.

    Parameters
    ----------
    presence : weight of each sample, 0 … 1, ``(ramp, fast)``
    """
    ticks = np.arange(presence.shape[1])
    last = np.max(np.where(presence > 0, ticks + 1, 0), axis=1)
    length = np.array([_smooth_below(int(n)) for n in last])
    weight = hann_weights(presence * (ticks < length[:, None]))
    bins = BINS_PER_CELL * length / times.rate
    first = np.floor(lowest * bins).astype(np.int64) - 8 * BINS_PER_CELL
    num_bins = int(np.max(np.ceil(highest * bins).astype(np.int64) - first)) + 8 * BINS_PER_CELL + 1
    is_whole = np.sum(presence * (ticks < length[:, None]), axis=1) == length
    energy = np.maximum(np.sum(weight**2, axis=1), 1e-30)
    farthest = -(-num_bins // BINS_PER_CELL) + 4
    broken = np.flatnonzero(~is_whole)
    tables = [_hann_moments(farthest)]
    tables += [_moments(weight[k, : length[k]], farthest) for k in broken]
    table = np.zeros(length.size, dtype=np.int64)
    table[broken] = 1 + np.arange(broken.size)
    return Band(
        first=first,
        num_bins=num_bins,
        rate=times.rate,
        length=length,
        gain=length / np.sqrt(energy),
        weight=weight / np.sqrt(energy)[:, None],
        is_whole=is_whole,
        moments=np.array(tables),
        table=table,
        farthest=farthest,
    )


@lru_cache(maxsize=1024)
def _smooth_below(length: int) -> int:
    """The greatest length up to this one whose prime factors are 2, 3 and 5; at least 2."""
    best = 2
    fives = 1
    while fives <= length:
        threes = fives
        while threes <= length:
            best = max(best, threes << ((length // threes).bit_length() - 1))
            threes *= 3
        fives *= 5
    return best


@lru_cache(maxsize=8)
def _hann_moments(farthest: int) -> FloatArray:
    """Moments of Hann's window from 2048 samples; the error of this number is 1/(2π 1024³)."""
    u = (np.arange(2048) + 0.5) / 2048
    return _moments(np.sin(np.pi * u) ** 2, farthest)


def _moments(weight: FloatArray, farthest: int) -> FloatArray:
    """Transforms of w u^2q as in `Band.moments`, ``TABLE_POINTS_PER_CELL`` points per cell."""
    length = weight.size
    u = (np.arange(length) - 0.5 * (length - 1)) / length
    powers = u ** (2 * np.arange(NUM_MOMENTS)[:, None])
    spectrum = np.fft.fft(weight * powers, TABLE_POINTS_PER_CELL * length, axis=-1) / length
    x = np.arange(-farthest * TABLE_POINTS_PER_CELL, farthest * TABLE_POINTS_PER_CELL)
    shown = spectrum[:, x % (TABLE_POINTS_PER_CELL * length)] * np.exp(
        1j * np.pi * x / TABLE_POINTS_PER_CELL * (length - 1) / length
    )
    parts = np.stack([shown.real, shown.imag]).reshape(
        2, NUM_MOMENTS, -1, TABLE_POINTS_PER_CELL // BINS_PER_CELL
    )
    return np.ascontiguousarray(np.moveaxis(parts, 3, 1))


@reordered
def _add_row(out: Any, factor: float, row: Any) -> None:  # pragma: no cover - compiled
    for i in range(out.size):
        out[i] += factor * row[i]


@inner
def _kernel_into(  # pragma: no cover - compiled
    out: Any, moments: Any, x: float, curvature: float, farthest: int, is_whole: bool
) -> None:
    """K(x + i/BINS_PER_CELL, curvature) for all places i of ``out``, ``(part, place)``.

    Lagrange's cubic over four table points; the moments are real where no sample is missing, so
    that term q of the series is real or imaginary.
    """
    out[:] = 0.0
    phases, terms, length = moments.shape[1:]
    place = (x + farthest) * TABLE_POINTS_PER_CELL
    middle = int(np.floor(place))
    t = place - middle
    count = out.shape[1]
    for o in range(-1, 3):
        if o == -1:
            share = -t * (t - 1.0) * (t - 2.0) / 6.0
        elif o == 0:
            share = 0.5 * (t + 1.0) * (t - 1.0) * (t - 2.0)
        elif o == 1:
            share = -0.5 * (t + 1.0) * t * (t - 2.0)
        else:
            share = (t + 1.0) * t * (t - 1.0) / 6.0
        start = (middle + o) // phases
        phase = (middle + o) - start * phases
        low, high = max(0, -start), min(count, length - start)
        if high <= low:
            continue
        for q in range(terms):
            row = moments[0, phase, q, start + low : start + high]
            odd = q % 2
            sign = 1.0 if q % 4 < 2 else -1.0
            _add_row(out[odd, low:high], sign * share, row)
            if not is_whole:
                row = moments[1, phase, q, start + low : start + high]
                _add_row(out[1 - odd, low:high], sign * share * (1.0 - 2.0 * odd), row)
            share *= np.pi * curvature / (q + 1)


@inner
def _span(place: float, cells: float, bins: int) -> Any:  # pragma: no cover - compiled
    """Numbers of the first bin, and after the last, within ``cells`` of a place."""
    low = max(0, int(np.ceil(place - cells * BINS_PER_CELL)))
    high = min(bins, int(np.floor(place + cells * BINS_PER_CELL)) + 1)
    return low, max(low, high)


@reordered
def _inner(a: Any, b: Any) -> Any:  # pragma: no cover - compiled
    """Σ a* b of two rows ``(part, place)``."""
    real, imag = 0.0, 0.0
    for i in range(a.shape[1]):
        real += a[0, i] * b[0, i] + a[1, i] * b[1, i]
        imag += a[0, i] * b[1, i] - a[1, i] * b[0, i]
    return complex(real, imag)


@compiled
def _match(  # pragma: no cover - compiled
    spectra: Any, places: Any, moments: Any, table: Any, farthest: int, gain: Any, is_whole: Any
) -> Any:
    _, ramps, channels, bins = spectra.shape
    out = np.zeros((places.shape[0], channels, ramps), dtype=np.complex128)
    values = np.empty((2, bins))
    for p in range(places.shape[0]):
        for k in range(ramps):
            place = places[p, k]
            low, high = _span(place[1], FIT_REACH, bins)
            own = values[:, : high - low]
            start = (low - place[1]) / BINS_PER_CELL
            _kernel_into(own, moments[table[k]], start, place[2], farthest, is_whole[k])
            energy = _inner(own, own).real + 1e-300
            turn = np.exp(-2j * np.pi * place[0]) / (gain[k] * energy)
            for m in range(channels):
                out[p, m, k] = _inner(own, spectra[:, k, m, low:high]) * turn
    return out


@compiled
def _fit(  # pragma: no cover - compiled
    spectra: Any,
    places: Any,
    noise: Any,
    moments: Any,
    table: Any,
    farthest: int,
    gain: Any,
    is_whole: Any,
) -> Any:
    _, ramps, channels, bins = spectra.shape
    points = places.shape[0]
    amplitude = np.zeros((points, channels, ramps), dtype=np.complex128)
    residual = spectra.copy()
    kernel = np.zeros((points, 2, bins))
    wide = np.zeros((points, 2), dtype=np.int64)
    near = np.zeros((points, 2), dtype=np.int64)
    order = np.zeros(points, dtype=np.int64)
    for k in range(ramps):
        # every point's kernel as far as it couples with others, and the normal equations
        own = moments[table[k]]
        reach = COUPLING_REACH + FIT_REACH if is_whole[k] else 2.0 * farthest
        for p in range(points):
            near[p, 0], near[p, 1] = _span(places[p, k, 1], FIT_REACH, bins)
            _kernel_near(kernel, wide, p, reach, places[p, k], own, farthest, is_whole[k])
        gram = _gram(kernel, wide, near)
        _factorize(gram, order)
        found = _solve(gram, order, _readings(kernel, near, residual[:, k]))
        # kernels of strong points reach farther, to where they fall to REMOVAL_LIMIT of the noise
        for p in range(points):
            above = np.abs(found[p]).max() / (2.0 * np.pi * REMOVAL_LIMIT * noise[k] + 1e-300)
            removal_reach = min(above ** (1.0 / 3.0), 2.0 * farthest)
            if removal_reach > reach:
                _kernel_near(
                    kernel, wide, p, removal_reach, places[p, k], own, farthest, is_whole[k]
                )
        _remove(residual[:, k], kernel, wide, found)
        # the second pass corrects for side lobes that the first solution did not couple
        change = _solve(gram, order, _readings(kernel, near, residual[:, k]))
        _remove(residual[:, k], kernel, wide, change)
        for p in range(points):
            turn = np.exp(-2j * np.pi * places[p, k, 0]) / gain[k]
            for m in range(channels):
                amplitude[p, m, k] = (found[p, m] + change[p, m]) * turn
    return amplitude, residual


@inner
def _kernel_near(  # pragma: no cover - compiled
    kernel: Any,
    wide: Any,
    p: int,
    cells: float,
    place: Any,
    moments: Any,
    farthest: int,
    is_whole: bool,
) -> None:
    """Write a point's kernel within ``cells`` of its beat, and its range of bins to ``wide``."""
    low, high = _span(place[1], cells, kernel.shape[2])
    wide[p, 0], wide[p, 1] = low, high
    start = (low - place[1]) / BINS_PER_CELL
    _kernel_into(kernel[p, :, low:high], moments, start, place[2], farthest, is_whole)


@inner
def _gram(kernel: Any, wide: Any, near: Any) -> Any:  # pragma: no cover - compiled
    points = kernel.shape[0]
    out = np.zeros((points, points), dtype=np.complex128)
    for p in range(points):
        for q in range(points):
            low, high = max(near[p, 0], wide[q, 0]), min(near[p, 1], wide[q, 1])
            if low < high:
                out[p, q] = _inner(kernel[p, :, low:high], kernel[q, :, low:high])
        out[p, p] = out[p, p] * (1.0 + REGULARISATION) + 1e-300
    return out


@inner
def _factorize(matrix: Any, order: Any) -> None:  # pragma: no cover - compiled
    """Replace a matrix by its factors L and U; row k of these is row ``order[k]`` of the matrix.

    Gauss's elimination with the largest element of each column, as LAPACK's ``getrf``; numba's
    ``np.linalg.solve`` takes 10 s to compile.
    """
    size = len(order)
    for k in range(size):
        order[k] = k
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        order[k], order[best] = order[best], order[k]
        for j in range(size):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, size):
            matrix[i, k] /= matrix[k, k]
            for j in range(k + 1, size):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]


@inner
def _solve(factors: Any, order: Any, right: Any) -> Any:  # pragma: no cover - compiled
    """Solution ``(row, column)`` of linear equations whose matrix `_factorize` has replaced."""
    size, columns = right.shape
    out = np.empty((size, columns), dtype=np.complex128)
    for m in range(columns):
        for i in range(size):
            total = right[order[i], m]
            for j in range(i):
                total -= factors[i, j] * out[j, m]
            out[i, m] = total
        for i in range(size - 1, -1, -1):
            total = out[i, m]
            for j in range(i + 1, size):
                total -= factors[i, j] * out[j, m]
            out[i, m] = total / factors[i, i]
    return out


@inner
def _readings(kernel: Any, near: Any, spectrum: Any) -> Any:  # pragma: no cover - compiled
    points, channels = kernel.shape[0], spectrum.shape[1]
    out = np.zeros((points, channels), dtype=np.complex128)
    for p in range(points):
        low, high = near[p]
        for m in range(channels):
            out[p, m] = _inner(kernel[p, :, low:high], spectrum[:, m, low:high])
    return out


@inner
def _remove(spectrum: Any, kernel: Any, wide: Any, found: Any) -> None:  # pragma: no cover
    for p in range(kernel.shape[0]):
        low, high = wide[p]
        for m in range(spectrum.shape[1]):
            real, imag = found[p, m].real, found[p, m].imag
            _add_row(spectrum[0, m, low:high], -real, kernel[p, 0, low:high])
            _add_row(spectrum[0, m, low:high], imag, kernel[p, 1, low:high])
            _add_row(spectrum[1, m, low:high], -real, kernel[p, 1, low:high])
            _add_row(spectrum[1, m, low:high], -imag, kernel[p, 0, low:high])


@compiled
def _subtract(  # pragma: no cover - compiled
    spectra: Any,
    places: Any,
    amplitude: Any,
    moments: Any,
    table: Any,
    farthest: int,
    gain: Any,
    is_whole: Any,
) -> None:
    _, ramps, _, bins = spectra.shape
    kernel, wide = np.zeros((1, 2, bins)), np.array([[0, bins]])
    for p in range(places.shape[0]):
        for k in range(ramps):
            place, own = places[p, k], moments[table[k]]
            _kernel_into(kernel[0], own, -place[1] / BINS_PER_CELL, place[2], farthest, is_whole[k])
            turn = np.exp(2j * np.pi * place[0]) * gain[k]
            _remove(spectra[:, k], kernel, wide, amplitude[p : p + 1, :, k] * turn)


@compiled
def _tilts(  # pragma: no cover - compiled
    residual: Any, places: Any, moments: Any, table: Any, farthest: int, gain: Any, is_whole: Any
) -> Any:
    """Least-squares fit of the kernel's derivative to the residual near a beat, cells."""
    _, ramps, channels, bins = residual.shape
    points = places.shape[0]
    out = np.zeros((points, channels, ramps), dtype=np.complex128)
    ahead, behind = np.empty((2, bins)), np.empty((2, bins))
    delta = 1.0 / TABLE_POINTS_PER_CELL
    for p in range(points):
        for k in range(ramps):
            place = places[p, k]
            low, high = _span(place[1], FIT_REACH, bins)
            start = (low - place[1]) / BINS_PER_CELL
            own, whole = moments[table[k]], is_whole[k]
            slope, other = behind[:, : high - low], ahead[:, : high - low]
            _kernel_into(slope, own, start - delta, place[2], farthest, whole)
            _kernel_into(other, own, start + delta, place[2], farthest, whole)
            slope -= other  # a beat fitted δ cells too low leaves δ/(2 delta) of this as residual
            below = _inner(slope, slope).real
            if below > 0.0:
                turn = np.exp(-2j * np.pi * place[0]) * 2.0 * delta / (gain[k] * below)
                for m in range(channels):
                    out[p, m, k] = _inner(slope, residual[:, k, m, low:high]) * turn
    return out
