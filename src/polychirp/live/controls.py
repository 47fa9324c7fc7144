"""Sliders and lists of the live page."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from nicegui import ui

from polychirp.live.settings import LiveSettings, RadarControls
from polychirp.units import from_db, to_db

WAVEFORMS: Final = {
    "triangular": "equal triangles",
    "diverse-triangular": "diverse triangles",
    "sawtooth": "equal chirps",
}
MITIGATIONS: Final = {"none": "none", "blanking": "blanking", "excision": "STFT excision"}
"""Words of the lists for waveforms and mitigations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slider:
    """A slider: its label, ends, step and unit, and how many SI units one unit has."""

    label: str
    least: float
    greatest: float
    step: float
    unit: str
    factor: float = 1.0


DISTANCE: Final = Slider(label="Distance", least=-10, greatest=80, step=0.5, unit="m")
SWEEPS: Final = Slider(label="Sweeps", least=2, greatest=128, step=2, unit="")
POWER: Final = Slider(label="Power", least=-20, greatest=30, step=1, unit="dBm")
OF_RAMPS: Final = {
    "bandwidth": Slider(
        label="Bandwidth", least=100, greatest=1000, step=10, unit="MHz", factor=1e6
    ),
    "ramp_duration": Slider(
        label="Ramp time", least=20, greatest=2000, step=10, unit="µs", factor=1e-6
    ),
}
OF_TIMING: Final = {
    "start_time": Slider(label="Start", least=-50, greatest=50, step=0.5, unit="µs", factor=1e-6),
    "clock_offset": Slider(
        label="Clock", least=-20, greatest=20, step=0.5, unit="ppm", factor=1e-6
    ),
}
"""Sliders of the street, and of a radar by the names of `RadarControls`; only the other radar has
those of timing."""


class Controls:
    """The column of controls; it calls ``on_change`` with the settings after every change."""

    def __init__(self, on_change: Callable[[LiveSettings], None]) -> None:
        self._on_change = on_change
        self._column = ui.column().classes("w-full gap-1")
        self._settings: LiveSettings

    def show(self, settings: LiveSettings) -> None:
        """Build all controls anew for these settings."""
        self._settings = settings
        self._column.clear()
        with self._column:
            _slider(DISTANCE, settings.distance, lambda v: self._change(distance=v))
            _slider(SWEEPS, settings.num_sweeps, lambda v: self._change(num_sweeps=int(v)))
            _choice(
                "Mitigation",
                MITIGATIONS,
                settings.mitigation,
                lambda v: self._change(mitigation=v),
            )
            for name, title in (("victim", "Own radar"), ("other", "Other radar")):
                ui.html(f"<h2>{title}</h2>", sanitize=False)
                self._radar(name)

    def _radar(self, name: str) -> None:
        controls: RadarControls = getattr(self._settings, name)

        def change(**values: Any) -> None:
            now: RadarControls = getattr(self._settings, name)
            self._change(**{name: replace(now, **values)})

        def in_si(field: str, slider: Slider) -> Callable[[float], None]:
            return lambda value: change(**{field: value * slider.factor})

        is_other = name == "other"
        if is_other:
            ui.switch("transmits", value=controls.is_on, on_change=lambda e: change(is_on=e.value))
        _choice("Waveform", WAVEFORMS, controls.waveform, lambda v: change(waveform=v))
        for field, slider in (OF_RAMPS | OF_TIMING if is_other else OF_RAMPS).items():
            _slider(slider, getattr(controls, field) / slider.factor, in_si(field, slider))
        power = float(to_db(controls.power)) + 30.0
        _slider(POWER, power, lambda value: change(power=from_db(value - 30.0)))

    def _change(self, **values: Any) -> None:
        self._settings = replace(self._settings, **values)
        self._on_change(self._settings)


def _slider(slider: Slider, value: float, on_change: Callable[[float], None]) -> None:
    with ui.row().classes("w-full items-center no-wrap gap-2"):
        ui.label(slider.label).classes("w-24 text-sm")
        control = ui.slider(
            min=slider.least, max=slider.greatest, step=slider.step, value=value
        ).props(f'aria-label="{slider.label}, {slider.unit}"')
        ui.label().classes("w-24 text-sm text-right").bind_text_from(
            control, "value", lambda v: f"{v:g} {slider.unit}"
        )
    control.on_value_change(lambda event: on_change(float(event.value)))


def _choice(
    label: str, words: dict[str, str], value: str, on_change: Callable[[str], None]
) -> None:
    ui.select(
        words, value=value, label=label, on_change=lambda event: on_change(event.value)
    ).classes("w-full").props("dense")
