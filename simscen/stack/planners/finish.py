"""From points to the path that is followed: evenly spaced, with headings."""

import numpy as np

from simscen.core.geometry import Array, Pose2

SPACING = 0.05
"""Meters between the points of a finished path."""


def spaced(points: Array, spacing: float) -> Array:
    """The polyline (n, 2) with points at most `spacing` meters apart; its corners are kept, so that none is cut."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    counts = np.maximum(1, np.ceil(lengths / spacing - 1e-9)).astype(np.int64)
    counts[lengths == 0.0] = 0
    first = np.repeat(np.cumsum(counts) - counts, counts)
    part = (np.arange(counts.sum()) - first + 1) / np.repeat(counts, counts)
    inner = np.repeat(points[:-1], counts, axis=0) + part[:, None] * np.repeat(steps, counts, axis=0)
    return np.vstack((points[:1], inner))


def with_headings(points: Array, goal: Pose2) -> Array:
    """Poses (n, 3): each point heads to the next, the last one as the goal does."""
    steps = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal.yaw)
    return np.column_stack((points, yaw))
