"""`ChirpProfile`: the chirps of a radar and who sends them, from a file of TI's tools."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from polychirp.capture.parameters import SLOPES, CaptureParameters, Sampling
from polychirp.capture.ti_files import read_tables
from polychirp.capture.ti_tables import Fields, TiTables
from polychirp.errors import InputError

Sharing = Literal["together", "time-division", "doppler-division", "phase-coded"]
"""The way in which several transmitters share the chirps."""

MOST_CHIRPS: Final = 512
"""Greatest number of chirps of a loop: a device has room for 512 (SWRA553)."""

_FORMATS: Final[dict[int, tuple[Sampling, float]]] = {
    0: ("real", 0.45),
    1: ("complex", 0.9),
    2: ("complex", 0.45),
}
"""Kind of the samples, and edge of the pass band over the sample rate, by the converter's format:
real, complex 1x and complex 2x (SWRA553, section 2.1.1)."""

_BITS: Final = {0: 12, 1: 14, 2: 16}
"""Bits of a sample by the converter's number of bits."""

_PHASE_BITS: Final = 0b11111100
"""Bits of a transmitter's byte of ``txPhaseShifter`` that hold its phase (mmWaveLink,
``rlProfileCfg_t``)."""

_LIMITS: Final = {
    "startFreq": (1e9, 1e12),
    "freqSlope": SLOPES,
    "idleTime": (0.0, 1.0),
    "adcStartTime": (0.0, 1.0),
    "rampEndTime": (1e-7, 1.0),
    "digOutSampleRate": (1e4, 1e9),
}
"""Least and greatest value of a chirp's fields, SI units. Chosen wide, so that they refuse wrong
units and columns, but no unusual radar."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChirpProfile:
    """Equal chirps, and the transmitters that send them.

    Parameters
    ----------
    chirps : ramps, converter and number of receivers; its ``num_transmitters`` are those that take
        turns, 1 for every other sharing
    transmitters : numbers of the transmitters, counted from 1, in the order of their turns or codes
    sharing : the way in which they share the chirps; "together" also if there is one
    num_bands : for Doppler division the number of parts of the Doppler band, else 1
    notes : sentences on what the file says and polychirp leaves out
    """

    chirps: CaptureParameters
    transmitters: tuple[int, ...] = (1,)
    sharing: Sharing = "together"
    num_bands: int = 1
    notes: tuple[str, ...] = ()


def read_profile(path: Path | str) -> ChirpProfile:
    """Chirps of a radar from a file of mmWave Studio (.json) or of the mmWave SDK (.cfg).

    `InputError` is raised if the file cannot be read, a value is missing or impossible, or chirps
    differ in anything but their transmitter. It names the file and the field.
    """
    path = Path(path)
    try:
        return profile_of(read_tables(path))
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def recording_parameters(path: Path | str) -> CaptureParameters:
    """Parameters of a recording whose chirps are those of a file of TI's tools.

    The layout of the recording has its defaults; `raw_parameters` reads that of a DCA1000 file too.
    `InputError` is raised as by `read_profile`, and if the transmitters share the chirps by a code
    of phases.

    `from_array` takes them.
    """
    profile = read_profile(path)
    if profile.sharing not in ("together", "time-division"):
        code = "a Doppler" if profile.sharing == "doppler-division" else "a binary"
        raise InputError(
            f"{Path(path).name}: txEnable: the transmitters send every chirp together with {code} "
            "code of phases, and recordings are read with transmitters that take turns or send "
            "together without a code; record with such a profile"
        )
    return profile.chirps


def profile_of(tables: TiTables) -> ChirpProfile:
    """Chirps of a frame from the tables of a file; `InputError` as of `read_profile`."""
    loop = [_chirp(tables, number) for number in _loop_numbers(tables)]
    _refuse_differences(loop)
    masks = [_transmitters(tables, fields, number) for number, fields in enumerate(loop)]
    transmitters, sharing, bands = _sharing(tables, masks)
    first = loop[0]
    if tables.adc_format not in _FORMATS:
        raise InputError(
            f"adcOutputFmt: {tables.adc_format} is not supported; use 0 (real), 1 (complex 1x) or "
            "2 (complex 2x)"
        )
    if tables.adc_bits not in _BITS:
        raise InputError(
            f"numADCBits: {tables.adc_bits} is not supported; use 0 (12 bits), 1 (14) or 2 (16)"
        )
    sampling, usable = _FORMATS[tables.adc_format]
    chirps = CaptureParameters(
        start_frequency=first["startFreq"],
        slope=first["freqSlope"],
        idle_time=first["idleTime"],
        ramp_end_time=first["rampEndTime"],
        adc_start=first["adcStartTime"],
        num_ramps=_bounded(len(loop) * tables.num_loops, "numLoops", 1_000_000),
        sample_rate=first["digOutSampleRate"],
        num_samples=_bounded(first["numAdcSamples"], "numAdcSamples", 1_000_000),
        sampling=sampling,
        adc_bits=_BITS[tables.adc_bits],
        highest_beat=usable * first["digOutSampleRate"],
        num_transmitters=len(transmitters) if sharing == "time-division" else 1,
        num_receivers=_receivers(tables.receivers),
    )
    return ChirpProfile(
        chirps=chirps,
        transmitters=transmitters,
        sharing=sharing,
        num_bands=bands,
        notes=tuple(_notes(first, transmitters, sharing)),
    )


def _bounded(value: float, place: str, most: int) -> int:
    if not 1 <= value <= most or value != int(value):
        raise InputError(f"{place}: {value:g} is not a whole number between 1 and {most}")
    return int(value)


def _loop_numbers(tables: TiTables) -> range:
    numbers = range(tables.first, tables.last + 1)
    if not 0 < len(numbers) <= MOST_CHIRPS or tables.last >= MOST_CHIRPS:
        raise InputError(
            f"chirpStartIdx and chirpEndIdx: {tables.first} to {tables.last} are no chirps of a "
            f"device, which has the chirps 0 to {MOST_CHIRPS - 1}"
        )
    return numbers


def _chirp(tables: TiTables, number: int) -> Fields:
    """Values of the chirp with this number: its profile's and its own variations on them."""
    covers = [c for c in tables.chirps if c["chirpStartIdx"] <= number <= c["chirpEndIdx"]]
    if not covers:
        raise InputError(f"chirp {number} is in the frame, but no chirpCfg sets it up; add one")
    chirp = covers[-1]
    profile = tables.profiles.get(int(chirp["profileId"]))
    if profile is None:
        raise InputError(
            f"profileId: the file lacks the profile {chirp['profileId']:g} of chirp {number}"
        )
    varied = {
        name: profile[f"{name}Const"] + chirp[f"{name}Var"]
        for name in ("startFreq", "freqSlope", "idleTime", "adcStartTime")
    }
    fields = {**profile, **varied, "txEnable": chirp["txEnable"]}
    for name, (least, greatest) in _LIMITS.items():
        if not least <= fields[name] <= greatest:
            raise InputError(
                f"{name}: {fields[name]:g} of chirp {number} is outside of {least:g} to "
                f"{greatest:g}, in SI units; check its column and its unit"
            )
    return fields


def _refuse_differences(loop: list[Fields]) -> None:
    first = loop[0]
    for number, fields in enumerate(loop):
        for name in first:
            is_alike = abs(fields[name] - first[name]) <= 1e-9 * abs(first[name])
            if name not in ("txEnable", "profileId") and not is_alike:
                raise InputError(
                    f"{name.removesuffix('Const')}: the chirps 0 and {number} of a loop differ in "
                    "it, and equal chirps are needed; keep chirps of one kind in the frame"
                )


def _transmitters(tables: TiTables, fields: Fields, number: int) -> tuple[int, ...]:
    """Numbers, from 1, of the transmitters that send a chirp."""
    mask = _bounded(fields["txEnable"], f"txEnable of chirp {number}", 255)
    if mask & ~tables.transmitters:
        raise InputError(
            f"txEnable: chirp {number} is sent by a transmitter that txChannelEn switches off"
        )
    return tuple(bit + 1 for bit in range(8) if mask >> bit & 1)


def _sharing(
    tables: TiTables, masks: list[tuple[int, ...]]
) -> tuple[tuple[int, ...], Sharing, int]:
    """Transmitters in the order of their turns or codes, their sharing, and Doppler bands."""
    first = masks[0]
    if all(mask == first for mask in masks):
        if len(first) > 1 and tables.doppler_order:
            order = tuple(number + 1 for number in tables.doppler_order)
            if sorted(order) != list(first) or len(masks) < len(first):
                raise InputError(
                    "ddmPhaseShiftAntOrder: must name every transmitter of txEnable once, and a "
                    "loop must have at least as many chirps"
                )
            return order, "doppler-division", len(masks)
        if len(first) == 2 == len(masks) and tables.is_binary_coded:
            return first, "phase-coded", 1
        return first, "together", 1
    turns = [mask[0] for mask in masks]
    order = tuple(dict.fromkeys(turns))
    repeated = order * (len(masks) // len(order))
    if any(len(mask) > 1 for mask in masks) or tuple(turns) != repeated:
        raise InputError(
            "txEnable: the transmitters of a loop neither take turns, one on each chirp, nor send "
            "every chirp together; polychirp has no code for this"
        )
    return order, "time-division", 1


def _receivers(mask: int) -> int:
    """Number of receivers in a mask, which must be neighbours, so that they are evenly spaced."""
    number = mask.bit_count()
    lowest = mask & -mask
    if not 1 <= number <= 8 or mask != ((1 << number) - 1) * lowest:
        raise InputError(
            f"rxChannelEn: {mask:#x} does not switch neighbouring receivers on, and the model's "
            "are evenly spaced; use a mask such as 0xF, or describe a recording that was made so "
            "in a parameter file, with enabled_receivers and channel_positions"
        )
    return number


def _notes(first: Fields, transmitters: tuple[int, ...], sharing: Sharing) -> list[str]:
    """Sentences on what the file says and the study leaves out."""
    notes = []
    *others, last = (str(number) for number in transmitters)
    names = f"{', '.join(others)} and {last}" if others else last
    if len(transmitters) > 1 and sharing == "together":
        notes.append(
            f"txEnable: transmitters {names} send every chirp together, as a beam; the study has "
            "one element with their power on the axis, without the beam's side lobes"
        )
        shifters = int(first["txPhaseShifter"])
        phases = {shifters >> 8 * (number - 1) & _PHASE_BITS for number in transmitters}
        if len(phases) > 1:
            notes.append(
                "txPhaseShifter: phases of the transmitters turn this beam away from the axis; the "
                "study's is on the axis, so turn the radar's mount by the beam's angle"
            )
    elif len(transmitters) > 1:
        notes.append(
            f"txEnable: the file does not say where transmitters {names} are; the study has them "
            "on one line in this order, a whole receiving array apart, none raised"
        )
    if first["txOutPowerBackoffCode"]:
        notes.append(
            "txOutPowerBackoffCode: the back-off of the transmitters' power is left out; lower "
            "defaults.radar.transmit_power by it"
        )
    if first["txStartTime"] > first["adcStartTime"]:
        notes.append(
            "txStartTime: the transmitters start after the converter; the study's send the whole "
            "ramp"
        )
    return notes
