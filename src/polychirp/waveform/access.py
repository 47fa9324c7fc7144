"""Rules by which the radars of a road share time and band, decided before a frame.

A rule gives every radar a delay of its first ramp and a shift of all its frequencies. It acts on
schedules, whatever their waveforms, and knows the radars' names and headings. Random choices come
from streams with the radar's name, so that a further radar does not move those of the others.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol, runtime_checkable

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Seconds
from polychirp.waveform.base import need_positive

Count = Annotated[int, Between(least=1, greatest=1_000_000)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assignment:
    """Time and band that a rule gives to each radar.

    Parameters
    ----------
    delay : s, added to the start of the radar's first ramp, ``(radar,)``
    shift : Hz, added to all of its frequencies, ``(radar,)``
    """

    delay: FloatArray
    shift: FloatArray


@runtime_checkable
class Access(Protocol):
    """A rule by which radars share time and band.

    `Slots` and `Compass` are examples. A class of your own needs this method alone.
    """

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """Delay and shift of every radar.

        Parameters
        ----------
        names : names of the radars
        heading : rad, direction of each radar's axis in the world, ``(radar,)``
        streams : of the trial; equal streams give an equal assignment
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomStarts(Spec):
    """Every radar starts at random within a period: no coordination at all.

    Parameters
    ----------
    period : s, within which starts are uniform

    Examples
    --------
    >>> rule = RandomStarts(period=1e-3)
    >>> given = rule.assign(names=["a", "b"], heading=np.zeros(2), streams=Streams(seed=1))
    >>> bool(np.all((given.delay >= 0) & (given.delay < 1e-3)))
    True
    """

    kind: Literal["random-starts"] = "random-starts"
    period: Seconds

    def __post_init__(self) -> None:
        need_positive("a rule of random starts", period=self.period)

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """See `Access.assign`."""
        del heading
        delay = [streams["access", name].uniform(0.0, self.period) for name in names]
        return Assignment(delay=np.array(delay), shift=np.zeros(len(names)))


@dataclass(frozen=True, slots=True, kw_only=True)
class SlottedAloha(Spec):
    """Every radar starts in a slot that it draws on its own.

    Two radars in one slot start together, and equal chirps then make ghosts. All radars need a
    common clock.

    Parameters
    ----------
    slot : s, length of a slot
    num_slots : number of slots among which a radar draws

    Examples
    --------
    >>> rule = SlottedAloha(slot=2e-6, num_slots=8)
    >>> given = rule.assign(names=["a", "b"], heading=np.zeros(2), streams=Streams(seed=1))
    >>> (given.delay / 2e-6).round(9)
    array([1., 4.])
    """

    kind: Literal["slotted-aloha"] = "slotted-aloha"
    slot: Seconds
    num_slots: Count

    def __post_init__(self) -> None:
        need_positive("slotted ALOHA", slot=self.slot, num_slots=self.num_slots)

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """See `Access.assign`."""
        del heading
        number = [int(streams["access", name].integers(self.num_slots)) for name in names]
        return Assignment(delay=self.slot * np.array(number), shift=np.zeros(len(names)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Slots(Spec):
    """Every radar starts in a slot of its own, which is agreed on: TDMA, as RadChat does.

    RadChat (Aydogdu et al. 2021) shifts equal chirps against each other by slots that are at least
    as long as the IF band over the slope and the delay over the greatest distance, so that the
    beats of other radars are outside of the IF band: one chirp has room for many radars. Slots as
    long as a frame separate frames. If there are more radars than slots, slots are used again. All
    radars need a common clock and a channel over which they agree, which is taken to be perfect.

    Parameters
    ----------
    slot : s, length of a slot
    num_slots : number of slots

    Examples
    --------
    >>> rule = Slots(slot=2e-6, num_slots=3)
    >>> given = rule.assign(names=["a", "b", "c"], heading=np.zeros(3), streams=Streams(seed=1))
    >>> sorted((given.delay / 2e-6).round(9).tolist())
    [0.0, 1.0, 2.0]
    """

    kind: Literal["slots"] = "slots"
    slot: Seconds
    num_slots: Count

    def __post_init__(self) -> None:
        need_positive("slots", slot=self.slot, num_slots=self.num_slots)

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """See `Access.assign`."""
        del heading
        order = streams["access", "slots"].permutation(self.num_slots)
        number = order[np.arange(len(names)) % self.num_slots]
        delay = np.asarray(self.slot * number, dtype=np.float64)
        return Assignment(delay=delay, shift=np.zeros(len(names)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Compass(Spec):
    r"""Every radar sends in a band that follows from the direction in which it looks.

    .. math:: k = \lfloor N\psi/2\pi + \tfrac12 \rfloor \bmod N

    is the number of the band of a radar with the heading ψ; sectors are centred on +x. Radars that
    face each other are in different bands for every N from 2 on. It needs a compass and no link.

    Parameters
    ----------
    num_bands : N, number of sectors
    spacing : Hz, between the bands; no less than the band of a waveform separates them

    Raises
    ------
    InputError
        There are fewer than two bands, or their spacing is not positive.

    Examples
    --------
    >>> rule = Compass(num_bands=4, spacing=250e6)
    >>> heading = np.radians([0.0, 90.0, 180.0, -100.0])
    >>> given = rule.assign(names=[*"abcd"], heading=heading, streams=Streams(seed=1))
    >>> given.shift / 1e6
    array([  0., 250., 500., 750.])
    """

    kind: Literal["compass"] = "compass"
    num_bands: Count
    spacing: Hertz

    def __post_init__(self) -> None:
        need_positive("bands by compass", spacing=self.spacing)
        if self.num_bands < 2:
            raise InputError("bands by compass need a num_bands of 2 or more; one band is no rule")

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """See `Access.assign`."""
        del streams
        sector = np.floor(self.num_bands * np.asarray(heading) / (2.0 * math.pi) + 0.5)
        return Assignment(
            delay=np.zeros(len(names)), shift=self.spacing * (sector % self.num_bands)
        )
