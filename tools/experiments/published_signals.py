"""Methods of mitigation on signals of the literature, beside the published values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation import (
    AnyMitigation,
    Autoregression,
    Blanking,
    Burg,
    DualSparsity,
    Imat,
    Interpolation,
    LowRankHankel,
    MatrixPencil,
    NoiseCanceller,
    StftExcision,
    StftStatistics,
    Wavelet,
)
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.scoring.mitigation import sample_sinr
from polychirp.study.mitigation.published import tu_delft
from polychirp.units import to_db

TU_DELFT_METHODS: Final[Mapping[str, tuple[AnyMitigation | None, str]]] = {
    "nothing": (None, "−12.7"),
    "noise canceller, on every ramp": (NoiseCanceller(least_gain=1.0), "worse than nothing"),
    "noise canceller": (NoiseCanceller(), "–"),
    "interpolation": (Interpolation(), "–"),
    "zeroing": (Blanking(), "3.9"),
    "STFT, L-statistics": (StftStatistics(window=256), "–"),
    "wavelet": (Wavelet(), "−0.9 to 9.1, other signals"),
    "STFT CFAR, zeroed": (StftExcision(window=256), "7 to 8"),
    "STFT CFAR, levelled": (StftExcision(window=256, cells="levelled"), "7 to 8"),
    "IMAT": (Imat(), "7.6"),
    "dual sparsity": (DualSparsity(window=256), "–"),
    "Burg, order 60": (Burg(order=60), "14.9"),
    "autoregression": (Autoregression(longest_gap=30.0), "–"),
    "matrix pencil": (MatrixPencil(), "–"),
    "low-rank Hankel, hit samples": (LowRankHankel(), "–"),
    "low-rank Hankel, all samples": (LowRankHankel(replaces="all"), "29.9 to 30.2"),
}
"""Methods by name with the published SINR, dB."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedRow:
    """SINR of a method over draws of a signal, dB.

    Parameters
    ----------
    method, published : name, and the published value
    median, low, high : median over the draws with its 95 % interval from order statistics
    tenth : of the draws, one in ten lies below
    """

    method: str
    published: str
    median: float
    low: float
    high: float
    tenth: float


def tu_delft_rows(
    *,
    draws: int = 40,
    seed: int = 1900,
    methods: Mapping[str, tuple[AnyMitigation | None, str]] = TU_DELFT_METHODS,
    progress: Progress = no_progress,
) -> tuple[PublishedRow, ...]:
    """Every method on the same draws of the signal of TU Delft."""
    signals = [tu_delft(Streams(seed + number))[:2] for number in range(draws)]
    rows = []
    for number, (name, (method, published)) in enumerate(methods.items()):
        progress("methods", number, len(methods))
        sinr = [repaired_sinr(method, frame, parts.echo) for frame, parts in signals]
        rows.append(_row(name, published, np.sort(to_db(np.array(sinr)))))
    progress("methods", len(methods), len(methods))
    return tuple(rows)


def repaired_sinr(method: AnyMitigation | None, frame: IfFrame, echo: ComplexArray) -> float:
    """SINR of the samples after a method, as a ratio."""
    return sample_sinr(echo, mitigated(method, frame).samples)


def _row(name: str, published: str, ordered: FloatArray) -> PublishedRow:
    from scipy.stats import binom

    first = max(int(binom.ppf(0.025, ordered.size, 0.5)) - 1, 0)
    return PublishedRow(
        method=name,
        published=published,
        median=float(np.median(ordered)),
        low=float(ordered[first]),
        high=float(ordered[-1 - first]),
        tenth=float(np.quantile(ordered, 0.1)),
    )
