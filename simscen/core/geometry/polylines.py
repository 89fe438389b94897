"""Polylines (n, 2) in the plane: length, resampling, and simplification."""

import math

import numpy as np

from simscen.core.geometry import Array


def polyline_length(points: Array) -> float:
    """Return the length in m of a polyline (n, 2)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def resample_polyline(points: Array, spacing: float, min_segments: int = 1) -> Array:
    """Return the polyline (n, 2) resampled to at least `min_segments` equal segments of at most `spacing` m."""
    distances = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    samples = np.linspace(0.0, distances[-1], max(min_segments, math.ceil(distances[-1] / spacing)) + 1)
    return np.column_stack((np.interp(samples, distances, points[:, 0]), np.interp(samples, distances, points[:, 1])))


def path_corners(path: Array, tolerance: float) -> list[int]:
    """Simplify a path (n, 2) to straight lines. Return the indices of the corners between the lines, without the ends.

    The path deviates from the lines by at most `tolerance` m. Source: Douglas and Peucker, Algorithms for the reduction
    of the number of points (1973).
    """
    line, offsets = path[-1] - path[0], path - path[0]
    along = np.clip(offsets @ line / max(float(line @ line), 1e-9), 0.0, 1.0)
    away = np.hypot(*(offsets - along[:, None] * line).T)
    bend = int(np.argmax(away))
    if away[bend] <= tolerance or bend in (0, len(path) - 1):
        return []
    after = [bend + index for index in path_corners(path[bend:], tolerance)]
    return [*path_corners(path[: bend + 1], tolerance), bend, *after]
