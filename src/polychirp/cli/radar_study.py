"""Study files of real radars: from a table of well-known ones, or from a profile of TI's tools."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from polychirp.capture.ti_profile import ChirpProfile

Row = tuple[Any, str]
"""Value of a key of a study file, and a comment on it. The key "" has a comment only."""

Tables = Mapping[str, Mapping[str, Row]]
"""Tables of a study file by their headers."""

RADARS: Final = {
    "awr1843-short": "class of TI's AWR1843, 30 m",
    "awr1843-long": "the same, 157 m",
    "awr2944-short": "class of TI's AWR2944, 51 m",
    "awr2944-long": "the same, 228 m",
    "lrr-77": "77-GHz long-range radar, 260 m",
    "paper": "the paper's radar, 30 m",
}
"""Radars of `radar_study` by their names, and what they are."""

PROFILE_HARDWARE: Final = "awr1843"
"""Front end and antennas of a study from a profile, which does not contain them."""

_SHARE_OF_STOPBAND: Final = 0.9
"""Edge of the pass band of TI's decimation filters over that of their stop band: with complex 1x
samples 0.9 of the sample rate (TI SWRA553, section 2.1.1)."""

_STEEPNESS: Final = 0.9
"""Slope of the other radar's chirps over the victim's. Chosen: its chirps then cross the victim's
IF band in a part of a chirp's duration."""

_EGO_SPEED: Final = 50.0 / 3.6
"""Speed of the victim's car in the scene, m/s. Chosen."""

_TARGET_RATE: Final = 2.0
"""Range rate of the target, m/s. Chosen. It is less if the chirps tell only lower ones apart."""

_COMMENT_COLUMN: Final = 34
"""Column at which the comments of a table begin."""


def radar_study(name: str) -> str:
    """Text of the study of a radar among `RADARS`."""
    from polychirp.capture.parameter_file import parameters_from
    from polychirp.capture.ti_profile import ChirpProfile

    radar = _table()["radars"][name]
    if "tables" in radar:
        tables = {
            header: {key: _row(value) for key, value in rows.items()}
            for header, rows in radar["tables"].items()
        }
        return _study(
            name=name,
            title=radar["title"],
            num_sweeps=radar["num_sweeps"],
            tables=tables,
            greatest_range=radar["greatest_range"],
        )
    profile = ChirpProfile(
        chirps=parameters_from(radar["chirps"], name=name),
        transmitters=tuple(radar["transmitters"]),
        sharing=radar["sharing"],
        num_bands=radar.get("num_bands", 1),
    )
    return _coded_study(
        profile,
        name=name,
        title=radar["title"],
        hardware=radar["hardware"],
        chirp_source=radar["chirp_source"],
        sharing_source=radar["sharing_source"],
    )


def profile_study(profile: ChirpProfile, path: Path) -> str:
    """Text of the study of a radar whose chirps were read from the file ``path``."""
    name = path.name.removesuffix(path.suffix).removesuffix(".mmwave")
    shown = "".join(c if c.isalnum() or c in "-_." else "-" for c in name)[:40]
    return _coded_study(
        profile,
        name=shown.strip(".") or "profile",
        title="a radar with the chirps of a profile of TI's tools",
        hardware=PROFILE_HARDWARE,
        chirp_source=f"from {json.dumps(path.name)[1:-1][:60]}",
        sharing_source="their places are not in the file; they stand on one line here",
    )


@lru_cache(maxsize=1)
def _table() -> dict[str, Any]:
    """Contents of the table of radars."""
    import tomllib
    from importlib.resources import files

    text = files("polychirp.cli").joinpath("templates", "radars.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def _row(value: Any) -> Row:
    """Value and comment of an entry of the table of radars; the comment may be absent."""
    return (value[0], value[1]) if isinstance(value, list) else (value, "")


def _coded_study(
    profile: ChirpProfile,
    *,
    name: str,
    title: str,
    hardware: str,
    chirp_source: str,
    sharing_source: str,
) -> str:
    front_end = {key: _row(value) for key, value in _table()["hardware"][hardware].items()}
    chirps = profile.chirps
    tables = {
        "defaults.radar": _power_rows(profile, front_end),
        "defaults.radar.array": _array_rows(profile),
        "defaults.radar.array.pattern": {
            key: front_end[key] for key in ("peak_gain", "azimuth_beamwidth", "elevation_beamwidth")
        },
        **_coding_table(profile, sharing_source),
        **_sampling_tables(profile),
        "defaults.radar.waveform": {
            "": (None, f"Chirps: {chirp_source}."),
            "kind": ("sawtooth", "equal chirps"),
            "start_frequency": (_text(chirps.start_frequency, 1e9, "GHz"), _adc_frequency(profile)),
            "bandwidth": (
                _text(chirps.slope * chirps.ramp_end_time, 1e6, "MHz"),
                f"of the whole ramp, at {_text(chirps.slope, 1e12, 'MHz/us')}",
            ),
            "ramp_duration": (_text(chirps.ramp_end_time, 1e-6, "us"), ""),
            "idle": (_text(chirps.idle_time, 1e-6, "us"), "between chirps"),
        },
    }
    return _study(
        name=name,
        title=title,
        num_sweeps=chirps.num_ramps,
        tables=tables,
        greatest_range=math.floor(chirps.greatest_range),
        phase_noise=front_end["phase_noise"][0],
        profile=profile,
    )


def _power_rows(profile: ChirpProfile, front_end: Mapping[str, Row]) -> dict[str, Row]:
    """Rows of the front end; transmitters that send together add up in phase on the axis."""
    number = len(profile.transmitters) if profile.sharing == "together" else 1
    gain = (
        (f"{20 * math.log10(number):.3g} dB", f"{number} transmitters in phase, on their axis")
        if number > 1
        else ("0 dB", "the power above is that at the antenna")
    )
    return {
        "transmit_power": front_end["transmit_power"],
        "transmit_gain": gain,
        "receive_gain": ("0 dB", "signal and noise grow with it alike"),
        "noise_figure": front_end["noise_figure"],
    }


def _array_rows(profile: ChirpProfile) -> dict[str, Row]:
    from polychirp.constants import SPEED_OF_LIGHT

    chirps = profile.chirps
    spacing = chirps.array.spacing
    in_wavelengths = spacing * chirps.middle_frequency / SPEED_OF_LIGHT
    rows: dict[str, Row] = {
        "num_channels": (chirps.num_receivers, "receiving elements"),
        "spacing": (_text(spacing, 1e-3, "mm", 4), f"{in_wavelengths:.2g} wavelengths"),
    }
    if profile.sharing != "together":
        names = ", ".join(str(number) for number in profile.transmitters)
        rows["num_transmitters"] = (
            len(profile.transmitters),
            f"the device's {names}, a whole receiving array apart",
        )
    return rows


def _coding_table(profile: ChirpProfile, source: str) -> dict[str, dict[str, Row]]:
    if profile.sharing == "together":
        return {}
    rows: dict[str, Row] = {
        "": (None, f"Transmitters: {source}."),
        "kind": (profile.sharing, "how they share the chirps"),
    }
    if profile.sharing == "doppler-division":
        empty = profile.num_bands - len(profile.transmitters)
        rows["num_bands"] = (profile.num_bands, f"of the Doppler band; {empty} stay empty")
    return {"defaults.radar.coding": rows}


def _sampling_tables(profile: ChirpProfile) -> dict[str, dict[str, Row]]:
    """Filter and converter.

    The filter of the model passes beats of both signs, so that it takes complex samples at twice
    the edge of its stop band. A device whose filter passes positive beats only (complex 1x) takes
    half as many.
    """
    chirps = profile.chirps
    stopband = chirps.usable_beat / _SHARE_OF_STOPBAND
    rate = 2.0 * stopband
    window = (round(chirps.num_samples * rate / chirps.sample_rate) - 0.5) / rate
    margin = max(chirps.ramp_end_time - chirps.adc_start - window, 0.0)
    device = f"the device's {chirps.sampling} {_text(chirps.sample_rate, 1e6, 'MS/s')}"
    return {
        "defaults.radar.if_filter": {
            "passband": (_text(chirps.usable_beat, 1e6, "MHz"), "beats above are weakened …"),
            "stopband": (_text(stopband, 1e6, "MHz"), "… and gone from here"),
            "attenuation": ("60 dB", "typical"),
        },
        "defaults.radar.converter": {
            "sample_rate": (_text(rate, 1e6, "MS/s"), f"complex, beats of both signs; {device}"),
            "start": (_text(chirps.adc_start, 1e-6, "us"), "after a chirp's start"),
            "margin": (_text(margin, 1e-6, "us"), "before its end"),
        },
    }


def _adc_frequency(profile: ChirpProfile) -> str:
    chirps = profile.chirps
    frequency = chirps.start_frequency + chirps.slope * chirps.adc_start
    return f"at the ramp's start; {_text(frequency, 1e9, 'GHz', 6)} at the first sample"


def _text(value: float, scale: float, unit: str, digits: int = 10) -> str:
    """A value in SI as text with its unit, which is ``scale`` in SI.

    >>> _text(77e9, 1e9, "GHz")
    '77 GHz'
    """
    return f"{value / scale:.{digits}g} {unit}"


def _study(
    *,
    name: str,
    title: str,
    num_sweeps: int,
    tables: Tables,
    greatest_range: float,
    phase_noise: str = "",
    profile: ChirpProfile | None = None,
) -> str:
    """Text of a study: the tables of its radar, and a scene that suits its range."""
    from importlib.resources import files
    from string import Template

    source = files("polychirp.cli").joinpath("templates", "radar.toml.template")
    text = "\n".join(_table_text(header, rows) for header, rows in tables.items())
    if phase_noise:
        text += "\n" + _phase_noise_text(phase_noise)
    crossing = 0.0 if profile is None else _crossing_delay(profile)
    return Template(source.read_text(encoding="utf-8")).substitute(
        name=name,
        title=title,
        num_sweeps=num_sweeps,
        tables=text,
        greatest_range=f"{greatest_range:g}",
        ahead=f"{max(4.0, round(0.35 * greatest_range)):g}",
        oncoming=f"{max(12.0, round(0.6 * greatest_range)):g}",
        speed=f"{_EGO_SPEED + _range_rate(profile):.4g}",
        start=_text(crossing, 1e-6, "us", 4) if crossing else "0 s",
        later="1 ms" if profile is None else _text(0.5 * crossing, 1e-6, "us", 4),
        other="" if profile is None else _other_waveform(profile),
        mitigation="blanking" if profile is None else "stft-excision",
    )


def _range_rate(profile: ChirpProfile | None) -> float:
    """Range rate of the target, m/s: at most two fifths of λ/4T, T from chirp to chirp."""
    if profile is None:
        return _TARGET_RATE
    chirps = profile.chirps
    span = chirps.speed_span * chirps.num_transmitters
    return min(_TARGET_RATE, 0.2 * span)


def _crossing_delay(profile: ChirpProfile) -> float:
    """Start of the victim's ramps after the other radar's, s, so that they cross in the middle.

    Both ramps start at the same frequency, and the other's slope is s' = `_STEEPNESS` s. If the
    victim starts by d later, s t = s' (t + d) at the time t = T/2 of the crossing gives d.
    """
    return 0.5 * profile.chirps.ramp_end_time * (1.0 / _STEEPNESS - 1.0)


def _other_waveform(profile: ChirpProfile) -> str:
    """Tables of the other radar, whose chirps are less steep and a little further apart."""
    chirps = profile.chirps
    rows = {
        "bandwidth": (
            _text(_STEEPNESS * chirps.slope * chirps.ramp_end_time, 1e6, "MHz"),
            "a little less steep: its chirps cross the victim's",
        ),
        "idle": (
            _text(chirps.idle_time + 20e-9, 1e-6, "us"),
            "20 ns longer: the crossings move from chirp to chirp",
        ),
    }
    return "\n" + _table_text("radars.waveform", rows).rstrip("\n")


def _phase_noise_text(level: str) -> str:
    """Phase noise as comments, whose level at 1 MHz is ``level``: the default's shape, shifted."""
    from polychirp.model.oscillator import PhaseNoise
    from polychirp.units import Unit, to_db

    default = PhaseNoise()
    at_1_mhz = default.level[default.offset.index(1e6)]
    shift = float(to_db(Unit("dBc/Hz").read(level) / at_1_mhz))
    offsets = [
        _text(offset, 1e6, "MHz") if offset >= 1e6 else _text(offset, 1e3, "kHz")
        for offset in default.offset
    ]
    levels = [f"{float(to_db(value)) + shift:.4g} dBc/Hz" for value in default.level]
    return (
        f"# Phase noise, {level} at 1 MHz: typical. Without '#', a run takes ten times as long.\n"
        "#[defaults.radar.oscillator.phase_noise]\n"
        f"#offset = {json.dumps(offsets)}\n"
        f"#level = {json.dumps(levels)}\n"
    )


def _table_text(header: str, rows: Mapping[str, Row]) -> str:
    """A table of a study file with its comments in one column."""
    lines = [f"[{header}]"]
    for key, (value, comment) in rows.items():
        if not key:
            lines.append(f"# {comment}")
            continue
        line = f"{key} = {json.dumps(value, ensure_ascii=False)}"
        lines.append(f"{line:<{_COMMENT_COLUMN}} # {comment}" if comment else line)
    return "\n".join(lines) + "\n"
