"""The moving picture of the README: ``python -m tools.figures.moving_picture FILE.gif``.

An oncoming car 40 m away carries a radar. First its equal chirps start at ever closer times to
ours, then its slope departs from ours, and at last our receiver blanks the bursts. Every picture is
a run of its own with the same noise: its range-rate map, and what the receiver detects.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from PIL import Image

import polychirp as pc
from polychirp.axes import FloatArray
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.overview.range_rate import range_rate_map
from polychirp.report.figures.drawing import BLUE, INK, STYLE_FILE, VERMILION
from polychirp.study.trial import VictimResult

SIZE: Final = (8.0, 4.0)
"""Width and height of a picture, in units of `DOTS` px."""

DOTS: Final = 100

FARTHEST: Final = 50.0
"""End of the map, m."""

SPAN_DB: Final = 48.0
"""Level over noise of the brightest cells, dB."""

LEVELS: Final = 24
"""Number of colours of the map: fewer make a smaller file."""

STEP_MS: Final = 140
"""Time for which a picture is shown, ms."""

PAUSE_MS: Final = 2500
"""Time for which the last picture of an act is shown, ms."""

OWN: Final = pc.Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)


NUM_CHIRPS: Final = 64
"""Chirps of a frame."""

STEEPEST: Final = 0.33
"""Greatest relative difference of the slopes."""

CAR: Final = pc.Vehicle(name="ego", x=0.0, y=0.0, speed=10.0, max_edge=0.5, coarseness=8.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """Settings of one picture.

    Parameters
    ----------
    words : above the picture
    start : s, by which the other radar's chirps are later than ours
    steeper : relative difference of its slope
    slower : s, by which its chirps are further apart
    is_blanked : true if our receiver blanks bursts
    pause : ms, for which the picture is shown
    """

    words: str
    start: float = 0.0
    steeper: float = 0.0
    slower: float = 0.0
    is_blanked: bool = False
    pause: int = STEP_MS

    @property
    def other(self) -> pc.Sawtooth:
        """Chirps of the other radar."""
        return replace(
            OWN, bandwidth=(1.0 + self.steeper) * OWN.bandwidth, idle=OWN.idle + self.slower
        )

    @property
    def receiver(self) -> pc.RangeDoppler:
        """Our receiver."""
        mitigation = pc.Blanking() if self.is_blanked else None
        return pc.RangeDoppler(greatest_range=FARTHEST, mitigation=mitigation)

    def study(self) -> pc.Study:
        """Two cars that meet, and a pedestrian, as points in free space."""
        oncoming = replace(CAR, name="other", x=40.0, y=3.5, heading=np.pi)
        echo = pc.Point(
            name="oncoming car", x=41.5, y=3.5, z=0.5, rcs=10.0, velocity=(-10.0, 0.0, 0.0)
        )
        pedestrian = pc.Point(name="pedestrian", x=31.0, y=-3.0, z=0.5, rcs=0.1)
        return pc.Study(
            name="moving picture",
            street=pc.Street(vehicles=(CAR, oncoming), points=(pedestrian, echo)),
            radars=(
                _radar("front", CAR.name, OWN, 0.0),
                _radar("oncoming", oncoming.name, self.other, self.start),
            ),
            victims=("front",),
            targets=(pedestrian.name, echo.name),
            num_sweeps=NUM_CHIRPS,
            tracer=pc.FreeSpace(),
            receiver=self.receiver,
        )


def _radar(name: str, vehicle: str, waveform: pc.Sawtooth, start: float) -> pc.StudyRadar:
    return pc.StudyRadar(
        name=name,
        vehicle=vehicle,
        mount=pc.Pose(z=0.5),
        waveform=waveform,
        start_time=start,
        array=pc.AntennaArray(num_channels=4, pattern=pc.ElementPattern(peak_gain=pc.from_db(12))),
        if_filter=pc.IfFilter(passband=6.5e6, stopband=9e6),
        converter=pc.Converter(sample_rate=16e6, start=2e-6, margin=0.5e-6),
    )


def moments() -> Iterator[Moment]:
    """All pictures in their order."""
    words = "Two radars with equal chirps, which start at ever closer times …"
    for start in np.linspace(0.42e-6, 0.0, 22):
        yield Moment(words=words, start=float(start))
    words = "… and together: a ghost at half the distance, above all true echoes"
    yield Moment(words=words, pause=PAUSE_MS)
    words = "Its slope departs from ours: the ghost dissolves into a floor …"
    for steeper in np.geomspace(2e-4, STEEPEST, 18):
        yield _crossing(words, steeper=float(steeper))
    words = "… which hides the oncoming car and the pedestrian"
    last = replace(_crossing(words, steeper=STEEPEST), pause=PAUSE_MS)
    yield last
    words = "Our receiver blanks the bursts: both are detected again"
    yield replace(last, words=words, is_blanked=True)


def _crossing(words: str, *, steeper: float) -> Moment:
    """Chirps of another slope that cross ours, at later and later places of each chirp."""
    delay = 0.5 * OWN.ramp_duration * steeper / (1.0 + steeper)
    return Moment(words=words, start=0.5 * delay, steeper=steeper, slower=delay / NUM_CHIRPS)


def picture(moment: Moment, seen: VictimResult, map_: RangeRateMap, *, noise: float) -> Image.Image:
    """One picture; ``noise`` is the level of the noise in the map, W."""
    file = io.BytesIO()
    with mpl.rc_context(fname=STYLE_FILE):
        figure = Figure(figsize=SIZE, dpi=DOTS)
        figure.set_layout_engine("none")
        figure.text(0.02, 0.945, moment.words, size=13, weight="bold", color=INK, va="center")
        _draw_map(figure.add_axes((0.49, 0.13, 0.495, 0.75)), seen, map_, noise)
        _draw_street(figure.add_axes((0.02, 0.52, 0.40, 0.36)))
        _draw_chirps(figure.add_axes((0.085, 0.13, 0.335, 0.33)), moment)
        figure.savefig(file, format="png", dpi=DOTS)
    return Image.open(file).convert("RGB")


def _draw_map(axes: Axes, seen: VictimResult, map_: RangeRateMap, noise: float) -> None:
    shown = map_.range <= FARTHEST
    level = 10.0 * np.log10(np.maximum(map_.power[:, shown] / noise, 1e-3))
    steps = np.clip(np.floor(level / SPAN_DB * LEVELS), 0, LEVELS - 1)
    axes.imshow(
        steps.T,
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        cmap="cividis",
        vmin=0,
        vmax=LEVELS - 1,
        extent=(float(map_.range_rate[0]), float(map_.range_rate[-1]), 0.0, FARTHEST),
    )
    axes.grid(visible=False)
    axes.set(xlabel="Range rate (m/s)", ylabel="Range (m)", ylim=(0, FARTHEST))
    for name, place, rate, found in zip(
        seen.truth.name,
        seen.truth.range,
        seen.truth.range_rate,
        seen.score.is_detected,
        strict=True,
    ):
        axes.plot(rate, place, "o", markersize=13, fillstyle="none", color="white", mew=1.6)
        words = name if found else f"{name}: missed"
        axes.annotate(
            words,
            (rate, place),
            (10, 8),
            textcoords="offset points",
            color="white",
            size=10,
            path_effects=[withStroke(linewidth=2.5, foreground=INK)],
        )
    ghosts = seen.score.numbers("direct")
    if ghosts:
        place = seen.detections.range[ghosts[0]]
        rate = seen.detections.range_rate[ghosts[0]]
        axes.plot(rate, place, "o", markersize=15, fillstyle="none", color=VERMILION, mew=2.2)
        axes.annotate(
            "ghost",
            (rate, place),
            (12, 8),
            textcoords="offset points",
            color="white",
            size=11,
            weight="bold",
            bbox={"facecolor": VERMILION, "edgecolor": "none", "pad": 2},
        )


def _draw_street(axes: Axes) -> None:
    axes.set(xlim=(-9, 50), ylim=(-8, 8))
    axes.axis("off")
    axes.axhspan(-2.2, 5.7, color="#e8e8e8")
    axes.axhline(1.75, color="white", linewidth=2, linestyle=(0, (6, 5)))
    for middle, lane, colour in ((-2.2, 0.0, BLUE), (42.2, 3.5, VERMILION)):
        axes.fill_between((middle - 2.2, middle + 2.2), lane - 0.9, lane + 0.9, color=colour)
    axes.annotate("", (38.5, 3.1), (1.5, 0.2), arrowprops={"arrowstyle": "<-", "color": VERMILION})
    axes.plot(31.0, -3.6, "o", color=INK, markersize=5)
    axes.text(31.0, -6.0, "pedestrian", ha="center", size=10)
    axes.text(-2.2, -6.0, "our radar", ha="center", size=10, color=BLUE)
    axes.text(42.0, 6.4, "the other radar", ha="center", size=10, color=VERMILION)


def _draw_chirps(axes: Axes, moment: Moment) -> None:
    for colour, ramps, start in ((BLUE, OWN, 0.0), (VERMILION, moment.other, moment.start)):
        times, frequencies = _saw(ramps, start)
        width = 4.0 if colour == BLUE else 2.0
        axes.plot(1e6 * times, 1e-6 * frequencies, color=colour, linewidth=width)
    axes.set(xlim=(0, 75), ylim=(0, 420), xlabel="Time (µs)", ylabel="Frequency (MHz)")
    axes.set_yticks([0, 200, 400])
    axes.grid(visible=False)


def _saw(ramps: pc.Sawtooth, start: float) -> tuple[FloatArray, FloatArray]:
    """Times and frequencies, s and Hz, of the corners of a few chirps; NaN between them."""
    first = start + np.arange(5) * (ramps.ramp_duration + ramps.idle)
    times = np.stack([first, first + ramps.ramp_duration, np.full(5, np.nan)], axis=1)
    return times.ravel(), np.tile([0.0, ramps.bandwidth, np.nan], 5)


def main() -> None:
    """Compute all pictures and write the file."""
    pictures, pauses, noise = [], [], 0.0
    for moment in moments():
        seen = pc.run_trial(moment.study()).victim("front")
        map_ = range_rate_map(moment.receiver, seen.frame)
        noise = noise or float(np.median(map_.power))
        pictures.append(picture(moment, seen, map_, noise=noise))
        pauses.append(moment.pause)
    # one palette for all: colours of cells stay where they are, and only what changes is stored
    sheet = Image.new("RGB", (pictures[0].width, 4 * pictures[0].height))
    for row, number in enumerate((0, 22, 32, -2)):
        sheet.paste(pictures[number], (0, row * pictures[0].height))
    palette = sheet.quantize(96, dither=Image.Dither.NONE)
    first, *rest = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    path = Path(sys.argv[1])
    first.save(path, save_all=True, append_images=rest, duration=pauses, loop=0, optimize=True)
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB, {len(pictures)} pictures")


if __name__ == "__main__":
    main()
