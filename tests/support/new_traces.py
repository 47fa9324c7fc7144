"""Rates of a path against traces of the moments before and after."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import PropagationPaths

STEP = 5e-4
"""Time from a trace to the next one, s."""


def check_rates(traced: Callable[[float], PropagationPaths]) -> None:
    """Compare second derivatives of lengths, and rates of directions, with those of new traces.

    Parameters
    ----------
    traced : paths at a time, s, the same ones at all times
    """
    early, now, late = (traced(time) for time in (-STEP, 0.0, STEP))
    slope = (late.delay_rate - early.delay_rate) / (2 * STEP)
    assert SPEED_OF_LIGHT * (now.delay_acceleration - slope) == pytest.approx(0.0, abs=0.1)
    for name in ("departure", "arrival"):
        turn = (getattr(late, name) - getattr(early, name)) / (2 * STEP)
        np.testing.assert_allclose(getattr(now, f"{name}_rate"), turn, atol=0.01)
