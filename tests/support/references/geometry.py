"""Slow and simple twins of the rays and points among triangles."""

from __future__ import annotations

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray


def closest_by_trying_all(
    triangles: FloatArray, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Slow twin of `Caster.closest`: every ray against every triangle."""
    corner = triangles[:, 0]
    u, v = triangles[:, 1] - corner, triangles[:, 2] - corner
    cross = np.cross(directions[:, None], v)
    volume = np.sum(u * cross, axis=-1)
    scale = 1.0 / np.where(volume == 0, np.inf, volume)
    away = origins[:, None] - corner
    alpha = np.sum(away * cross, axis=-1) * scale
    turned = np.cross(away, u)
    beta = np.sum(directions[:, None] * turned, axis=-1) * scale
    along = np.sum(v * turned, axis=-1) * scale
    is_hit = (volume != 0) & (alpha >= 0) & (beta >= 0) & (alpha + beta <= 1) & (along > 0)
    distance = np.where(is_hit, along, np.inf)
    face = np.argmin(distance, axis=1)
    nearest = np.take_along_axis(distance, face[:, None], axis=1)[:, 0]
    return nearest * np.linalg.norm(directions, axis=-1), face


def closest_points_by_columns(
    corners: FloatArray, place: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Slow twin of `closest_points`: all triangles at once, one operation after the other."""
    a = corners[:, 0]
    u, v, w = corners[:, 1] - a, corners[:, 2] - a, place - a
    is_front = np.sum(np.cross(u, v) * w, axis=-1) > 0
    uu, uv, vv = np.sum(u * u, -1), np.sum(u * v, -1), np.sum(v * v, -1)
    wu, wv = np.sum(w * u, -1), np.sum(w * v, -1)
    area = uu * vv - uv * uv
    safe = np.where(area > 0, area, 1.0)
    s, t = (vv * wu - uv * wv) / safe, (uu * wv - uv * wu) / safe
    best = a + s[:, None] * u + t[:, None] * v
    best[~((area > 0) & (s >= 0) & (t >= 0) & (s + t <= 1))] = np.inf
    for first, second in ((0, 1), (1, 2), (2, 0)):
        start, side = corners[:, first], corners[:, second] - corners[:, first]
        length = np.maximum(np.sum(side * side, -1), 1e-300)
        share = np.clip(np.sum((place - start) * side, -1) / length, 0.0, 1.0)
        other = start + share[:, None] * side
        nearer = np.sum((other - place) ** 2, -1) < np.sum((best - place) ** 2, -1)
        best = np.where(nearer[:, None], other, best)
    return np.asarray(best), np.asarray(is_front)
