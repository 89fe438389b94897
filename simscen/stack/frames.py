"""Poses of the robot in the map and odom frames (REP 105), the transform between both, and the odometry history."""

import math
from bisect import bisect_left
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Polygon, Pose2, wrap_array


class Frames(NamedTuple):
    """The estimated pose of the robot in the map frame, and its odometry pose in the odom frame.

    The pose in the map frame jumps when the localizer corrects it; odometry is continuous but drifts.
    """

    pose: Pose2
    odometry: Pose2

    @property
    def map_from_odom(self) -> Pose2:
        """The transform that a localizer publishes: pose of the odom frame in the map frame."""
        return self.pose.compose(self.odometry.inverse())

    @property
    def odom_from_map(self) -> Pose2:
        """The inverse transform."""
        return self.odometry.compose(self.pose.inverse())

    def shift_since(self, odom_from_map: Pose2, reach: float) -> float:
        """Return how far in m points of the map have shifted in the odom frame since an earlier `odom_from_map`.

        The result is an upper bound for all points within `reach` m of the robot.
        """
        (x, y, yaw), (mapped_x, mapped_y, mapped_yaw), (odom_x, odom_y, odom_yaw) = (
            odom_from_map,
            self.pose,
            self.odometry,
        )
        c, s = math.cos(yaw), math.sin(yaw)
        dx, dy = x + c * mapped_x - s * mapped_y - odom_x, y + s * mapped_x + c * mapped_y - odom_y
        return math.hypot(dx, dy) + reach * abs(math.remainder(yaw + mapped_yaw - odom_yaw, math.tau))


def transform_poses(frame: Pose2, poses: Array) -> Array:
    """Return poses (n, 3) given in `frame`, expressed in its parent frame."""
    moved = np.empty((len(poses), 3))
    moved[:, :2], moved[:, 2] = frame.apply(poses[:, :2]), wrap_array(poses[:, 2] + frame.yaw)
    return moved


def transform_polygon(frame: Pose2, polygon: Polygon) -> Polygon:
    """Return a polygon given in `frame`, expressed in its parent frame."""
    c, s = math.cos(frame.yaw), math.sin(frame.yaw)
    return tuple((frame.x + c * x - s * y, frame.y + s * x + c * y) for x, y in polygon)


HISTORY_S = 10
"""Time for which past poses can be looked up: the default of tf2's buffer."""
TRAIL_S = 60
"""Time covered by the trail of the robot in the reference stack. Recovery behaviors use the trail."""
# Larger values, as from a broken encoder, are rejected: their squares could overflow.
_MAX_VALUE = 1e6


def is_plausible(values: tuple[float, float, float]) -> bool:
    """Return whether a pose or velocity is finite and below 1e6 in all components."""
    x, y, yaw = values
    return -_MAX_VALUE < x < _MAX_VALUE and -_MAX_VALUE < y < _MAX_VALUE and -_MAX_VALUE < yaw < _MAX_VALUE


class OdometryHistory:
    """Odometry poses of the last HISTORY_S seconds by tick, and the trail: the poses of about `trail_s` seconds."""

    def __init__(self, tick_rate: int, trail_s: float = HISTORY_S) -> None:
        """Create an empty history. `tick_rate` is in Hz."""
        self._span, self._trail, self._capacity = HISTORY_S * tick_rate, trail_s * tick_rate, (trail_s + 1) * tick_rate
        self.clear()

    def clear(self) -> None:
        """Remove all poses, for example to switch to another source of odometry."""
        self._readings: list[tuple[int, Pose2]] = []
        self._newest: float = -math.inf
        self._prune_at: float = -math.inf
        self.now = Pose2(0.0, 0.0)
        """The latest pose; the origin if there is none."""

    @property
    def has_pose(self) -> bool:
        """Whether there is any pose."""
        return self._prune_at > -math.inf

    def add(self, tick: int, pose: Pose2) -> bool:
        """Add a pose. Return False if it is rejected: not plausible, or not newer than the latest."""
        if tick <= self._newest or not is_plausible(pose):
            return False
        self._newest, self.now = tick, pose
        self._readings.append((tick, pose))
        if tick > self._prune_at:
            self._prune()
        return True

    def _prune(self) -> None:
        """Remove poses that are too old, and determine when to do so again."""
        del self._readings[: bisect_left(self._readings, (self._newest - self._trail,))]
        self._prune_at = self._readings[0][0] + self._capacity

    def _oldest_index(self) -> int:
        """Return the index of the oldest pose within HISTORY_S."""
        return bisect_left(self._readings, (self._newest - self._span,))

    def trail(self) -> list[Pose2]:
        """Return the poses of the trail, the oldest first."""
        return [pose for _, pose in self._readings]

    def reaches(self, tick: int) -> bool:
        """Return whether there is odometry at `tick` or later."""
        return self._newest >= tick

    def latest_until(self, tick: int) -> Pose2:
        """Return the latest pose up to `tick` without interpolation, or the oldest pose if all are later."""
        if tick >= self._newest:
            return self.now
        first = self._oldest_index()
        return self._readings[max(first, bisect_left(self._readings, (tick + 1,), first) - 1)][1]

    def at(self, tick: int) -> Pose2 | None:
        """Return the pose at `tick`, interpolated linearly; None before the oldest or after the latest pose."""
        if tick == self._newest:
            return self.now
        first = self._oldest_index()
        after = bisect_left(self._readings, (tick,), first)
        if after == len(self._readings):
            return None
        later_tick, later = self._readings[after]
        if later_tick == tick:
            return later
        if after == first:
            return None
        earlier_tick, earlier = self._readings[after - 1]
        fraction = (tick - earlier_tick) / (later_tick - earlier_tick)
        step = earlier.between(later)
        return earlier.compose(Pose2(fraction * step.x, fraction * step.y, fraction * step.yaw))

    def past_pose(self, latest: Pose2, tick: int) -> Pose2:
        """Return the pose at `tick`, not interpolated, in another frame. `latest` is the latest pose in that frame."""
        past = self.latest_until(tick)
        return latest if past is self.now else latest.compose(self.now.between(past))
