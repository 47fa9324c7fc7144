"""Raw files as the DCA1000 writes them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.capture.dca1000 import NUM_LANES, Words
from polychirp.capture.parameters import Device
from polychirp.errors import InputError


def write_raw(
    path: Path | str, frames: Iterable[ComplexArray], *, device: Device, is_complex: bool
) -> None:
    """Write frames ``(receiver, ramp, fast)`` of whole numbers as the device would.

    Raises
    ------
    InputError
        A sample does not fit 16 bits.
    """
    with Path(path).open("wb") as file:
        for samples in frames:
            pack = pack_complex if is_complex else pack_real
            file.write(pack(_as_words(samples), device).tobytes())


def pack_complex(words: Words, device: Device) -> Words:
    """The stream of a frame of words ``(receiver, ramp, fast, I or Q)``."""
    receivers, ramps, samples, _ = words.shape
    if device == "xwr14xx":
        return _on_four_lanes(words)
    pairs = words.reshape(receivers, ramps, samples // 2, 2, 2)
    return pairs.transpose(1, 0, 2, 4, 3).reshape(-1)


def pack_real(words: Words, device: Device) -> Words:
    """The stream of a frame of words ``(receiver, ramp, fast, I or Q)``, I only."""
    if device == "xwr14xx":
        return _on_four_lanes(words[..., :1])
    return words[..., 0].transpose(1, 0, 2).reshape(-1)


def _on_four_lanes(words: Words) -> Words:
    receivers, ramps, samples, parts = words.shape
    lanes = np.zeros((ramps, samples, parts, NUM_LANES), dtype="<i2")
    lanes[..., :receivers] = words.transpose(1, 2, 3, 0)
    return lanes.reshape(-1)


def _as_words(samples: ComplexArray) -> Words:
    """Words ``(receiver, ramp, fast, I or Q)``."""
    values = np.rint(np.stack([samples.real, samples.imag], axis=-1))
    if np.max(np.abs(values + 0.5), initial=0.0) > 32767.5:
        raise InputError("a sample does not fit 16 bits; scale them to at most 32767")
    return values.astype("<i2")
