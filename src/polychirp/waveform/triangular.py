"""Triangular waveforms, with given slopes (`Triangular`) and with random slopes.

`DiverseTriangular` draws a slope for every sweep, and `FixedTriangular` one per radar.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.ramp import RampSchedule, continuous_phase
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Hertz, Seconds
from polychirp.waveform.base import need_limits, need_not_negative, need_positive, need_sweeps

Order = Literal["up-first", "down-first"]


def triangles(
    *,
    start_frequency: FloatArray,
    bandwidth: FloatArray,
    ramp_duration: FloatArray,
    is_up_first: BoolArray,
    idle: float,
) -> RampSchedule:
    r"""Schedule of triangles, each an up- and a down-ramp of equal duration.

    .. math:: \beta = \pm\frac{B}{T}

    Equation (6) of the paper, with T the duration of **one ramp**: a triangle lasts 2T.

    Parameters
    ----------
    start_frequency : Hz, ``(sweep,)``, lowest frequency of each triangle
    bandwidth : Hz, ``(sweep,)``
    ramp_duration : s, ``(sweep,)``
    is_up_first : ``(sweep,)``, true if the up-ramp comes first
    idle : s, silence after every triangle

    Examples
    --------
    >>> import numpy as np
    >>> ramps = triangles(start_frequency=np.array([79e9]), bandwidth=np.array([1e9]),
    ...     ramp_duration=np.array([1e-3]), is_up_first=np.array([True]), idle=0.0)
    >>> ramps.slope / 1e12, ramps.stop_frequency / 1e9
    (array([ 1., -1.]), array([80., 79.]))
    """
    num_sweeps = bandwidth.size
    starts_low = np.stack([is_up_first, ~is_up_first], axis=-1)
    start_of_ramp = start_frequency[:, None] + np.where(starts_low, 0.0, bandwidth[:, None])
    slope = np.where(starts_low, 1.0, -1.0) * (bandwidth / ramp_duration)[:, None]
    duration = np.repeat(ramp_duration, 2)
    start_of_sweep = np.concatenate([[0.0], np.cumsum(2.0 * ramp_duration + idle)[:-1]])
    start_time = start_of_sweep[:, None] + np.stack([0.0 * ramp_duration, ramp_duration], axis=-1)
    return RampSchedule(
        start_time=start_time.ravel(),
        duration=duration,
        start_frequency=start_of_ramp.ravel(),
        slope=slope.ravel(),
        start_phase=continuous_phase(
            duration=duration, start_frequency=start_of_ramp.ravel(), slope=slope.ravel()
        ),
        sweep=np.repeat(np.arange(num_sweeps), 2),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Triangular(Spec):
    """Conventional triangular FMCW: all triangles of all radars are equal.

    The defaults are the middle values of the paper's table 2.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of the band
    bandwidth : Hz
    ramp_duration : s, of one ramp; a triangle lasts twice as long
    idle : s, silence between triangles
    order : which ramp of a triangle comes first

    Raises
    ------
    InputError
        A frequency, bandwidth or duration is not positive, or the idle time is negative.

    Examples
    --------
    >>> from polychirp.rng import Streams
    >>> ramps = Triangular().schedule(num_sweeps=16, streams=Streams(seed=1))
    >>> ramps.num_ramps, round(float(ramps.end_time[-1]) * 1e3, 9)
    (32, 48.0)
    """

    kind: Literal["triangular"] = "triangular"
    start_frequency: Hertz = 79e9
    bandwidth: Hertz = 900e6
    ramp_duration: Seconds = 1.5e-3
    idle: Seconds = 0.0
    order: Order = "up-first"

    def __post_init__(self) -> None:
        need_positive(
            "a triangle",
            start_frequency=self.start_frequency,
            bandwidth=self.bandwidth,
            ramp_duration=self.ramp_duration,
        )
        need_not_negative("a triangle", idle=self.idle)

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` triangles, without random numbers."""
        del streams
        need_sweeps(num_sweeps)
        return triangles(
            start_frequency=np.full(num_sweeps, self.start_frequency),
            bandwidth=np.full(num_sweeps, self.bandwidth),
            ramp_duration=np.full(num_sweeps, self.ramp_duration),
            is_up_first=np.full(num_sweeps, self.order == "up-first"),
            idle=self.idle,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class DiverseTriangular(Spec):
    """The paper's proposal: ramp duration and bandwidth are drawn anew for every triangle.

    Every quantity is uniformly distributed between its limits, and has its own random stream, so
    that a change of one limit does not change other draws. The defaults are those of table 2.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency a triangle can reach
    start_frequency_spread : Hz, greatest random increase of a triangle's lowest frequency
    bandwidth, ramp_duration : Hz and s, lower and upper limit of the draws
    idle : s, silence between triangles
    random_order : if true, the first ramp of every triangle is up or down at random; else it is up

    Raises
    ------
    InputError
        Limits are inverted or not positive, or the spread or the idle time is negative.

    Examples
    --------
    >>> from polychirp.rng import Streams
    >>> ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(seed=1))
    >>> len(set(ramps.slope))
    32
    """

    kind: Literal["diverse-triangular"] = "diverse-triangular"
    start_frequency: Hertz = 79e9
    start_frequency_spread: Hertz = 0.0
    bandwidth: tuple[Hertz, Hertz] = (800e6, 1000e6)
    ramp_duration: tuple[Seconds, Seconds] = (1e-3, 2e-3)
    idle: Seconds = 0.0
    random_order: bool = False

    def __post_init__(self) -> None:
        owner = "a diverse triangle"
        need_positive(owner, start_frequency=self.start_frequency)
        need_limits(owner, bandwidth=self.bandwidth, ramp_duration=self.ramp_duration)
        need_not_negative(owner, start_frequency_spread=self.start_frequency_spread, idle=self.idle)

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` triangles, drawn from this radar's streams."""
        need_sweeps(num_sweeps)
        extra = streams["waveform", "start_frequency"].uniform(
            0.0, self.start_frequency_spread, num_sweeps
        )
        heads = streams["waveform", "order"].random(num_sweeps) < 0.5
        return triangles(
            start_frequency=self.start_frequency + extra,
            bandwidth=streams["waveform", "bandwidth"].uniform(*self.bandwidth, num_sweeps),
            ramp_duration=streams["waveform", "ramp_duration"].uniform(
                *self.ramp_duration, num_sweeps
            ),
            is_up_first=heads if self.random_order else np.ones(num_sweeps, dtype=np.bool_),
            idle=self.idle,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedTriangular(Spec):
    """One draw of ramp duration and bandwidth per radar, the same for every triangle.

    It is the fair comparison for `DiverseTriangular`: radars differ from each other, but no radar
    changes from sweep to sweep. Draws are uniformly distributed between their limits.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of the band
    bandwidth, ramp_duration : Hz and s, lower and upper limit of the draw
    idle : s, silence between triangles
    order : which ramp of a triangle comes first

    Raises
    ------
    InputError
        Limits are inverted or not positive, or the idle time is negative.

    Examples
    --------
    >>> from polychirp.rng import Streams
    >>> ramps = FixedTriangular().schedule(num_sweeps=16, streams=Streams(seed=1))
    >>> len(set(abs(ramps.slope)))
    1
    """

    kind: Literal["fixed-per-radar"] = "fixed-per-radar"
    start_frequency: Hertz = 79e9
    bandwidth: tuple[Hertz, Hertz] = (800e6, 1000e6)
    ramp_duration: tuple[Seconds, Seconds] = (1e-3, 2e-3)
    idle: Seconds = 0.0
    order: Order = "up-first"

    def __post_init__(self) -> None:
        owner = "a triangle fixed per radar"
        need_positive(owner, start_frequency=self.start_frequency)
        need_limits(owner, bandwidth=self.bandwidth, ramp_duration=self.ramp_duration)
        need_not_negative(owner, idle=self.idle)

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` equal triangles, drawn once from this radar's streams."""
        drawn = Triangular(
            start_frequency=self.start_frequency,
            bandwidth=float(streams["waveform", "bandwidth"].uniform(*self.bandwidth)),
            ramp_duration=float(streams["waveform", "ramp_duration"].uniform(*self.ramp_duration)),
            idle=self.idle,
            order=self.order,
        )
        return drawn.schedule(num_sweeps=num_sweeps, streams=streams)
