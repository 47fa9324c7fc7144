"""`PhaseCodedSawtooth`: equal chirps, each with a random phase of a few."""

from dataclasses import dataclass, replace
from typing import Literal

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Hertz, Seconds
from polychirp.waveform.sawtooth import Sawtooth


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseCodedSawtooth(Spec):
    r"""Equal chirps with a phase from chirp to chirp that is drawn from a few equal steps.

    The receiver turns the samples of each chirp back by the phase that was sent. In a schedule this
    is the start phase of the ramp: it is in the echo and in the signal that drives the mixer, and
    cancels in the radar's own echoes. Signals of other radars keep the difference of both codes, so
    that a ghost is spread over all range rates, with :math:`-10\log_{10}K` dB in each of K cells
    on average. A burst of an interferer that crosses has the same power as without a code.

    Echoes of one chirp that arrive in the next are not separated by a code of the receiver: they
    are spread as well.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of the band
    bandwidth : Hz
    ramp_duration : s
    idle : s, silence between the end of a ramp and the start of the next
    num_phases : number of phases, evenly spaced; 2 is a binary code
    direction : whether the frequency rises or falls on a ramp

    Raises
    ------
    InputError
        There are fewer than two phases, a frequency, bandwidth or duration is not positive, or the
        idle time is negative.

    Examples
    --------
    >>> ramps = PhaseCodedSawtooth().schedule(num_sweeps=4, streams=Streams(seed=1))
    >>> plain = Sawtooth(bandwidth=300e6, ramp_duration=20e-6, idle=5e-6, start_frequency=76.5e9)
    >>> same = plain.schedule(num_sweeps=4, streams=Streams(seed=1))
    >>> ((ramps.start_phase - same.start_phase) % 1.0).round(9)
    array([0. , 0.5, 0.5, 0.5])
    """

    kind: Literal["phase-coded-sawtooth"] = "phase-coded-sawtooth"
    start_frequency: Hertz = 76.5e9
    bandwidth: Hertz = 300e6
    ramp_duration: Seconds = 20e-6
    idle: Seconds = 5e-6
    num_phases: int = 2
    direction: Literal["up", "down"] = "up"

    def __post_init__(self) -> None:
        self._plain()
        if self.num_phases < 2:
            raise InputError(
                f"a phase-coded sawtooth needs 2 phases or more, not {self.num_phases}; the "
                "waveform 'sawtooth' has no code"
            )

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` chirps, with a code drawn from this radar's streams."""
        ramps = self._plain().schedule(num_sweeps=num_sweeps, streams=streams)
        code = streams["waveform", "code"].integers(self.num_phases, size=num_sweeps)
        return replace(ramps, start_phase=(ramps.start_phase + code / self.num_phases) % 1.0)

    def _plain(self) -> Sawtooth:
        """The same chirps without a code."""
        return Sawtooth(
            start_frequency=self.start_frequency,
            bandwidth=self.bandwidth,
            ramp_duration=self.ramp_duration,
            idle=self.idle,
            direction=self.direction,
        )
