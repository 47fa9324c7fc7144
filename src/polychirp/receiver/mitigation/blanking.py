"""Blanking: samples that interference hits are left out."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated, with_weights
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.units import Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Blanking(BurstRepair):
    r"""Leave out the samples that bursts of interference hit.

    Samples within ``taper`` (L samples) of a blanked one are weighted by a raised cosine
    :math:`\tfrac12(1 - \cos\frac{\pi d}{L+1})` of the distance d = 1 … L in samples. With weights
    :math:`u_n`, a window :math:`w_n` and white noise, a tone's SNR in its ramp's spectrum is
    :math:`(\sum w u)^2 / (\sum w^2 u^2)` times that of one sample.

    Parameters
    ----------
    taper : s, length of the raised cosine on either side of blanked samples; 0 s for none

    Examples
    --------
    A burst hits one sample; the sample rate is 1 MHz.

    >>> from polychirp.model.antenna import AntennaArray
    >>> from polychirp.model.if_frame import SampleTimes
    >>> from polychirp.model.ramp import RampSchedule
    >>> ramp = RampSchedule(start_time=[0.0], duration=[1e-5], start_frequency=[77e9],
    ...     slope=[1e13], start_phase=[0.0], sweep=[0])
    >>> frame = IfFrame(samples=[[[1, 1j, -1, -1j, 9, 1j, -1, -1j]]], schedule=ramp,
    ...     times=SampleTimes(first=[0.0], num_samples=[8], rate=1e6),
    ...     array=AntennaArray(num_channels=1))
    >>> Blanking(guard=1e-6, taper=1e-6).mitigate(frame).weight
    array([[1. , 1. , 0.5, 0. , 0. , 0. , 0.5, 1. ]])
    """

    kind: Literal["blanking"] = "blanking"
    taper: Seconds = 0.0

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.taper < 0:
            raise InputError("a blanking taper cannot be negative; 0 s is none")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without those that are hit, and the weights of the others."""
        near = tapered(self.hit(frame), round(self.taper * frame.times.rate))
        return with_weights(frame, near * frame.times.is_sample)


def tapered(hit: BoolArray, length: int) -> FloatArray:
    """Weights ``(ramp, fast)``: 0 where hit, a raised cosine of ``length`` samples on either side.

    >>> tapered(np.array([[False, False, False, True]]), 2).round(2)
    array([[1.  , 0.75, 0.25, 0.  ]])
    """
    place = np.arange(hit.shape[1])
    far = 2 * hit.shape[1] + length
    before = np.maximum.accumulate(np.where(hit, place, -far), axis=1)
    after = np.minimum.accumulate(np.where(hit, place, far)[:, ::-1], axis=1)[:, ::-1]
    distance = np.minimum(place - before, after - place)
    share = np.minimum(distance, length + 1) / (length + 1)
    return np.asarray(0.5 * (1.0 - np.cos(np.pi * share)))
