"""What a trial yields, as one line of text, and the file that keeps those lines."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final
from zlib import crc32

from polychirp.errors import InputError, RunError
from polychirp.scoring.ghosts import Nature

if TYPE_CHECKING:
    from polychirp.study.trial import Trial, Victim

NATURES: Final = tuple(nature.value for nature in Nature)
"""What a claim can be, in the order in which claims are counted."""

_SYNC_INTERVAL: Final = 1.0
"""s between two calls that move lines from the system's memory to the disk."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VictimRecord:
    """What one radar found in one trial; errors are zero where nothing was found.

    Parameters
    ----------
    name : of the radar
    target : names of its targets
    is_visible, is_detected : of each target
    range, range_rate, azimuth : m, m/s, rad, true
    range_error, range_rate_error, azimuth_error : m, m/s, rad, found minus true
    sinr : ratio
    claims : number of each of `NATURES`
    floor_rise : ratio
    """

    name: str
    target: tuple[str, ...]
    is_visible: tuple[bool, ...]
    is_detected: tuple[bool, ...]
    range: tuple[float, ...]
    range_rate: tuple[float, ...]
    azimuth: tuple[float, ...]
    range_error: tuple[float, ...]
    range_rate_error: tuple[float, ...]
    azimuth_error: tuple[float, ...]
    sinr: tuple[float, ...]
    claims: tuple[int, ...]
    floor_rise: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialRecord:
    """What one trial found.

    Parameters
    ----------
    study_hash : of the point's study
    trial : its number
    seed : that runs it again
    victims : in the order of the radars
    """

    study_hash: str
    trial: int
    seed: int
    victims: tuple[VictimRecord, ...]

    @property
    def key(self) -> tuple[str, int]:
        """Which trial of which study."""
        return self.study_hash, self.trial


def victim_records(trial: Trial) -> tuple[VictimRecord, ...]:
    """What is kept of a trial."""
    return tuple(_record(victim) for victim in trial.victims)


def _record(victim: Victim) -> VictimRecord:
    truth, score = victim.truth, victim.score
    return VictimRecord(
        name=victim.name,
        target=truth.name,
        is_visible=tuple(truth.is_visible.tolist()),
        is_detected=tuple(score.is_detected.tolist()),
        range=tuple(truth.range.tolist()),
        range_rate=tuple(truth.range_rate.tolist()),
        azimuth=tuple(truth.azimuth.tolist()),
        range_error=tuple(score.range_error.tolist()),
        range_rate_error=tuple(score.range_rate_error.tolist()),
        azimuth_error=tuple(score.azimuth_error.tolist()),
        sinr=tuple(score.sinr.tolist()),
        claims=tuple(score.nature.count(nature) for nature in NATURES),
        floor_rise=float(score.floor_rise),
    )


# ── lines ─────────────────────────────────────────────────────────────────────


def _line(content: Mapping[str, Any]) -> bytes:
    text = json.dumps(content, separators=(",", ":")).encode()
    return b"%08x %s\n" % (crc32(text), text)


def _content(line: bytes) -> dict[str, Any] | None:
    """What a line says; None where it is torn or damaged."""
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


# ── the file ──────────────────────────────────────────────────────────────────


class TrialLog:
    """An append-only file of finished trials, one line each with its checksum.

    A line goes to the system in one call as soon as its trial is finished, so that it outlives
    the program however that ends; it is on the disk a second later. A line torn by a failing
    machine is left out, and its trial runs again.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._synced = time.monotonic()

    def append(self, record: TrialRecord) -> None:
        """Keep one finished trial."""
        try:
            self._file.write(_line(asdict(record)))
            self._file.flush()
            if time.monotonic() > self._synced + _SYNC_INTERVAL:
                os.fsync(self._file.fileno())
                self._synced = time.monotonic()
        except OSError as error:
            raise RunError(
                f"a finished trial cannot be kept: {error.strerror or error}; those before it "
                "are, and the same command goes on"
            ) from error


@contextmanager
def trial_log(
    path: Path, *, made_with: Mapping[str, Any], anew: bool = False
) -> Iterator[TrialLog]:
    """The file at ``path``, open for one run at a time, behind its last whole line.

    Parameters
    ----------
    made_with : versions and platform; a file made with others is refused
    anew : forget what is in it

    Raises
    ------
    InputError
        Another run is at work on it, or it was made with other versions.
    RunError
        It cannot be written.
    """
    with _write_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("a+b")
    try:
        _lock(file, path)
        with _write_errors(path):
            if anew:
                file.truncate(0)
            _go_to_end(file)
        if file.tell() == 0:
            file.write(_line(made_with))
        else:
            _need_same_makers(path, made_with)
        yield TrialLog(file)
        with _write_errors(path):
            file.flush()
            os.fsync(file.fileno())
    finally:
        # closing writes again what could not be written, and what it raises would hide the reason
        with suppress(OSError):
            file.close()


@contextmanager
def _write_errors(path: Path) -> Iterator[None]:
    """Raise `RunError` where the file cannot be written."""
    try:
        yield
    except OSError as error:
        raise RunError(f"'{path}' cannot be written: {error.strerror or error}") from error


def _go_to_end(file: IO[bytes]) -> None:
    """Cut off a line that was torn at the end."""
    file.seek(0)
    end = 0
    for line in file:
        if line.endswith(b"\n"):
            end += len(line)
    file.truncate(end)
    file.seek(end)


def _lock(file: IO[bytes], path: Path) -> None:
    """Refuse a second run where the system can tell; the lock ends with its program."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            f"another run is at work in '{path.parent}'; wait for it, or name another folder "
            "with --out"
        ) from None


def _need_same_makers(path: Path, made_with: Mapping[str, Any]) -> None:
    with path.open("rb") as file:
        earlier = _content(file.readline())
    if earlier != json.loads(json.dumps(made_with)):
        raise InputError(
            f"the trials in '{path.parent}' were made with {_in_words(earlier)}, and these would "
            f"be with {_in_words(made_with)}; name another folder with --out, or --force begins "
            "anew"
        )


def _in_words(made_with: Mapping[str, Any] | None) -> str:
    if made_with is None:
        return "nobody knows what"
    versions = ", ".join(f"{name} {version}" for name, version in made_with["versions"].items())
    return f"{versions} on {made_with['platform']}"


def read_records(path: Path) -> Iterator[TrialRecord]:
    """Every whole trial of a file, each once, in the order in which they were finished."""
    if not path.exists():
        return
    seen: set[tuple[str, int]] = set()
    with path.open("rb") as file:
        file.readline()
        for line in file:
            content = _content(line)
            if content is None:
                continue
            record = _record_from(content)
            if record.key not in seen:
                seen.add(record.key)
                yield record
