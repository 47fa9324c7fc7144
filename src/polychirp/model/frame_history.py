"""`FrameHistory`: starts and interference of the radars of a road, frame by frame."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, BoolArray, FloatArray, Sealed

PerFrame = Annotated[FloatArray, Axes("frame", "radar")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameHistory(Sealed):
    """Frames of all radars under a rule that acts from frame to frame.

    A `Trial` has it if the study's rule is such a one.

    Parameters
    ----------
    names : names of the radars
    interval : s, from the begin of one frame of a radar to that of the next
    start_time : s, start of the radar's first ramp, ``(frame, radar)``
    inr : power ratio of interference to noise in the IF band, mean over the frame's samples,
        ``(frame, radar)``
    hit_ramps : share of the ramps with more interference than noise, ``(frame, radar)``
    is_lost : true for a frame whose ``inr`` exceeds what the rule tolerates, ``(frame, radar)``

    Examples
    --------
    >>> one = np.array([[True], [True], [False], [True]])
    >>> history = FrameHistory(names=("front",), interval=0.05, start_time=one, inr=one,
    ...     hit_ramps=one, is_lost=one)
    >>> history.longest_loss.tolist(), history.frames_until_free.tolist()
    ([2], [2])
    """

    names: tuple[str, ...]
    interval: float
    start_time: PerFrame
    inr: PerFrame
    hit_ramps: PerFrame
    is_lost: Annotated[BoolArray, Axes("frame", "radar", dtype=bool)]

    def of(self, name: str) -> BoolArray:
        """True for each frame of one radar that is lost, ``(frame,)``."""
        return np.asarray(self.is_lost[:, self.names.index(name)])

    @property
    def longest_loss(self) -> FloatArray:
        """Greatest number of frames that a radar loses in a row, ``(radar,)``."""
        return np.array([longest_run(lost) for lost in self.is_lost.T])

    @property
    def frames_until_free(self) -> FloatArray:
        """Number of frames that a radar loses before the first that it does not, ``(radar,)``."""
        return np.array([frames_until_free(lost) for lost in self.is_lost.T])


def longest_run(lost: BoolArray) -> int:
    """Greatest number of true values in a row.

    >>> longest_run(np.array([True, False, True, True]))
    2
    """
    longest = here = 0
    for one in lost:
        here = here + 1 if one else 0
        longest = max(longest, here)
    return longest


def frames_until_free(lost: BoolArray) -> int:
    """Number of true values before the first false one; all of them if there is none.

    >>> frames_until_free(np.array([True, True, False, True]))
    2
    """
    return int(np.argmin(lost)) if not np.all(lost) else int(lost.size)
