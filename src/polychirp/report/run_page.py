"""The page of a stored run: what every radar receives, the street, targets and detections."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.receiver.overview.pooling import group_means, pooled
from polychirp.receiver.overview.range_rate import range_rate_map
from polychirp.receiver.selection import AnyReceiver
from polychirp.report.figures.range_rate_parts import folded_rates
from polychirp.report.page_data import (
    causes,
    detection_marks,
    map_data,
    rounded,
    speeds,
    tenths,
)
from polychirp.report.page_parts import (
    Table,
    figure_of,
    number_cell,
    rendered,
    text_cell,
    verdict_cell,
)
from polychirp.report.run_plots import draw, figures_of
from polychirp.report.street_model import street_model
from polychirp.report.verdict import counted
from polychirp.report.words import decimal
from polychirp.study.part_views import ALL, MITIGATED, part_views
from polychirp.study.spec import scene_of
from polychirp.study.store.load import StoredRun, StoredVictim
from polychirp.units import to_db

MAP_CELLS: Final = (150, 240)
"""Greatest numbers of cells along range rate and range; chosen: two to four pixels each."""

PROFILE_POINTS: Final = 1200
"""Greatest number of points of a profile; chosen: as many as a wide screen has pixels."""

RUN_FIGURES: Final[Mapping[str, str]] = {
    "range-profile": "Power over range of every part of the samples, with targets and detections.",
    "detections": "Detections with their causes over the visible metal of the targets.",
    "ramps": "Spectrogram of the signal that the radar transmits.",
}
"""Figures of the page, of every radar, with their captions."""


def write_run_page(run: StoredRun, folder: Path) -> Path:
    """Write ``report.html`` and the files of its figures into ``folder``; gives its path."""
    figures = folder / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    shown = []
    for number, victim in enumerate(run.victims):
        for name, caption in RUN_FIGURES.items():
            if name not in figures_of(victim):
                continue
            drawing = draw(name, victim, run.study.receiver)
            file = f"{name}-{number}"
            picture = drawing.save(figures, file, formats=("png", "svg"))
            words = f"Radar {victim.name}. {caption}"
            is_photo = name == "ramps"
            shown.append(figure_of(file, picture, caption=words, is_wide=True, is_photo=is_photo))
    page = folder / "report.html"
    page.write_text(run_page(run, shown), encoding="utf-8")
    return page


def run_page(run: StoredRun, figures: Sequence[Mapping[str, str]]) -> str:
    """The page as HTML, with figures of `figure_of`."""
    study = run.study
    names = [victim.name for victim in run.victims]
    rows = [frame_data(victim, study.receiver) for victim in run.victims]
    return rendered(
        "run.html",
        title=study.name,
        data={
            "rows": rows,
            "causes": causes(),
            "headline": None,
            "street": street_model(scene_of(study)),
        },
        answer=[_sentence(victim) for victim in run.victims],
        folding=[row["key"] for row in rows if row["is_periodic"]],
        controls=[
            {
                "name": "case",
                "title": "Radar",
                "chosen": names[0],
                "options": dict(zip(names, names, strict=True)),
            }
        ],
        victims=[_victim(victim) for victim in run.victims],
        figures=figures,
        facts={
            "seed": str(study.seed),
            "study": run.provenance.study_hash[:12],
            **dict(run.provenance.versions),
        },
    )


def frame_data(victim: StoredVictim, receiver: AnyReceiver) -> dict[str, Any]:
    """Values for JSON of the frame of one radar, after mitigation."""
    maps = part_views(range_rate_map, receiver, victim.frame, victim.parts)
    map_ = maps.get(MITIGATED, maps[ALL])
    noise = maps.get("noise", map_)
    rates, ranges = MAP_CELLS
    power = pooled(pooled(map_.power, most=rates, axis=0), most=ranges, axis=1)
    found, truth = victim.detections, victim.truth
    folded = folded_rates(truth.range_rate, map_)
    return {
        "key": victim.name,
        "reach": round(float(map_.range[-1]), 3),
        "floor_rise": tenths(float(to_db(victim.score.floor_rise))),
        "noise": tenths(float(np.median(_dbm(noise.power.max(axis=0))))),
        "profile": {
            "range": rounded(group_means(map_.range, most=PROFILE_POINTS), 3),
            "power": rounded(_dbm(pooled(map_.power.max(axis=0), most=PROFILE_POINTS, axis=0)), 1),
        },
        "targets": [
            {
                "name": name,
                "range": round(float(truth.range[n]), 2),
                **speeds(truth.range_rate[n], folded[n]),
                "found": bool(victim.score.is_detected[n]),
            }
            for n, name in enumerate(truth.name)
            if victim.score.is_in_sight[n] or victim.score.is_detected[n]
        ],
        "marks": detection_marks(
            range_=found.range,
            range_rate=found.range_rate,
            folded=folded_rates(found.range_rate, map_),
            power_db=_dbm(found.power),
            causes=victim.score.nature,
            origins=victim.score.origin,
        ),
        "is_periodic": map_.is_periodic,
        "map": map_data(
            range_=group_means(map_.range, most=ranges),
            range_rate=group_means(map_.range_rate, most=rates),
            power_db=_dbm(power),
        ),
    }


def _dbm(power: FloatArray) -> FloatArray:
    return np.asarray(to_db(np.maximum(power, 1e-30)) + 30.0)


def _sentence(victim: StoredVictim) -> str:
    score = victim.score
    seen = int(np.sum(score.is_in_sight))
    found = int(np.sum(score.is_detected & score.is_in_sight))
    targets = (
        f"finds {found} of {counted(seen, 'target')} in sight" if seen else "has no target in sight"
    )
    return (
        f"Radar {victim.name} {targets} and detects "
        f"{counted(len(score.ghosts), 'ghost')}; the floor is "
        f"{decimal(float(to_db(score.floor_rise)), 1)} dB above that of noise."
    )


def _victim(victim: StoredVictim) -> dict[str, Any]:
    """Tables of the targets and of the detections of one radar."""
    truth, score, found = victim.truth, victim.score, victim.detections
    targets = [
        [
            text_cell(name),
            number_cell(decimal(float(truth.range[n]))),
            number_cell(decimal(-float(truth.range_rate[n]))),
            verdict_cell(bool(score.is_detected[n]))
            if score.is_in_sight[n] or score.is_detected[n]
            else text_cell("not in sight"),
            number_cell(decimal(float(score.range_error[n]), 3, signed=True)),
            number_cell(decimal(-float(score.range_rate_error[n]), 3, signed=True)),
            number_cell(decimal(math.degrees(score.azimuth_error[n]), 2, signed=True)),
        ]
        for n, name in enumerate(truth.name)
    ]
    labels = causes()
    detections = [
        [
            text_cell(labels[score.nature[n]]["label"]),
            text_cell(score.origin[n] or "–"),
            number_cell(decimal(float(found.range[n]))),
            number_cell(decimal(-float(found.range_rate[n]))),
            number_cell(decimal(math.degrees(found.azimuth[n]))),
            number_cell(decimal(float(_dbm(found.power)[n]), 1)),
        ]
        for n in range(found.num_detections)
    ]
    place = ("Range (m)", "Closing speed (m/s)")
    errors = ("Range error (m)", "Speed error (m/s)", "Azimuth error (°)")
    return {
        "name": victim.name,
        "count": counted(found.num_detections, "detection"),
        "targets": Table(("Target", *place, "Result", *errors), targets),
        "detections": Table(("Cause", "From", *place, "Azimuth (°)", "Power (dBm)"), detections),
    }
