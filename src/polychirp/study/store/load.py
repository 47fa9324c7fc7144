"""Reading of a stored run."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.axes import axes_of
from polychirp.capture.zarr_file import ZarrArray, group_attributes
from polychirp.errors import InputError, no_such
from polychirp.model.antenna import AntennaArray, ElementPattern
from polychirp.model.detection import Detections
from polychirp.model.front_end import HighPass
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import IfFrame, IfParts, SampleTimes
from polychirp.model.paths import PropagationPaths
from polychirp.model.placement import Placement
from polychirp.model.ramp import RampSchedule
from polychirp.model.ramp_code import RampCode
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.study.provenance import Provenance
from polychirp.study.restored import restored
from polychirp.study.spec import Study
from polychirp.study.store.layout import FOLDERS, FORMAT, FORMAT_VERSION

if TYPE_CHECKING:
    from polychirp.report.run_plots import RunPlots


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredVictim:
    """A `VictimResult` as it was stored: its samples have been rounded to single precision.

    `StoredRun.victim` returns it.
    """

    name: str
    frame: IfFrame
    parts: IfParts
    paths: PropagationPaths
    detections: Detections
    truth: Truth
    score: Score
    placement: Placement


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredRun:
    """A run as it was stored.

    `load_run` returns it.

    Parameters
    ----------
    provenance : the study and the versions that made it
    radars, actors : names of the radars and actors to whose numbers paths refer
    victims : results of the radars that received
    """

    provenance: Provenance
    radars: tuple[str, ...]
    actors: tuple[str, ...]
    victims: tuple[StoredVictim, ...]

    @property
    def study(self) -> Study:
        """The study that was run; a mesh file is named by its name and content alone."""
        found: Study = restored(Study, json.loads(self.provenance.study))
        return found

    @property
    def plot(self) -> RunPlots:
        """Figures of the run as matplotlib axes, as in ``run.plot.range_profile()``."""
        from polychirp.report.run_plots import RunPlots

        return RunPlots(self)

    def victim(self, name: str) -> StoredVictim:
        """The result of the radar called ``name``.

        `InputError` is raised if the run has no such victim; the message names the victims that it
        has.
        """
        for victim in self.victims:
            if victim.name == name:
                return victim
        if name in self.radars:
            victims = ", ".join(f"'{victim.name}'" for victim in self.victims)
            raise InputError(
                f"the radar '{name}' is no victim of this run, which stored the frames of "
                f"{victims} alone; run the study with it among its victims"
            )
        raise InputError(no_such("radar", name, [victim.name for victim in self.victims]))


RUN: Final = "run.zarr"
"""Name of the run in the folder into which ``polychirp run`` stores its results."""


def load_run(path: Path | str) -> StoredRun:
    """Read a stored run, or the one in the folder into which ``polychirp run`` stored it.

    `InputError` is raised if there is no complete run at ``path``, or it has another format
    version.

    `save_run` writes such a run, and `export` writes it in other formats.
    """
    path = Path(path)
    # a run that holds another one in a folder of that name is meant itself
    if not (path / "zarr.json").is_file() and (path / RUN).is_dir():
        path = path / RUN
    try:
        attributes = group_attributes(path)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(
            f"there is no run in '{path}'; name the folder into which 'polychirp run' stored its "
            "results, or the one in it that ends in .zarr"
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
            radars=tuple(attributes["radars"]),
            actors=tuple(attributes["actors"]),
            victims=tuple(
                _read_victim(path / f"victim-{i}", is_whole)
                for i in range(len(attributes["victims"]))
            ),
        )
    except (OSError, KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(
            f"the run in '{path}' is damaged ({error}); run the study again"
        ) from error


def stored_hash(path: Path) -> str | None:
    """Hash of the study whose run is stored at ``path``; None if there is no run."""
    try:
        with (path / "zarr.json").open(encoding="utf-8") as file:
            attributes = json.load(file)["attributes"]
        return str(attributes["provenance"]["study_hash"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _read_victim(folder: Path, is_whole: bool) -> StoredVictim:
    attributes = group_attributes(folder)
    corners = attributes["high_pass"]

    def noun(kind: Any) -> Any:
        return _read_noun(kind, folder / FOLDERS[kind], is_whole)

    schedule = noun(RampSchedule)
    if (folder / FOLDERS[RampCode]).is_dir():
        schedule = replace(schedule, code=noun(RampCode))
    frame = IfFrame(
        samples=ZarrArray(folder / "samples", has_all_chunks=is_whole).whole(),
        times=noun(SampleTimes),
        schedule=schedule,
        array=_array_from(str(attributes["array"])),
        high_pass=HighPass(corners=tuple(corners)) if corners else None,
        if_filter=_filter_from(attributes.get("if_filter")),
    )
    return StoredVictim(
        name=str(attributes["name"]),
        frame=frame,
        parts=IfParts(
            samples=ZarrArray(folder / "parts", has_all_chunks=is_whole).whole(),
            names=tuple(attributes["part"]),
            neglected=attributes["neglected"],
        ),
        paths=noun(PropagationPaths),
        detections=noun(Detections),
        truth=noun(Truth),
        score=noun(Score),
        placement=noun(Placement),
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


def _filter_from(numbers: list[float] | None) -> IfFilter | None:
    """IF filter of its edges and attenuation; None in runs of versions that did not store it."""
    if not numbers:
        return None
    passband, stopband, attenuation = numbers
    return IfFilter(passband=passband, stopband=stopband, attenuation=attenuation)


def _array_from(text: str) -> AntennaArray:
    values = json.loads(text)
    pattern = ElementPattern(**values.pop("pattern"))
    return AntennaArray(**values, pattern=pattern)
