"""IMAT: a spectrum of few lines replaces the samples that interference hits."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.sparse_filling import (
    batches_of_one_length,
    filled_from_lines,
    samples_at,
)
from polychirp.units import Between, Ratio, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class Imat(BurstRepair):
    """Replace bursts by an iterative method with adaptive thresholding (IMAT).

    Echoes are few lines in a ramp's spectrum: samples that are hit are filled from its lines, by
    the iteration of `sparse_lines`, which is that of Marvasti et al. 2012 and of Bechter, Roos,
    Rahman and Waldschmidt 2017. Channels keep the same lines, so that azimuths are kept. Every
    burst is filled, whatever its length; no test tells whether the filled samples are right.

    `Blanking` sets the bursts to zero instead.

    Parameters
    ----------
    iterations : number of thresholds
    depth : power ratio of the first threshold to the last
    """

    kind: Literal["imat"] = "imat"
    iterations: Annotated[int, Between(greatest=1000)] = 10
    depth: Ratio = from_db(60.0)

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.iterations < 2:
            raise InputError("IMAT needs 2 iterations or more, for its threshold to fall")
        if not self.depth > 1.0:
            raise InputError("IMAT's depth must be above 0 dB, for its threshold to fall")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with all hit ones replaced."""
        hit = self.hit(frame)
        missing = (
            (ramps, samples_at(hit[ramps, : frame.times.num_samples[ramps[0]]]))
            for ramps in batches_of_one_length(frame, np.any(hit, axis=1))
        )
        return filled_from_lines(frame, missing, iterations=self.iterations, depth=self.depth)
