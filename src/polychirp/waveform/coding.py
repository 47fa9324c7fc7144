r"""Codes by which several transmitting elements share a radar's ramps (MIMO), sweep by sweep.

All ramps of a sweep have the same weights, so that the same elements send the up- and the down-ramp
of a triangle. A weight of magnitude 1 is full power: each element has its own amplifier,
and elements that transmit together do not share it.

A beat carries the conjugate of the weight, since the mixer gives
:math:`y = s_{tx}\,\overline{s_{rx}}`. `polychirp.receiver.mimo` decodes the samples.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Literal, Protocol, runtime_checkable

import numpy as np

from polychirp.axes import ComplexArray, IntArray
from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.spec import ByKind, Spec
from polychirp.units import Between


@runtime_checkable
class Coding(Protocol):
    """A rule that gives every transmitting element a weight on every sweep.

    `TimeDivision` is an example. A class of your own needs this method alone.
    """

    def weights(self, sweep: IntArray, *, num_elements: int) -> ComplexArray:
        """Weights ``(len(sweep), element)`` on the sweeps with the numbers ``sweep``.

        `InputError` is raised if a receiver could not separate so many elements.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeDivision(Spec):
    """One element sends on each sweep, and the elements take turns from sweep to sweep.

    >>> TimeDivision().weights(np.arange(3), num_elements=2).real
    array([[1., 0.],
           [0., 1.],
           [1., 0.]])
    """

    kind: Literal["time-division"] = "time-division"

    def weights(self, sweep: IntArray, *, num_elements: int) -> ComplexArray:
        """See `Coding.weights`."""
        return np.eye(num_elements, dtype=np.complex128)[sweep % num_elements]


@dataclass(frozen=True, slots=True, kw_only=True)
class DopplerDivision(Spec):
    r"""All elements send; the phase of element l advances by l/N cycles from sweep to sweep.

    .. math:: w_{kl} = e^{j2\pi k l / N}

    Beats of echoes of element l are lower than those of element 0 by l/N of the Doppler band.

    Parameters
    ----------
    num_bands : N, number of parts of the Doppler band, by default that of the elements. Parts that
        remain empty tell a receiver which part belongs to element 0

    Examples
    --------
    >>> DopplerDivision(num_bands=4).weights(np.arange(4), num_elements=2).round(9)[:, 1]
    array([ 1.+0.j,  0.+1.j, -1.+0.j, -0.-1.j])
    """

    kind: Literal["doppler-division"] = "doppler-division"
    num_bands: Annotated[int, Between(greatest=1024)] | None = None

    def weights(self, sweep: IntArray, *, num_elements: int) -> ComplexArray:
        """See `Coding.weights`."""
        bands = num_elements if self.num_bands is None else self.num_bands
        if bands < num_elements:
            raise InputError(
                f"{bands} Doppler bands cannot tell {num_elements} transmitting elements apart; "
                f"set num_bands to at least {num_elements}"
            )
        # whole numbers of steps, so that the code repeats exactly
        step = np.outer(sweep, np.arange(num_elements)) % bands
        return np.asarray(np.exp(2j * np.pi * np.arange(bands) / bands)[step])


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseCoded(Spec):
    r"""All elements send, with signs from a Hadamard matrix: binary phase modulation.

    .. math:: w_{kl} = (-1)^{\text{number of ones in } (k \bmod N) \wedge l}

    This is Sylvester's matrix of N rows, the least power of two not below the number of elements.

    >>> PhaseCoded().weights(np.arange(4), num_elements=3).real.astype(int)
    array([[ 1,  1,  1],
           [ 1, -1,  1],
           [ 1,  1, -1],
           [ 1, -1, -1]])
    """

    kind: Literal["phase-coded"] = "phase-coded"

    def weights(self, sweep: IntArray, *, num_elements: int) -> ComplexArray:
        """See `Coding.weights`."""
        order = 1 << (num_elements - 1).bit_length()
        common = (np.asarray(sweep) % order)[:, None] & np.arange(num_elements)
        return np.asarray(1.0 - 2.0 * (np.bitwise_count(common) % 2), dtype=np.complex128)


AnyCoding = Annotated[TimeDivision | DopplerDivision | PhaseCoded, ByKind(method="weights")]


def coded(schedule: RampSchedule, coding: Coding, *, num_elements: int) -> RampSchedule:
    """The schedule, sent by ``num_elements`` transmitting elements with the weights of ``coding``.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Triangular
    >>> ramps = Triangular().schedule(num_sweeps=2, streams=Streams(seed=1))
    >>> coded(ramps, TimeDivision(), num_elements=2).transmit_weight.real
    array([[1., 0.],
           [1., 0.],
           [0., 1.],
           [0., 1.]])
    """
    weights = coding.weights(schedule.sweep, num_elements=num_elements)
    return replace(schedule, transmit_weight=weights)
