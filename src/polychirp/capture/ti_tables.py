"""Commands of TI's tools that describe a radar's chirps, as tables of numbers in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

Fields = Mapping[str, float]
"""Values of one command by TI's names of its fields, in SI units; masks and counts are numbers."""


class TiField(NamedTuple):
    """A field of a command: its key in mmWave Studio's files, and its unit in SI there.

    ``command_unit`` is its unit in the commands of the mmWave SDK; None if that is the same.
    """

    key: str
    unit: float = 1.0
    command_unit: float | None = None


PROFILE_FIELDS: Final = {
    "profileId": TiField("profileId"),
    "startFreqConst": TiField("startFreqConst_GHz", 1e9),
    "idleTimeConst": TiField("idleTimeConst_usec", 1e-6),
    "adcStartTimeConst": TiField("adcStartTimeConst_usec", 1e-6),
    "rampEndTime": TiField("rampEndTime_usec", 1e-6),
    "txOutPowerBackoffCode": TiField("txOutPowerBackoffCode"),
    "txPhaseShifter": TiField("txPhaseShifter"),
    "freqSlopeConst": TiField("freqSlopeConst_MHz_usec", 1e12),
    "txStartTime": TiField("txStartTime_usec", 1e-6),
    "numAdcSamples": TiField("numAdcSamples"),
    "digOutSampleRate": TiField("digOutSampleRate", 1e3),
}
"""Fields of a profile in the order of the command ``profileCfg``; its high-pass filters and its
gain follow them."""

CHIRP_FIELDS: Final = {
    "chirpStartIdx": TiField("chirpStartIdx"),
    "chirpEndIdx": TiField("chirpEndIdx"),
    "profileId": TiField("profileId"),
    "startFreqVar": TiField("startFreqVar_MHz", 1e6, command_unit=1.0),
    "freqSlopeVar": TiField("freqSlopeVar_KHz_usec", 1e9),
    "idleTimeVar": TiField("idleTimeVar_usec", 1e-6),
    "adcStartTimeVar": TiField("adcStartTimeVar_usec", 1e-6),
    "txEnable": TiField("txEnable"),
}
"""Fields of chirps in the order of the command ``chirpCfg``."""

JSON_STREAM: Final = (
    "rlDevDataFmtCfg_t.iqSwapSel",
    "rlDevDataFmtCfg_t.chInterleave",
    "rlDevDataPathCfg_t.intfSel",
    "rlDevDataPathCfg_t.transferFmtPkt0",
    "rlDevDataPathCfg_t.transferFmtPkt1",
    "rlDevLaneEnable_t.laneEn",
    "rlDevLvdsLaneCfg_t.laneFmtMap",
)
"""Fields of ``rawDataCaptureConfig`` in mmWave Studio's files that say how samples are sent."""

COMMAND_STREAM: Final = {
    "adcbufCfg": ("adcOutputFmt", "SampleSwap", "ChanInterleave", "ChirpThreshold"),
    "lvdsStreamCfg": ("enableHeader", "dataFmt", "enableSW"),
}
"""Fields of commands of the mmWave SDK that say how samples are sent; ``subFrameIdx`` precedes
them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TiTables:
    """Contents of a file of TI's tools that concern its chirps.

    Parameters
    ----------
    profiles : fields of the profiles by their ``profileId``
    chirps : fields of the chirps' commands, in the order of the file
    first, last : numbers of a loop's first and last chirp
    num_loops : number of loops in a frame
    receivers, transmitters : masks of the channels that are switched on; bit 0 is the first
    adc_format : 0 real, 1 complex 1x, 2 complex 2x, 3 pseudo-real
    adc_bits : 0, 1 or 2 for 12, 14 or 16 bits of a sample
    is_binary_coded : True if the signs of two transmitters are a binary code
    doppler_order : transmitters, counted from 0, in the order of their steps of phase from chirp to
        chirp; empty without such a code
    stream : values of the fields that say how samples are sent to a capture card, by the names of
        `ti_stream`; without the fields that the file lacks
    """

    profiles: Mapping[int, Fields]
    chirps: tuple[Fields, ...]
    first: int
    last: int
    num_loops: int
    receivers: int
    transmitters: int
    adc_format: int
    adc_bits: int = 2
    is_binary_coded: bool = False
    doppler_order: tuple[int, ...] = ()
    stream: Mapping[str, int] = field(default_factory=dict)
