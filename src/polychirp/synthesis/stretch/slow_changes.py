r"""Changes of links within a ramp that are slow against the IF filter.

The engine takes a link's beat as a chirp of constant amplitude a. Two small factors remain. The
amplitude changes at the rate :math:`\dot a` from its value at the time :math:`t_0` of the paths.
A delay with the acceleration :math:`\ddot\tau` gives the beat a cubic phase. On a ramp of the
duration 2h, with the time x from its middle, `path_kernels.beat_of` leaves of it

.. math:: 2\pi q\,c(x), \qquad q = \tfrac12 g\,\ddot\tau, \qquad c(x) = x^3 - \tfrac34 h^2 x

with the transmitted ramp's slope g. Both factors change little while the filter's window of length
S lasts. So they multiply the filtered beat :math:`y_p` of link p:

.. math:: \sum_p \bigl(a_p + \dot a_p (t - t_0) + j2\pi q_p a_p\,c(x)\bigr)\,y_p(t)
          = \sum_p a_p y_p(t) + (t - t_0) \sum_p \dot a_p y_p(t) + c(x) \sum_p j2\pi q_p a_p y_p(t)

Each sum is a contribution with other amplitudes. Neglected are the product of the small factors,
the square of the cubic phase, and the factors' change within a window, at most :math:`\dot a S/2`.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.synthesis.stretch.kernel_records import LinkTable, Tables
from polychirp.synthesis.stretch.kernel_tables import with_limits

NEGLIGIBLE_CHANGE: Final = 1e-6
"""Limit of the omitted part of these changes, relative to the rms of the strongest samples; chosen:
−120 dB."""


GREATEST_FADE: Final = 1.5
"""Greatest change of an amplitude, over itself, in an interval of the snapshots, which may be that
of a fade; chosen: a fade changes by 1, and the antenna may add to it."""


class SlowChange(NamedTuple):
    """A sum with other amplitudes, to be multiplied by ``factor`` (ramp, sample).

    ``floor``, V, is what the sum may leave out.
    """

    tables: Tables
    factor: FloatArray
    floor: float


def slow_changes(tables: Tables, strongest: float) -> list[SlowChange]:
    """Changes that are not negligible against the ``strongest`` samples, V rms."""
    found = (_drift(tables), _cubic_phase(tables))
    return [
        SlowChange(changed._replace(links=with_limits(links, floor)), factor, floor)
        for changed, factor in found
        if (floor := NEGLIGIBLE_CHANGE * strongest / max(_largest(factor), 1e-300)) > 0.0
        and (links := _strong_enough(changed.links, floor)).delay.size
    ]


def _largest(factor: FloatArray) -> float:
    return float(np.max(np.abs(factor), initial=0.0))


def _drift(tables: Tables) -> tuple[Tables, FloatArray]:
    """Rates of the amplitudes, V/s, and the times since the paths' own time, s.

    A rate that would change an amplitude by more than itself is left out: the path is a sum of
    contributions that do not stay in phase for so long, and its drift is valid for less. A path
    that fades in or out changes by itself in one interval of the snapshots at most, and together
    with the path that replaces it not at all, so that neither may lose its rate on longer ramps.
    """
    links = tables.links
    since = tables.own.start - links.reference_time[links.snapshot]
    factor = since[:, None] + _times(tables)
    interval = float(np.min(np.diff(np.sort(links.reference_time)), initial=np.inf))
    least = min(_largest(factor), interval / GREATEST_FADE)
    is_valid = np.abs(links.amplitude_rate) * least <= np.abs(links.amplitude)
    rate = np.where(is_valid, links.amplitude_rate, 0.0)
    return tables._replace(links=links._replace(amplitude=rate)), factor


def _cubic_phase(tables: Tables) -> tuple[Tables, FloatArray]:
    """Amplitudes times 2πjq over c's unit, and c, s³; the slopes are in the elements' weights."""
    links, sent = tables.links, tables.sent
    steepest = max(float(np.max(np.abs(sent.slope), initial=0.0)), 1e-300)
    amplitude = 1j * math.pi * steepest * links.delay_acceleration * links.amplitude
    weight: ComplexArray = np.ascontiguousarray(sent.weight * (sent.slope / steepest)[:, None])
    half = 0.5 * tables.own.duration[:, None]
    x = _times(tables) - half
    changed = tables._replace(
        links=links._replace(amplitude=amplitude), sent=sent._replace(weight=weight)
    )
    return changed, x * (x * x - 0.75 * half * half)


def _times(tables: Tables) -> FloatArray:
    """Times of samples from the starts of their ramps, s ``(ramp, sample)``; 0 after the last."""
    window = tables.window
    number = np.arange(int(np.max(window.num_samples, initial=0)))
    times = window.first[:, None] + number * window.step
    return np.where(number < window.num_samples[:, None], times, 0.0)


def _strong_enough(links: LinkTable, floor: float) -> LinkTable:
    """The links without those whose sum cannot reach ``floor``, V, in any snapshot."""
    keep: BoolArray = np.zeros(links.delay.size, dtype=np.bool_)
    start = [0]
    for low, high in zip(links.start[:-1], links.start[1:], strict=True):
        some = np.abs(links.amplitude[low:high])
        keep[low:high] = some > 0.25 * floor / math.sqrt(max(some.size, 1))
        start.append(start[-1] + int(np.count_nonzero(keep[low:high])))
    columns = {
        name: getattr(links, name)[keep]
        for name in LinkTable._fields
        if name not in ("start", "reference_time", "snapshot")
    }
    return links._replace(start=np.array(start, dtype=np.int64), **columns)
