"""How fast a robot went whose log says only where it was."""

from __future__ import annotations

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.trace import Ticks

SPAN = 0.2
"""Seconds over which a difference of positions becomes a velocity: a motion capture trembles by millimeters."""
STANDS = 0.1
"""Meters: what moved further has a velocity that is not zero all the time."""


def velocity(ticks: Ticks, poses: Array, rate: int) -> Array:
    """vx, vy, wz (n, 3) in the body's frame from x, y, yaw (n, 3), averaged over about SPAN seconds around each."""
    if len(ticks) < 2:
        return np.zeros((len(ticks), 3))
    half = max(1, round(SPAN / 2 * rate))
    before = np.searchsorted(ticks, ticks - half, side="right") - 1
    after = np.searchsorted(ticks, ticks + half, side="left")
    before, after = np.maximum(before, 0), np.minimum(after, len(ticks) - 1)
    span = (ticks[after] - ticks[before]) / rate
    dx, dy = ((poses[after, axis] - poses[before, axis]) / span for axis in (0, 1))
    unwrapped = np.unwrap(poses[:, 2])
    turn = (unwrapped[after] - unwrapped[before]) / span
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))


def is_unfilled(twists: Array, poses: Array) -> bool:
    """Whether an odometry's twist was never filled in: zero all the time though the robot moved."""
    far = float(np.ptp(poses[:, 0]) + np.ptp(poses[:, 1])) if len(poses) else 0.0
    turned = float(np.abs(wrap_array(poses[:, 2] - poses[0, 2])).max()) if len(poses) else 0.0
    return not twists.any() and (far > STANDS or turned > STANDS)
