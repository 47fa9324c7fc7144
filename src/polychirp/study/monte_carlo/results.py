"""`Results` — results of all trials of a plan as arrays, and their store.

.. code-block:: text

    results.zarr              attributes: format, version, provenance, axes of the grid, hash of
    │                         each point's study, trials and stop_half_width that were asked for
    ├── AXIS …                labels of each axis of the grid; victim, target, nature: names
    ├── num_trials            (AXIS …) number of trials at each point
    ├── seed                  (trial)
    ├── detected              (AXIS …, trial, victim, target) 1 detected, 0 missed
    ├── range … detection_sinr(AXIS …, trial, victim, target)
    ├── num_detections            (AXIS …, trial, victim, nature)
    ├── floor_rise …          (AXIS …, trial, victim)
    └── lost                  (AXIS …, trial, victim, frame) 1 lost, 0 not; of rules from frame to
                              frame (`FrameHistory`), and without frames for all others

Every array names its axes and its unit, as xarray reads them. **NaN** means that there is no value:
the trial was not run or failed, the victim does not have this target, or the target was not in
sight (``detected``) or not detected (errors, ``detection_sinr``). The ``mean`` of ``detected`` over
trials is thus the detection probability.
"""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, cast

import numpy as np

from polychirp.axes import Axes, FloatArray, IntArray, axes_of, seal
from polychirp.errors import InputError
from polychirp.study.folders import replace_folder
from polychirp.study.monte_carlo.grid import Label, trial_seed
from polychirp.study.monte_carlo.plan import Plan
from polychirp.study.monte_carlo.records import (
    NATURES,
    TRIALS_ARE_KEPT,
    TrialRecord,
    VictimRecord,
    write_errors,
)
from polychirp.study.provenance import Provenance, canonical_json

if TYPE_CHECKING:
    from zarr import Group

FORMAT: Final = "polychirp monte carlo"
FORMAT_VERSION: Final = 8

PerTargetOfTrial = Annotated[FloatArray, Axes("point", "trial", "victim", "target")]

_UNITS: Final = {
    "num_trials": "1",
    "seed": "1",
    "detected": "1",
    "range": "m",
    "range_rate": "m/s",
    "azimuth": "rad",
    "elevation": "rad",
    "range_error": "m",
    "range_rate_error": "m/s",
    "azimuth_error": "rad",
    "elevation_error": "rad",
    "detection_sinr": "1",
    "echo_snr": "1",
    "snr": "1",
    "inr": "1",
    "mitigated_sinr": "1",
    "num_points": "1",
    "length": "m",
    "width": "m",
    "range_rate_span": "m/s",
    "visible_length": "m",
    "visible_width": "m",
    "visible_range_rate_span": "m/s",
    "num_detections": "1",
    "floor_rise": "1",
    "num_unresolved": "1",
    "lost": "1",
    "num_out_of_sight": "1",
}
"""Unit of every stored array; "1" for numbers and ratios."""

_OF_DETECTED: Final = (
    *("range_error", "range_rate_error", "azimuth_error", "elevation_error"),
    *("detection_sinr", "length", "width", "range_rate_span"),
)
_TRUE_VALUES: Final = (
    *("range", "range_rate", "azimuth", "elevation"),
    *("echo_snr", "snr", "inr", "mitigated_sinr", "num_points"),
    *("visible_length", "visible_width", "visible_range_rate_span"),
)
"""Arrays with values for detected targets alone, and for all targets."""

_OF_FRAMES: Final = ("floor_rise", "num_unresolved", "num_out_of_sight")
"""Arrays with one value for each frame."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Results:
    """Results of all trials; NaN where there is no value.

    `load_results` reads it from a folder into which `run_plan` has stored it.

    Parameters
    ----------
    axes : name and labels of each axis of the grid; the array axis ``point`` counts through all
        combinations of labels, those of the last axis fastest
    study_hash : hash of the study of each point
    victim, target : names of the radars with results, and of all their targets
    num_trials : number of trials at each point; a trial that failed is counted and has NaN
    seed : seed of each trial, the same at every point
    detected : 1 if the target was detected, 0 if it was missed, NaN if it is not visible
    range, range_rate, azimuth, elevation : true values, m, m/s, rad, rad, of hidden targets too
    range_error, range_rate_error, azimuth_error, elevation_error : detected minus true value, m,
        m/s, rad, rad
    detection_sinr : power ratio at a target's detection, own echo to all other parts of the samples
    echo_snr : coherent SNR of the echo of each target's body, as of `Score`
    snr, inr : power ratio of own echo, and of interference, to noise in the cell of every target,
        detected or not, before mitigation
    mitigated_sinr : own echo to all other parts there, after mitigation
    num_points : number of detections on each target
    length, width, range_rate_span : extent of these along range, m, across, m, and in range rate,
        m/s; of objects, if the receiver groups detections
    visible_length, visible_width, visible_range_rate_span : extent of each target's visible metal
    num_detections : number of detections of each of `NATURES`
    floor_rise : power ratio, floor of the range spectra to that of noise alone
    num_unresolved : number of detections left out by the receiver, as of `Detections`
    lost : 1 if a frame was lost to interference, 0 if it was not, of a rule that acts from frame to
        frame; there are no frames if no point has such a rule
    num_out_of_sight : number of targets that no receiver could find (`scoring.sight`)
    origin : provenance of the study without its grid
    """

    axes: tuple[tuple[str, tuple[Label, ...]], ...]
    study_hash: tuple[str, ...]
    victim: tuple[str, ...]
    target: tuple[str, ...]
    num_trials: Annotated[IntArray, Axes("point", dtype=np.int64)]
    seed: Annotated[IntArray, Axes("trial", dtype=np.int64)]
    detected: PerTargetOfTrial
    range: PerTargetOfTrial
    range_rate: PerTargetOfTrial
    azimuth: PerTargetOfTrial
    elevation: PerTargetOfTrial
    range_error: PerTargetOfTrial
    range_rate_error: PerTargetOfTrial
    azimuth_error: PerTargetOfTrial
    elevation_error: PerTargetOfTrial
    detection_sinr: PerTargetOfTrial
    echo_snr: PerTargetOfTrial
    snr: PerTargetOfTrial
    inr: PerTargetOfTrial
    mitigated_sinr: PerTargetOfTrial
    num_points: PerTargetOfTrial
    length: PerTargetOfTrial
    width: PerTargetOfTrial
    range_rate_span: PerTargetOfTrial
    visible_length: PerTargetOfTrial
    visible_width: PerTargetOfTrial
    visible_range_rate_span: PerTargetOfTrial
    num_detections: Annotated[FloatArray, Axes("point", "trial", "victim", "nature")]
    floor_rise: Annotated[FloatArray, Axes("point", "trial", "victim")]
    num_unresolved: Annotated[FloatArray, Axes("point", "trial", "victim")]
    lost: Annotated[FloatArray, Axes("point", "trial", "victim", "frame")]
    num_out_of_sight: Annotated[FloatArray, Axes("point", "trial", "victim")]
    origin: Provenance

    def __post_init__(self) -> None:
        seal(self)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of labels on each axis of the grid."""
        return tuple(len(labels) for _, labels in self.axes)

    def labels(self, point: int) -> tuple[Label, ...]:
        """Label of a point on each axis."""
        numbers = np.unravel_index(point, self.shape) if self.shape else ()
        return tuple(labels[int(n)] for (_, labels), n in zip(self.axes, numbers, strict=True))


def study_name(results: Results) -> str:
    """Name of the study whose results these are."""
    return str(json.loads(results.origin.study)["name"])


def gather(plan: Plan, *, num_trials: Sequence[int], records: Iterable[TrialRecord]) -> Results:
    """Results of a plan, from records of its trials in any order.

    Of point n, the trials 0 … ``num_trials[n]`` − 1 are used, and later records are left out.
    """
    point_of = {point.study_hash: n for n, point in enumerate(plan.points)}
    kept = {}
    for record in records:
        point = point_of.get(record.study_hash)
        if point is not None and record.trial < num_trials[point]:
            kept[point, record.trial] = record
    ordered = [kept[key] for key in sorted(kept)]
    victims = _names(victim.name for record in ordered for victim in record.victims)
    targets = _names(
        name for record in ordered for victim in record.victims for name in victim.target
    )
    trials = max(num_trials)
    of_trial = (len(plan.points), trials, len(victims))
    arrays = {
        name: np.full((*of_trial, len(targets)), np.nan)
        for name in ("detected", *_TRUE_VALUES, *_OF_DETECTED)
    }
    arrays["num_detections"] = np.full((*of_trial, len(NATURES)), np.nan)
    arrays |= {name: np.full(of_trial, np.nan) for name in _OF_FRAMES}
    frames = max((len(victim.lost) for record in ordered for victim in record.victims), default=0)
    arrays["lost"] = np.full((*of_trial, frames), np.nan)
    for (point, trial), record in kept.items():
        for victim in record.victims:
            columns = [targets.index(name) for name in victim.target]
            _fill(arrays, (point, trial, victims.index(victim.name)), victim, columns)
    return Results(
        axes=tuple((axis.name, axis.labels) for axis in plan.axes),
        study_hash=tuple(point.study_hash for point in plan.points),
        victim=victims,
        target=targets,
        num_trials=np.array(num_trials, dtype=np.int64),
        seed=np.array([trial_seed(plan.origin.seed, n) for n in range(trials)], dtype=np.int64),
        origin=plan.origin,
        **arrays,
    )


def _names(names: Iterable[str]) -> tuple[str, ...]:
    """Distinct names, in the order of their first appearance."""
    return tuple(dict.fromkeys(names))


def _fill(
    arrays: dict[str, FloatArray],
    place: tuple[int, int, int],
    record: VictimRecord,
    columns: list[int],
) -> None:
    is_detected = np.array(record.is_detected, bool)
    is_in_sight = np.array(record.is_in_sight, bool)
    arrays["num_detections"][place] = record.detections
    for name in _OF_FRAMES:
        arrays[name][place] = getattr(record, name)
    arrays["lost"][place][: len(record.lost)] = record.lost
    arrays["detected"][place][columns] = np.where(is_in_sight, is_detected, np.nan)
    for name in _TRUE_VALUES:
        arrays[name][place][columns] = getattr(record, name)
    for name in _OF_DETECTED:
        arrays[name][place][columns] = np.where(is_detected, getattr(record, name), np.nan)


def save_results(path: Path, results: Results, *, plan: Plan) -> None:
    """Store results in place of those at ``path``; equal results give equal files.

    `RunError` is raised if the folder cannot be written.
    """
    unfinished = path.with_name(f"{path.name}.unfinished")
    try:
        with write_errors(path, advice=TRIALS_ARE_KEPT):
            shutil.rmtree(unfinished, ignore_errors=True)
            _write(unfinished, results, plan)
            replace_folder(path, unfinished)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _write(path: Path, results: Results, plan: Plan) -> None:
    import zarr

    root = zarr.create_group(store=path, zarr_format=3)
    root.attrs.update(
        {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "provenance": asdict(results.origin),
            "grid": canonical_json(plan.axes),
            "trials": plan.trials,
            "stop_half_width": plan.stop_half_width,
            "study_hash": list(results.study_hash),
        }
    )
    names = {"victim": results.victim, "target": results.target, "nature": NATURES}
    for name, labels in (*results.axes, *names.items()):
        _write_labels(root, name, labels)
    grid = [name for name, _ in results.axes]
    for field, axes in axes_of(Results).items():
        array = getattr(results, field)
        dimensions = [*axes]
        if axes[0] == "point":
            array = array.reshape((*results.shape, *array.shape[1:]))
            dimensions = [*grid, *axes[1:]]
        _write_array(root, field, array, dimensions, chunk_axes=len(grid))
    with warnings.catch_warnings():
        # xarray reads all metadata from one file, which Zarr warns is not in its format 3
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(root.store)


def _write_labels(root: Group, name: str, labels: Sequence[Label]) -> None:
    is_number = all(isinstance(label, int | float) for label in labels) and len(labels) > 0
    values = np.array(labels) if is_number else np.array([str(v) for v in labels], dtype=object)
    array = root.create_array(
        name,
        shape=values.shape,
        dtype=values.dtype if is_number else str,
        chunks=(max(1, len(labels)),),
        dimension_names=[name],
    )
    if values.size:
        array[...] = values


def _write_array(
    root: Group, name: str, values: Any, dimensions: Sequence[str], *, chunk_axes: int
) -> None:
    from zarr.codecs import BloscCodec

    # a small array is one chunk; in a large one, each point of the grid is a chunk
    grid = min(chunk_axes, values.ndim) if values.nbytes > _LARGEST_SINGLE_CHUNK else 0
    chunks = (*(1,) * grid, *(max(1, length) for length in values.shape[grid:]))
    array = root.create_array(
        name,
        shape=values.shape,
        dtype=values.dtype,
        chunks=chunks,
        compressors=BloscCodec(cname="zstd", shuffle="bitshuffle", typesize=8),
        fill_value=np.nan if values.dtype.kind == "f" else 0,
        dimension_names=dimensions,
        attributes={"units": _UNITS[name]},
    )
    if values.size:
        array[...] = values


_LARGEST_SINGLE_CHUNK: Final = 16e6
"""Greatest size of an array that is stored as one chunk, bytes; chosen."""


def load_results(path: Path | str) -> Results:
    """Read stored results.

    `InputError` is raised if there are no results at ``path``, another version of polychirp wrote
    them, or they are damaged.

    `run_plan` stores such results.
    """
    import zarr
    from zarr.errors import NodeNotFoundError

    path = Path(path)
    try:
        root = zarr.open_group(store=path, mode="r", zarr_format=3)
        attributes = cast("dict[str, Any]", dict(root.attrs))
    except (FileNotFoundError, NodeNotFoundError, NotADirectoryError):
        raise InputError(
            f"there are no results in '{path}'; name the folder that ends in .zarr"
        ) from None
    stated = (attributes.get("format"), attributes.get("format_version"))
    if stated[0] != FORMAT:
        raise InputError(f"'{path}' holds no Monte Carlo results; name the folder 'results.zarr'")
    if stated != (FORMAT, FORMAT_VERSION):
        raise InputError(
            f"'{path}' has format version {stated[1]}; this polychirp reads version "
            f"{FORMAT_VERSION}, so run the study again"
        )
    try:
        return _stored(root, attributes)
    except (OSError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"the results in '{path}' are damaged ({error}); run the same command again, which "
            "makes them from the log of trials"
        ) from error


def _stored(root: Group, attributes: dict[str, Any]) -> Results:
    names: list[str] = list(cast("Any", root["num_trials"]).metadata.dimension_names or ())
    stored = {name: _values(root, name) for name in _UNITS}
    num_points = stored["num_trials"].size
    arrays = {
        field: stored[field].reshape((num_points, *stored[field].shape[len(names) :]))
        if axes[0] == "point"
        else stored[field]
        for field, axes in axes_of(Results).items()
    }
    return Results(
        axes=tuple((name, tuple(_values(root, name).tolist())) for name in names),
        study_hash=tuple(attributes["study_hash"]),
        victim=tuple(_values(root, "victim").tolist()),
        target=tuple(_values(root, "target").tolist()),
        origin=Provenance(**attributes["provenance"]),
        **arrays,
    )


def _values(root: Group, name: str) -> Any:
    return np.asarray(cast("Any", root[name])[...])
