"""Examples on which the complex network is trained: planes of ramps, and what to keep of them.

Frames are drawn from families of the benchmark's set v2, from streams of their own: no frame of
the benchmark is among them. From a third of the ramps interference is taken away.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.receiver.mitigation.complex_network import HOPS, WINDOW, compressed_planes
from polychirp.receiver.mitigation.stft_excision import hann_transform
from polychirp.rng import Streams
from polychirp.study.mitigation.frame_sets import FRAME_SETS

FRAMES: Final[Mapping[str, int]] = {
    "tu-delft": 60,
    "arim": 240,
    "toth": 50,
    "direct": 30,
    "indirect": 30,
    "near-parallel": 30,
    "many": 30,
    "real-mixer": 20,
    "street-direct": 12,
    "street-ramps": 24,
    "street-ramps-indirect": 24,
}
"""Frames of each family; chosen so that families have similar numbers of cells."""

CROPS: Final = 10
"""Greatest number of pieces of a frame, each of another ramp and channel if there are several."""

SLICES: Final = 34
"""Slices of a piece: most of a ramp of the road's frames."""

CLEAN: Final = 0.35
"""Share of the pieces from which interference is taken away; chosen."""

HARMLESS: Final = 1e-3
"""Power of interference relative to the echoes of its cell that may stay beside them; chosen."""


class Examples(NamedTuple):
    """Planes, the label m of each cell, and its weight, ``(piece, frequency, slice)``."""

    planes: ComplexArray
    kept: FloatArray
    weight: FloatArray

    def some(self, chosen: IntArray | slice) -> Examples:
        """The chosen pieces."""
        return Examples(self.planes[chosen], self.kept[chosen], self.weight[chosen])


def drawn_examples(purpose: str, share: float = 1.0) -> Examples:
    """Examples from streams of this purpose's own, of a share of the `FRAMES`."""
    pieces: list[tuple[ComplexArray, FloatArray]] = []
    for family, count in FRAMES.items():
        for number in range(round(share * count)):
            streams = Streams(0).of("network", purpose, family, number)
            random = streams["pieces"]
            _, parts = FRAME_SETS["v2"][family](streams)
            channels, ramps = parts.samples.shape[1:3]
            for ramp in random.permutation(ramps)[:CROPS]:
                of_ramp = parts.samples[:, random.integers(channels), ramp]
                pieces += _pieces(of_ramp, parts.names, random, 3 if ramps == 1 else 1)
    planes, kept = (np.stack(arrays) for arrays in zip(*pieces, strict=True))
    # an error in a strong cell costs more, be it an echo that is lost or a burst that stays
    weight = 1.0 + np.abs(planes) ** 2
    return Examples(planes, kept.astype(np.float32), weight.astype(np.float32))


def _pieces(
    of_ramp: ComplexArray, names: tuple[str, ...], random: np.random.Generator, count: int
) -> list[tuple[ComplexArray, FloatArray]]:
    """Pieces of one ramp, from its parts ``(part, fast)``."""
    is_other, is_noise = np.isin(names, ("direct", "indirect")), np.isin(names, ("noise",))
    other, noise, echo = (
        of_ramp[part].sum(axis=0) for part in (is_other, is_noise, ~is_other & ~is_noise)
    )
    if random.random() < CLEAN:
        other = np.zeros_like(other)
    planes = compressed_planes((echo + noise + other)[None])[0]
    transform = hann_transform(WINDOW, HOPS)
    of_noise, of_echo, of_other = (
        np.abs(transform.stft(part)) ** 2 for part in (noise, echo, other)
    )
    harmless = of_noise.mean() + HARMLESS * of_echo
    kept = harmless / np.maximum(harmless + of_other, 1e-300)
    spare = planes.shape[-1] - SLICES
    starts = random.integers(0, spare + 1, count)
    return [(planes[:, s : s + SLICES], kept[:, s : s + SLICES]) for s in starts]
