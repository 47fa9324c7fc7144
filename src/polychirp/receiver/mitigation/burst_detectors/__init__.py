"""Detectors of interference bursts: the ones that a study file may name by their ``kind``.

The modules in reading order; others use the detectors themselves:

- `base`: the detector's interface `BurstDetection`; the guard.
- `median_threshold`: amplitude and prediction error over the ramp's medians, the default.
- `amplitude_steps`: amplitude and steps over the ramp's means, with hysteresis.
- `time_frequency`: ridges in the time-frequency plane, with a false-alarm probability.
"""

from typing import Annotated

from polychirp.receiver.mitigation.burst_detectors.amplitude_steps import (
    AmplitudeSteps as AmplitudeSteps,
)
from polychirp.receiver.mitigation.burst_detectors.median_threshold import (
    MedianThreshold as MedianThreshold,
)
from polychirp.receiver.mitigation.burst_detectors.time_frequency import StftCfar as StftCfar
from polychirp.spec import ByKind

AnyBurstDetector = Annotated[MedianThreshold | AmplitudeSteps | StftCfar, ByKind(method="hit")]
