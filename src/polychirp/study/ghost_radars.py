"""The radar that causes each ghost of interference.

A frame keeps the sum of all interferers. Where there are ghosts, the signals of the audible radars
are computed again, a few radars at a time, which bounds the memory; the receiver then says what
power each contributes to each detection, by the linear steps that gave the power of each part.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import IfParts
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.scoring.causes import Nature
from polychirp.synthesis.base import SynthesisEngine
from polychirp.synthesis.received_frame import audible_interferers, interference_of

_OF_RADARS: Final = (Nature.DIRECT.value, Nature.INDIRECT.value)
"""Natures of the ghosts that other radars cause, in the order of the parts of `interference_of`."""

MOST_AT_ONCE: Final = 8
"""Radars whose signals are held together. Chosen: they take three times the memory of the frame's
own parts. The phases of each detection are computed once for all of them: with eight radars, 256
chirps and 124 detections it takes 2.6 s of CPU time, and one radar at a time took 10.9 s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Interference:
    """The signals of other radars in one frame, to be computed again; as given to `synthesize`.

    Parameters
    ----------
    interferers : numbers of the radars that disturb the victim; None: all others
    """

    engine: SynthesisEngine
    scene: Scene
    schedules: Sequence[RampSchedule]
    snapshots: Sequence[PropagationPaths]
    victim: int
    interferers: Sequence[int] | None = None

    def audible(self) -> tuple[int, ...]:
        """Numbers of the radars that are in the frame."""
        return audible_interferers(
            self.scene,
            self.schedules,
            self.snapshots,
            victim=self.victim,
            interferers=self.interferers,
        ).numbers

    def parts(self, transmitter: int) -> IfParts:
        """The parts ``direct`` and ``indirect`` of one radar."""
        return interference_of(
            self.engine,
            self.scene,
            self.schedules,
            self.snapshots,
            victim=self.victim,
            transmitter=transmitter,
        )


def radars_of_ghosts(
    nature: Sequence[str],
    interference: Interference,
    powers_of: Callable[[Sequence[IfParts]], FloatArray],
) -> tuple[str | None, ...]:
    """Name of the radar that contributes most power to each ghost of interference; else None.

    A direct ghost is compared by the radars' direct paths, an indirect one by their other paths. If
    one radar alone is audible, nothing is computed.

    Parameters
    ----------
    nature : cause of every detection (`Score`)
    powers_of : power of the parts of several radars in each detection, W,
        ``(detection, radar, part)``
    """
    name = [radar.name for radar in interference.scene.radars]
    if not any(cause in _OF_RADARS for cause in nature):
        return (None,) * len(nature)
    audible = interference.audible()
    strongest = np.zeros((len(nature), len(_OF_RADARS)), dtype=np.int64)
    if len(audible) > 1:
        blocks = [audible[n : n + MOST_AT_ONCE] for n in range(0, len(audible), MOST_AT_ONCE)]
        powers = [powers_of([interference.parts(n) for n in block]) for block in blocks]
        strongest = np.argmax(np.concatenate(powers, axis=1), axis=1)
    return tuple(
        name[audible[strongest[n, _OF_RADARS.index(cause)]]] if cause in _OF_RADARS else None
        for n, cause in enumerate(nature)
    )
