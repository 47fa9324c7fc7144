r"""`raw_parameters`: parameters of a DCA1000 file, with the layout that a file of TI's tools tells.

The fields of mmWave Studio and their meaning are those of TI's mmWaveLink (``rl_device.h``,
``rlDevDataFmtCfg_t``, ``rlDevDataPathCfg_t``, ``rlDevLaneEnable_t``, ``rlDevLvdsLaneCfg_t``); those
of the commands are of the mmWave SDK's user guide. TI's ``rawDataReader.m``, which comes with
mmWave Studio, reads the same two layouts as `dca1000` and refuses all others:

====================  ===========================  =====================
layout                ``laneEn``                   ``chInterleave``
====================  ===========================  =====================
xWR12xx, 14xx         0xF, four lanes              0, interleaved
xWR16xx, 18xx, 68xx   0x3, two lanes               1, not interleaved
====================  ===========================  =====================

``iqSwapSel`` 1 sends Q before I. The SDK calls it ``SampleSwap``, "Q in LSB, I in MSB", and the
lower half of a word of 32 bits is the first one in the file: the reader of the RadarML project
(``xwr``) finds Q first in files that were recorded with it.
"""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from polychirp.capture.parameters import CaptureParameters, Device
from polychirp.capture.ti_files import read_tables
from polychirp.capture.ti_profile import recording_parameters
from polychirp.errors import InputError, ModelWarning

_SWAPS: Final = ("rlDevDataFmtCfg_t.iqSwapSel", "adcbufCfg: SampleSwap")
"""Fields with 1 if Q is sent before I."""

_INTERLEAVES: Final = ("rlDevDataFmtCfg_t.chInterleave", "adcbufCfg: ChanInterleave")
"""Fields with 0 if the samples of the receivers alternate, 1 if the receivers follow each other."""

_LANES: Final = "rlDevLaneEnable_t.laneEn"
_FOUR_LANES: Final = 0xF
_TWO_LANES: Final = 0x3

_BUFFER_FORMAT: Final = "adcbufCfg: adcOutputFmt"


class _Readable(NamedTuple):
    """Values of a field that can be read, and what a recording with another value holds."""

    values: tuple[int, ...]
    otherwise: str


_READABLE: Final = {
    **dict.fromkeys(_SWAPS, _Readable((0, 1), "an order of I and Q that is not defined")),
    **dict.fromkeys(_INTERLEAVES, _Readable((0, 1), "an order of receivers that is not defined")),
    _LANES: _Readable((_TWO_LANES, _FOUR_LANES), "lanes in an order that TI does not describe"),
    "rlDevDataPathCfg_t.intfSel": _Readable((1,), "no samples of LVDS lanes, which the card takes"),
    "rlDevDataPathCfg_t.transferFmtPkt0": _Readable((1,), "more than the samples"),
    "rlDevDataPathCfg_t.transferFmtPkt1": _Readable((0,), "more than the samples"),
    "rlDevLvdsLaneCfg_t.laneFmtMap": _Readable((0,), "the receivers in reverse order"),
    _BUFFER_FORMAT: _Readable((0, 1), "samples in a format that is not defined"),
    "adcbufCfg: ChirpThreshold": _Readable((0, 1), "several ramps of a receiver in succession"),
    "lvdsStreamCfg: enableHeader": _Readable((0,), "headers between the samples"),
    "lvdsStreamCfg: dataFmt": _Readable((1,), "more than the samples"),
    "lvdsStreamCfg: enableSW": _Readable((0,), "results of the device between the samples"),
}
"""Fields of a stream; a file with another value is refused, except for `_NOT_SENT`."""

_NOT_SENT: Final = ("lvdsStreamCfg: dataFmt", 0)
"""Field and value with which the demos of the SDK send no samples to the card."""

_UNLIKELY_RECEIVERS: Final = 3
"""Number of receivers for which SWRA581 says that two lanes cannot send them."""


def raw_parameters(path: Path | str, *, device: Device | None = None) -> CaptureParameters:
    """Parameters of a DCA1000 file from the file of TI's tools with which it was recorded.

    They are `recording_parameters`, with ``conjugate`` if the device sent Q before I, with the
    numbers of its receivers, and with the device if the file tells its number of lanes. Q + jI is
    the conjugate of I + jQ turned by 90°, so that all phases are 90° too small, which no range,
    range rate or azimuth depends on.

    `InputError` is raised as by `recording_parameters`, and if the samples were sent in a layout
    that `open_raw` does not read; it names the field. `ModelWarning` is raised if the file says
    that no samples are sent, or three receivers on two lanes.

    Parameters
    ----------
    device : TI device that wrote the recording, if it is known
    """
    path = Path(path)
    parameters = recording_parameters(path)
    tables = read_tables(path)
    try:
        _refuse_unreadable(tables.stream, parameters)
        device = _device(tables.stream, device)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    if tables.stream.get(_NOT_SENT[0]) == _NOT_SENT[1]:
        _warn(
            f"{path.name}: {_NOT_SENT[0]}: {_NOT_SENT[1]} sends no samples to the card, so the "
            "recording was made with other commands; check that they had the same chirps and order"
        )
    if parameters.num_receivers == _UNLIKELY_RECEIVERS and device not in (None, "xwr14xx"):
        _warn(
            f"{path.name}: rxChannelEn: {tables.receivers:#x} switches three receivers on, which "
            "two lanes do not send according to TI's report SWRA581; check the azimuths, or record "
            "two or four"
        )
    is_swapped = any(tables.stream.get(name) == 1 for name in _SWAPS)
    return replace(
        parameters,
        device=device,
        conjugate=is_swapped and parameters.sampling == "complex",
        enabled_receivers=() if tables.receivers & 1 else _numbers(tables.receivers),
    )


def _warn(message: str) -> None:
    warnings.warn(message, ModelWarning, stacklevel=3)


def _numbers(mask: int) -> tuple[int, ...]:
    """Numbers, from 0, of the receivers in a mask.

    >>> _numbers(0xC)
    (2, 3)
    """
    return tuple(bit for bit in range(mask.bit_length()) if mask >> bit & 1)


def _refuse_unreadable(stream: Mapping[str, int], parameters: CaptureParameters) -> None:
    for name, value in stream.items():
        readable = _READABLE[name]
        if value not in readable.values and (name, value) != _NOT_SENT:
            shown = hex if name == _LANES else str
            works = " or ".join(shown(one) for one in readable.values)
            raise InputError(
                f"{name}: with {shown(value)} the recording holds {readable.otherwise}, which is "
                f"not supported; record with {works}"
            )
    buffered = stream.get(_BUFFER_FORMAT)
    if buffered is not None and (buffered == 1) != (parameters.sampling == "real"):
        kind = "real" if buffered == 1 else "complex"
        raise InputError(
            f"{_BUFFER_FORMAT}: {buffered} are {kind} samples, but those of adcCfg are "
            f"{parameters.sampling}; correct the one with which the recording was not made"
        )


def _device(stream: Mapping[str, int], device: Device | None) -> Device | None:
    """The device, or one with the same layout; None if the file tells no lanes.

    `InputError` is raised if its lanes and its interleaving are not one of the two layouts.
    """
    lanes = stream.get(_LANES)
    if lanes is not None and device is None:
        device = "xwr14xx" if lanes == _FOUR_LANES else "xwr16xx"
    if device is None:
        return None
    has_four = device == "xwr14xx"
    expected = _FOUR_LANES if has_four else _TWO_LANES
    if lanes not in (None, expected):
        raise InputError(
            f"{_LANES}: {lanes:#x} are {lanes.bit_count()} lanes, but {device} sends on "
            f"{expected.bit_count()}; give the device that wrote the recording, as in "
            f"--set device={'xwr16xx' if has_four else 'xwr14xx'}"
        )
    for name in _INTERLEAVES:
        if stream.get(name, 1 - has_four) != 1 - has_four:
            order = "one after the other" if has_four else "sample by sample"
            raise InputError(
                f"{name}: {stream[name]} sends the receivers {order}, which TI does not describe "
                f"for the lanes of {device}; record with {1 - has_four}, or give the device that "
                "wrote the recording"
            )
    return device
