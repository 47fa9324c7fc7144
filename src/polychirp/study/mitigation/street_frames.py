"""Frames of drawn streets whose rays are traced: bodies of many facets, walls, bounces, a road.

A frame takes seconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from polychirp.channel.tracers.composite import Composite
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.rng import Streams
from polychirp.study.mitigation.engine_frames import (
    FREQUENCY_OF_SETS,
    frame_of_study,
    kept_interference,
    road_radar,
)
from polychirp.study.spec import Study, StudyRadar
from polychirp.study.traffic import StudyTraffic
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.random_traffic import Lane
from polychirp.traffic.street import Road, Street, Vehicle
from polychirp.waveform import DiverseTriangular

LANES: Final = (
    Lane(y=-1.75),
    Lane(y=-5.0, speed=(0.0, 0.0)),
    Lane(y=5.0, oncoming=True, speed=(0.0, 0.0)),
)
"""Lanes of the other vehicles: the victim's own, and parked ones on both sides. Chosen: nothing
hides the oncoming radar."""

OTHERS: Final = 4
"""Number of other vehicles; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreetKind:
    """Radars of a drawn street, of which one is the victim and another one drives towards it.

    Parameters
    ----------
    chirps : 64 chirps of 20 µs; else 4 of the paper's triangles with drawn slopes
    ratios : least and greatest slope of the interferer's chirps over that of the victim
    kept : part of the interference that stays in the frame; None for all
    sampling : of the victim's converter
    """

    chirps: bool = True
    ratios: tuple[float, float] = (0.5, 0.8)
    kept: Literal["direct", "indirect"] | None = None
    sampling: Literal["complex", "real"] = "complex"


STREETS: Final[Mapping[str, StreetKind]] = {
    "street-direct": StreetKind(kept="direct"),
    "street-indirect": StreetKind(kept="indirect"),
    "street-parallel": StreetKind(ratios=(0.96, 0.985)),
    "street-real": StreetKind(sampling="real"),
    "street-ramps": StreetKind(chirps=False),
    "street-ramps-indirect": StreetKind(chirps=False, kept="indirect"),
}
"""Kinds of streets by name."""


def street_frame(streams: Streams, kind: StreetKind) -> tuple[IfFrame, IfParts]:
    """A frame of a traced street, and its parts."""
    return kept_interference(*frame_of_study(street_study(streams, kind))[:2], kind.kept)


def street_study(streams: Streams, kind: StreetKind) -> Study:
    """The drawn street as a study, whose first radar is the victim.

    Chosen: the victim drives in the right-hand lane, the interferer comes towards it from 15 to
    45 m ahead in the other one, and four vehicles stand or drive within 40 m.
    """
    random = streams["street"]
    ego = Vehicle(name="ego", x=0.0, y=-1.75, speed=float(random.uniform(5.0, 15.0)))
    other = Vehicle(
        name="oncoming",
        body="hatchback",
        x=float(random.uniform(15.0, 45.0)),
        y=1.75,
        heading=np.pi,
        speed=float(random.uniform(5.0, 15.0)),
    )
    own, foreign = _chirps(random, kind) if kind.chirps else _ramps(random)
    traffic = StudyTraffic(seen_from="ego", num_targets=OTHERS, reach=40.0, lanes=LANES)
    return Study(
        name="street",
        seed=int(random.integers(2**31)),
        num_sweeps=64 if kind.chirps else 4,
        street=Street(vehicles=(ego, other), road=Road(length=160.0, width=7.0)),
        radars=(own, foreign),
        victims=("victim",),
        traffic=traffic,
        tracer=Composite(frequency=FREQUENCY_OF_SETS),
    )


def _chirps(random: np.random.Generator, kind: StreetKind) -> tuple[StudyRadar, StudyRadar]:
    """Radars of `engine_frames`: 400 MHz in 20 µs, and a slope of the kind's ratio."""
    bandwidth, duration = 400e6, 20e-6
    ratio = float(random.uniform(*kind.ratios))
    crossing = float(random.uniform(5e-6, 16e-6))
    own = road_radar(
        "victim",
        "ego",
        bandwidth,
        duration,
        sampling=kind.sampling,
        mount=bumper_mount("sedan", "front"),
    )
    other = road_radar(
        "other",
        "oncoming",
        ratio * bandwidth,
        duration,
        start_frequency=77e9 + bandwidth / duration * (1.0 - ratio) * crossing,
        idle=5e-6 + float(random.uniform(0.0, 0.2e-6)),
        mount=bumper_mount("hatchback", "front"),
    )
    return own, replace(other, num_sweeps=64)


def _ramps(random: np.random.Generator) -> tuple[StudyRadar, StudyRadar]:
    """Radars of the paper: 0.8 to 1 GHz in 1 to 2 ms, drawn at every triangle."""
    own = StudyRadar(
        name="victim",
        vehicle="ego",
        mount=bumper_mount("sedan", "front"),
        waveform=DiverseTriangular(),
    )
    other = replace(
        own,
        name="other",
        vehicle="oncoming",
        mount=bumper_mount("hatchback", "front"),
        start_time=float(random.uniform(0.0, 1e-3)),
    )
    return own, replace(other, num_sweeps=6)
