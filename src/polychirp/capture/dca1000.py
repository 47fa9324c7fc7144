r"""Raw files of TI's DCA1000 capture card: int16, little endian, in the order of the LVDS lanes.

TI's application report SWRA581, "Mmwave Radar Device ADC Raw Data Capture", gives the order:

===================  ==========================================================================
xWR16xx, 18xx, 68xx  two lanes; per ramp one receiver after the other;
                     complex: I0 I1 Q0 Q1 I2 I3 Q2 Q3 …; real: one sample after the other
xWR12xx, 14xx        four lanes, one for each receiver; per sample complex: I of all four, then Q
                     of all four; real: one of each. Unused receivers hold zeros
===================  ==========================================================================

On two lanes only the receivers that are switched on are sent. On four lanes receiver n is on lane
n, so that `CaptureParameters.enabled_receivers` must name them unless they are the first ones. TI's
``rawDataReader.m`` leaves unused lanes out, unlike SWRA581; a warning tells if an unused lane does
not hold zeros.

Ramps follow each other in time without headers. Samples of 12 or 14 bits (``adc_bits``) stand in
words of 16 with zeros in front, also if they are negative. If the device was set to swap I and Q,
or if its targets beat at negative frequencies, ``conjugate`` must be set in the parameter file;
`raw_parameters` sets it from the files of TI's tools.
"""

import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray
from polychirp.capture.parameters import CaptureParameters, Device
from polychirp.capture.recording import Recording, frames_needed, way_out
from polychirp.errors import InputError, ModelWarning

NUM_LANES: Final = 4
"""Number of lanes of the xWR14xx (SWRA581), and the greatest number of receivers of any device."""

Words = NDArray[np.int16]


def open_raw(
    path: Path | str,
    parameters: CaptureParameters,
    *,
    frames: Iterable[int] | None = None,
) -> Recording:
    """A recording in a DCA1000 file, mapped into memory.

    `raw_parameters` reads the parameters from the files of TI's tools.

    Parameters
    ----------
    frames : numbers of the frames that will be read; if given, later frames may be missing

    Raises
    ------
    InputError
        The parameters name no device or do not fit it; the file cannot be read, or ends before or
        in the last frame needed. The message then says what is missing, and which frames are whole.
    """
    path = Path(path)
    device = parameters.device
    if device is None:
        raise InputError(
            f'{path.name}: its parameters name no device; add device = "xwr16xx", or the device '
            "that wrote it, to the parameter file, or give it with --set device=xwr16xx"
        )
    try:
        size = path.stat().st_size
    except FileNotFoundError:
        raise InputError(f"there is no recording '{path}'") from None
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}") from None
    if not path.is_file():
        raise InputError(f"'{path}' is not a file; name the raw file itself")
    per_ramp = 2 * _words_per_ramp(parameters, device)
    per_frame = per_ramp * parameters.num_ramps
    whole, rest = divmod(size, per_frame)
    # an empty file cannot be mapped into memory, even to read no frame of it
    needed = max(1, frames_needed(whole + (rest > 0), parameters, frames))
    if whole < needed:
        ramps = rest // per_ramp
        started = f" and the first {ramps} of frame {whole}'s {parameters.num_ramps} ramps"
        noun, verb = ("frame", "is") if needed == 1 else ("frames", "are")
        held = "frame" if whole == 1 else "frames"
        raise InputError(
            f"{path.name}: {needed * per_frame - size} bytes are missing: {needed} {noun} "
            f"of {parameters.num_ramps} ramps {verb} {needed * per_frame} bytes, the file "
            f"has {size}; it holds {whole} whole {held}{started if rest else ''}"
            + way_out(whole, "the numbers in the parameter file")
        )
    stored = np.memmap(path, dtype="<i2", mode="r", shape=(whole, per_frame // 2))
    return Recording(
        name=path.name,
        parameters=parameters,
        num_frames=whole,
        read=lambda number: _read(stored[number], parameters, device=device, name=path.name),
    )


def _read(
    words: Words, parameters: CaptureParameters, *, device: Device, name: str
) -> ComplexArray:
    """Samples of the words of one frame; warns if a lane that is left out holds some too."""
    if device == "xwr14xx":
        is_used = np.any(words.reshape(-1, NUM_LANES), axis=0)
        others = [lane for lane in np.flatnonzero(is_used) if lane not in _lanes(parameters)]
        if others:
            warnings.warn(
                f"{name}: there are samples on lane {' and lane '.join(map(str, others))}, but the "
                "parameters have no such receiver, so the lanes may be in another order; correct "
                "num_receivers or enabled_receivers",
                ModelWarning,
                stacklevel=3,
            )
    return unpack(words, parameters, device=device)


def _lanes(parameters: CaptureParameters) -> list[int]:
    """Lane of each receiver of an xWR14xx."""
    return list(parameters.enabled_receivers or range(parameters.num_receivers))


def unpack(words: Words, parameters: CaptureParameters, *, device: Device) -> ComplexArray:
    """Samples ``(receiver, ramp, fast)`` of the words of one frame."""
    receivers, ramps = parameters.num_receivers, parameters.num_ramps
    parts = 2 if parameters.sampling == "complex" else 1
    if device == "xwr14xx":
        table = words.reshape(ramps, parameters.num_samples, parts, NUM_LANES)
        table = table.transpose(3, 0, 1, 2)[_lanes(parameters)]
    elif parts == 2:
        # (ramp, receiver, pair of samples, I or Q, sample of the pair)
        table = words.reshape(ramps, receivers, parameters.num_samples // 2, 2, 2)
        table = table.transpose(1, 0, 2, 4, 3).reshape(receivers, ramps, -1, 2)
    else:
        table = words.reshape(ramps, receivers, parameters.num_samples, 1).transpose(1, 0, 2, 3)
    values = _with_sign(table, parameters.adc_bits).astype(np.float64)
    return np.asarray(values[..., 0] + 1j * values[..., 1] if parts == 2 else values[..., 0] + 0j)


def _with_sign(words: Words, bits: int) -> Words:
    """Words of two's complement numbers of ``bits`` bits, whatever stands in front of these.

    >>> _with_sign(np.array([5, 4095, -1], dtype=np.int16), 12).tolist()
    [5, -1, -1]
    """
    in_front = 16 - bits
    return np.asarray((words << in_front) >> in_front)


def _words_per_ramp(parameters: CaptureParameters, device: Device) -> int:
    parts = 2 if parameters.sampling == "complex" else 1
    receivers = NUM_LANES if device == "xwr14xx" else parameters.num_receivers
    if parameters.num_receivers > NUM_LANES:
        raise InputError(
            f"num_receivers: a DCA1000 file has at most {NUM_LANES} receivers, not "
            f"{parameters.num_receivers}"
        )
    if max(parameters.enabled_receivers, default=0) >= NUM_LANES:
        raise InputError(
            f"enabled_receivers: a device has the receivers 0 to {NUM_LANES - 1}; name them so"
        )
    if parts == 2 and device != "xwr14xx" and parameters.num_samples % 2:
        raise InputError("num_samples: must be even, because the file holds samples in pairs")
    return parts * receivers * parameters.num_samples
