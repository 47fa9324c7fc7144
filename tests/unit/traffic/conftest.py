"""Slow and obvious geometry for the tests of traffic: nearest points and blocked lines."""

from collections.abc import Callable

import numpy as np
import pytest


def closest_point(point: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance ``(…,)`` and place of the nearest point of each triangle ``(…, corner, xyz)``."""
    a, b, c = (corners[..., k, :] for k in range(3))
    u, v, w = b - a, c - a, point - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    area = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    place = a + s[..., None] * u + t[..., None] * v
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    best = np.where(inside, np.linalg.norm(point - place, axis=-1), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        at = ((point - start) * along).sum(-1) / (along * along).sum(-1)
        foot = start + np.clip(at, 0, 1)[..., None] * along
        length = np.linalg.norm(point - foot, axis=-1)
        place = np.where((length < best)[..., None], foot, place)
        best = np.minimum(best, length)
    return best, place


def is_blocked(start: np.ndarray, end: np.ndarray, corners: np.ndarray) -> bool:
    """True if any triangle cuts the segment without its last millimetre."""
    way = end - start
    reach = 1 - 1e-3 / np.linalg.norm(way)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(way, v)
    area = (u * across).sum(-1)
    flat = np.abs(area) < 1e-15
    area = np.where(flat, 1.0, area)
    offset = start - corners[:, 0]
    s = (offset * across).sum(-1) / area
    other = np.cross(offset, u)
    t, at = (other @ way) / area, (v * other).sum(-1) / area
    hit = ~flat & (s >= 0) & (t >= 0) & (s + t <= 1) & (at > 1e-6) & (at < reach)
    return bool(hit.any())


@pytest.fixture(name="closest", scope="session")
def closest_fixture() -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    return closest_point


@pytest.fixture(name="blocked", scope="session")
def blocked_fixture() -> Callable[..., bool]:
    return is_blocked
