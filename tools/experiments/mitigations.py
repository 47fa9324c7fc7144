"""Methods of mitigation on one frame, compared with no mitigation and with a clean oracle."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, axes_of
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.receiver.attribution import part_amplitudes
from polychirp.receiver.mitigation import (
    AnyMitigation,
    Autoregression,
    Blanking,
    Imat,
    StftExcision,
)
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.selection import FrameReceiver, receiver_for
from polychirp.rng import Streams
from polychirp.scoring.causes import MADE_BY_RADARS
from polychirp.scoring.mitigation import (
    error_vector_magnitude,
    share_touched,
    signal_to_disturbance,
)
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import Study, scene_of, schedules_of, target_names
from polychirp.study.trial import VictimResult, receive_and_score, trace_frame
from polychirp.synthesis.impairments.oscillator_errors import Oscillating
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.units import to_db

METHODS: Final[Mapping[str, AnyMitigation | None]] = {
    "nothing": None,
    "blanking": Blanking(),
    "blanking, tapered": Blanking(taper=8e-6),
    "blanking by amplitude": Blanking(whitening=0),
    "autoregression": Autoregression(),
    "IMAT": Imat(),
    "STFT excision": StftExcision(),
    "STFT excision, levelled": StftExcision(cells="levelled"),
}
"""Mitigation of the receiver, by name."""

ORACLE: Final = "clean oracle"
"""Name of the receiver that removes exactly the interference, since it knows the parts of the
frame; no real receiver can."""

SCENARIOS: Final[Mapping[str, tuple[str, str]]] = {
    "C, direct": ("vehicle-2", "vehicle-4"),
    "B, indirect": ("vehicle-1", "vehicle-3"),
}
"""Victim and interferer of scenarios of the paper."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MitigationRow:
    """Result of one method on a frame.

    Values are those of the worst of the targets that the oracle detects; NaN if it detects none.

    Parameters
    ----------
    scenario, method : names
    sinr_db : own echo over noise and interference in the cell of the target, after mitigation
    evm : error of the complex amplitude of the target, relative to that of the oracle
    floor_rise_db : rise of the range spectra over thermal noise
    ghosts : number of false detections from interference or the front end
    others : number of further false detections
    echoes : number of detections that are echoes of other bodies than the targets
    missed : number of targets that were missed
    lost : share of the samples that have no weight after mitigation
    touched_clean : share of the samples that the method changes in a frame without interference
    loss_clean_db : loss of SINR in that frame
    """

    scenario: str
    method: str
    sinr_db: float
    evm: float
    floor_rise_db: float
    ghosts: int
    others: int
    echoes: int
    missed: int
    lost: float
    touched_clean: float
    loss_clean_db: float


def compare_paper_mitigations(
    *, seed: int = 1, progress: Progress = no_progress
) -> tuple[MitigationRow, ...]:
    """Every method on one frame each of scenarios C and B of the paper, with diverse waveforms."""
    rows: list[MitigationRow] = []
    for scenario, radars in SCENARIOS.items():
        study = replace(paper_study("diverse", radars=radars, seed=seed), victims=radars[:1])
        rows += compare_mitigations(study, scenario=scenario, progress=progress)
    return tuple(rows)


def compare_mitigations(
    study: Study,
    *,
    scenario: str = "",
    methods: Mapping[str, AnyMitigation | None] = METHODS,
    progress: Progress = no_progress,
) -> tuple[MitigationRow, ...]:
    """Each method on the frame of the study's first victim, then the clean oracle."""
    bench = _Bench(study, progress)
    rows = []
    for number, (name, mitigation) in enumerate(methods.items()):
        progress("mitigations", number, len(methods) + 1)
        rows.append(bench.row(scenario, name, mitigation))
    progress("mitigations", len(methods), len(methods) + 1)
    rows.append(bench.oracle(scenario))
    progress("mitigations", len(methods) + 1, len(methods) + 1)
    return tuple(rows)


class _Bench:
    """One frame, with interference and without, on which methods are compared."""

    def __init__(self, study: Study, progress: Progress) -> None:
        self.study = study
        self.scene = scene_of(study)
        self.victim = self.scene.radar_index((study.victims or (study.radars[0].name,))[0])
        schedules = schedules_of(study)
        self.snapshots = trace_frame(
            study.tracer,
            self.scene,
            [schedules[self.victim]],
            refresh_interval=study.refresh_interval,
            receivers=[self.victim],
            progress=progress,
        )
        streams = Streams(study.seed)
        self.frame, self.parts = synthesize(
            Oscillating(inner=Stretch(), streams=streams),
            self.scene,
            schedules,
            self.snapshots,
            victim=self.victim,
            interferers=None,
            streams=streams,
        )
        alone = without_interference(self.parts)
        self.clean = self._receive(None, self.frame.with_samples(alone.total()), alone)
        self.cells = select(self.clean.detections, self.clean.score.target_detection)
        self.own, self.rest = self._amplitudes(None, self.clean)

    def row(self, scenario: str, name: str, mitigation: AnyMitigation | None) -> MitigationRow:
        result = self._receive(mitigation, self.frame, self.parts)
        treated = mitigated(mitigation, result.frame)
        untouched = mitigated(mitigation, self.clean.frame)
        own, rest = self._amplitudes(mitigation, self.clean)
        loss = to_db(signal_to_disturbance(self.own, self.rest) / signal_to_disturbance(own, rest))
        present = result.frame.times.is_sample
        return replace(
            self._outcome(scenario, name, mitigation, result),
            lost=float(1.0 - np.mean(treated.weight[present])),
            touched_clean=share_touched(
                self.clean.frame.samples, untouched.samples, untouched.weight, present
            ),
            loss_clean_db=_worst(loss, np.max),
        )

    def oracle(self, scenario: str) -> MitigationRow:
        return self._outcome(scenario, ORACLE, None, self.clean)

    def _outcome(
        self, scenario: str, name: str, mitigation: AnyMitigation | None, result: VictimResult
    ) -> MitigationRow:
        own, rest = self._amplitudes(mitigation, result)
        score = result.score
        made = sum(score.nature[n] in MADE_BY_RADARS for n in score.ghosts)
        return MitigationRow(
            scenario=scenario,
            method=name,
            sinr_db=_worst(to_db(signal_to_disturbance(own, rest)), np.min),
            evm=_worst(error_vector_magnitude(own + rest, self.own + self.rest), np.max),
            floor_rise_db=float(to_db(score.floor_rise)),
            ghosts=made,
            others=len(score.ghosts) - made,
            echoes=len(score.other_echoes),
            missed=score.num_missed,
            lost=0.0,
            touched_clean=0.0,
            loss_clean_db=0.0,
        )

    def _receiver(self, mitigation: AnyMitigation | None) -> FrameReceiver:
        return receiver_for(
            replace(self.study.receiver, mitigation=mitigation), self.frame.schedule
        )

    def _receive(
        self, mitigation: AnyMitigation | None, frame: IfFrame, parts: IfParts
    ) -> VictimResult:
        return receive_and_score(
            self._receiver(mitigation),
            self.scene,
            self.snapshots,
            victim=self.victim,
            frame=frame,
            parts=parts,
            targets=target_names(self.study, self.study.radars[self.victim]),
        )

    def _amplitudes(
        self, mitigation: AnyMitigation | None, result: VictimResult
    ) -> tuple[ComplexArray, ComplexArray]:
        """Own echo, and the rest, in the cells of the targets, ``(target, ramp)``."""
        amplitude = part_amplitudes(
            self._receiver(mitigation), result.frame, result.parts.samples, self.cells
        )
        is_own = np.isin(result.parts.names, ("echo", "multipath"))
        return amplitude[:, is_own].sum(axis=1), amplitude[:, ~is_own].sum(axis=1)


def without_interference(parts: IfParts) -> IfParts:
    """Parts without interference, as the clean oracle has them."""
    kept = [n for n, name in enumerate(parts.names) if name not in ("direct", "indirect")]
    return replace(parts, samples=parts.samples[kept], names=tuple(parts.names[n] for n in kept))


def select(detections: Detections, numbers: Sequence[int]) -> Detections:
    """Detections with these numbers."""
    few = {name: getattr(detections, name)[list(numbers)] for name in axes_of(Detections)}
    return replace(detections, **few)


def _worst(values: FloatArray, of: Callable[[FloatArray], float]) -> float:
    return float(of(values)) if values.size else math.nan
