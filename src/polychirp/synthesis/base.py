"""`SynthesisEngine`, the protocol of engines that compute samples from paths."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from polychirp.axes import ComplexArray
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene


@runtime_checkable
class SynthesisEngine(Protocol):
    """Engine that computes samples from paths; exact if delays are linear in time on a ramp."""

    def contribution(
        self,
        scene: Scene,
        schedules: Sequence[RampSchedule],
        snapshots: Sequence[PropagationPaths],
        *,
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        """One transmitter's signal after the victim's IF filter, V ``(part, channel, ramp, fast)``.

        For the victim's own transmitter, the parts are unmirrored paths, mirrored paths
        (`PropagationPaths.is_mirrored`) and, if it has any (`Radar.receives_itself`), leakage; for
        another transmitter they are direct (`is_direct`) and all other paths. Noise, the channels'
        errors and the `FrontEnd` are not included; after a short ramp's last sample it is zero.
        """
