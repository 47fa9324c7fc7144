r"""SigMF recordings: complex samples in ``NAME.sigmf-data``, JSON in ``NAME.sigmf-meta``.

They follow the Signal Metadata Format 1.2. Fields that radars need and the format lacks have the
namespace ``polychirp:``. It is declared as an optional extension, which other readers may ignore.

========================== ==================================================================
``polychirp:schedule``     the ramps that were played: equally long lists, in SI
``polychirp:num_samples``  number of samples written; with fewer, a file was cut off
``polychirp:start_time``   time of the first sample on the clock of the schedule, s
========================== ==================================================================

Integers are read as ratios to full scale, 2¹⁵ for 16 bits, and written in the same way, so that
samples of 16 bits that are read and written again have the same bytes.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha512
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray
from polychirp.bounded_text import json_value, text_of
from polychirp.errors import InputError, short
from polychirp.model.baseband import Baseband, Progress, no_progress
from polychirp.model.ramp import RampSchedule

META: Final = ".sigmf-meta"
DATA: Final = ".sigmf-data"
"""Suffixes of the files of metadata and of samples."""

SIGMF_VERSION: Final = "1.2.0"
SIGMF_EXTENSION: Final = {"name": "polychirp", "version": "0.1.0", "optional": True}
"""Version of the format that is written; declaration of the namespace ``polychirp:`` in it."""

Written = Literal["ci16_le", "cf32_le"]

FORMATS: Final[Mapping[str, tuple[str, float, float]]] = {
    "cf64_le": ("<f8", 0.0, 1.0),
    "cf64_be": (">f8", 0.0, 1.0),
    "cf32_le": ("<f4", 0.0, 1.0),
    "cf32_be": (">f4", 0.0, 1.0),
    "ci32_le": ("<i4", 0.0, 2.0**31),
    "ci32_be": (">i4", 0.0, 2.0**31),
    "ci16_le": ("<i2", 0.0, 2.0**15),
    "ci16_be": (">i2", 0.0, 2.0**15),
    "cu16_le": ("<u2", 2.0**15, 2.0**15),
    "cu16_be": (">u2", 2.0**15, 2.0**15),
    "ci8": ("i1", 0.0, 2.0**7),
    "cu8": ("u1", 2.0**7, 2.0**7),
}
"""Data types that are read: element type, stored value of zero, steps from zero to full scale."""

RAMP_FIELDS: Final = (
    "start_time",
    "duration",
    "start_frequency",
    "slope",
    "start_phase",
    "sweep",
)
"""Fields of `RampSchedule` that the metadata hold, each as a list."""

LEAST_RATE: Final = 1.0
GREATEST_RATE: Final = 1e12
"""Bounds of plausible sample rates, 1/s. Chosen."""

GREATEST_FREQUENCY: Final = 1e12
"""Greatest plausible magnitude of a carrier frequency, Hz. Chosen."""

GREATEST_TIME: Final = 1e12
"""Greatest plausible magnitude of a start time, s. Chosen: seconds since 1970 are below it."""

GREATEST_OF_RAMP: Final = 1e18
"""Greatest plausible magnitude of any number in a schedule, in SI. Chosen: 1 GHz in 1 ns, Hz/s."""

MOST_SAMPLES: Final = 1 << 29
"""Greatest number of samples that are read into memory at once. Chosen: they take 8 GB."""

HASHED_AT_ONCE: Final = 1 << 24
"""Number of bytes that are hashed between two reports of progress. Chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SigmfRecording:
    """Complex samples on disk, read piece by piece (a `SampleSource`).

    Parameters
    ----------
    name : name of the recording, for messages
    path : path of the samples' file
    datatype : one of `FORMATS`
    sample_rate : 1/s
    centre_frequency : Hz; zero if the metadata name none
    num_samples : number of samples in the file
    start_time : time of the first sample, s
    schedule : ramps that were played; None if the metadata name none
    metadata : content of the metadata's file
    """

    name: str
    path: Path
    datatype: str
    sample_rate: float
    centre_frequency: float
    num_samples: int
    start_time: float
    schedule: RampSchedule | None
    metadata: Mapping[str, Any]

    def read(self, first: int, last: int) -> ComplexArray:
        """Samples from ``first`` to ``last - 1``, ``(time,)``, integers as ratios to full scale.

        `InputError` is raised if samples are NaN or too large, as happens with a wrong datatype.
        """
        kind, zero, full = FORMATS[self.datatype]
        width = np.dtype(kind).itemsize
        words: NDArray[Any] = np.fromfile(
            self.path, dtype=kind, count=2 * (last - first), offset=2 * width * first
        )
        values = (words.astype(np.float64) - zero) / full
        # below 1e100, squares of correlations stay finite
        if not np.all(np.abs(values) < 1e100):
            raise InputError(
                f"{self.name}: holds values that are not numbers or are implausibly large; its "
                f"core:datatype says {self.datatype}, but the samples may be integers"
            )
        return values.view(np.complex128)

    def signal(self) -> Baseband:
        """All samples, in memory.

        `InputError` is raised if there are more than `MOST_SAMPLES`, or some are NaN or too large.
        """
        if self.num_samples > MOST_SAMPLES:
            raise InputError(
                f"{self.name}: has {self.num_samples} samples, too many to be held in memory; cut "
                f"out at most {MOST_SAMPLES}, or use --search, which reads it piece by piece"
            )
        return Baseband(
            samples=self.read(0, self.num_samples),
            sample_rate=self.sample_rate,
            centre_frequency=self.centre_frequency,
            start_time=self.start_time,
        )


def open_sigmf(path: Path | str) -> SigmfRecording:
    """A recording by the path of either of its files; no sample is read yet.

    `InputError` is raised if a file cannot be read, if the metadata are no SigMF, contradict
    themselves, or describe samples that are not complex numbers of one channel, or if the number of
    samples in the file is wrong.
    """
    path = Path(path)
    meta = path.with_suffix(META)
    data = path.with_suffix(DATA)
    if path.suffix not in (META, DATA):
        raise InputError(f"'{path}' is no SigMF recording; name its file NAME{META}")
    metadata = _json(meta)
    fields, capture = _global(metadata, meta.name), _capture(metadata, meta.name)
    datatype = _datatype(fields, meta.name)
    rate = _number(fields, "core:sample_rate", meta.name, greatest=GREATEST_RATE)
    if not LEAST_RATE <= rate <= GREATEST_RATE:
        raise InputError(
            f"{meta.name}: core:sample_rate is {rate:g}; give the samples per second, from "
            f"{LEAST_RATE:g} to {GREATEST_RATE:g}"
        )
    count = _count(data, datatype, fields)
    schedule = _schedule(fields, meta.name)
    centre = _number(
        capture, "core:frequency", meta.name, greatest=GREATEST_FREQUENCY, otherwise=0.0
    )
    _check_band(schedule, rate, centre, meta.name)
    return SigmfRecording(
        name=data.name,
        path=data,
        datatype=datatype,
        sample_rate=rate,
        centre_frequency=centre,
        num_samples=count,
        start_time=_number(
            fields, "polychirp:start_time", meta.name, greatest=GREATEST_TIME, otherwise=0.0
        ),
        schedule=schedule,
        metadata=metadata,
    )


def check_sha512(recording: SigmfRecording, *, progress: Progress = no_progress) -> None:
    """Refuse samples whose SHA-512 differs from the one in their metadata, if one is there.

    `InputError` is raised if the two differ.
    """
    told = recording.metadata["global"].get("core:sha512")
    if told is None:
        return
    found = _hash(recording.path, progress)
    if found != str(told).lower():
        raise InputError(
            f"{recording.name}: its SHA-512 is not the one in its metadata: the samples were "
            "changed or belong to another recording; copy both files again"
        )


def _hash(path: Path, progress: Progress = no_progress) -> str:
    size, done, hashed = path.stat().st_size, 0, sha512()
    with path.open("rb") as file:
        while block := file.read(HASHED_AT_ONCE):
            progress("SHA-512", done, size)
            hashed.update(block)
            done += len(block)
    progress("SHA-512", size, size)
    return hashed.hexdigest()


def _json(path: Path) -> dict[str, Any]:
    try:
        found = json_value(text_of(path))
    except FileNotFoundError:
        raise InputError(f"there is no recording '{path}'") from None
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(
            f"{path.name}: is not JSON ({error}); SigMF metadata must be JSON"
        ) from None
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path.name}: is not an object with 'global' and 'captures', as SigMF is")
    return found


def _global(metadata: Mapping[str, Any], name: str) -> dict[str, Any]:
    fields = metadata.get("global")
    if not isinstance(fields, dict):
        raise InputError(f"{name}: has no object 'global'; SigMF metadata have one")
    if fields.get("core:num_channels", 1) != 1:
        raise InputError(
            f"{name}: has {short(repr(fields['core:num_channels']))} channels; store each channel "
            "as its own recording"
        )
    return fields


def _capture(metadata: Mapping[str, Any], name: str) -> dict[str, Any]:
    captures = metadata.get("captures")
    if not (isinstance(captures, list) and all(isinstance(one, dict) for one in captures)):
        raise InputError(f"{name}: has no list 'captures'; SigMF metadata have one")
    if any(one.get("core:header_bytes") for one in captures):
        raise InputError(f"{name}: has headers between samples, which are not read; remove them")
    if any(one.get("core:frequency") != captures[0].get("core:frequency") for one in captures):
        raise InputError(
            f"{name}: was retuned while recording; split it where core:frequency changes"
        )
    return captures[0] if captures else {}


def _datatype(fields: Mapping[str, Any], name: str) -> str:
    told = fields.get("core:datatype")
    if told is None:
        raise InputError(f"{name}: core:datatype is missing; give it, as in 'cf32_le'")
    if not isinstance(told, str) or told not in FORMATS:
        why = "is real, but I and Q are needed" if str(told).startswith("r") else "is unknown"
        raise InputError(
            f"{name}: core:datatype {short(repr(told))} {why}; known are {', '.join(FORMATS)}"
        )
    return str(told)


def _number(
    fields: Mapping[str, Any],
    key: str,
    name: str,
    *,
    greatest: float,
    otherwise: float | None = None,
) -> float:
    value = fields.get(key, otherwise)
    if value is None:
        raise InputError(f"{name}: {key} is missing; give it")
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and abs(value) <= greatest):  # false for NaN as well
        raise InputError(
            f"{name}: {key} is {short(repr(value))}; it must be a number of at most {greatest:g}"
        )
    return float(value)


def _count(data: Path, datatype: str, fields: Mapping[str, Any]) -> int:
    """Number of samples in the file; it must be whole, and the one in the metadata, if any."""
    try:
        size = data.stat().st_size
    except FileNotFoundError:
        raise InputError(f"there are no samples '{data}' beside their metadata") from None
    except OSError as error:
        raise InputError(f"'{data}' cannot be read: {error.strerror}") from None
    if not data.is_file():
        raise InputError(
            f"'{data}' is not a file; the samples must be in a file beside their metadata"
        )
    width = 2 * np.dtype(FORMATS[datatype][0]).itemsize
    count, rest = divmod(size, width)
    told = fields.get("polychirp:num_samples")
    if told is not None and (not isinstance(told, int) or isinstance(told, bool) or told < 1):
        raise InputError(
            f"{data.name}: polychirp:num_samples is {short(repr(told))}; it must be a count of "
            "samples"
        )
    if told is not None and count < told:
        raise InputError(
            f"{data.name}: was cut off: {count} of {told} samples are there; copy it again, or "
            "correct polychirp:num_samples and remove core:sha512 to use what is there"
        )
    if rest or not count or (told is not None and count > told):
        raise InputError(
            f"{data.name}: its {size} bytes are not "
            + (f"{told} samples" if told is not None else "whole samples")
            + f" of {width} bytes ({datatype}); it was cut off, or core:datatype is wrong"
        )
    return count


def _schedule(fields: Mapping[str, Any], name: str) -> RampSchedule | None:
    told = fields.get("polychirp:schedule")
    if told is None:
        return None
    try:
        columns: dict[str, Any] = {field: _bounded(told[field]) for field in RAMP_FIELDS}
        return RampSchedule(**columns)
    except InputError as error:
        raise InputError(f"{name}: polychirp:schedule: {error}") from None
    except (KeyError, TypeError, ValueError, IndexError):
        raise InputError(
            f"{name}: polychirp:schedule needs lists of numbers {', '.join(RAMP_FIELDS)}"
        ) from None


def _bounded(values: Any) -> NDArray[Any]:
    """Array of a list of plausible numbers; raises `ValueError` for anything else."""
    is_list = isinstance(values, list) and all(type(one) in (int, float) for one in values)
    if not is_list or not all(abs(one) <= GREATEST_OF_RAMP for one in values):
        raise ValueError(values)
    return np.array(values)


def _check_band(schedule: RampSchedule | None, rate: float, centre: float, name: str) -> None:
    """Refuse a schedule whose ramps are all outside of the recorded band."""
    if schedule is None or centre == 0.0:
        return
    middle = schedule.centre_frequency
    if np.all(np.abs(middle - centre) - 0.5 * schedule.bandwidth > 0.5 * rate):
        raise InputError(
            f"{name}: its ramps are about {float(middle[0]) / 1e9:g} GHz, but core:frequency is "
            f"{centre / 1e9:g} GHz and core:sample_rate {rate / 1e6:g} MS/s; correct the wrong one"
        )


def write_sigmf(
    path: Path | str,
    signal: Baseband,
    *,
    datatype: Written = "cf32_le",
    schedule: RampSchedule | None = None,
    description: str = "",
) -> Path:
    """Write a signal and return the path of its metadata, ``NAME.sigmf-meta``.

    Equal signals give equal bytes, because no time of day is stored.

    Parameters
    ----------
    path : path with either suffix, or with none
    datatype : data type of the file; "ci16_le" holds I and Q from −1 to just below 1
    schedule : ramps that were played

    Raises
    ------
    InputError
        A sample is beyond full scale of 16-bit integers.
    """
    path = Path(path)
    if path.suffix not in (META, DATA):
        path = path.with_name(path.name + META)
    meta, data = path.with_suffix(META), path.with_suffix(DATA)
    meta.parent.mkdir(parents=True, exist_ok=True)
    data.write_bytes(_words(signal.samples, datatype).tobytes())
    fields: dict[str, Any] = {
        "core:datatype": datatype,
        "core:sample_rate": signal.sample_rate,
        "core:version": SIGMF_VERSION,
        "core:num_channels": 1,
        "core:sha512": _hash(data),
        "core:recorder": "polychirp",
        "core:description": description,
        "core:extensions": [SIGMF_EXTENSION],
        "polychirp:num_samples": signal.num_samples,
        "polychirp:start_time": signal.start_time,
    }
    if schedule is not None:
        fields["polychirp:schedule"] = {
            field: getattr(schedule, field).tolist() for field in RAMP_FIELDS
        }
    capture: dict[str, Any] = {"core:sample_start": 0}
    if signal.centre_frequency:
        capture["core:frequency"] = signal.centre_frequency
    text = json.dumps(
        {"global": fields, "captures": [capture], "annotations": []},
        indent=1,
        allow_nan=False,
        ensure_ascii=False,
    )
    meta.write_text(text + "\n", encoding="utf-8")
    return meta


def _words(samples: ComplexArray, datatype: Written) -> NDArray[Any]:
    kind, _, full = FORMATS[datatype]
    values = np.ascontiguousarray(samples).view(np.float64)
    if datatype == "cf32_le":
        return values.astype(kind)
    whole = np.rint(values * full)
    if whole.min() < -full or whole.max() >= full:
        raise InputError(
            f"a sample is beyond full scale ({np.abs(values).max():.3g} of 1); scale the signal "
            "down, or write cf32_le"
        )
    return whole.astype(kind)
