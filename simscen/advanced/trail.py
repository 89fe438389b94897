"""The robot's own trail, along which the robot can drive back."""

import math
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array

SPACING_M = 0.01
"""Distance between two poses of a trail, by `Trail.footprint_distance`."""
LOOP_CLOSURE_M, MIN_LOOP_M = 0.12, 0.3
"""Maximum distance between the ends of a loop, and minimum length of a loop, both by `Trail.footprint_distance`."""
MIN_LATERAL_SHARE = 0.1
"""Share of lateral motion above which the base has strafed. Slipping wheels cause less."""


class Trail:
    """The robot's path in reverse: evenly spaced poses from the current one to the oldest one, without loops.

    Beyond the oldest pose, the trail continues straight backward.

    poses (n, 3):              x, y, and yaw in m and rad
    base_distances (n,):       distance in m that the base drives from the first pose to each pose
    footprint_distances (n,):  the same distance, measured by `footprint_distance`
    """

    def __init__(self, earlier: Sequence[Pose2], current: Pose2, radius: float, extension: float) -> None:
        """Take the poses (oldest first), the circumscribed radius in m, and the length in m of the straight part."""
        self._radius = radius
        past_poses = self._thinned(np.array([current, *reversed(earlier)], dtype=np.float64))
        self.has_strafed = _has_strafed(past_poses)
        trail = self._without_loops(past_poses)
        x, y, yaw = trail[-1].tolist()
        end = (x - extension * math.cos(yaw), y - extension * math.sin(yaw), yaw)
        self.known_count = len(self._resampled(trail))
        """Number of poses without the straight part."""
        self.poses = self._resampled(np.concatenate((trail, [end])))
        self.footprint_distances = self._lengths(self.poses)
        steps = np.hypot(np.diff(self.poses[:, 0]), np.diff(self.poses[:, 1]))
        self.base_distances = np.concatenate(([0.0], np.cumsum(steps)))

    def footprint_distance(self, poses: Array, others: Array) -> Array:
        """Return the distances (…,) in m that the footprint moves between `poses` (…, 3) and `others` (…, 3).

        The distance is the distance between the positions, plus the turn in rad times the circumscribed radius.
        """
        turned = np.abs(wrap_array(poses[..., 2] - others[..., 2]))
        return np.asarray(
            np.hypot(poses[..., 0] - others[..., 0], poses[..., 1] - others[..., 1]) + self._radius * turned
        )

    def _lengths(self, poses: Array) -> Array:
        """Return the distances (n,) in m along poses (n, 3), by `footprint_distance`."""
        return np.concatenate(([0.0], np.cumsum(self.footprint_distance(poses[1:], poses[:-1]))))

    def _thinned(self, trail: Array) -> Array:
        """Return the poses that are at least SPACING_M from the previous returned pose."""
        indices = [0]
        for k in range(1, len(trail)):
            if self.footprint_distance(trail[k], trail[indices[-1]]) >= SPACING_M:
                indices.append(k)
        return trail[indices]

    def _without_loops(self, trail: Array) -> Array:
        """Return the poses without loops, which return to a pose within LOOP_CLOSURE_M after at least MIN_LOOP_M."""
        lengths = self._lengths(trail)
        indices, k = [0], 0
        while k < len(trail) - 1:
            is_near = self.footprint_distance(trail, trail[k]) <= LOOP_CLOSURE_M
            is_return = is_near & (lengths >= lengths[k] + MIN_LOOP_M)
            k = int(is_return.nonzero()[0][-1]) if is_return.any() else k + 1
            indices.append(k)
        return trail[indices]

    def _resampled(self, trail: Array) -> Array:
        """Return poses interpolated at equal distances."""
        lengths = self._lengths(trail)
        stations = np.arange(0.0, lengths[-1], SPACING_M)
        trail = np.column_stack((trail[:, :2], np.unwrap(trail[:, 2])))
        return np.column_stack([np.interp(stations, lengths, column) for column in trail.T])


def _has_strafed(past_poses: Array) -> bool:
    """Return whether the base drove sideways between poses (n, 3)."""
    steps, yaw = np.diff(past_poses[:, :2], axis=0), past_poses[:-1, 2] + wrap_array(np.diff(past_poses[:, 2])) / 2
    lateral = np.abs(np.cos(yaw) * steps[:, 1] - np.sin(yaw) * steps[:, 0])
    return bool(lateral.sum() > MIN_LATERAL_SHARE * np.hypot(*steps.T).sum())
