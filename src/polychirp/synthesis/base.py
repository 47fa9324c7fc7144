"""`SynthesisEngine`, the seam between paths and samples."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from polychirp.axes import ComplexArray
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene


@runtime_checkable
class SynthesisEngine(Protocol):
    """Maker of samples from paths: exact for delays that are linear in time during a ramp."""

    def contribution(
        self,
        scene: Scene,
        schedules: Sequence[RampSchedule],
        snapshots: Sequence[PropagationPaths],
        *,
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        """Signal of one transmitter in the victim's IF: V, ``(part, channel, ramp, fast)``.

        For the victim's own transmitter, the parts are unmirrored and mirrored paths
        (`PropagationPaths.is_mirrored`) and, if it has any (`Radar.receives_itself`), leakage; for
        another transmitter they are direct and other paths (`is_direct`). The signal is free of
        noise and ahead of the front end; behind the last sample of a short ramp it is zero.
        """
