"""Records of finished trials, and the log file that holds one line of text for each."""

import json
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final
from zlib import crc32

from polychirp.errors import InputError, RunError
from polychirp.file_locks import try_to_lock
from polychirp.scoring.causes import Nature
from polychirp.study.folders import remove_results

if TYPE_CHECKING:
    from polychirp.model.frame_history import FrameHistory
    from polychirp.model.score import Score
    from polychirp.model.truth import Truth
    from polychirp.study.trial import Trial, VictimResult

NATURES: Final = tuple(nature.value for nature in Nature)
"""Natures of detections, in the order of `VictimRecord.detections`."""

TRIALS_ARE_KEPT: Final = (
    "; finished trials are kept, and the same command continues with the missing trials"
)
"""End of the message of an error after which a run can be continued."""

_SYNC_INTERVAL: Final = 1.0
"""Least time between calls of ``fsync``, s; chosen: if the machine fails, trials may be lost that
finished within this time after the last call."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VictimRecord:
    """Results of one radar in one trial; errors, SINR and extents are zero for missed targets.

    Parameters
    ----------
    name : name of the radar
    target : names of its targets
    is_visible, is_in_sight, is_detected : True for each target that is in line of sight, that a
        receiver could find (`scoring.sight`), that was detected
    range, range_rate, azimuth, elevation : true values of each target, m, m/s, rad, rad
    range_error, range_rate_error, azimuth_error, elevation_error : detected minus true value, m,
        m/s, rad, rad
    detection_sinr : power ratio at each target's detection, own echo to all other parts of the
        samples
    echo_snr : coherent SNR of the echo of each target's body
    snr, inr, mitigated_sinr : power ratios in the cell of every target, as of `Score`
    num_points : number of detections on each target
    length, width, range_rate_span : extent of these, m, m, m/s, as of `Score`
    visible_length, visible_width, visible_range_rate_span : extent of each target's visible metal
    detections : number of detections of each of `NATURES`
    floor_rise : power ratio, floor of the range spectra to that of noise alone
    num_unresolved : number of detections left out by the receiver, as of `Detections`
    lost : True for each frame that was lost to interference, of a rule that acts from frame to
        frame (`FrameHistory`); empty for other rules
    """

    name: str
    target: tuple[str, ...]
    is_visible: tuple[bool, ...]
    is_in_sight: tuple[bool, ...]
    is_detected: tuple[bool, ...]
    range: tuple[float, ...]
    range_rate: tuple[float, ...]
    azimuth: tuple[float, ...]
    elevation: tuple[float, ...]
    range_error: tuple[float, ...]
    range_rate_error: tuple[float, ...]
    azimuth_error: tuple[float, ...]
    elevation_error: tuple[float, ...]
    detection_sinr: tuple[float, ...]
    echo_snr: tuple[float, ...]
    snr: tuple[float, ...]
    inr: tuple[float, ...]
    mitigated_sinr: tuple[float, ...]
    num_points: tuple[float, ...]
    length: tuple[float, ...]
    width: tuple[float, ...]
    range_rate_span: tuple[float, ...]
    visible_length: tuple[float, ...]
    visible_width: tuple[float, ...]
    visible_range_rate_span: tuple[float, ...]
    detections: tuple[int, ...]
    floor_rise: float
    num_unresolved: int
    lost: tuple[bool, ...] = ()

    @property
    def num_out_of_sight(self) -> int:
        """Number of targets that no receiver could find."""
        return len(self.target) - sum(self.is_in_sight)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialRecord:
    """Results of one trial.

    Parameters
    ----------
    study_hash : hash of the study of the trial's point
    trial : number of the trial, from 0
    seed : seed of the trial
    victims : record of each victim, in the order of the radars
    """

    study_hash: str
    trial: int
    seed: int
    victims: tuple[VictimRecord, ...]

    @property
    def key(self) -> tuple[str, int]:
        """Hash of the study, and number of the trial."""
        return self.study_hash, self.trial


def victim_records(trial: "Trial") -> tuple[VictimRecord, ...]:
    """Record of each victim of a trial."""
    return tuple(_record(victim, trial.frames) for victim in trial.victims)


def _record(victim: "VictimResult", frames: "FrameHistory | None") -> VictimRecord:
    def values(noun: "Truth | Score", *names: str) -> dict[str, Any]:
        return {name: tuple(getattr(noun, name).tolist()) for name in names}

    errors = ("range_error", "range_rate_error", "azimuth_error", "elevation_error")
    levels = ("detection_sinr", "echo_snr", "snr", "inr", "mitigated_sinr")
    extents = ("length", "width", "range_rate_span")
    visible = [victim.truth.extent(n) for n in range(len(victim.truth.name))]
    return VictimRecord(
        name=victim.name,
        target=victim.truth.name,
        **values(victim.truth, "is_visible", "range", "range_rate", "azimuth", "elevation"),
        **values(victim.score, "is_in_sight", "is_detected", *errors, *levels),
        **values(victim.score, "num_points", *extents),
        **{f"visible_{name}": tuple(getattr(one, name) for one in visible) for name in extents},
        detections=tuple(victim.score.nature.count(nature) for nature in NATURES),
        floor_rise=float(victim.score.floor_rise),
        num_unresolved=victim.score.num_unresolved,
        lost=() if frames is None else tuple(frames.of(victim.name).tolist()),
    )


def _line(content: Mapping[str, Any]) -> bytes:
    text = json.dumps(content, separators=(",", ":")).encode()
    return b"%08x %s\n" % (crc32(text), text)


def _content(line: bytes) -> dict[str, Any] | None:
    """Content of a line; None if it is incomplete or damaged."""
    mark, space, text = line.rstrip(b"\n").partition(b" ")
    if not (space and line.endswith(b"\n") and mark == b"%08x" % crc32(text)):
        return None
    content: dict[str, Any] = json.loads(text)
    return content


def _record_from(content: Mapping[str, Any]) -> TrialRecord:
    victims = tuple(_victim_from(victim) for victim in content["victims"])
    return TrialRecord(**{**content, "victims": victims})


def _victim_from(content: Mapping[str, Any]) -> VictimRecord:
    fields: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in content.items()
    }
    return VictimRecord(**fields)


class TrialLog:
    """An append-only file of finished trials, one line each with its checksum.

    A line is handed to the operating system as soon as its trial is finished, so that it stays
    however the program ends. ``fsync`` forces lines to the disk, at most once in `_SYNC_INTERVAL`.
    A line that a failure of the machine cut off is skipped, and its trial runs again.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._synced = time.monotonic()

    def append(self, record: Any) -> None:
        """Store the record of one finished trial, a data class."""
        try:
            self._file.write(_line(asdict(record)))
            self._file.flush()
            if time.monotonic() > self._synced + _SYNC_INTERVAL:
                os.fsync(self._file.fileno())
                self._synced = time.monotonic()
        except OSError as error:
            raise RunError(
                f"a finished trial cannot be stored: {error.strerror or error}; earlier trials "
                "are kept, and the same command continues with the missing trials"
            ) from error


@contextmanager
def trial_log(
    path: Path,
    *,
    made_with: Mapping[str, Any],
    anew: bool = False,
    results: Iterable[Path] = (),
) -> Iterator[TrialLog]:
    """The log at ``path``, open for one run at a time, after its last complete line.

    Parameters
    ----------
    made_with : versions and platform; a log that was made with other ones is refused
    anew : True to remove the trials in the log, and before them ``results``
    results : files and folders that were made from the log

    Raises
    ------
    InputError
        Another run is using the log, or it was made with other versions or on another platform.
    RunError
        The log cannot be written.
    """
    with write_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("a+b")
    try:
        _lock(file, path)
        with write_errors(path):
            if anew:
                for result in results:
                    remove_results(result)
                file.truncate(0)
            _go_to_end(file)
        if file.tell() == 0:
            file.write(_line(made_with))
        else:
            _need_same_makers(path, made_with)
        yield TrialLog(file)
        with write_errors(path):
            file.flush()
            os.fsync(file.fileno())
    finally:
        # closing tries again to write what could not be written; its error would hide the first one
        with suppress(OSError):
            file.close()


@contextmanager
def write_errors(path: Path, *, advice: str = "") -> Iterator[None]:
    """Turn an `OSError` into a `RunError` that names the file, and ends with ``advice``."""
    try:
        yield
    except OSError as error:
        raise RunError(f"'{path}' cannot be written: {error.strerror or error}{advice}") from error


def _go_to_end(file: IO[bytes]) -> None:
    """Remove an incomplete last line, and move to the end of the file."""
    file.seek(0)
    end = 0
    for line in file:
        if line.endswith(b"\n"):
            end += len(line)
    file.truncate(end)
    file.seek(end)


def _lock(file: IO[bytes], path: Path) -> None:
    """Refuse a second run, on systems with file locks."""
    if not try_to_lock(file):
        raise InputError(
            f"another run uses '{path.parent}'; wait for it, or name another folder with --out"
        )


def _need_same_makers(path: Path, made_with: Mapping[str, Any]) -> None:
    with path.open("rb") as file:
        earlier = _content(file.readline())
    if earlier != json.loads(json.dumps(made_with)):
        raise InputError(
            f"the trials in '{path.parent}' were made with {_in_words(earlier)}, and these would "
            f"be with {_in_words(made_with)}; name another folder with --out, or remove the "
            "trials with --force"
        )


def _in_words(made_with: Mapping[str, Any] | None) -> str:
    if made_with is None or not _is_header(made_with):
        return "unknown versions"
    versions = ", ".join(f"{name} {version}" for name, version in made_with["versions"].items())
    return f"{versions} on {made_with['platform']} ({made_with['format']})"


def read_records(path: Path) -> Iterator[TrialRecord]:
    """Every complete trial of a log, each once, in the order in which they finished."""
    seen: set[tuple[str, int]] = set()
    for content in read_contents(path):
        record = _record_from(content)
        if record.key not in seen:
            seen.add(record.key)
            yield record


def read_contents(path: Path) -> Iterator[dict[str, Any]]:
    """Content of every complete record of a log, in their order; none if there is no log.

    Logs with equal headers may follow each other in the file. `InputError` is raised if a later
    header differs from the first one.
    """
    if not path.exists():
        return
    with path.open("rb") as file:
        first = file.readline()
        for line in file:
            content = _content(line)
            if content is None or line == first:
                continue
            if _is_header(content):
                raise InputError(
                    f"'{path}' also holds trials made with {_in_words(content)}; keep trials of "
                    "different versions in folders of their own"
                )
            yield content


def _is_header(content: Mapping[str, Any]) -> bool:
    return {"format", "versions", "platform"} <= content.keys()
