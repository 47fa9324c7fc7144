"""Readers of the two kinds of files in which TI's tools keep a radar's chirps.

mmWave Studio writes JSON (``*.mmwave.json``); the demos of the mmWave SDKs read text with one
command per line (``*.cfg``), of which only those are read here that describe the chirps or the
stream of samples to a capture card. The files are those of strangers: every value that is used is
checked, and nothing else is looked at.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from polychirp.bounded_text import json_value, text_of
from polychirp.capture.ti_tables import (
    CHIRP_FIELDS,
    COMMAND_STREAM,
    JSON_STREAM,
    PROFILE_FIELDS,
    Fields,
    TiField,
    TiTables,
)
from polychirp.errors import InputError, short

_NUMBER: Final = re.compile(r"0[xX][0-9a-fA-F]{1,16}|[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")
"""Text of a number: hexadecimal, or decimal as in "-1.5e3"."""

_LONGEST_NUMBER: Final = 40
"""Greatest number of characters of a number. Chosen."""

SUFFIXES: Final = (".json", ".cfg")
"""Ends of the names of the files of mmWave Studio and of the mmWave SDK."""

MOST_COMMANDS: Final = 2048
"""Greatest number of commands for profiles or chirps in a file. Chosen: a device has room for 4
profiles and 512 chirps."""


def read_tables(path: Path) -> TiTables:
    """Tables of a file of TI's tools.

    `InputError` is raised if the file cannot be read, its name does not end in .json or .cfg, or a
    value that is needed is missing or is not a number.
    """
    readers = dict(zip(SUFFIXES, (_tables_of_json, _tables_of_commands), strict=True))
    if path.suffix.lower() not in readers:
        raise InputError(
            "is no profile of TI's tools by its name; it must end in .json (mmWave Studio) or .cfg "
            "(mmWave SDK)"
        )
    try:
        text = text_of(path)
    except FileNotFoundError:
        raise InputError("this profile does not exist; check its path") from None
    except OSError as error:
        raise InputError(f"this profile cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError("is not text in UTF-8; a profile of TI's tools is text") from None
    return readers[path.suffix.lower()](text)


def _number(value: object, place: str) -> float:
    """A number, or the number that a text holds; `InputError` names ``place`` otherwise."""
    if isinstance(value, str) and len(value) <= _LONGEST_NUMBER and _NUMBER.fullmatch(value):
        value = int(value, 16) if value[:2] in ("0x", "0X") else float(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{place}: {short(repr(value))} is not a number")
    if not math.isfinite(value) or abs(value) > 1e15:
        raise InputError(f"{place}: is too large a number")
    return float(value)


def _whole(value: object, place: str) -> int:
    """A whole number of at least 0; `InputError` names ``place`` otherwise."""
    number = _number(value, place)
    if number < 0 or number != int(number):
        raise InputError(f"{place}: {number:g} is not a whole number of 0 or more")
    return int(number)


MOST_VALUES: Final = 64
"""Greatest number of values of a command. Chosen: ``profileCfg`` has 14."""

_CODES: Final = {
    "rlBpmChirps": "rlBpmChirpCfg_t",
    "rlRfPhaseShiftCfgs": "rlRfPhaseShiftCfg_t",
}
"""Lists of the codes of chirps in mmWave Studio's files, and the key of their entries."""

_NO_CODE: Final = {"isConfigured", "chirpStartIdx", "chirpEndIdx"}
"""Keys of the entries of `_CODES` that are no codes."""

# ── mmWave Studio ─────────────────────────────────────────────────────────────


def _tables_of_json(text: str) -> TiTables:
    try:
        data = json_value(text)
    except json.JSONDecodeError as error:
        raise InputError(f"is not JSON: {error}") from None
    devices = _entry(data, "mmWaveDevices", "")
    if not isinstance(devices, list) or len(devices) != 1:
        raise InputError(
            "mmWaveDevices: must list one device; devices in cascade are not supported, so keep "
            "the entry of one"
        )
    config = _entry(devices[0], "rfConfig", "mmWaveDevices[0].")
    _refuse_other_waveforms(config)
    profiles = [
        _json_fields(one, PROFILE_FIELDS, place)
        for one, place in _listed(config, "rlProfiles", "rlProfileCfg_t")
    ]
    chirps = [
        _json_fields(one, CHIRP_FIELDS, place)
        for one, place in _listed(config, "rlChirps", "rlChirpCfg_t")
    ]
    frame = _entry(config, "rlFrameCfg_t", "rfConfig.")
    channels = _entry(config, "rlChanCfg_t", "rfConfig.")
    adc = _entry(_entry(config, "rlAdcOutCfg_t", "rfConfig."), "fmt", "rlAdcOutCfg_t.")

    def whole(table: Any, key: str, place: str) -> int:
        return _whole(_entry(table, key, place), f"{place}{key}")

    return TiTables(
        profiles={_whole(one["profileId"], "profileId"): one for one in profiles},
        chirps=tuple(chirps),
        first=whole(frame, "chirpStartIdx", "rlFrameCfg_t."),
        last=whole(frame, "chirpEndIdx", "rlFrameCfg_t."),
        num_loops=whole(frame, "numLoops", "rlFrameCfg_t."),
        receivers=whole(channels, "rxChannelEn", "rlChanCfg_t."),
        transmitters=whole(channels, "txChannelEn", "rlChanCfg_t."),
        adc_format=whole(adc, "b2AdcOutFmt", "rlAdcOutCfg_t.fmt."),
        adc_bits=whole(adc, "b2AdcBits", "rlAdcOutCfg_t.fmt."),
        stream=_json_stream(devices[0].get("rawDataCaptureConfig")),
    )


def _json_stream(config: object) -> dict[str, int]:
    """Values of the fields of the stream that the file has.

    mmWave Studio also writes sections that it did not set up; their ``isConfigured`` is 0.
    """
    if config is None:
        return {}
    if not isinstance(config, dict):
        raise InputError("rawDataCaptureConfig: must be a JSON object")
    found = {}
    for name in JSON_STREAM:
        section, _, key = name.partition(".")
        fields = config.get(section)
        if fields is None:
            continue
        if not isinstance(fields, dict):
            raise InputError(f"rawDataCaptureConfig.{section}: must be a JSON object")
        if fields.get("isConfigured", 1) != 0 and key in fields:
            found[name] = _whole(fields[key], name)
    return found


def _refuse_other_waveforms(config: Any) -> None:
    """Refuse frames with subframes, and phases that change from chirp to chirp."""
    kind = config.get("waveformType", "legacyFrameChirp") if isinstance(config, dict) else ""
    if kind != "legacyFrameChirp":
        raise InputError(
            f"waveformType: {short(repr(kind))} is not supported; set up a frame without subframes "
            "(legacyFrameChirp)"
        )
    refused = "codes that change from chirp to chirp are not supported; remove them"
    for key in ("rlDynChirpCfgs", "rlDynPerChirpPhShftCfgs"):
        if config.get(key):
            raise InputError(f"{key}: {refused}")
    for key, inner in _CODES.items():
        for one, place in _listed({key: [], **config}, key, inner):
            names = set(one if isinstance(one, dict) else ()) - _NO_CODE
            if any(_number(one[name], f"{place}.{name}") != 0 for name in names):
                raise InputError(f"{place}: {refused}")


def _entry(table: object, key: str, place: str) -> Any:
    """Value of a key of a JSON object; `InputError` if it has none."""
    if not isinstance(table, dict):
        raise InputError(f"{place.rstrip('.') or 'the file'}: must be a JSON object")
    if key not in table:
        raise InputError(f"{place}{key}: is missing")
    return table[key]


def _listed(config: Any, key: str, inner: str) -> Iterator[tuple[Any, str]]:
    """Entries of a list of the configuration, unwrapped, and their places in words."""
    values = _entry(config, key, "rfConfig.")
    if not isinstance(values, list):
        raise InputError(f"{key}: must be a list")
    if len(values) > MOST_COMMANDS:
        raise InputError(f"{key}: has {len(values)} entries, more than {MOST_COMMANDS}")
    for number, value in enumerate(values):
        place = f"{key}[{number}]"
        yield _entry(value, inner, f"{place}."), f"{place}.{inner}"


def _json_fields(table: object, fields: Mapping[str, TiField], place: str) -> Fields:
    return {
        name: field.unit * _number(_entry(table, field.key, f"{place}."), f"{place}.{field.key}")
        for name, field in fields.items()
    }


# ── mmWave SDK ────────────────────────────────────────────────────────────────


def _tables_of_commands(text: str) -> TiTables:
    single: dict[str, Sequence[float]] = {}
    profiles: dict[int, Fields] = {}
    chirps: list[Fields] = []
    for name, values, place in _commands(text):
        match name:
            case "flushCfg":
                profiles, chirps = {}, []
            case "profileCfg":
                fields = _positional(values, PROFILE_FIELDS, place)
                profiles[_whole(fields["profileId"], f"{place}: profileId")] = fields
            case "chirpCfg":
                chirps.append(_positional(values, CHIRP_FIELDS, place))
            case _:
                single[name] = values
        if len(chirps) > MOST_COMMANDS:
            raise InputError(f"chirpCfg: there are more than {MOST_COMMANDS} commands")
    for name in ("frameCfg", "channelCfg", "adcCfg"):
        if name not in single:
            raise InputError(f"{name}: is missing; add this command")
    if single.get("dfeDataOutputMode", [1])[:1] != [1] or "subFrameCfg" in single:
        raise InputError(
            "dfeDataOutputMode: only frames of chirps are supported (mode 1), without subframes"
        )

    def whole(name: str, number: int, field: str) -> int:
        values = single[name]
        if len(values) <= number:
            raise InputError(f"{name}: {field} is missing")
        return _whole(values[number], f"{name}: {field}")

    return TiTables(
        profiles=profiles,
        chirps=tuple(chirps),
        first=whole("frameCfg", 0, "chirpStartIdx"),
        last=whole("frameCfg", 1, "chirpEndIdx"),
        num_loops=whole("frameCfg", 2, "numLoops"),
        receivers=whole("channelCfg", 0, "rxChannelEn"),
        transmitters=whole("channelCfg", 1, "txChannelEn"),
        adc_format=whole("adcCfg", 1, "adcOutputFmt"),
        adc_bits=whole("adcCfg", 0, "numADCBits"),
        is_binary_coded="bpmCfg" in single and whole("bpmCfg", 1, "enabled") > 0,
        doppler_order=tuple(
            whole("ddmPhaseShiftAntOrder", number, "transmitter")
            for number in range(min(len(single.get("ddmPhaseShiftAntOrder", ())), 8))
        ),
        stream=_command_stream(single),
    )


def _command_stream(single: Mapping[str, Sequence[float]]) -> dict[str, int]:
    """Values of the fields of the stream; commands of the first SDKs lack ``subFrameIdx``."""
    found = {}
    for command, fields in COMMAND_STREAM.items():
        values = single.get(command)
        if values is None:
            continue
        if not len(fields) <= len(values) <= len(fields) + 1:
            raise InputError(
                f"{command}: has {len(values)} values; write subFrameIdx, {', '.join(fields)}"
            )
        for field, value in zip(fields, values[-len(fields) :], strict=True):
            name = f"{command}: {field}"
            found[name] = _whole(value, name)
    return found


READ_COMMANDS: Final = {
    *("flushCfg", "dfeDataOutputMode", "channelCfg", "adcCfg", "profileCfg", "chirpCfg"),
    *("frameCfg", "subFrameCfg", "bpmCfg", "ddmPhaseShiftAntOrder"),
    *COMMAND_STREAM,
}
"""Commands that are read; the others set up the device's own signal processing."""


def _commands(text: str) -> Iterator[tuple[str, list[float], str]]:
    """Name, values and place in words of every command that is read."""
    for number, line in enumerate(text.splitlines(), start=1):
        name, *words = line.split("%")[0].split("#")[0].split() or [""]
        if name in READ_COMMANDS:
            place = f"line {number}, {name}"
            if len(words) > MOST_VALUES:
                raise InputError(f"{place}: has {len(words)} values, more than {MOST_VALUES}")
            yield name, [_number(word, place) for word in words], place


def _positional(values: Sequence[float], fields: Mapping[str, TiField], place: str) -> Fields:
    if len(values) < len(fields):
        missing = list(fields)[len(values)]
        raise InputError(f"{place}: has {len(values)} values, and {missing} is missing")
    return {
        name: value * (field.unit if field.command_unit is None else field.command_unit)
        for (name, field), value in zip(fields.items(), values, strict=False)
    }
