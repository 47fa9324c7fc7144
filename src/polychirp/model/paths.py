"""`PropagationPaths`: the channel between all radars, in the form that every ray tracer gives."""

from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Annotated, Self

import numpy as np

from polychirp.axes import (
    Axes,
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    PerPath,
    PerPathIndex,
    PerPathVector,
    axes_of,
    seal,
)
from polychirp.errors import InputError


class Bounce(IntEnum):
    """Interaction of a wave with a surface."""

    SCATTERING = 0
    """Radiated by currents on a body: a point scatterer or physical optics."""
    REFLECTION = 1
    """Reflected by a plate (road or wall), or by a body's facets on the way to another body."""
    DIFFRACTION = 2
    """Diffracted at the edge of a body that blocks the straight line or is close to it."""
    TRANSMISSION = 3
    """Transmitted through a thin sheet, such as glass."""
    DIFFUSE = 4
    """Scattered with a random phase by a rough plane or by leaves."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PropagationPaths:
    r"""All paths of a scene at one time, between every transmitter and every receiver.

    Between isotropic antennas, the transfer function of path p is

    .. math:: H_p(f, t) = A_p\,\bigl(1 + \gamma_p\,(t - t_0)\bigr)\, e^{-j2\pi f \tau_p(t)}, \qquad
              \tau_p(t) = \tau_p + \dot\tau_p\,(t - t_0) + \tfrac12\ddot\tau_p\,(t - t_0)^2

    for signals :math:`e^{+j\omega t}`, where t is the time of **reception**. A is a 2×2 matrix
    with the receiving polarisation as row and the transmitting one as column, (V, H) of
    `frames.polarisation_basis` for the outward direction at each end. |A|² is the ratio of received
    to transmitted power between isotropic antennas: a line of sight of length d has A = λ/4πd, with
    λ at ``frequency``. A holds no phase of the propagation, which follows from the delay alone.

    Near :math:`t_0`, within a ramp, a delay is quadratic in time; amplitude and directions are
    linear.

    A `RayTracer` returns it for a `Scene`.

    Parameters
    ----------
    reference_time : s, :math:`t_0`
    frequency : Hz, at which amplitudes and materials are evaluated
    transmitter, receiver : numbers of the radars, ``(path,)``
    delay, delay_rate : s and s/s, ``(path,)``
    coherence_time : s, ``(path,)``; for a path that is the sum of many contributions, the time of
        extrapolation after which their phases have spread by about 1 rad rms, so that the sum is
        wrong by about half of its amplitude. Infinite for a single contribution, and by default
    delay_acceleration : second derivative of the delay, 1/s, ``(path,)``; it is v²/Rc for two ends
        at a distance R that pass each other at the speed v, across the line between them. Zero by
        default
    transfer : A, ``(path, 2, 2)`` complex
    transfer_drift : γ, relative rate of A, 1/s ``(path,)`` complex. A single wave of length R has
        :math:`-\dot R/R`; the sum of many contributions also changes as their phases drift apart.
        Zero by default
    departure, arrival : outward directions in the world, ``(path, xyz)``: from the transmitter
        along the path's first leg, and from the receiver along its last leg. For a sum of
        contributions they are weighted means, whose length is not exactly 1. To compute the phases
        of antenna elements, use these means as they are: normalised ones give other phases
    departure_rate, arrival_rate : time derivatives of the directions, 1/s ``(path, xyz)``; zero by
        default
    bounce_start : ``(offset,)``, one more than paths: path p has bounces
        ``bounce_start[p]:bounce_start[p + 1]``, from transmitter to receiver
    bounce_actor : number of the actor, ``(bounce,)``
    bounce_kind : a value of `Bounce`, ``(bounce,)``
    bounce_point : m, in the world, ``(bounce, xyz)``
    """

    reference_time: float
    frequency: float
    transmitter: PerPathIndex
    receiver: PerPathIndex
    delay: PerPath
    delay_rate: PerPath
    transfer: Annotated[ComplexArray, Axes("path", "2", "2", dtype=np.complex128)]
    departure: PerPathVector
    arrival: PerPathVector
    bounce_start: Annotated[IntArray, Axes("offset", dtype=np.int64)]
    bounce_actor: Annotated[IntArray, Axes("bounce", dtype=np.int64)]
    bounce_kind: Annotated[IntArray, Axes("bounce", dtype=np.int64)]
    bounce_point: Annotated[FloatArray, Axes("bounce", "3")]
    coherence_time: PerPath = field(default_factory=lambda: np.zeros(0))
    delay_acceleration: PerPath = field(default_factory=lambda: np.zeros(0))
    transfer_drift: Annotated[ComplexArray, Axes("path", dtype=np.complex128)] = field(
        default_factory=lambda: np.zeros(0, dtype=np.complex128)
    )
    departure_rate: PerPathVector = field(default_factory=lambda: np.zeros((0, 3)))
    arrival_rate: PerPathVector = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        count = np.size(self.delay)
        defaults: dict[str, FloatArray | ComplexArray] = {
            "coherence_time": np.full(count, np.inf),
            "delay_acceleration": np.zeros(count),
            "transfer_drift": np.zeros(count, dtype=np.complex128),
            "departure_rate": np.zeros((count, 3)),
            "arrival_rate": np.zeros((count, 3)),
        }
        for name, default in defaults.items():
            if not np.size(getattr(self, name)):
                object.__setattr__(self, name, default)
        seal(self)
        names = ("delay", "delay_rate", "delay_acceleration", "transfer", "transfer_drift")
        vectors = ("departure", "departure_rate", "arrival", "arrival_rate")
        for name in (*names, *vectors):
            is_number = np.isfinite(getattr(self, name))
            if not is_number.all():
                path = int(np.argmin(is_number.reshape(len(is_number), -1).all(axis=1)))
                raise InputError(
                    f"PropagationPaths.{name} of path {path} is not finite; leave out paths that "
                    "do not exist"
                )
        is_known = np.isin(self.bounce_kind, [*Bounce])
        if not is_known.all():
            known = ", ".join(f"{one.value} ({one.name.lower()})" for one in Bounce)
            raise InputError(
                f"PropagationPaths.bounce_kind of bounce {int(np.argmin(is_known))} is "
                f"{self.bounce_kind[~is_known][0]}; a value of Bounce is one of {known}"
            )
        if self.bounce_start.size != self.num_paths + 1:
            raise InputError(
                "PropagationPaths.bounce_start needs one entry more than there are paths"
            )
        if self.bounce_start[0] != 0 or self.bounce_start[-1] != self.bounce_actor.size:
            raise InputError(
                "PropagationPaths.bounce_start must run from 0 to the number of bounces"
            )

    @property
    def num_paths(self) -> int:
        """Number of paths of all pairs."""
        return int(self.delay.size)

    @property
    def num_bounces(self) -> IntArray:
        """Number of bounces of every path, ``(path,)``."""
        return np.diff(self.bounce_start)

    @property
    def is_direct(self) -> BoolArray:
        """Mask of the paths without reflection and scattering, ``(path,)``.

        Paths that are diffracted or pass through thin sheets are included.
        """
        return np.asarray(self._count(~self._is_passed) == 0)

    @property
    def is_mirrored(self) -> BoolArray:
        """Mask of the paths that a surface reflects on the way to or from a body, ``(path,)``.

        They are reflected or scattered by two actors at least, of which a trailer is one. The echo
        of a plate alone is not mirrored, nor is a wave that one body reflects between its own
        parts, as in a lamp or in the corner of a house: its range is that of the body.
        """
        sends = ~self._is_passed
        path = np.repeat(np.arange(self.num_paths), self.num_bounces)[sends]
        actor = self.bounce_actor[sends]
        goes_on = (path[1:] == path[:-1]) & (actor[1:] != actor[:-1])
        out = np.zeros(self.num_paths, dtype=np.bool_)
        out[path[1:][goes_on]] = True
        return out

    @property
    def _is_passed(self) -> BoolArray:
        """Mask of the bounces that a wave passes, at an edge or through a sheet, ``(bounce,)``."""
        return np.isin(self.bounce_kind, (Bounce.DIFFRACTION, Bounce.TRANSMISSION))

    def _count(self, bounces: BoolArray) -> IntArray:
        """Number of bounces of every path, ``(path,)``, that are in the mask ``(bounce,)``."""
        total = np.concatenate([[0], np.cumsum(bounces.astype(np.int64))])
        return np.asarray(total[self.bounce_start[1:]] - total[self.bounce_start[:-1]])

    def carried(self, elapsed: float) -> Self:
        r"""The same paths ``elapsed`` s later; a negative time gives earlier paths.

        .. math:: \tau_p(t_0 + t) = \tau_p + \dot\tau_p\,t + \tfrac12\ddot\tau_p\,t^2

        Directions turn at their rates. Amplitudes and visibility are unchanged: the drift of an
        amplitude is valid for a ramp only. A path that is the sum of many contributions is valid
        for less than its `coherence_time`.

        >>> from polychirp.testing.paths import HandPath, paths_of
        >>> paths_of(HandPath(delay=1e-7, delay_rate=1e-8)).carried(2.0).delay.tolist()
        [1.2e-07]
        """
        delay, delay_rate = self.delays_after(elapsed)
        return replace(
            self,
            reference_time=self.reference_time + elapsed,
            delay=delay,
            delay_rate=delay_rate,
            departure=self.departure + self.departure_rate * elapsed,
            arrival=self.arrival + self.arrival_rate * elapsed,
        )

    def delays_after(self, elapsed: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Delays (s) and their rates (s/s) some time later, as in `carried`, ``(path,)`` each.

        ``elapsed`` (s) is one time for all paths, or one for each, ``(path,)``.
        """
        bend = 0.5 * self.delay_acceleration * elapsed**2
        return (
            self.delay + self.delay_rate * elapsed + bend,
            self.delay_rate + self.delay_acceleration * elapsed,
        )

    def select(self, which: BoolArray | IntArray) -> Self:
        """Some of the paths, by mask or by number, bounces included."""
        chosen = np.arange(self.num_paths)[which]
        counts = self.num_bounces[chosen]
        start = np.concatenate([[0], np.cumsum(counts)])
        inner = np.arange(start[-1]) - np.repeat(start[:-1], counts)
        bounce = np.repeat(self.bounce_start[chosen], counts) + inner
        rows = {"path": chosen, "bounce": bounce}
        columns = {
            name: getattr(self, name)[rows[axes[0]]]
            for name, axes in axes_of(type(self)).items()
            if axes[0] in rows
        }
        return replace(self, bounce_start=start, **columns)
