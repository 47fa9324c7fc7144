"""A run on disk: one Zarr 3 group with samples, parts, schedules, detections, truth, provenance.

.. code-block:: text

    run.zarr                          attributes: format, version, provenance, names of victims
    └── victim-0                      attributes: name, antenna array, high-pass
        ├── samples                   V (channel, ramp, fast)
        ├── parts                     V (part, channel, ramp, fast); attributes part, the names of
        │                             the parts, and neglected, V
        ├── times/first …             s (ramp); attribute rate, 1/s
        ├── schedule/start_time …     (ramp)
        ├── detections/range …        (detection); attributes time, s, and num_unresolved
        ├── truth/range …             (target), place_range (place); attributes time, s, and name
        └── score/range_error …       (target), power (detection); attributes nature, body …

Every array names its axes (``dimension_names``, as xarray reads them) and its unit.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import axes_of
from polychirp.capture.zarr_file import ZarrArray, group_attributes
from polychirp.errors import InputError, RunError, no_such
from polychirp.model.antenna import AntennaArray, ElementPattern
from polychirp.model.detection import Detections
from polychirp.model.front_end import HighPass
from polychirp.model.if_frame import IfFrame, IfParts, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.study.folders import replace_folder
from polychirp.study.provenance import Provenance

if TYPE_CHECKING:
    from zarr import Group

    from polychirp.study.trial import VictimResult

FORMAT: Final = "polychirp run"
FORMAT_VERSION: Final = 6

UNITS: Final[Mapping[type, Mapping[str, str]]] = {
    IfFrame: {"samples": "V"},
    IfParts: {"samples": "V"},
    SampleTimes: {"first": "s", "num_samples": "1"},
    RampSchedule: {
        "start_time": "s",
        "duration": "s",
        "start_frequency": "Hz",
        "slope": "Hz/s",
        "start_phase": "cycle",
        "sweep": "1",
        "transmit_weight": "1",
    },
    Detections: {
        "range": "m",
        "range_rate": "m/s",
        "azimuth": "rad",
        "elevation": "rad",
        "power": "W",
        "snr": "1",
        "num_points": "1",
        "length": "m",
        "width": "m",
        "range_rate_span": "m/s",
    },
    Score: {
        "is_detected": "1",
        "range_error": "m",
        "range_rate_error": "m/s",
        "azimuth_error": "rad",
        "elevation_error": "rad",
        "sinr": "1",
        "snr": "1",
        "inr": "1",
        "mitigated_sinr": "1",
        "num_points": "1",
        "length": "m",
        "width": "m",
        "range_rate_span": "m/s",
        "power": "W",
    },
    Truth: {
        "range": "m",
        "range_rate": "m/s",
        "azimuth": "rad",
        "elevation": "rad",
        "point": "m",
        "is_visible": "1",
        "place_target": "1",
        "place_range": "m",
        "place_range_rate": "m/s",
        "place_azimuth": "rad",
        "place_elevation": "rad",
    },
}
"""Unit of every stored array, by data type and field; "1" for numbers, ratios and masks."""

_FOLDERS: Final[Mapping[type, str]] = {
    SampleTimes: "times",
    RampSchedule: "schedule",
    Detections: "detections",
    Truth: "truth",
    Score: "score",
}
"""Name of the group of each data type, within the group of a victim."""

_AXIS_NAMES: Final = {"3": "xyz"}
"""Stored names of axes that are named by their length in the data types."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredVictim:
    """A `VictimResult` as it was stored: its samples have been rounded to single precision."""

    name: str
    frame: IfFrame
    parts: IfParts
    detections: Detections
    truth: Truth
    score: Score


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredRun:
    """A run as it was stored: its provenance and the results of its victims."""

    provenance: Provenance
    victims: tuple[StoredVictim, ...]

    def victim(self, name: str) -> StoredVictim:
        """The result of the radar called ``name``.

        `InputError` is raised if the run has no such victim; the message names the victims that it
        has.
        """
        for victim in self.victims:
            if victim.name == name:
                return victim
        raise InputError(no_such("radar", name, [victim.name for victim in self.victims]))


def save_run(path: Path | str, *, victims: Iterable[VictimResult], provenance: Provenance) -> None:
    """Store a run; equal runs give equal files.

    Samples and parts are stored as ``complex64``, all else in full precision. A folder at ``path``
    is replaced once the new run is complete. If it cannot be replaced, both are kept. `RunError` is
    raised if the folder cannot be written.
    """
    path = Path(path)
    unfinished = path.with_name(f"{path.name}.unfinished")
    is_complete = False
    try:
        shutil.rmtree(unfinished, ignore_errors=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(unfinished, victims=tuple(victims), provenance=provenance)
        is_complete = True
        replace_folder(path, unfinished)
    except OSError as error:
        kept = f"; the new run is kept in '{unfinished}'" if is_complete else ""
        raise RunError(f"'{path}' cannot be written: {error.strerror or error}{kept}") from error
    finally:
        if not is_complete:
            shutil.rmtree(unfinished, ignore_errors=True)


def _write(path: Path, *, victims: tuple[VictimResult, ...], provenance: Provenance) -> None:
    import zarr

    root = zarr.create_group(store=path, zarr_format=3)
    root.attrs.update(
        {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "has_all_chunks": True,
            "provenance": asdict(provenance),
            "victims": [victim.name for victim in victims],
        }
    )
    for number, victim in enumerate(victims):
        group = root.create_group(f"victim-{number}")
        frame = victim.frame
        corners = None if frame.high_pass is None else list(frame.high_pass.corners)
        group.attrs.update(
            {"name": victim.name, "array": _array_attributes(frame.array), "high_pass": corners}
        )
        _write_array(group, "samples", frame.samples, noun=IfFrame, field="samples")
        _write_array(group, "parts", victim.parts.samples, noun=IfParts, field="samples")
        group["parts"].attrs.update(
            {"part": list(victim.parts.names), "neglected": victim.parts.neglected}
        )
        _write_noun(group, "times", frame.times, {"rate": frame.times.rate})
        _write_noun(group, "schedule", frame.schedule, {})
        found, truth = victim.detections, victim.truth
        _write_noun(
            group, "detections", found, {"time": found.time, "num_unresolved": found.num_unresolved}
        )
        _write_noun(group, "truth", truth, {"time": truth.time, "name": list(truth.name)})
        _write_noun(group, "score", victim.score, _score_attributes(victim.score))


def _score_attributes(score: Score) -> dict[str, Any]:
    return {
        "nature": list(score.nature),
        "body": list(score.body),
        "target_detection": list(score.target_detection),
        "num_missed": score.num_missed,
        "floor_rise": score.floor_rise,
        "num_unresolved": score.num_unresolved,
    }


def _write_noun(parent: Group, name: str, noun: Any, attributes: dict[str, Any]) -> None:
    group = parent.create_group(name)
    group.attrs.update(attributes)
    for field in axes_of(type(noun)):
        _write_array(group, field, getattr(noun, field), noun=type(noun), field=field)


def _write_array(group: Group, name: str, values: NDArray[Any], *, noun: type, field: str) -> None:
    from zarr.codecs import BloscCodec

    stored = values.astype(np.complex64) if field == "samples" else values
    # each part is one chunk, so that a part can be read without the others
    whole = tuple(max(1, length) for length in stored.shape)
    chunks = (1, *whole[1:]) if name == "parts" else whole
    array = group.create_array(
        name,
        shape=stored.shape,
        dtype=stored.dtype,
        chunks=chunks,
        compressors=BloscCodec(cname="lz4", shuffle="bitshuffle", typesize=stored.dtype.itemsize),
        dimension_names=[_AXIS_NAMES.get(axis, axis) for axis in axes_of(noun)[field]],
        attributes={"units": UNITS[noun][field]},
        # a chunk of zeros is stored too, so that a missing chunk is noticed
        config={"write_empty_chunks": True},
    )
    if stored.size:
        array[...] = stored


def load_run(path: Path | str) -> StoredRun:
    """Read a stored run.

    `InputError` is raised if there is no complete run at ``path``, or it has another format
    version.
    """
    path = Path(path)
    try:
        attributes = group_attributes(path)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(
            f"there is no run in '{path}'; name the folder that ends in .zarr"
        ) from None
    if attributes.get("format") != FORMAT:
        raise InputError(
            f"'{path}' is not a run of polychirp: its attribute 'format' is not '{FORMAT}'"
        )
    if attributes.get("format_version") != FORMAT_VERSION:
        raise InputError(
            f"'{path}' has format version {attributes.get('format_version')}; this polychirp "
            f"reads version {FORMAT_VERSION}, so run the study again"
        )
    try:
        is_whole = bool(attributes.get("has_all_chunks", False))
        return StoredRun(
            provenance=Provenance(**attributes["provenance"]),
            victims=tuple(
                _read_victim(path / f"victim-{i}", is_whole)
                for i in range(len(attributes["victims"]))
            ),
        )
    except (OSError, KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(
            f"the run in '{path}' is damaged ({error}); run the study again"
        ) from error


def _read_victim(folder: Path, is_whole: bool) -> StoredVictim:
    attributes = group_attributes(folder)
    corners = attributes["high_pass"]

    def noun(kind: Any) -> Any:
        return _read_noun(kind, folder / _FOLDERS[kind], is_whole)

    frame = IfFrame(
        samples=ZarrArray(folder / "samples", has_all_chunks=is_whole).whole(),
        times=noun(SampleTimes),
        schedule=noun(RampSchedule),
        array=_array_from(str(attributes["array"])),
        high_pass=HighPass(corners=tuple(corners)) if corners else None,
    )
    return StoredVictim(
        name=str(attributes["name"]),
        frame=frame,
        parts=_read_parts(folder / "parts", is_whole),
        detections=noun(Detections),
        truth=noun(Truth),
        score=noun(Score),
    )


def _read_parts(folder: Path, is_whole: bool) -> IfParts:
    array = ZarrArray(folder, has_all_chunks=is_whole)
    return IfParts(
        samples=array.whole(),
        names=tuple(array.metadata.attributes["part"]),
        neglected=array.metadata.attributes["neglected"],
    )


def _read_noun(noun: Any, folder: Path, is_whole: bool) -> Any:
    attributes = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in group_attributes(folder).items()
    }
    arrays = {
        field: ZarrArray(folder / field, has_all_chunks=is_whole).whole() for field in axes_of(noun)
    }
    return noun(**attributes, **arrays)


def _array_attributes(array: AntennaArray) -> str:
    # JSON text, since an isotropic element's infinite beamwidth is no JSON number for Zarr
    return json.dumps(asdict(array))


def _array_from(text: str) -> AntennaArray:
    values = json.loads(text)
    pattern = ElementPattern(**values.pop("pattern"))
    return AntennaArray(**values, pattern=pattern)


def stored_hash(path: Path) -> str | None:
    """Hash of the study whose run is stored at ``path``; None if there is no run."""
    try:
        with (path / "zarr.json").open(encoding="utf-8") as file:
            attributes = json.load(file)["attributes"]
        return str(attributes["provenance"]["study_hash"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
