"""Tables of a study file that describe a radar: front end, antennas, sampling and chirps."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from polychirp.capture.ti_profile import ChirpProfile

Row = tuple[Any, str]
"""Value of a key of a study file, and a comment on it. The key "" has a comment only."""

Tables = Mapping[str, Mapping[str, Row]]
"""Tables of a study file by their headers."""

_SHARE_OF_STOPBAND: Final = 0.9
"""Edge of the pass band of TI's decimation filters over that of their stop band: with complex 1x
samples 0.9 of the sample rate (TI SWRA553, section 2.1.1)."""

_COMMENT_COLUMN: Final = 34
"""Column at which the comments of a table begin."""


def radar_tables(
    profile: ChirpProfile,
    front_end: Mapping[str, Row],
    *,
    chirp_source: str,
    sharing_source: str,
) -> Tables:
    """Tables of a radar with the chirps of ``profile``.

    Parameters
    ----------
    front_end : its power, noise figure, phase noise at 1 MHz, and an element's gain and beam
    chirp_source, sharing_source : sources of the chirps and of the transmitters' places
    """
    chirps = profile.chirps
    return {
        "defaults.radar": _power_rows(profile, front_end),
        "defaults.radar.array": _array_rows(profile),
        "defaults.radar.array.pattern": {
            key: front_end[key] for key in ("peak_gain", "azimuth_beamwidth", "elevation_beamwidth")
        },
        "defaults.radar.oscillator.phase_noise": _phase_noise_rows(front_end["phase_noise"]),
        **_coding_table(profile, sharing_source),
        **_sampling_tables(profile),
        "defaults.radar.waveform": {
            "": (None, f"Chirps: {chirp_source}."),
            "kind": ("sawtooth", "equal chirps"),
            "start_frequency": (
                text_of(chirps.start_frequency, 1e9, "GHz"),
                f"at the ramp's start; {_first_frequency(profile)} at the first sample",
            ),
            "bandwidth": (
                text_of(chirps.slope * chirps.ramp_end_time, 1e6, "MHz"),
                f"of the whole ramp, at {text_of(chirps.slope, 1e12, 'MHz/us')}",
            ),
            "ramp_duration": (text_of(chirps.ramp_end_time, 1e-6, "us"), ""),
            "idle": (text_of(chirps.idle_time, 1e-6, "us"), "between chirps"),
        },
    }


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
        "spacing": (text_of(spacing, 1e-3, "mm", 4), f"{in_wavelengths:.2g} wavelengths"),
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
    device = f"the device's {chirps.sampling} {text_of(chirps.sample_rate, 1e6, 'MS/s')}"
    return {
        "defaults.radar.if_filter": {
            "passband": (text_of(chirps.usable_beat, 1e6, "MHz"), "beats above are weakened …"),
            "stopband": (text_of(stopband, 1e6, "MHz"), "… and gone from here"),
            "attenuation": ("60 dB", "typical"),
        },
        "defaults.radar.converter": {
            "sample_rate": (text_of(rate, 1e6, "MS/s"), f"complex, beats of both signs; {device}"),
            "start": (text_of(chirps.adc_start, 1e-6, "us"), "after a chirp's start"),
            "margin": (text_of(margin, 1e-6, "us"), "before its end"),
        },
    }


def _first_frequency(profile: ChirpProfile) -> str:
    """Frequency that is transmitted at the converter's first sample."""
    chirps = profile.chirps
    return text_of(chirps.start_frequency + chirps.slope * chirps.adc_start, 1e9, "GHz", 6)


def text_of(value: float, scale: float, unit: str, digits: int = 10) -> str:
    """A value in SI as text with its unit, which is ``scale`` in SI.

    >>> text_of(77e9, 1e9, "GHz")
    '77 GHz'
    """
    return f"{value / scale:.{digits}g} {unit}"


def _phase_noise_rows(level: Row) -> dict[str, Row]:
    """Phase noise whose level at 1 MHz is given: the shape of polychirp's default, shifted."""
    from polychirp.model.oscillator import PhaseNoise
    from polychirp.units import Unit, to_db

    at_1_mhz, comment = level
    default = PhaseNoise()
    usual = default.level[default.offset.index(1e6)]
    shift = float(to_db(Unit("dBc/Hz").read(at_1_mhz) / usual))
    offsets = [
        text_of(offset, 1e6, "MHz") if offset >= 1e6 else text_of(offset, 1e3, "kHz")
        for offset in default.offset
    ]
    return {
        "": (
            None,
            f"Phase noise: {at_1_mhz} at 1 MHz, {comment}. Without this table there is none.",
        ),
        "offset": (offsets, ""),
        "level": ([f"{float(to_db(value)) + shift:.4g} dBc/Hz" for value in default.level], ""),
    }


def table_text(header: str, rows: Mapping[str, Row]) -> str:
    """A table of a study file with its comments in one column."""
    lines = [f"[{header}]"]
    for key, (value, comment) in rows.items():
        if not key:
            lines.append(f"# {comment}")
            continue
        line = f"{key} = {json.dumps(value, ensure_ascii=False)}"
        lines.append(f"{line:<{_COMMENT_COLUMN}} # {comment}" if comment else line)
    return "\n".join(lines) + "\n"
