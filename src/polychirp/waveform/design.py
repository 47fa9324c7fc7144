"""Sweep time and bandwidth for a range and a resolution: equations (7) and (8) of the paper."""

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.units import Hertz, Metres, Seconds
from polychirp.waveform.base import need_positive


def sweep_time(*, slope_factor: float, greatest_range: Metres) -> Seconds:
    r"""Duration, s, of a ramp of ``slope_factor`` times the round trip to ``greatest_range``.

    .. math:: T = \alpha\,\frac{2 R_{max}}{c}

    Equation (7) of the paper. With the paper's :math:`\alpha` of 5 to 6 and its 30 m this is 1.0 to
    1.2 **µs**, while its table 2 lists 1 to 2 **ms**, which needs :math:`\alpha` of 5 000 to
    10 000. The defaults of the waveform families are those of table 2, because only ramps of
    milliseconds resolve the speeds of the paper.

    >>> round(sweep_time(slope_factor=5.5, greatest_range=30.0) * 1e6, 2)
    1.1
    >>> round(sweep_time(slope_factor=5e3, greatest_range=30.0) * 1e3, 2)
    1.0
    """
    need_positive("a sweep", slope_factor=slope_factor, greatest_range=greatest_range)
    return slope_factor * 2.0 * greatest_range / SPEED_OF_LIGHT


def bandwidth_for(range_resolution: Metres) -> Hertz:
    r"""Bandwidth of a ramp that resolves ``range_resolution``, Hz.

    .. math:: B = \frac{c}{2\,\Delta R}

    Equation (8) of the paper.

    >>> round(bandwidth_for(0.15) / 1e6, 1)
    999.3
    """
    need_positive("a sweep", range_resolution=range_resolution)
    return SPEED_OF_LIGHT / (2.0 * range_resolution)
