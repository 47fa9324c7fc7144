"""Linear interpolation: a straight line replaces each gap that interference hits."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.patches import Patch, gaps, patched


@dataclass(frozen=True, slots=True, kw_only=True)
class Interpolation(BurstRepair):
    r"""Replace each gap by the straight line from its last good sample to its first one.

    .. math:: \hat x_n = \frac{b - n}{b - a}\,x_a + \frac{n - a}{b - a}\,x_b, \qquad a < n < b

    (TI 2020). It is right for beats far below the reciprocal of the gap's duration alone: a tone of
    f cycles per sample is wrong by up to twice its amplitude if f (b − a) is one half or more.
    Gaps at an end of the ramp stay blank. It takes 4 real multiplications per missing sample.

    `Autoregression` and `Burg` fill gaps with tones.
    """

    kind: Literal["interpolation"] = "interpolation"

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with lines in place of the bursts."""
        hit = self.hit(frame)
        patches = []
        for ramp in np.flatnonzero(hit.any(axis=1)):
            for missing in gaps(hit[ramp, : frame.times.num_samples[ramp]], 1):
                ends = np.array([missing[0] - 1, missing[-1] + 1])
                share = (missing - ends[0]) / (ends[1] - ends[0])
                matrix = np.stack([1.0 - share, share], axis=1)
                place = int(ramp)
                patches.append(Patch(missing=(place, missing), known=(place, ends), matrix=matrix))
        return patched(frame, hit, patches)
