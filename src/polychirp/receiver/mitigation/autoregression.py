"""Interpolation: an autoregressive model replaces the samples that interference hits."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, IntArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.patches import Patch, gaps, patched
from polychirp.receiver.mitigation.prediction import covariance_model
from polychirp.units import Between


@dataclass(frozen=True, slots=True, kw_only=True)
class Autoregression(BurstRepair):
    r"""Replace bursts by the interpolation of an autoregressive process from both sides.

    Echoes are tones, and P tones obey :math:`x_n = -\sum_{k=1}^{P} a_k x_{n-k}` exactly, forward
    and, with conjugate coefficients, backward. The coefficients are those of `covariance_model`
    over the good samples within 4 P samples on either side of a gap. The missing samples minimise
    the sum of squared prediction errors over the gap (Janssen, Veldhuis and Vries 1986). Forward
    and backward errors have the same sum, so that both sides count alike. All channels share the
    model, so that azimuths are kept.

    A gap is left blank if more than ``longest_gap`` P samples are missing, or if good ones are too
    few (fewer than P on a side, or than a model needs). Gaps with fewer than P good samples between
    them are one gap. The filled samples repeat noise from around the gap, some decibels stronger if
    echoes are much stronger than noise, and the more so the longer the gap and the lower the order.

    A gap of g samples takes some 4 g² (P + g/3) + 16 P³ real multiplications and 8 P g per channel.

    `Blanking` sets the bursts to zero instead.

    Parameters
    ----------
    order : P, number of samples from which the next one is predicted; choose several for each
        strong echo, but no more than a sixteenth of a ramp's samples
    longest_gap : greatest number of missing samples of a gap that is filled, over the order
    """

    kind: Literal["autoregression"] = "autoregression"
    order: Annotated[int, Between(greatest=1024)] = 64
    longest_gap: float = 1.0

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.order < 1:
            raise InputError("an autoregression's order must be 1 or more")
        if not self.longest_gap > 0:
            raise InputError("an autoregression's longest gap must be positive")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with short gaps filled; other samples that are hit get weight 0."""
        hit = self.hit(frame)
        patches: list[Patch] = []
        for ramp in np.flatnonzero(hit.any(axis=1)):
            length = int(frame.times.num_samples[ramp])
            ramp_hit, samples = hit[ramp, :length], frame.samples[:, ramp, :length]
            for missing in gaps(ramp_hit, self.order):
                if missing.size <= self.longest_gap * self.order:
                    patches.extend(_patch(int(ramp), samples, ramp_hit, missing, self.order))
        return patched(frame, hit, patches)


def _patch(
    ramp: int, samples: ComplexArray, hit: BoolArray, missing: IntArray, order: int
) -> Iterator[Patch]:
    """The patch of one gap; none if there are too few good samples around it."""
    reach = 4 * order
    near = slice(max(0, missing[0] - reach), missing[-1] + reach + 1)
    model = covariance_model(samples[:, near], ~hit[near], order)
    if model is not None:
        span = np.arange(missing[0] - order, missing[-1] + order + 1)
        known = np.setdiff1d(span, missing, assume_unique=True)
        matrix = interpolator(model, missing, known)
        yield Patch(missing=(ramp, missing), known=(ramp, known), matrix=matrix)


def interpolator(model: ComplexArray, missing: IntArray, known: IntArray) -> ComplexArray:
    r"""Matrix from known to missing samples that minimises the squared prediction error.

    With :math:`r_l = \sum_k \overline{a_k} a_{k+l}` and :math:`T_{ij} = r_{i-j}`, the missing
    samples m obey :math:`T_{mm} x_m = -T_{mk} x_k` (known: k). Shape ``(missing, known)``.

    Parameters
    ----------
    model : coefficients 1, a₁ … a_P
    missing, known : numbers of the samples; known are all others within P of a missing one

    Examples
    --------
    One sample is missing between two samples of a tone whose phase grows by 90° per sample.

    >>> matrix = interpolator(np.array([1, -1j]), np.array([1]), np.array([0, 2]))
    >>> (matrix @ np.array([1, -1])).round(12)
    array([0.+1.j])
    """
    lags = np.correlate(model, model, mode="full")
    order = model.size - 1

    def block(columns: IntArray) -> ComplexArray:
        lag = missing[:, None] - columns
        inside = np.abs(lag) <= order
        return np.where(inside, lags[np.clip(lag, -order, order) + order], 0.0)

    return np.asarray(np.linalg.solve(block(missing), -block(known)))
