"""Interference of an oncoming lane: closed form, free space, and vehicles that hide each other.

The places of cars are drawn as Matérn's process of type II, so that no two are closer than a gap.
Every car has a radar in its front bumper that faces the victim's. The interference is the sum of
the powers on all direct paths to the victim, of all radars that send at the same time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.direct.line_of_sight import line_of_sight
from polychirp.channel.materials.library import material_table
from polychirp.channel.point_vehicles.paths import direct, prepared
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray, ElementPattern
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.scoring.closed_forms.roads import hard_core_density, mean_of_lane_in_lobes
from polychirp.synthesis.links.links import links_between
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import from_db

FREQUENCY: Final = 79e9
"""Hz."""

BEAMWIDTH: Final = math.radians(40.0)
"""Full 3-dB width of both antennas in azimuth, rad."""

ROAD_LENGTH: Final = 400.0
"""Length of the drawn road before the victim, m."""

CAR_GAP: Final = 8.0
"""Least distance between the middles of two cars, m: a sedan of 4.6 m and 3.4 m before it."""

DENSITIES: Final = (0.01, 0.03, 0.1)
"""Cars per metre before the gaps are kept, of each lane."""

NUM_ROADS: Final = 400
"""Number of drawn roads for each row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadRow:
    """One lane, or two of equal density, whose radars all send.

    Parameters
    ----------
    offsets : m, of the lanes from the victim's line, to its left
    cars : mean number of cars per metre of a lane
    closed_form : mean of the interference, W
    free_space : mean over the roads, W, with its standard error
    visible : mean with vehicles that hide others over that in free space, with its standard error
    """

    offsets: tuple[float, ...]
    cars: float
    closed_form: float
    free_space: tuple[float, float]
    visible: tuple[float, float]


def measure_roads(*, num_roads: int = NUM_ROADS) -> list[RoadRow]:
    """Rows for one lane, the next one, and both together, at every density."""
    lanes = ((3.5,), (7.0,), (3.5, 7.0))
    return [_row(offsets, d, num_roads) for offsets in lanes for d in DENSITIES]


def _row(offsets: tuple[float, ...], density: float, num_roads: int) -> RoadRow:
    kept = hard_core_density(density, gap=CAR_GAP)
    one = power_at_a_metre(_radar("front"))
    form = sum(_closed_form(one, density=kept, offset=y) for y in offsets)
    powers = np.array([_powers(offsets, density, seed) for seed in range(num_roads)])
    free, bodies = powers.T
    mean, ratio = float(free.mean()), float(bodies.mean() / free.mean())
    # the error of a ratio of means, both on the same roads
    errors = np.array([free, (bodies - ratio * free) / mean]).std(axis=1, ddof=1)
    error, ratio_error = (errors / math.sqrt(num_roads)).tolist()
    return RoadRow(
        offsets=offsets,
        cars=kept,
        closed_form=form,
        free_space=(mean, error),
        visible=(ratio, ratio_error),
    )


def _closed_form(power: float, *, density: float, offset: float) -> float:
    """Mean interference, W, of the part of a lane that is drawn: without the narrow rest ahead."""
    rest = 2.0 * math.atan2(offset, ROAD_LENGTH)
    whole, beyond = (
        mean_of_lane_in_lobes(
            power, density=density, offset=offset, opening=opening, beamwidth=BEAMWIDTH
        )
        for opening in (math.pi, rest)
    )
    return whole - beyond


def power_at_a_metre(radar: Radar) -> float:
    """Power, W, that a radar receives from an equal one that it faces at a distance of 1 m."""
    both = radar.array.pattern.peak_gain**2 * radar.transmit_gain * radar.receive_gain
    return radar.transmit_power * both * (299_792_458.0 / FREQUENCY / (4.0 * math.pi)) ** 2


def _powers(offsets: tuple[float, ...], density: float, seed: int) -> tuple[float, float]:
    """Interference on one road in free space and with vehicles' boxes, W."""
    scene = _road(offsets, density, seed)
    street = prepared(
        scene, frequency=FREQUENCY, dynamic_range=1e15, max_length=1e4, table=material_table({})
    )
    pairs = np.array([[n, 0] for n in range(1, len(scene.radars))], dtype=np.int64).reshape(-1, 2)
    free = line_of_sight(scene, frequency=FREQUENCY, pairs=pairs)
    return _received(scene, free), _received(scene, direct(street))


def _received(scene: Scene, paths: PropagationPaths) -> float:
    """Power of all radars at radar 0 on its direct paths, W."""
    return sum(
        float(np.sum(np.abs(links_between(scene, paths, victim=0, transmitter=n).amplitude) ** 2))
        for n in range(1, len(scene.radars))
    )


def _road(offsets: tuple[float, ...], density: float, seed: int) -> Scene:
    mesh = vehicle_mesh("sedan", max_edge=0.5, coarseness=8.0)
    mount = bumper_mount("sedan", "front")
    ego = Actor(name="ego", kind="vehicle", mesh=mesh, pose=Pose(x=-mount.x))
    cars = [
        Actor(
            name=f"lane {y:g} m, car {n}",
            kind="vehicle",
            mesh=mesh,
            pose=Pose(x=float(x), y=y, yaw=math.pi),
        )
        for y in offsets
        for n, x in enumerate(_places(density, Streams(seed)["road", f"{y:g}"]))
    ]
    radars = (_radar("front"), *(_radar(car.name) for car in cars))
    return Scene(time=0.0, actors=(ego, *cars), radars=radars, carriers=tuple(range(len(radars))))


def _places(density: float, draw: np.random.Generator) -> FloatArray:
    """Middles of the cars of a lane, m: radars are from 0 to `ROAD_LENGTH` before the victim's."""
    front = bumper_mount("sedan", "front").x
    first, last = front - CAR_GAP, ROAD_LENGTH + front + CAR_GAP
    x = np.sort(draw.uniform(first, last, draw.poisson(density * (last - first))))
    mark = draw.uniform(size=x.size)
    ends = zip(
        np.searchsorted(x, x - CAR_GAP),
        np.searchsorted(x, x + CAR_GAP, side="right"),
        strict=True,
    )
    is_first = np.array([mark[a:b].min() for a, b in ends]) == mark if x.size else mark < 0
    kept = x[is_first]
    return np.asarray(kept[(kept >= front) & (kept <= ROAD_LENGTH + front)])


def _radar(name: str) -> Radar:
    pattern = ElementPattern(
        peak_gain=from_db(15.0),
        azimuth_beamwidth=BEAMWIDTH,
        elevation_beamwidth=math.inf,
        floor=1e-9,
    )
    radar = Radar(name=name, mount=bumper_mount("sedan", "front"))
    return replace(radar, array=AntennaArray(num_channels=1, pattern=pattern))
