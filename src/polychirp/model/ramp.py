"""`RampSchedule`: the ramps that a radar transmits, of any waveform family."""

from dataclasses import dataclass, field, replace
from typing import Annotated, Self

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, PerRamp, PerRampIndex, seal
from polychirp.errors import InputError
from polychirp.model.ramp_code import RampCode


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RampSchedule:
    r"""The ramps of one radar in one frame, in order of time.

    On ramp k, at :math:`t_k \le t < t_k + T_k`, the transmitted phase in cycles is

    .. math:: \varphi(t) = \varphi_k + f_k (t - t_k) + \tfrac12 b_k (t - t_k)^2

    with :math:`f_k` an absolute radio frequency; nothing is sent between ramps. The transmitting
    element l of the radar's array sends :math:`w_{kl}\,e^{j2\pi\varphi(t)}`, at full power for
    :math:`|w_{kl}| = 1`: every element has an amplifier of its own. The mixer's other input is
    the oscillator's signal, without weights.

    A ramp may carry a code: chips that multiply the transmitted signal and not the oscillator's
    (`RampCode`). A signal that is no ramp is one of slope zero with chips: phase-modulated
    continuous waves have chips of ±1, noise has drawn complex ones.

    Parameters
    ----------
    start_time, duration : s, ``(ramp,)``
    start_frequency : Hz, ``(ramp,)``, radio frequency at the ramp's start
    slope : Hz/s, ``(ramp,)``, negative for a down-ramp
    start_phase : cycles, ``(ramp,)``, see `continuous_phase`
    sweep : ``(ramp,)``, number of the sweep (triangle) to which the ramp belongs
    transmit_weight : w, ``(ramp, element)`` complex, at most 1 in magnitude; by default the first
        element alone, at full power
    code : chips within the ramps, the same on all transmitting elements; None for none

    Raises
    ------
    InputError
        The schedule has no ramp; a ramp has no positive duration, reaches zero frequency, is
        shorter than its code, or starts before the previous one ends; or an element's weight is
        above 1 in magnitude.

    Examples
    --------
    >>> ramps = RampSchedule(start_time=[0.0, 1e-3], duration=[1e-3, 1e-3],
    ...     start_frequency=[79e9, 80e9], slope=[1e12, -1e12], start_phase=[0, 0], sweep=[0, 0])
    >>> ramps.num_ramps, float(ramps.stop_frequency[1] / 1e9)
    (2, 79.0)
    """

    start_time: PerRamp
    duration: PerRamp
    start_frequency: PerRamp
    slope: PerRamp
    start_phase: PerRamp
    sweep: PerRampIndex
    transmit_weight: Annotated[ComplexArray, Axes("ramp", "element", dtype=np.complex128)] = field(
        default_factory=lambda: np.ones((0, 1), dtype=np.complex128)
    )
    code: RampCode | None = None

    def __post_init__(self) -> None:
        if not np.size(self.transmit_weight):
            object.__setattr__(self, "transmit_weight", np.ones((np.size(self.start_time), 1)))
        seal(self)
        if self.num_ramps == 0:
            raise InputError("a schedule needs at least one ramp")
        if not np.all(self.duration > 0):
            raise InputError(f"ramp {int(np.argmin(self.duration))} has no duration; give it one")
        if not np.all(np.minimum(self.start_frequency, self.stop_frequency) > 0):
            raise InputError("a ramp reaches zero frequency; lower its bandwidth or reverse it")
        # 1e-9 (chosen) allows for phase factors that rounding makes greater than 1
        if not np.all(np.abs(self.transmit_weight) <= 1.0 + 1e-9):
            raise InputError("a transmitting element's weight is above 1; 1 is full power")
        if self.code is not None:
            _need_room(self.code, self.duration)
        overlap = self.end_time[:-1] - self.start_time[1:]
        # an overlap of up to 1e-12 s, or 1e-12 of a time above 1 s, is taken as rounding
        worst = int(np.argmax(overlap)) if overlap.size else 0
        if overlap.size and overlap[worst] > 1e-12 * max(1.0, abs(self.end_time[worst])):
            raise InputError(
                f"ramp {worst + 1} starts {overlap[worst]:.3g} s before ramp {worst} ends; "
                f"start it later or shorten ramp {worst}"
            )

    @property
    def num_ramps(self) -> int:
        """Number of ramps."""
        return int(self.start_time.size)

    @property
    def num_elements(self) -> int:
        """Number of transmitting elements with a weight."""
        return int(self.transmit_weight.shape[1])

    @property
    def end_time(self) -> FloatArray:
        """Ends of the ramps, s, ``(ramp,)``."""
        return self.start_time + self.duration

    @property
    def stop_frequency(self) -> FloatArray:
        """Radio frequency at the end of each ramp, Hz, ``(ramp,)``."""
        return self.start_frequency + self.slope * self.duration

    @property
    def centre_frequency(self) -> FloatArray:
        """Radio frequency in the middle of each ramp, Hz, ``(ramp,)``."""
        return self.start_frequency + 0.5 * self.slope * self.duration

    @property
    def bandwidth(self) -> FloatArray:
        """Width of the band that each ramp covers, Hz, ``(ramp,)``, never negative.

        It is that of the sweep, or that of the code if that is more.
        """
        swept = np.abs(self.slope * self.duration)
        return swept if self.code is None else np.maximum(swept, self.code.bandwidth)

    @property
    def is_stepped(self) -> bool:
        """True if all ramps hold their frequencies, which differ, and carry no code.

        1e-6 of the band (chosen) allows for a clock that drifts.
        """
        steps = float(np.ptp(self.start_frequency))
        return self.code is None and float(np.max(self.bandwidth)) < 1e-6 * steps

    @property
    def resolving_bandwidth(self) -> FloatArray:
        """Band that resolves ranges on each ramp, Hz, ``(ramp,)``.

        It is the `bandwidth` of the ramp; if all ramps are steps, that from the lowest step to the
        highest one.
        """
        if self.is_stepped:
            return np.full(self.num_ramps, float(np.ptp(self.start_frequency)))
        return self.bandwidth

    @property
    def occupied(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest frequency of each ramp, Hz ``(ramp,)``, with the band of its code.

        A code adds half of its bandwidth on both sides of the sweep.
        """
        beside = 0.0 if self.code is None else 0.5 * self.code.bandwidth
        ends = self.start_frequency, self.stop_frequency
        return np.minimum(*ends) - beside, np.maximum(*ends) + beside

    def as_clocked(
        self, *, start_time: float = 0.0, clock_offset: float = 0.0, clock_drift: float = 0.0
    ) -> Self:
        r"""The same schedule, started late, on a clock with a frequency error and a drift.

        A clock that is fast by the ratio δ completes the schedule in 1/(1+δ) of its time, at (1+δ)
        times its frequencies. With a drift ρ, the clock shows u and runs at the rate r, t seconds
        after the start:

        .. math:: u(t) = (1+\delta)\,t + \tfrac12\rho t^2, \qquad
                  r(u) = \dot u = \sqrt{(1+\delta)^2 + 2\rho u}

        and the transmitted phase is that of the schedule at u: a ramp scheduled for :math:`u_k`
        starts when the clock shows that time, at :math:`f' = r_k f`, with
        :math:`b' = r_k^2 b + \rho f`; phases in cycles are unchanged. The remaining cubic phase,
        :math:`\tfrac12 \rho r b s^3` at s seconds into a ramp, is neglected: at the end of a ramp
        of bandwidth B it is BρT²/2, 1e-3 cycles for 1 GHz, 1.4 ms and ρ = 1e-6/s.

        Parameters
        ----------
        start_time : s, added after the clock has scaled the schedule
        clock_offset : ratio δ, the clock's relative frequency error at the start, positive if fast
        clock_drift : 1/s, ρ, change of that error per second

        Raises
        ------
        InputError
            The drift would stop the clock before the schedule ends.

        Examples
        --------
        >>> ramps = RampSchedule(start_time=[0.0, 1.0], duration=[1e-3, 1e-3],
        ...     start_frequency=[79e9, 79e9], slope=[1e12, 1e12], start_phase=[0, 0], sweep=[0, 1])
        >>> late = ramps.as_clocked(clock_drift=1e-6)
        >>> (late.start_frequency - ramps.start_frequency).round(-2)
        array([    0., 79000.])
        """
        if not np.all((1.0 + clock_offset) ** 2 + 2.0 * clock_drift * self.end_time > 0):
            raise InputError(
                f"with a drift of {clock_drift:g} per second, a clock stands still before the "
                "schedule ends; use a smaller drift"
            )
        base = 1.0 + clock_offset
        rate = np.sqrt(base**2 + 2.0 * clock_drift * self.start_time)
        # t = (r − r₀)/ρ is computed as 2u/(r₀ + r), which works for ρ = 0 and loses no digits
        ends = np.sqrt(rate**2 + 2.0 * clock_drift * self.duration)
        faster = 0.5 * (rate + ends)
        code = self.code
        if code is not None:
            code = replace(code, chip_duration=code.chip_duration / faster)
        return replace(
            self,
            code=code,
            start_time=self.start_time / (0.5 * (base + rate)) + start_time,
            duration=self.duration / faster,
            start_frequency=self.start_frequency * rate,
            slope=self.slope * rate**2 + clock_drift * self.start_frequency,
        )

    def with_late_sweeps(self, delay: FloatArray) -> Self:
        """The same ramps, with every sweep started late by its own ``delay``.

        Phases at the ramps' starts are unchanged, and the radar's own sample times move with its
        ramps. So only the beats of other radars' signals and of moving targets change. ``delay``
        (s) is ``(sweep,)``, negative for a sweep that starts early. `InputError` is raised if a
        ramp starts before the previous one ends, or there are fewer delays than sweeps.
        """
        if self.sweep.max() >= delay.size:
            raise InputError(
                f"{delay.size} delays are too few for {self.sweep.max() + 1} sweeps; "
                "give one to each"
            )
        start = self.start_time + delay[self.sweep]
        early = start[1:] - (start[:-1] + self.duration[:-1])
        worst = int(np.argmin(early)) if early.size else 0
        if early.size and early[worst] < -1e-12 * max(1.0, abs(start[worst + 1])):
            raise InputError(
                f"jitter starts sweep {self.sweep[worst + 1]} {-early[worst]:.3g} s before sweep "
                f"{self.sweep[worst]} ends; leave more idle time between sweeps or jitter less"
            )
        return replace(self, start_time=start)


def _need_room(code: RampCode, duration: FloatArray) -> None:
    """Refuse a code that is not of these ramps, or is longer than one of them."""
    if code.row.size != duration.size:
        raise InputError(
            f"a code of {code.row.size} ramps is given to {duration.size} ramps; give each ramp one"
        )
    short = int(np.argmin(duration - code.period))
    if duration[short] < code.period[short] * (1 - 1e-9):
        raise InputError(
            f"ramp {short} lasts {duration[short] * 1e6:.4g} µs, shorter than its code of "
            f"{code.num_chips} chips, which lasts {code.period[short] * 1e6:.4g} µs; lengthen the "
            "ramp, or use fewer or shorter chips"
        )


def continuous_phase(
    *, duration: FloatArray, start_frequency: FloatArray, slope: FloatArray
) -> FloatArray:
    """Start phases, cycles ``(ramp,)``, of an oscillator whose phase does not jump between ramps.

    Idle time between ramps does not advance the phase. This has no effect on a radar's own echoes:
    the start phase of a ramp is in both the echo and the oscillator, and cancels in the mixer.

    Examples
    --------
    >>> start, slope = np.full(2, 79.00006e9), np.full(2, 1.2e13)
    >>> duration = np.full(2, 1e-5)
    >>> phase = continuous_phase(duration=duration, start_frequency=start, slope=slope)
    >>> phase.round(6)
    array([0. , 0.6])
    """
    advance = start_frequency * duration + 0.5 * slope * duration**2
    return np.concatenate([[0.0], np.cumsum(advance)[:-1]]) % 1.0
