"""Matrix pencil: tones of the good samples beside a gap fill it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, IntArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.patches import Patch, gaps_and_ends, patched
from polychirp.units import Between

LEAST_SINGULAR = 1e-3
"""Singular values of tones below this share of the greatest are not used in a fit. Chosen: almost
equal tones would have large amplitudes of opposite sign."""

NOISE_FACTOR = 3.0
"""Singular values above this multiple of their median belong to echoes; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixPencil(BurstRepair):
    r"""Replace each gap by the steady tones that the good samples on both sides share.

    The tones' poles :math:`z` are the generalised eigenvalues of two matrices of windows of the
    good samples that are one sample apart (Hua and Sarkar 1990), found from those singular vectors
    whose singular value is above `NOISE_FACTOR` times the median. Poles are put on the unit
    circle: echoes are steady. Amplitudes are those of least squares over the good samples within
    ``reach`` windows on both sides, together; all channels share the poles (J. Wang, Ding and
    Yarovoy 2021). What is weaker than the noise in the windows is not filled. A gap without a whole
    window of good samples on either side stays blank. With windows of L samples it takes some
    16 (2 L)³ real multiplications per gap, and 8 K per missing sample with K tones.
    `Autoregression` also fills what no few tones explain.

    Parameters
    ----------
    window : L, length of the windows, samples; the number of tones stays below it
    reach : greatest number of good samples that count on either side, over L
    """

    kind: Literal["matrix-pencil"] = "matrix-pencil"
    window: Annotated[int, Between(greatest=1024)] = 64
    reach: Annotated[int, Between(greatest=64)] = 4

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.window < 2 or self.reach < 2:
            raise InputError("a matrix pencil needs windows of 2 samples or more, and a reach of 2")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with tones in place of the bursts."""
        hit = self.hit(frame)
        patches: list[Patch] = []
        for k in np.flatnonzero(hit.any(axis=1)):
            length = int(frame.times.num_samples[k])
            patches += self._patches(frame.samples[:, k, :length], hit[k, :length], int(k))
        return patched(frame, hit, patches)

    def _patches(self, line: ComplexArray, hit: BoolArray, ramp: int) -> Iterator[Patch]:
        for missing in gaps_and_ends(hit, self.window):
            reach = self.reach * self.window
            near = np.arange(max(0, missing[0] - reach), min(hit.size, missing[-1] + 1 + reach))
            known = near[~hit[near]]
            pole = poles(line[:, near], ~hit[near], self.window)
            if pole.size:
                start = near[0]
                fit = np.linalg.pinv(powers(pole, known - start), rcond=LEAST_SINGULAR)
                matrix = powers(pole, missing - start) @ fit
                yield Patch(missing=(ramp, missing), known=(ramp, known), matrix=matrix)


def poles(samples: ComplexArray, is_good: BoolArray, window: int) -> ComplexArray:
    """Poles of the steady tones in samples ``(channel, fast)``, on the unit circle ``(tone,)``.

    Only windows of good samples are used; there are no poles if none is good.

    >>> tone = np.exp(0.5j * np.arange(40))[None]
    >>> np.angle(poles(tone, np.ones(40, dtype=bool), 8)).round(6)
    array([0.5])
    """
    windows = np.lib.stride_tricks.sliding_window_view
    if is_good.size <= window:
        return np.zeros(0, dtype=np.complex128)
    whole = windows(is_good, window + 1).all(axis=-1)
    rows = windows(samples, window + 1, axis=-1)[:, whole].reshape(-1, window + 1)
    if len(rows) < 1:
        return np.zeros(0, dtype=np.complex128)
    # eigenvectors of the Gram matrix are the right singular vectors of the windows
    value, vector = np.linalg.eigh(rows.T @ rows.conj())
    singular = np.sqrt(np.maximum(value, 0.0))
    floor = max(float(np.median(singular)), 1e-7 * float(singular[-1]))
    signal = vector[:, singular > NOISE_FACTOR * floor][:, -(window // 2) :]
    if signal.shape[1] == 0:
        return np.zeros(0, dtype=np.complex128)
    turn = np.linalg.lstsq(signal[:-1], signal[1:], rcond=None)[0]
    pole = np.linalg.eigvals(turn)
    return np.asarray(pole / np.maximum(np.abs(pole), 1e-300))


def powers(pole: ComplexArray, place: IntArray) -> ComplexArray:
    """Tones of the poles at places counted in samples, ``(place, tone)``."""
    return np.asarray(np.exp(1j * np.outer(place, np.angle(pole))))
