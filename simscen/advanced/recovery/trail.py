"""Trail of a robot: the poses that it came through, in reverse order, without loops and evenly spaced."""

import math
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array

STEP = 0.01
"""Distance in m that the footprint moves between two poses of a trail, including rotation."""
AGAIN, LOOP = 0.12, 0.3
"""A loop, which is removed, returns to within AGAIN m of a pose after the footprint has moved by at least LOOP m."""
ASIDE = 0.1
"""Share of lateral motion above which the base has strafed; a slipping base has less."""


class Trail:
    """Poses (n, 3) to drive back along, starting at the robot, and the distance (n,) that the footprint moves to each.

    Beyond the known part, the trail continues straight backward.
    """

    def __init__(self, way: Sequence[Pose2], pose: Pose2, lever: float, length: float) -> None:
        """Take earlier poses (oldest first), the current one, the circumscribed radius and the minimum length in m."""
        self._lever = lever
        came = self._thinned(np.array([pose, *reversed(way)], dtype=np.float64))
        self.strafed = _strafed(came)
        """Whether the base moved sideways."""
        back = self._without_loops(came)
        x, y, yaw = back[-1].tolist()
        end = (x - length * math.cos(yaw), y - length * math.sin(yaw), yaw)
        self.known = len(self._even(back))
        """Number of poses that the robot really came through."""
        self.poses = self._even(np.concatenate((back, [end])))
        self.along = np.concatenate(([0.0], np.cumsum(self.apart(self.poses[1:], self.poses[:-1]))))
        steps = np.hypot(np.diff(self.poses[:, 0]), np.diff(self.poses[:, 1]))
        self.driven = np.concatenate(([0.0], np.cumsum(steps)))
        """Distance (n,) in m that the base drives to each pose."""

    def apart(self, poses: Array, others: Array) -> Array:
        """Return the distances (…,) in m that the footprint moves from poses (…, 3) to others."""
        turned = np.abs(wrap_array(poses[..., 2] - others[..., 2]))
        return np.asarray(
            np.hypot(poses[..., 0] - others[..., 0], poses[..., 1] - others[..., 1]) + self._lever * turned
        )

    def _thinned(self, back: Array) -> Array:
        """Return poses between which the footprint moves by at least STEP."""
        kept = [0]
        for k in range(1, len(back)):
            if self.apart(back[k], back[kept[-1]]) >= STEP:
                kept.append(k)
        return back[kept]

    def _without_loops(self, back: Array) -> Array:
        """Return the poses without loops, in which the robot returns to an earlier pose."""
        moved = np.concatenate(([0.0], np.cumsum(self.apart(back[1:], back[:-1]))))
        kept, k = [0], 0
        while k < len(back) - 1:
            near = (self.apart(back, back[k]) <= AGAIN) & (moved >= moved[k] + LOOP)
            k = int(near.nonzero()[0][-1]) if near.any() else k + 1
            kept.append(k)
        return back[kept]

    def _even(self, back: Array) -> Array:
        """Return the poses resampled evenly."""
        moved = np.concatenate(([0.0], np.cumsum(self.apart(back[1:], back[:-1]))))
        at = np.arange(0.0, moved[-1], STEP)
        back = np.column_stack((back[:, :2], np.unwrap(back[:, 2])))
        return np.column_stack([np.interp(at, moved, column) for column in back.T])


def _strafed(came: Array) -> bool:
    steps, yaw = np.diff(came[:, :2], axis=0), came[:-1, 2] + wrap_array(np.diff(came[:, 2])) / 2
    aside = np.abs(np.cos(yaw) * steps[:, 1] - np.sin(yaw) * steps[:, 0])
    return bool(aside.sum() > ASIDE * np.hypot(*steps.T).sum())
