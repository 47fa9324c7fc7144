"""Detections of two versions of the coherent receiver on the same frames.

    python -m bench.same_detections streets STREETS [SEED …]
    PYTHONPATH=OLD/src OPENBLAS_NUM_THREADS=1 python -m bench.same_detections record A [STREETS]
    PYTHONPATH=src OPENBLAS_NUM_THREADS=1 python -m bench.same_detections record B [STREETS]
    python -m bench.same_detections compare A B

`streets` traces frames of the paper's street, `record` stores detections on drawn frames, or on
those of a file, with the CPU time of each, and `compare` prints what differs. Frames of points are
drawn with 1 to 14 points of 56 dB of power range, on equal and on diverse triangles, without and
with noise from one direction on a third of the ramps.
"""

from __future__ import annotations

import pickle
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from polychirp.model.if_frame import IfFrame
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.trial import run_trial
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.interference import with_noisy_ramps
from tests.support.points import HandPoint, frame_of

Found = dict[str, Any]
"""Detections on a frame: place (m, m/s, rad), SNR, and the CPU time that they took, s."""

FAMILIES = {
    "equal": Triangular(bandwidth=1e9, ramp_duration=1e-3),
    "diverse": DiverseTriangular(),
}
TRIALS, MOST_POINTS = 28, 14
GATE = (0.05, 0.02, 0.05)
"""Range (m), range rate (m/s) and azimuth (rad) within whose sum two detections are the same."""

ERROR_OF_RANGE = np.sqrt(12.0) / (2.0 * np.pi)
"""Cramér–Rao bound of a range in cells c/2B, times the root of twice the coherent SNR."""


def drawn(family: str, trial: int, *, is_interfered: bool) -> IfFrame:
    """One frame of drawn points."""
    draw = np.random.default_rng([trial, is_interfered, len(family)])
    points = [
        HandPoint(
            range=draw.uniform(2, 29),
            range_rate=draw.uniform(-30, 30),
            azimuth=draw.uniform(-1, 1),
            power=10 ** draw.uniform(-2.6, 3),
        )
        for _ in range(1 + trial % MOST_POINTS)
    ]
    ramps = FAMILIES[family].schedule(num_sweeps=16, streams=Streams(trial + 50))
    frame = frame_of(ramps, points, seed=trial)
    if not is_interfered:
        return frame
    count = ramps.num_ramps
    power = np.where(draw.random(count) < 0.3, 10 ** draw.uniform(1, 4, count), 0.0)
    return with_noisy_ramps(frame, power, azimuth=draw.uniform(-1, 1), seed=trial)


def drawn_frames() -> Iterator[tuple[str, IfFrame]]:
    """All drawn frames with their names."""
    for trial in range(TRIALS):
        for family in FAMILIES:
            for is_interfered in (False, True):
                name = f"{family} {trial}{' interfered' if is_interfered else ''}"
                yield name, drawn(family, trial, is_interfered=is_interfered)


def street_frames(seeds: list[int]) -> list[tuple[str, IfFrame]]:
    """Frames of all radars of the paper's street, conventional and diverse."""
    return [
        (f"{waveform} {seed} {one.name}", one.frame)
        for seed in seeds
        for waveform in ("conventional", "diverse")
        for one in run_trial(replace(paper_study(waveform), seed=seed)).victims
    ]


def recorded(frames: Iterator[tuple[str, IfFrame]]) -> dict[str, Found]:
    """Detections on frames, and the CPU time of the second run on each, s."""
    found: dict[str, Found] = {}
    receiver = CoherentReceiver()
    for name, frame in frames:
        receiver.detect(frame)
        began = time.process_time()
        one = receiver.detect(frame)
        taken = time.process_time() - began
        place = np.stack([one.range, one.range_rate, one.azimuth], axis=1)
        found[name] = {"place": place, "snr": np.array(one.snr), "time": taken}
    return found


def compared(before: dict[str, Found], after: dict[str, Found]) -> None:
    """Print the frames that differ, and totals."""
    cell = 0.15  # of about 1 GHz, m
    ratio, apart, in_bounds, numbers = [], [], [], 0
    for name, old in before.items():
        new = after[name]
        ratio.append(old["time"] / new["time"])
        off = np.abs(old["place"][:, None] - new["place"]) / GATE
        near = off.sum(axis=2) < 1.0
        lost, fresh = (~near.any(axis=1)).sum(), (~near.any(axis=0)).sum()
        numbers += len(old["place"]) != len(new["place"])
        if near.size:
            error = GATE[0] * np.where(near, off[:, :, 0], np.inf).min(axis=1)
            is_same = np.isfinite(error)
            bound = cell * ERROR_OF_RANGE / np.sqrt(2.0 * old["snr"])
            apart.extend(error[is_same])
            in_bounds.extend((error / bound)[is_same])
        if lost or fresh:
            print(f"{name}: {len(old['place'])} detections, {lost} lost, {fresh} new")
    print(f"{len(ratio)} frames, {numbers} with another number of detections")
    for share in (50, 95, 100):
        print(
            f"ranges of {share} % of the same detections differ by less than "
            f"{1e3 * np.percentile(apart, share):.4f} mm and "
            f"{np.percentile(in_bounds, share):.4f} of the Cramér–Rao bound"
        )
    print(f"CPU time before over after: median {np.median(ratio):.2f}")


def main(command: str, path: str, *others: str) -> None:
    """Do as the words of the command line say."""
    if command == "compare":
        files = []
        for one in (path, *others):
            files.append(pickle.loads(Path(one).read_bytes()))
        compared(*files)
        return
    if command == "streets":
        stored = street_frames([int(one) for one in others] or [1])
    elif others:
        stored = recorded(iter(pickle.loads(Path(others[0]).read_bytes())))
    else:
        stored = recorded(drawn_frames())
    Path(path).write_bytes(pickle.dumps(stored))


if __name__ == "__main__":
    main(*sys.argv[1:])
