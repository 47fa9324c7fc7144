"""The radar that causes each ghost of interference.

A frame has the sum of all interferers. Where there are ghosts, the signals of the audible radars
are needed one by one, a few radars at a time, which bounds the memory: those of the first few are
kept when the frame is computed, others are computed again. The receiver then says what power each
contributes to each detection, by the linear steps that gave the power of each part.
"""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import IfParts
from polychirp.scoring.causes import Nature
from polychirp.study.reception import MOST_AT_ONCE, Reception

_OF_RADARS: Final = (Nature.DIRECT.value, Nature.INDIRECT.value)
"""Natures of the ghosts that other radars cause, in the order of the parts of `interference_of`."""


def radars_of_ghosts(
    nature: Sequence[str],
    reception: Reception,
    powers_of: Callable[[Sequence[IfParts]], FloatArray],
) -> tuple[str | None, ...]:
    """Name of the radar that contributes most power to each ghost of interference; else None.

    A direct ghost is compared by the radars' direct paths, an indirect one by their other paths. If
    one radar alone is audible, nothing is computed.

    Parameters
    ----------
    nature : cause of every detection (`Score`)
    powers_of : power of the parts of several radars in each detection, W,
        ``(detection, radar, part)``
    """
    name = [radar.name for radar in reception.scene.radars]
    if not any(cause in _OF_RADARS for cause in nature):
        return (None,) * len(nature)
    audible = reception.audible()
    strongest = np.zeros((len(nature), len(_OF_RADARS)), dtype=np.int64)
    if len(audible) > 1:
        blocks = [audible[n : n + MOST_AT_ONCE] for n in range(0, len(audible), MOST_AT_ONCE)]
        powers = [powers_of([reception.parts(n) for n in block]) for block in blocks]
        strongest = np.argmax(np.concatenate(powers, axis=1), axis=1)
    return tuple(
        name[audible[strongest[n, _OF_RADARS.index(cause)]]] if cause in _OF_RADARS else None
        for n, cause in enumerate(nature)
    )
