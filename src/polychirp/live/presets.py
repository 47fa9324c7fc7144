"""Settings to begin from."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from polychirp.live.settings import Car, LiveSettings, RadarControls

SHORT_CHIRPS = RadarControls(waveform="sawtooth", bandwidth=0.5e9, ramp_duration=50e-6)
"""Chirps of a usual 77-GHz radar."""

FIRST_PRESET: Final = "paper C: direct interference"
"""Preset with which the page opens: its ghost is seen at once."""

_INDIRECT: Final = LiveSettings(
    title="paper B: indirect interference",
    ego=Car(name="vehicle 1", body="sedan", x=0.0, y=-1.75, speed=9.0),
    looks_back=True,
    carrier=Car(name="vehicle 3", body="van", x=-2.7, y=1.75, oncoming=True, speed=11.8),
    cars=(
        Car(name="target 3", body="hatchback", x=-12.8, y=1.75, oncoming=True, speed=9.2),
        Car(name="target 4", body="sedan", x=-10.7, y=-1.75, speed=10.1),
    ),
)
"""Scenario B; A is the same without the other radar."""

PRESETS: Final[Mapping[str, LiveSettings]] = {
    "paper A: no interference": replace(
        _INDIRECT, title="paper A: no interference", other=RadarControls(is_on=False)
    ),
    "paper B: indirect interference": _INDIRECT,
    "paper C: direct interference": LiveSettings(
        title="paper C: direct interference",
        ego=Car(name="vehicle 2", body="hatchback", x=22.0, y=-1.75, speed=11.2),
        carrier=Car(name="vehicle 4", body="sedan", x=39.2, y=1.75, oncoming=True, speed=8.4),
        cars=(Car(name="target 2", body="van", x=39.1, y=-1.75, speed=11.5),),
    ),
    "motorway, oncoming": LiveSettings(
        title="motorway, oncoming",
        ego=Car(name="ego", body="sedan", x=0.0, y=-5.0, speed=33.0),
        carrier=Car(name="oncoming", body="sedan", x=60.0, y=5.0, oncoming=True, speed=36.0),
        cars=(
            Car(name="ahead", body="van", x=42.0, y=-5.0, speed=30.0),
            Car(name="overtaking", body="sedan", x=25.0, y=-1.5, speed=38.0),
        ),
        victim=SHORT_CHIRPS,
        other=SHORT_CHIRPS,
        num_sweeps=64,
    ),
    "car park": LiveSettings(
        title="car park",
        ego=Car(name="ego", body="hatchback", x=0.0, y=-1.5, speed=2.0),
        carrier=Car(name="coming", body="sedan", x=18.0, y=1.5, oncoming=True, speed=2.5),
        cars=(
            Car(name="parked 1", body="hatchback", x=7.0, y=-5.0),
            Car(name="parked 2", body="sedan", x=12.0, y=-5.0),
            Car(name="parked 3", body="van", x=9.0, y=5.5),
        ),
    ),
}
"""Presets of the page by name."""
