"""Spectrograms of a walker and a bicycle, and cross sections of road users over aspect.

``python -m tools.figures.road_users FOLDER`` writes ``road-users.png``. The spectrograms are those
of samples: a radar of equal chirps at rest receives each body alone, without noise.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.direct.moving_parts import part_echoes
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.rng import Streams
from polychirp.study.spec import Study, StudyRadar, scene_of, schedules_of
from polychirp.study.trial import trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.traffic.road_users import Bicycle, Motorcycle, Pedestrian, RoadUser
from polychirp.traffic.street import Street, Vehicle
from polychirp.units import to_db
from polychirp.waveform import Sawtooth

CHIRPS: Final = Sawtooth(start_frequency=77e9, bandwidth=90e6, ramp_duration=30e-6, idle=20e-6)
"""Chirps of the spectrograms, which are unambiguous to ±19 m/s."""

WINDOW: Final = 512
"""Chirps in a window of a spectrogram: 26 ms, in which a foot changes its speed by 1 m/s."""

FREQUENCY: Final = 79e9
"""Frequency of the cross sections, Hz."""

SMOOTHING: Final = 5
"""Neighbours to either side over which cross sections are averaged: 5 deg."""

LENGTH: Final = {"walker": 1.2, "bicycle": 0.45}
"""Simulated time of the spectrograms, s."""


def echo_samples(user: Pedestrian | Bicycle, seconds: float) -> ComplexArray:
    """Echo of a road user at a radar in (0, 0) that looks along +x, ``(ramp, fast)``."""
    sweeps = int(seconds / (CHIRPS.ramp_duration + CHIRPS.idle))
    radar = StudyRadar(name="front", vehicle="ego", waveform=CHIRPS, mount=Pose(x=2.33, z=0.5))
    street = Street(
        vehicles=(Vehicle(name="ego", x=-2.33, y=0.0),),
        pedestrians=(user,) if isinstance(user, Pedestrian) else (),
        bicycles=(user,) if isinstance(user, Bicycle) else (),
    )
    study = Study(
        name="alone", num_sweeps=sweeps, street=street, radars=(radar,), tracer=FreeSpace()
    )
    scene, schedules = scene_of(study), schedules_of(study)
    snapshots = trace_frame(study.tracer, scene, schedules, refresh_interval=1e-3)
    _, parts = synthesize(
        Stretch(), scene, schedules, snapshots, victim=0, interferers=None, streams=Streams(seed=1)
    )
    return np.asarray(parts.echo[0])


def spectrogram(samples: ComplexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times (s), range rates (m/s) and powers ``(time, rate)`` of the sum over all ranges."""
    ranges = np.fft.fft(samples * np.hanning(samples.shape[1]), axis=1)
    starts = np.arange(0, len(samples) - WINDOW + 1, WINDOW // 8)
    pieces = ranges[starts[:, None] + np.arange(WINDOW)] * np.hanning(WINDOW)[:, None]
    power = np.sum(np.abs(np.fft.fftshift(np.fft.fft(pieces, axis=1), axes=1)) ** 2, axis=2)
    interval = CHIRPS.ramp_duration + CHIRPS.idle
    wavelength = SPEED_OF_LIGHT / CHIRPS.start_frequency
    shift = np.fft.fftshift(np.fft.fftfreq(WINDOW, interval))
    # the beat of a receding target rises: its frequency over the chirps is 2 v / wavelength
    times = np.asarray((starts + 0.5 * WINDOW) * interval, dtype=np.float64)
    return times, np.asarray(0.5 * wavelength * shift), np.asarray(power)


def cross_sections(user: RoadUser, azimuth: FloatArray, *, distance: float = 10.0) -> FloatArray:
    """Cross sections, m² ``(azimuth,)``, from a radar 0.6 m above the ground."""
    radars = tuple(
        Radar(
            name=str(number),
            mount=Pose(x=distance * math.cos(angle), y=distance * math.sin(angle), z=0.6),
            array=AntennaArray(pattern=ISOTROPIC),
        )
        for number, angle in enumerate(azimuth)
    )
    actors = (user.actor(), Actor(name="radars", kind="object"))
    scene = Scene(time=0.0, actors=actors, radars=radars, carriers=(1,) * len(radars))
    own = np.repeat(np.arange(len(radars))[:, None], 2, axis=1)
    paths = part_echoes(scene, 0, frequency=FREQUENCY, pairs=own)
    echo = np.zeros(len(radars), dtype=np.complex128)
    turn = np.exp(-2j * np.pi * FREQUENCY * paths.delay)
    np.add.at(echo, paths.transmitter, paths.transfer[:, 0, 0] * turn)
    wavelength = SPEED_OF_LIGHT / FREQUENCY
    return np.asarray(np.abs(echo) ** 2 * (4 * np.pi) ** 3 * distance**4 / wavelength**2)


def mean_over_phases(kind: str, azimuth: FloatArray) -> FloatArray:
    """Mean cross sections, m² ``(azimuth,)``, over eight instants and 2 `SMOOTHING` + 1 aspects."""
    users: dict[str, list[RoadUser]] = {
        "adult": [Pedestrian(name="u", x=0, y=0, speed=1.4, phase=n / 8) for n in range(8)],
        "bicycle": [Bicycle(name="u", x=0, y=0, speed=5.0, phase=n / 8) for n in range(8)],
        "motorcycle": [Motorcycle(name="u", x=0, y=0, speed=14.0, phase=n / 8) for n in range(8)],
    }
    found = np.mean([cross_sections(user, azimuth) for user in users[kind]], axis=0)
    shifts = range(-SMOOTHING, SMOOTHING + 1)
    return np.asarray(np.mean([np.roll(found, shift) for shift in shifts], axis=0))


@styled
def drawing() -> Drawing:
    """Both spectrograms and the cross sections."""
    figure = new_figure(12.4, 3.6)
    panels = figure.subplots(1, 3)
    walker = Pedestrian(name="walker", x=12.0, y=0.0, heading=math.pi, speed=1.4)
    bicycle = Bicycle(name="bicycle", x=12.0, y=1.0, heading=math.pi, speed=5.0)
    shown: tuple[tuple[Pedestrian | Bicycle, tuple[float, float]], ...] = (
        (walker, (-7.5, 2.0)),
        (bicycle, (-12.0, 2.0)),
    )
    for axes, (user, limits) in zip(panels[:2], shown, strict=True):
        times, rates, power = spectrogram(echo_samples(user, LENGTH[user.name]))
        level = to_db(power / power.max())
        image = axes.pcolormesh(
            times, rates, level.T, vmin=-50, vmax=0, cmap="magma", shading="auto"
        )
        for factor in (0.0, 1.0, 2.0) if user is bicycle else (1.0, 4.0):
            axes.axhline(-factor * user.speed, color="white", linewidth=0.6, linestyle=":")
        axes.set(xlabel="Time (s)", ylabel="Range rate (m/s)", ylim=limits)
        axes.set_title(f"{user.name.capitalize()} towards the radar, {user.speed:g} m/s")
        axes.grid(visible=False)
        figure.colorbar(image, ax=axes, label="Power (dB)")
    azimuth = np.radians(np.arange(0.0, 360.0, 1.0))
    data: dict[str, FloatArray] = {"aspect (deg)": np.degrees(azimuth)}
    last = panels[2]
    for colour, kind in zip(
        (BLUE, GREEN, VERMILION), ("adult", "bicycle", "motorcycle"), strict=True
    ):
        data[f"RCS of {kind} (dBsm)"] = to_db(mean_over_phases(kind, azimuth))
        last.plot(data["aspect (deg)"], data[f"RCS of {kind} (dBsm)"], color=colour, label=kind)
    last.set(
        xlabel="Aspect (deg), 0 from ahead", ylabel="RCS (dBsm)", xlim=(0, 360), ylim=(-20, 15)
    )
    last.set_title("Mean over ±5 deg and time")
    last.grid(visible=True, color=GREY, alpha=0.2)
    last.legend(loc="lower right", fontsize=7)
    return Drawing(figure=figure, data=data)


def main() -> None:
    """Write the figure into the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    (parser.parse_args().folder / "road-users.png").write_bytes(drawing().png())


if __name__ == "__main__":
    main()
