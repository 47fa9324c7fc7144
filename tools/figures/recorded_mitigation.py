"""Picture of a recording with simulated interference, before and after mitigation.

``python -m tools.figures.recorded_mitigation SHARED FOLDER`` reads the recording in the folder
SHARED and writes ``recorded-mitigation.png`` into FOLDER.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from PIL import Image

from polychirp.axes import ComplexArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame
from polychirp.report.figures.drawing import Column, Drawing, styled
from polychirp.report.figures.panels import Surface, panels
from polychirp.rng import Streams
from polychirp.units import to_db
from tools.experiments.recorded_mitigation import (
    FILE,
    RecordedResult,
    compare_recorded,
    injected,
    recorded_frame,
)


@styled
def recorded_picture(frame: IfFrame, results: Sequence[RecordedResult]) -> Drawing:
    """Range-rate maps of the recording, of its spoiled form, and after each method."""
    shown: dict[str, ComplexArray] = {"recorded": frame.samples}
    names = {one.method: f"{one.method}: {to_db(one.left) + 0.0:.1f} dB left" for one in results}
    names["nothing"] = "with interference"
    shown |= {names[one.method]: one.samples for one in results}
    surfaces = {name: _surface(frame, samples) for name, samples in shown.items()}
    figure = panels(
        surfaces,
        _unmarked,
        title="A recorded frame with simulated interference, and what methods give back",
        xlabel="Range rate (m/s)",
        ylabel="Range (m)",
        height=2.6,
    )
    data: dict[str, Column] = {
        "method": [one.method for one in results],
        "left_db": [float(to_db(one.left)) for one in results],
    }
    return Drawing(figure=figure, data=data)


def _unmarked(axes: Axes, name: str) -> None:
    """Nothing is drawn over the panels."""
    del axes, name


def _surface(frame: IfFrame, samples: ComplexArray) -> Surface:
    """Mean power over the channels; this radar's beats lie between zero and the sample rate."""
    ramps, length = samples.shape[1:]
    windowed = samples * np.outer(np.hanning(ramps), np.hanning(length))
    found = np.fft.fftshift(np.fft.fft2(windowed), axes=1)
    own = frame.schedule
    interval = float(np.diff(own.start_time[:2])[0])
    rate = np.fft.fftshift(np.fft.fftfreq(ramps, interval))
    beat = np.arange(length) * frame.times.rate / length
    return Surface(
        x=0.5 * rate * SPEED_OF_LIGHT / float(own.centre_frequency[0]),
        y=0.5 * beat * SPEED_OF_LIGHT / float(own.slope[0]),
        power=np.mean(np.abs(found) ** 2, axis=0),
    )


if __name__ == "__main__":
    recorded = recorded_frame(Path(sys.argv[1]) / FILE)
    compared = compare_recorded(recorded, injected(recorded, streams=Streams(1)))
    picture = recorded_picture(recorded, compared).png()
    # maps of noise compress badly; 128 colours are enough for them
    few = Image.open(io.BytesIO(picture)).convert("P", palette=Image.Palette.ADAPTIVE, colors=128)
    few.save(Path(sys.argv[2]) / "recorded-mitigation.png", optimize=True)
    for one in compared:
        print(f"{one.method}: {to_db(one.left):.1f} dB")
