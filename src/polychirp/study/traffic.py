"""`StudyTraffic` — random traffic of a study, and the radars of its vehicles."""

from dataclasses import dataclass

from polychirp.errors import InputError
from polychirp.traffic.random_traffic import RandomTraffic
from polychirp.units import Fraction, Seconds
from polychirp.waveform import AnyWaveform


@dataclass(frozen=True, kw_only=True)
class StudyTraffic(RandomTraffic):
    """Random traffic in which some carriers have a copy of the study's first radar.

    These interferers are in the middle of the front bumpers of the first carriers. The street does
    not depend on their number.

    Parameters
    ----------
    num_interferers : number of carriers with a radar
    are_silent : true if these radars are there but do not transmit, for comparison: the paths are
        then those of the study in which they do, and need not be traced again
    start_spread : s; each interferer starts up to this later than the first radar, drawn uniformly
    clock_spread : each interferer's relative clock error is drawn uniformly between minus and plus
        this value
    waveform : waveform of the interferers; if not given, that of the first radar

    Examples
    --------
    >>> from polychirp.traffic.random_traffic import Lane
    >>> traffic = StudyTraffic(
    ...     lanes=(Lane(y=3.5),), num_carriers=3, num_interferers=2, seen_from="ego"
    ... )
    >>> traffic.carrier_names
    ('carrier-1', 'carrier-2', 'carrier-3')
    """

    num_interferers: int = 0
    are_silent: bool = False
    start_spread: Seconds = 0.0
    clock_spread: Fraction = 0.0
    waveform: AnyWaveform | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.num_interferers < 0:
            raise InputError(f"num_interferers is {self.num_interferers}; use 0 or more")
        if self.num_interferers > self.num_carriers:
            raise InputError(
                f"num_interferers is {self.num_interferers}, but only {self.num_carriers} "
                "carriers can have a radar; raise 'num_carriers' or lower 'num_interferers'"
            )
        if not (self.start_spread >= 0 and 0 <= self.clock_spread < 0.01):
            raise InputError(
                "random traffic needs a start spread of 0 s or more and a clock spread of 0 or "
                "more and below 10 000 ppm"
            )
