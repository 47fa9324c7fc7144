"""`SynthesisEngine`, the seam between paths and samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from polychirp.axes import ComplexArray
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene


@runtime_checkable
class SynthesisEngine(Protocol):
    """From paths to samples: exact for delays that are linear in time while a ramp lasts."""

    def contribution(
        self,
        scene: Scene,
        schedules: Sequence[RampSchedule],
        snapshots: Sequence[PropagationPaths],
        *,
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        """What one transmitter puts into the victim's IF: V, ``(part, channel, ramp, fast)``.

        The parts are unmirrored and mirrored paths for the victim's own transmitter
        (`PropagationPaths.is_mirrored`), and what it hears without a scene if it does
        (`Radar.receives_itself`); direct and other paths (`is_direct`) for another. Free of noise,
        ahead of the front end; zero behind the last sample of a short ramp.
        """
        ...
