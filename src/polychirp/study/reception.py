"""The frame that one radar receives, and the signals of the other radars in it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from polychirp.axes import ComplexArray
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.rng import Streams
from polychirp.synthesis.base import SynthesisEngine
from polychirp.synthesis.received_frame import (
    audible_interferers,
    interference_of,
    synthesize,
)

MOST_AT_ONCE: Final = 8
"""Radars whose signals are held together. Chosen: they take three times the memory of the frame's
own parts. The phases of each detection are computed once for all of them: with eight radars, 256
chirps and 124 detections it takes 2.6 s of CPU time, and one radar at a time took 10.9 s."""

MOST_KEPT: Final = 4
"""Radars whose signals are kept from the frame until its ghosts are named. Chosen: they take twice
the memory of the frame's own parts while the receiver reads it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reception:
    """Signals that one radar receives in one frame, as a whole and radar by radar.

    The fields are those of `synthesize`.

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
    _kept: dict[int, ComplexArray] = field(default_factory=dict, init=False, repr=False)

    def frame(self, streams: Streams, *, keeps: bool = True) -> tuple[IfFrame, IfParts]:
        """The frame and its parts.

        Parameters
        ----------
        keeps : whether the signals of up to `MOST_KEPT` other radars are kept for `parts`
        """
        return synthesize(
            _Keeping(self.engine, self._kept) if keeps else self.engine,
            self.scene,
            self.schedules,
            self.snapshots,
            victim=self.victim,
            interferers=self.interferers,
            streams=streams,
        )

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
            _Releasing(self.engine, self._kept),
            self.scene,
            self.schedules,
            self.snapshots,
            victim=self.victim,
            transmitter=transmitter,
        )


@dataclass(frozen=True, slots=True)
class _Keeping:
    """An engine that keeps the signals of the first few other radars that it computes."""

    inner: SynthesisEngine
    kept: dict[int, ComplexArray]

    def contribution(
        self,
        scene: Scene,
        schedules: Sequence[RampSchedule],
        snapshots: Sequence[PropagationPaths],
        *,
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        made = self.inner.contribution(
            scene, schedules, snapshots, victim=victim, transmitter=transmitter
        )
        if transmitter != victim and len(self.kept) < MOST_KEPT:
            self.kept[transmitter] = made
        return made


@dataclass(frozen=True, slots=True)
class _Releasing:
    """An engine that hands out signals that were kept, once, and computes others."""

    inner: SynthesisEngine
    kept: dict[int, ComplexArray]

    def contribution(
        self,
        scene: Scene,
        schedules: Sequence[RampSchedule],
        snapshots: Sequence[PropagationPaths],
        *,
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        kept = self.kept.pop(transmitter, None)
        if kept is not None:
            return kept
        return self.inner.contribution(
            scene, schedules, snapshots, victim=victim, transmitter=transmitter
        )
