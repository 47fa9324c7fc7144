"""The coherent receiver on ray-traced streets with unmitigated interference.

The street is that of the paper with the bodies, mirrors and bounces of the default tracer. Speeds
and places are redrawn for every street. Two radars receive, each with its interferer.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from multiprocessing import get_context
from typing import Final

import numpy as np

from polychirp.model.baseband import Progress, no_progress
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.scoring.statistics import Estimate, mean_count, wilson
from polychirp.study.paper.results import WaveformKind
from polychirp.study.paper.scenarios import TARGETS_OF_RADAR, paper_study
from polychirp.study.spec import Study, scene_of, schedules_of
from polychirp.study.trial import VictimResult, receive_and_score, trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.threads import limit_cores
from polychirp.units import from_db

NUM_STREETS: Final = 200
"""Number of streets that are drawn; chosen: an hour on two cores."""

FIRST_STREET: Final = 200
"""Number of the first one: the receiver was made on streets of lower numbers."""

SPREAD_OF_SPEEDS, SPREAD_OF_PLACES = 1.5, 0.3
"""Greatest changes of a vehicle's speed, m/s, and of its place, m."""

SPREAD_OF_INTERVALS: Final = 0.3
"""Greatest change of the interval at which streets are traced, as a share of it. It moves all
instants of tracing."""

WAVEFORMS: Final[tuple[WaveformKind, ...]] = ("conventional", "diverse")
"""Waveforms of all radars of a street."""

PAIRS: Final = (("vehicle-1", "vehicle-3"), ("vehicle-2", "vehicle-4"))
"""Radars that receive, and the interferer of each."""

MARGINS_DB: Final = (9.0, 0.0)
"""Residue margins of the receiver, dB: the default, and none."""

PAPERS_GHOSTS: Final = 2
"""Number of ghosts by way of the targets in the paper's figure 10a."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreetRow:
    """Detections of one radar with one waveform and receiver, one frame on each street.

    Parameters
    ----------
    margin_db : the receiver's residue margin beside near bodies, dB
    found : share of the frames in which each target is found, by name
    with_ghosts : share of the frames with at least `PAPERS_GHOSTS` ghosts of indirect interference
    unexplained : mean number of detections per frame that no body, ghost or known path explains
    detections : mean number of all detections per frame
    seconds : median CPU time of a frame
    """

    waveform: str
    radar: str
    margin_db: float
    found: dict[str, Estimate]
    with_ghosts: Estimate
    unexplained: Estimate
    detections: Estimate
    seconds: float
    num_trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Score of one radar with one waveform and receiver on one frame.

    ``is_detected`` and ``is_in_sight`` ``(target,)`` are those of the score, ``natures`` the
    causes of all detections, and ``seconds`` the CPU time of the receiver and of the score.
    """

    waveform: str
    radar: str
    margin_db: float
    is_detected: tuple[bool, ...]
    is_in_sight: tuple[bool, ...]
    natures: tuple[str, ...]
    seconds: float


def traced_streets(
    *,
    num_streets: int = NUM_STREETS,
    num_processes: int = 1,
    progress: Progress = no_progress,
) -> tuple[StreetRow, ...]:
    """Rows of all receivers, waveforms and radars, the same for any number of processes."""
    read: dict[tuple[float, str, str], list[Reading]] = {}
    numbers = range(FIRST_STREET, FIRST_STREET + num_streets)
    with ProcessPoolExecutor(num_processes, mp_context=get_context("spawn")) as pool:
        for count, readings in enumerate(pool.map(readings_of, numbers)):
            progress("streets", count, num_streets)
            for one in readings:
                read.setdefault((one.margin_db, one.waveform, one.radar), []).append(one)
    names = [name for name, _ in PAIRS]
    return tuple(_row(*key, read[key]) for key in product(MARGINS_DB, WAVEFORMS, names))


def drawn_street(waveform: WaveformKind, number: int) -> Study:
    """The paper's street whose vehicles have other speeds and places, traced at other instants."""
    study = paper_study(waveform, seed=1 + number)
    draw = np.random.default_rng([77, number])
    vehicles = tuple(
        replace(
            vehicle,
            speed=vehicle.speed and vehicle.speed + draw.uniform(-1, 1) * SPREAD_OF_SPEEDS,
            x=vehicle.x + draw.uniform(-1, 1) * SPREAD_OF_PLACES,
            y=vehicle.y + draw.uniform(-1, 1) * SPREAD_OF_PLACES,
        )
        for vehicle in study.street.vehicles
    )
    interval = study.refresh_interval * (1.0 + draw.uniform(-1, 1) * SPREAD_OF_INTERVALS)
    street = replace(study.street, vehicles=vehicles)
    return replace(study, street=street, refresh_interval=interval)


def readings_of(number: int) -> list[Reading]:
    """A frame of each waveform and radar on one street, read by each receiver in one thread."""
    limit_cores(1)
    return [
        Reading(
            waveform=waveform,
            radar=one.name,
            margin_db=margin,
            is_detected=tuple(map(bool, one.score.is_detected)),
            is_in_sight=tuple(map(bool, one.score.is_in_sight)),
            natures=one.score.nature,
            seconds=seconds,
        )
        for waveform, margin, one, seconds in received_on(number)
    ]


def received_on(number: int) -> Iterator[tuple[WaveformKind, float, VictimResult, float]]:
    """Waveform, residue margin, result and CPU-seconds of each receiver's frames on one street.

    Vehicles move alike with all waveforms, so that one tracing over the longest frame serves all.
    """
    studies = {waveform: drawn_street(waveform, number) for waveform in WAVEFORMS}
    study = studies[WAVEFORMS[0]]
    scene = scene_of(study)
    schedules = {waveform: schedules_of(one) for waveform, one in studies.items()}
    traced = trace_frame(
        study.tracer,
        scene,
        [ramps for of_radars in schedules.values() for ramps in of_radars],
        refresh_interval=study.refresh_interval,
        receivers=[scene.radar_index(name) for name, _ in PAIRS],
    )
    for waveform, (name, interferer) in product(WAVEFORMS, PAIRS):
        victim = scene.radar_index(name)
        frame, parts = synthesize(
            Stretch(),
            scene,
            schedules[waveform],
            traced,
            victim=victim,
            interferers=[scene.radar_index(interferer)],
            streams=Streams(1 + number),
        )
        for margin in MARGINS_DB:
            begin = time.process_time()
            one = receive_and_score(
                CoherentReceiver(residue_margin=from_db(margin)),
                scene,
                traced,
                victim=victim,
                frame=frame,
                parts=parts,
                targets=TARGETS_OF_RADAR[name],
            )
            yield waveform, margin, one, time.process_time() - begin


def _row(margin_db: float, waveform: str, radar: str, readings: list[Reading]) -> StreetRow:
    in_sight = np.array([one.is_in_sight for one in readings])
    hits = np.array([one.is_detected for one in readings]) & in_sight
    natures = [one.natures for one in readings]
    return StreetRow(
        waveform=waveform,
        radar=radar,
        margin_db=margin_db,
        found={
            name: wilson(hits[:, n].sum() / in_sight[:, n].sum(), in_sight[:, n].sum())
            for n, name in enumerate(TARGETS_OF_RADAR[radar])
        },
        with_ghosts=wilson(
            float(np.mean([n.count("indirect") >= PAPERS_GHOSTS for n in natures])), len(natures)
        ),
        unexplained=mean_count(np.array([n.count("unexplained") for n in natures], dtype=float)),
        detections=mean_count(np.array([len(n) for n in natures], dtype=float)),
        seconds=float(np.median([one.seconds for one in readings])),
        num_trials=len(readings),
    )
