"""Profiles of the coherent receiver in the order of their steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def in_order(value: NDArray[np.float32]) -> NDArray[np.float32]:
    """Profiles ``(…, step within a range, range)``, one step after the other, ``(…, step)``."""
    return np.moveaxis(value, -1, -2).reshape(*value.shape[:-2], -1)
