"""Datasets of interfered frames with their clean twins, stored as Zarr, one group per frame.

A frame depends on the source, the seed and its number alone. Its group is written beside its place
and moved there when it is complete: an interrupted run continues with the missing frames, and the
bytes are the same for any number of workers.
"""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from polychirp.errors import InputError, RunError
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.scoring.burst_detection import hit_in_truth
from polychirp.study.mitigation.engine_frames import (
    ROADS,
    StudyFrame,
    frame_of_study,
    kept_interference,
    road_study,
)
from polychirp.study.mitigation.frame_sets import FRAME_SETS, NEWEST, PUBLISHED
from polychirp.study.mitigation.published import ARIM_GRID, PublishedFrame, arim
from polychirp.study.mitigation.street_frames import STREETS, street_study
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.tasks import Outcome, Task, outcome_of
from polychirp.study.provenance import canonical_json, versions
from polychirp.study.spec import Study
from polychirp.units import from_db

FORMAT: Final = "polychirp dataset, version 4"

GRID: Final = "arim-grid"
"""Preset that takes the cells of ARIM's grid in turn: frame n is of cell n modulo 960."""

PRESETS: Final = (*FRAME_SETS[NEWEST], GRID)
"""Kinds of frames by name, beside a study's: those of the benchmark, with other draws, and `GRID`,
whose frames depend on their number too."""

ARRAYS: Final[Mapping[str, tuple[tuple[str, ...], str, str]]] = {
    "interfered": (("channel", "ramp", "fast"), "V", "samples of the radar"),
    "clean": (("channel", "ramp", "fast"), "V", "the same without other radars"),
    "noise_free": (("channel", "ramp", "fast"), "V", "echoes alone"),
    "interference": (("channel", "ramp", "fast"), "V", "signals of other radars alone"),
    "hit": (("ramp", "fast"), "", "interference exceeds the noise's mean power"),
    "sample_rate": (("radar",), "1/s", "of the converter; one value"),
    "receiver_position": (("channel", "xyz"), "m", "of each channel's element, from the radar"),
    "transmitter_position": (("element", "xyz"), "m", "of each transmitting element; y is left"),
    "num_samples": (("ramp",), "", "samples on each ramp; the rest is padding"),
    "first": (("ramp",), "s", "time of each ramp's first sample"),
    "start_time": (("ramp",), "s", "start of each ramp"),
    "start_frequency": (("ramp",), "Hz", "of each ramp"),
    "duration": (("ramp",), "s", "of each ramp"),
    "slope": (("ramp",), "Hz/s", "of each ramp"),
    "transmit_weight": (("ramp", "element"), "", "of each transmitting element; 1: full power"),
    "target_range": (("target",), "m", "of each target, in the middle of the frame"),
    "target_range_rate": (("target",), "m/s", "positive: away"),
    "target_azimuth": (("target",), "rad", "positive: left; 0 for presets of one channel"),
    "target_elevation": (("target",), "rad", "positive: up; 0 for presets of one channel"),
    "target_is_visible": (("target",), "", "in sight of the radar"),
    "cell": (("label",), "", "SNR and SIR, dB, and relative slope; of the preset arim-grid only"),
    "path_transmitter": (("path",), "", "number of the transmitting radar; of bodies only"),
    "path_delay": (("path",), "s", "of each path to the radar"),
    "path_gain": (("path",), "", "norm of its polarimetric transfer"),
    "other_radar": (("other",), "", "number of the radar of each ramp of others; of bodies only"),
    "other_start_time": (("other",), "s", "start of each ramp of others, at their antennas"),
    "other_start_frequency": (("other",), "Hz", "of each ramp of others"),
    "other_duration": (("other",), "s", "of each ramp of others"),
    "other_slope": (("other",), "Hz/s", "of each ramp of others"),
}
"""Axes, unit and meaning of the arrays of a frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetPlan:
    """A dataset: its source, seed and number of frames.

    Parameters
    ----------
    source : study, or name of one of `PRESETS`
    """

    source: Study | str
    seed: int
    num_frames: int

    def __post_init__(self) -> None:
        if self.num_frames < 1:
            raise InputError(f"the number of frames is {self.num_frames}; use 1 or more")
        if self.seed < 0:
            raise InputError(f"seed: is {self.seed}; use 0 or more")

    def header(self) -> dict[str, Any]:
        """Everything on which the bytes of a frame depend, without the number of frames."""
        source = self.source
        return {
            "format": FORMAT,
            "preset": source if isinstance(source, str) else None,
            "study": None if isinstance(source, str) else json.loads(canonical_json(source)),
            "seed": self.seed,
            "versions": versions(),
            "arrays": {
                name: {"axes": axes, "unit": unit, "meaning": meaning}
                for name, (axes, unit, meaning) in ARRAYS.items()
            },
        }


def write_dataset(
    plan: DatasetPlan, folder: Path, *, workers: int = 1, progress: Progress = no_progress
) -> int:
    """Write the frames that ``folder`` lacks, and the data card; return how many were written.

    Raises
    ------
    InputError
        The folder holds another dataset, or other files.
    RunError
        A frame cannot be made or stored.
    """
    from polychirp.study.monte_carlo.executor import LocalWorkers

    _prepare(plan, folder)
    missing = [n for n in range(plan.num_frames) if not frame_folder(folder, n).is_dir()]
    tasks = (Task(point=0, trial=n, seed=trial_seed(plan.seed, n)) for n in missing)
    work = partial(_written, plan, folder)
    outcomes: Iterator[Outcome]
    outcomes = (
        map(work, tasks) if workers == 1 else LocalWorkers(count=workers).compute(work, tasks)
    )
    progress("frames", 0, len(missing))
    for number, outcome in enumerate(outcomes, start=1):
        if outcome.failure:
            raise RunError(
                f"frame {outcome.task.trial} failed: {outcome.failure}; finished frames are kept"
            )
        progress("frames", number, len(missing))
    card = data_card(plan, num_frames=num_stored(folder))
    (folder / "README.md").write_text(card, encoding="utf-8")
    return len(missing)


def num_stored(folder: Path) -> int:
    """Number of frames in a folder, also of those that an earlier call wrote."""
    return sum(1 for _ in folder.glob("frame-*.zarr"))


def frame_folder(folder: Path, number: int) -> Path:
    """Folder of a frame's Zarr group."""
    return folder / f"frame-{number:06d}.zarr"


def frame_arrays(plan: DatasetPlan, number: int) -> dict[str, NDArray[Any]]:
    """All `ARRAYS` of a frame by name.

    >>> arrays = frame_arrays(DatasetPlan(source="tu-delft", seed=1, num_frames=1), 0)
    >>> missing = sorted(set(ARRAYS) - set(arrays))
    >>> missing[0], missing[-3:]
    ('cell', ['path_delay', 'path_gain', 'path_transmitter'])
    >>> bool(np.allclose(arrays["clean"] + arrays["interference"], arrays["interfered"], atol=1e-5))
    True
    """
    seed = trial_seed(plan.seed, number)
    if isinstance(plan.source, str):
        return _preset_arrays(plan.source, Streams(seed).of("dataset", plan.source), number)
    one = frame_of_study(replace(plan.source, seed=seed))
    clean = {"clean": one.clean.astype(np.complex64)}
    return _samples(one.frame, one.parts) | clean | _truth(one)


def _truth(one: StudyFrame) -> dict[str, NDArray[Any]]:
    """Targets, paths and ramps of the other radars of a frame of a study."""
    return _ramps(one.others) | {
        "target_range": one.truth.range,
        "target_range_rate": one.truth.range_rate,
        "target_azimuth": one.truth.azimuth,
        "target_elevation": one.truth.elevation,
        "target_is_visible": one.truth.is_visible,
        "path_transmitter": one.paths.transmitter,
        "path_delay": one.paths.delay,
        "path_gain": np.linalg.norm(one.paths.transfer, axis=(1, 2)),
    }


def _ramps(others: Mapping[int, RampSchedule]) -> dict[str, NDArray[Any]]:
    """Ramps of all other radars, one radar after the other."""
    owners = [np.full(one.num_ramps, number) for number, one in others.items()]
    nothing: NDArray[Any] = np.zeros(0)

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([nothing, *(getattr(one, name) for one in others.values())])

    names = ("start_time", "start_frequency", "duration", "slope")
    return {
        "other_radar": np.concatenate([nothing.astype(np.int64), *owners]),
        **{f"other_{name}": joined(name) for name in names},
    }


def _preset_arrays(name: str, streams: Streams, number: int) -> dict[str, NDArray[Any]]:
    if name in ROADS or name in STREETS:
        is_road = name in ROADS
        study = (
            road_study(streams, ROADS[name]) if is_road else street_study(streams, STREETS[name])
        )
        kept = ROADS[name].kept if is_road else STREETS[name].kept
        one = frame_of_study(study)
        return _samples(*kept_interference(one.frame, one.parts, kept)) | _truth(one)
    if name == GRID:
        snr, sir, ratio = ARIM_GRID[number % len(ARIM_GRID)]
        drawn = arim(streams, snr=from_db(snr), sir=from_db(sir), ratio=ratio)
        return _of_points(drawn) | {"cell": np.array([snr, sir, ratio])}
    return _of_points(PUBLISHED[name](streams))


def data_card(plan: DatasetPlan, *, num_frames: int) -> str:
    """Content and origin of a dataset of so many frames, as Markdown."""
    source = (
        f"the preset `{plan.source}`"
        if isinstance(plan.source, str)
        else f"the study `{plan.source.name}`, whose settings are in `dataset.json`"
    )
    rows = "\n".join(
        f"| `{name}` | {', '.join(axes)} | {unit or '–'} | {meaning} |"
        for name, (axes, unit, meaning) in ARRAYS.items()
    )
    return f"""# Simulated radar frames with interference

{num_frames} frames of {source}, seed {plan.seed}, made by polychirp {versions()["polychirp"]}.
Every frame is a Zarr group, `frame-NUMBER.zarr`, of these arrays:

| array | axes | unit | content |
|---|---|---|---|
{rows}

Samples are complex64; `interfered` is `clean` plus `interference`, and `clean` is `noise_free` plus
noise and leakage. With a digitiser, both are what it reads: `clean` without other radars. All
frames are simulated: none is recorded. Frames are drawn independently, so
that any split by numbers separates training from tests. The targets of studies, roads and streets
are their bodies, seen from the radar; those of tu-delft, arim and toth are all drawn points, also
those below the noise.
"""


def _samples(frame: IfFrame, parts: IfParts) -> dict[str, NDArray[Any]]:
    interference = parts.interference
    own = frame.schedule
    return {
        "interfered": frame.samples.astype(np.complex64),
        "clean": (frame.samples - interference).astype(np.complex64),
        "noise_free": parts.echo.astype(np.complex64),
        "interference": interference.astype(np.complex64),
        "hit": hit_in_truth(parts, frame.times.is_sample),
        "sample_rate": np.array([frame.times.rate]),
        "receiver_position": frame.array.position,
        "transmitter_position": frame.array.transmit_position[: own.num_elements],
        "num_samples": frame.times.num_samples,
        "first": frame.times.first,
        "start_time": own.start_time,
        "start_frequency": own.start_frequency,
        "duration": own.duration,
        "slope": own.slope,
        "transmit_weight": own.transmit_weight,
    }


def _of_points(drawn: PublishedFrame) -> dict[str, NDArray[Any]]:
    """Arrays of a frame of the literature, with its points in the middle of the frame."""
    times = drawn.frame.times
    middle = 0.5 * float(times.time[0, 0] + times.time[-1, -1])
    rate = np.array([target.range_rate for target in drawn.targets])
    return _samples(drawn.frame, drawn.parts) | {
        "target_range": np.array([target.range for target in drawn.targets]) + rate * middle,
        "target_range_rate": rate,
        "target_azimuth": np.zeros(len(rate)),
        "target_elevation": np.zeros(len(rate)),
        "target_is_visible": np.ones(len(rate), dtype=np.bool_),
    }


def _prepare(plan: DatasetPlan, folder: Path) -> None:
    """Make the folder with its header, or check that it holds frames of the same plan."""
    header = json.dumps(plan.header(), indent=1, ensure_ascii=False) + "\n"
    path = folder / "dataset.json"
    if path.exists():
        if path.read_text(encoding="utf-8") != header:
            raise InputError(
                f"'{folder}' holds a dataset of another source, seed or version; name another one"
            )
        return
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"'{folder}' holds other files; name an empty or a new folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(header, encoding="utf-8")
    except OSError as error:
        raise RunError(f"'{folder}' cannot be written: {error.strerror or error}") from error


def _written(plan: DatasetPlan, folder: Path, task: Task) -> Outcome:
    """Make and store the frame of a task."""

    def store() -> str:
        path = frame_folder(folder, task.trial)
        unfinished = path.with_suffix(".unfinished")
        shutil.rmtree(unfinished, ignore_errors=True)
        _write_frame(unfinished, frame_arrays(plan, task.trial), number=task.trial)
        unfinished.rename(path)
        return path.name

    return outcome_of(task, store)


def _write_frame(path: Path, arrays: Mapping[str, NDArray[Any]], *, number: int) -> None:
    import zarr
    from zarr.codecs import BloscCodec

    root = zarr.create_group(store=path, zarr_format=3)
    root.attrs.update({"format": FORMAT, "frame": number})
    for name, values in arrays.items():
        axes, unit, _ = ARRAYS[name]
        stored = root.create_array(
            name,
            shape=values.shape,
            dtype=values.dtype,
            chunks=tuple(max(1, length) for length in values.shape),
            compressors=BloscCodec(
                cname="lz4", shuffle="bitshuffle", typesize=values.dtype.itemsize
            ),
            dimension_names=axes,
            attributes={"units": unit},
            config={"write_empty_chunks": True},
        )
        if values.size:
            stored[...] = values
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        zarr.consolidate_metadata(path)
