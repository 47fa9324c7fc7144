r"""Measures of a method of mitigation on one frame, in the range-Doppler map.

The map is the Hann-windowed spectrum over samples and, from eight equal ramps on, over ramps. Only
beats of the sign that echoes have are used, up to half the sample rate, or up to the sample rate
where echoes lie there. Ramps that differ have a row each instead, the spectrum
of their own samples. *Objects* are the local maxima of the map E of the echoes alone, multipath
included, that are at most 40 dB below the greatest and 13 dB or more above the noise; *empty* cells
are those in which E is 10 dB or more below the noise. With the map S after the method and the map C
of the frame without interference (echo and noise, as the clean oracle has it):

========================  ========================================================================
``sinr_range``            mean power of S in the objects' cells (±2) of their range cuts, over that
                          of the cuts' empty cells; dB, mean over the objects
``sinr_velocity``         the same along the cuts over range rate, which are rings; NaN without
                          rates
``evm``                   :math:`|S - C| / |C|` in the objects' cells, rms over objects and channels
``phase_error``           :math:`|\arg(S \overline{C})|`, rad, mean over objects and channels;
                          between channels it is an error of the azimuth
``floor_rise``            mean power of S over that of C in empty cells, dB
``detection``             share of the objects above the power that one in 100 empty cells of S
                          exceeds: Pd at the measured false-alarm probability 0.01
``ghosts``                local maxima of S in empty cells above the threshold of the clean frame's
                          noise for 10⁻⁶ per cell
``missed``                share of the objects below that threshold
``lost``                  share of the samples without weight after the method
========================  ========================================================================

Samples without weight count as zeros, so that a method that leaves out a quarter of the samples has
an EVM of a quarter; the receivers of polychirp divide by the weights, which restores the mean.
SINR alone misleads: a method that lowers everything, echoes too, has a good one and a bad EVM.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.signal_model.equal_ramps import unequal
from polychirp.units import from_db, to_db

LEAST_RAMPS: Final = 8
"""Number of equal ramps from which a map has an axis of range rates."""

DEPTH: Final = from_db(40.0)
"""Greatest ratio of the strongest object's power to that of an object; chosen."""

LEAST_SNR: Final = from_db(13.0)
"""Least ratio of an object's power to the noise's in a cell; chosen."""

EMPTY_RATIO: Final = 0.1
"""Greatest ratio of the echoes' power to the noise's in an empty cell; chosen."""

LOBE_CELLS: Final = 2
"""Cells beside an object that count as its own; chosen: the main lobe of a Hann window."""

FALSE_ALARMS: Final = 0.01
"""Share of the empty cells above the threshold of ``detection``. Chosen: a single ramp has few
hundreds of them."""

GHOST_PROBABILITY: Final = 1e-6
"""False-alarm probability per cell of the threshold of ``ghosts`` and ``missed``; chosen."""

MEASURES: Final = (
    "sinr_range",
    "sinr_velocity",
    "evm",
    "phase_error",
    "floor_rise",
    "detection",
    "ghosts",
    "missed",
    "lost",
)
"""Names of the measures, in the order of the table above."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredFrame:
    """A frame with what the measures compare: maps ``(channel, range rate, range)`` and masks.

    Parameters
    ----------
    frame, clean : the frame, and the same without interference
    clean_map : C
    objects : cells of the objects, ``(object, 2)``
    empty : mask of the empty cells, ``(range rate, range)``
    threshold : power of ``ghosts`` and ``missed``
    whole_band : beats up to the sample rate are in the maps
    """

    frame: IfFrame
    clean: IfFrame
    clean_map: ComplexArray
    objects: np.ndarray[tuple[int, int], np.dtype[np.int64]]
    empty: BoolArray
    threshold: float
    whole_band: bool = False

    def map_of(self, samples: ComplexArray) -> ComplexArray:
        """Map ``(channel, range rate, range)`` of samples of the frame."""
        return range_rate_map(self.frame, samples, whole_band=self.whole_band)


def measured_frame(frame: IfFrame, parts: IfParts, *, whole_band: bool = False) -> MeasuredFrame:
    """A frame with its maps, objects and empty cells, from its parts.

    ``whole_band`` takes in beats from half the sample rate up to all of it.
    """
    from scipy.special import gammainccinv

    kept = [n for n, name in enumerate(parts.names) if name not in ("direct", "indirect")]
    clean = frame.with_samples(parts.samples[kept].sum(axis=0))
    map_of = partial(range_rate_map, frame, whole_band=whole_band)
    echo = _power(map_of(parts.echo))
    noise = float(np.mean(_power(map_of(parts.noise))))
    least = max(float(echo.max()) / DEPTH, LEAST_SNR * noise)
    looks = len(frame.samples)
    return MeasuredFrame(
        frame=frame,
        clean=clean,
        clean_map=map_of(clean.samples),
        objects=np.argwhere(local_maxima(echo, has_rates=has_rates(frame)) & (echo >= least)),
        empty=echo < EMPTY_RATIO * noise,
        threshold=noise * float(gammainccinv(looks, GHOST_PROBABILITY)) / looks,
        whole_band=whole_band,
    )


def measures(on: MeasuredFrame, treated: Mitigated) -> dict[str, float]:
    """All `MEASURES` of a method's result on a frame; NaN where the frame has no object."""
    found = on.map_of(treated.samples)
    power, before = _power(found), _power(on.clean_map)
    row, column = on.objects.T
    here, there = found[:, row, column], on.clean_map[:, row, column]
    floor = float(np.mean(power[on.empty]))
    high = float(np.quantile(power[on.empty], 1.0 - FALSE_ALARMS))
    rates = has_rates(on.frame)
    ghosts = local_maxima(power, has_rates=rates) & on.empty & (power > on.threshold)
    present = on.frame.times.is_sample
    return {
        "sinr_range": _mean(
            [_cut(power[r], on.empty[r], _on_line(c, power.shape[1])) for r, c in on.objects]
        ),
        "sinr_velocity": _mean(
            [
                _cut(power[:, c], on.empty[:, c], _on_ring(r, power.shape[0]))
                for r, c in on.objects
                if rates
            ]
        ),
        "evm": math.sqrt(_mean((np.abs(here - there) ** 2 / np.abs(there) ** 2).ravel())),
        "phase_error": _mean(np.abs(np.angle(here * there.conj())).ravel()),
        "floor_rise": float(to_db(floor / float(np.mean(before[on.empty])))),
        "detection": _mean(power[row, column] > high),
        "ghosts": float(np.count_nonzero(ghosts)),
        "missed": _mean(power[row, column] < on.threshold),
        "lost": float(np.mean(treated.weight[present] == 0.0)),
    }


def has_rates(frame: IfFrame) -> bool:
    """True if a frame's map has an axis of range rates: its ramps are equal, and many."""
    return frame.schedule.num_ramps >= LEAST_RAMPS and not unequal(frame.schedule)


def range_rate_map(
    frame: IfFrame, samples: ComplexArray, *, whole_band: bool = False
) -> ComplexArray:
    """Hann-windowed spectrum over ramps and samples ``(channel, range rate, range)``.

    Ranges are the beats of the sign of the slope, from the first bin to the last one below half
    the sample rate, or to the last one of all with ``whole_band``. Fewer equal ramps than
    `LEAST_RAMPS`: the first alone. Unequal ramps: a row each, ``(channel, ramp, range)``.
    """
    from scipy import fft

    ramps, length = samples.shape[1:]
    if ramps > 1 and unequal(frame.schedule):
        return _map_of_ramps(frame, samples, whole_band=whole_band)
    bins = _bins(length, whole_band=whole_band) * (1 if frame.schedule.slope[0] > 0 else -1)
    if ramps < LEAST_RAMPS:
        return np.asarray(fft.fft(samples[:, :1] * _hann(length), axis=2)[:, :, bins])
    over_range = fft.fft(samples * _hann(length), axis=2)[:, :, bins]
    return np.asarray(fft.fft(over_range * _hann(ramps)[:, None], axis=1))


def _bins(length: int, *, whole_band: bool) -> IntArray:
    """Bins of the beats of a map's ranges."""
    return np.arange(1, length if whole_band else length // 2)


def _map_of_ramps(frame: IfFrame, samples: ComplexArray, *, whole_band: bool) -> ComplexArray:
    """Spectrum of every ramp with a window of its own length, ``(channel, ramp, range)``."""
    from scipy import fft

    ramps, length = samples.shape[1:]
    window = np.zeros((ramps, length))
    for k, count in enumerate(frame.times.num_samples):
        window[k, :count] = _hann(count)
    sign = np.where(frame.schedule.slope > 0, 1, -1)[:, None]
    bins = sign * _bins(length, whole_band=whole_band)
    spectrum = fft.fft(samples * window, axis=2)
    return np.asarray(spectrum[:, np.arange(ramps)[:, None], bins])


def local_maxima(power: FloatArray, *, has_rates: bool) -> BoolArray:
    """Mask of the cells ``(range rate, range)`` that no neighbour exceeds; rates are a ring.

    Without rates the rows are ramps, each of which has maxima of its own.
    """
    from scipy.ndimage import maximum_filter

    size = (3 if has_rates else 1, 3)
    return np.asarray(power >= maximum_filter(power, size=size, mode=("wrap", "nearest")))


def _on_ring(place: int, size: int) -> IntArray:
    """Cells of the main lobe around a place of a cut over range rate."""
    return np.arange(place - LOBE_CELLS, place + LOBE_CELLS + 1) % size


def _on_line(place: int, size: int) -> IntArray:
    """Cells of the main lobe around a place of a cut over range.

    A cell beyond the end is replaced by its mirror image, as the main lobe is symmetric. The mean
    of the strongest cells alone would be 1.4 dB too great for an object in the last cell.
    """
    cells = np.arange(place - LOBE_CELLS, place + LOBE_CELLS + 1)
    return np.where((cells >= 0) & (cells < size), cells, np.clip(2 * place - cells, 0, size - 1))


def _cut(power: FloatArray, empty: BoolArray, around: IntArray) -> float:
    """Power in the cells ``around`` of a cut over that of its empty cells, dB; NaN without them."""
    if not empty.any():
        return math.nan
    return float(to_db(np.mean(power[around]) / np.mean(power[empty])))


def _power(amplitude: ComplexArray) -> FloatArray:
    return np.asarray(np.mean(amplitude.real**2 + amplitude.imag**2, axis=0))


def _mean(values: object) -> float:
    """Mean without NaN; NaN of nothing."""
    array = np.asarray(values, dtype=np.float64)
    array = array[~np.isnan(array)]
    return float(np.mean(array)) if array.size else math.nan


def _hann(length: int) -> FloatArray:
    return np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
