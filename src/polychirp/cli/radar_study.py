"""Study files of real radars: from a table of well-known ones, or from a profile of TI's tools."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.radar_tables import (
    Row,
    Tables,
    radar_tables,
    table_text,
    text_of,
)

if TYPE_CHECKING:
    from polychirp.capture.ti_profile import ChirpProfile

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

_MITIGATION: Final = "stft-excision"
"""Mitigation of studies whose radar names no other. Chosen: it finds crossings that last for
much of a chirp, which blanking and IMAT miss."""

_STEEPNESS: Final = 0.9
"""Slope of the other radar's chirps over the victim's. Chosen: its chirps then cross the victim's
IF band in a part of a chirp's duration."""

_MOUNT: Final = 2.33
"""Distance of a radar from the middle of its car, m, as in the text of the study."""

_EGO_SPEED: Final = 50.0 / 3.6
"""Speed of the victim's car in the scene, m/s. Chosen."""

_TARGET_RATE: Final = 2.0
"""Range rate of the target, m/s. Chosen. It is less if the chirps tell only lower ones apart."""


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
            mitigation=radar["mitigation"],
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
        mitigation=radar.get("mitigation", _MITIGATION),
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
    mitigation: str = _MITIGATION,
) -> str:
    front_end = {key: _row(value) for key, value in _table()["hardware"][hardware].items()}
    return _study(
        name=name,
        title=title,
        num_sweeps=profile.chirps.num_ramps,
        tables=radar_tables(
            profile, front_end, chirp_source=chirp_source, sharing_source=sharing_source
        ),
        greatest_range=profile.chirps.greatest_range,
        mitigation=mitigation,
        profile=profile,
    )


def _study(
    *,
    name: str,
    title: str,
    num_sweeps: int,
    tables: Tables,
    greatest_range: float,
    mitigation: str,
    profile: ChirpProfile | None = None,
) -> str:
    """Text of a study: the tables of its radar, and a scene that suits its range."""
    from importlib.resources import files
    from string import Template

    source = files("polychirp.cli").joinpath("templates", "radar.toml.template")
    text = "\n".join(table_text(header, rows) for header, rows in tables.items())
    crossing = 0.0 if profile is None else _crossing_delay(profile)
    return Template(source.read_text(encoding="utf-8")).substitute(
        name=name,
        title=title,
        num_sweeps=num_sweeps,
        tables=text,
        greatest_range=f"{greatest_range:.3g}",
        ahead=f"{_MOUNT + 0.35 * greatest_range:.4g}",
        oncoming=f"{max(12.0, _MOUNT + 0.6 * greatest_range):.4g}",
        speed=f"{_EGO_SPEED + _range_rate(profile):.4g}",
        start=text_of(crossing, 1e-6, "us", 4) if crossing else "0 s",
        later="1 ms" if profile is None else text_of(0.5 * crossing, 1e-6, "us", 4),
        other="" if profile is None else _other_waveform(profile),
        mitigation=mitigation,
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
            text_of(_STEEPNESS * chirps.slope * chirps.ramp_end_time, 1e6, "MHz"),
            "a little less steep: its chirps cross the victim's",
        ),
        "idle": (
            text_of(chirps.idle_time + 20e-9, 1e-6, "us"),
            "20 ns longer: the crossings move from chirp to chirp",
        ),
    }
    return "\n" + table_text("radars.waveform", rows).rstrip("\n")
