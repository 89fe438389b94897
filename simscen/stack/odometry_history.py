"""History of the odometry, for poses at past times and the trail of the robot."""

import math
from bisect import bisect_left

from simscen.core.geometry import Pose2

HISTORY_S = 10
"""Time for which past poses can be looked up: the default of tf2's buffer."""
TRAIL_S = 60
"""Time covered by the trail of the robot in the reference stack. Recovery behaviors use the trail."""
_MAX_VALUE = 1e6
"""Larger values, as from a broken encoder, are rejected, because their squares could overflow."""


def is_plausible(values: tuple[float, float, float]) -> bool:
    """Return whether a pose or velocity is finite and below 1e6 in all components."""
    x, y, yaw = values
    return -_MAX_VALUE < x < _MAX_VALUE and -_MAX_VALUE < y < _MAX_VALUE and -_MAX_VALUE < yaw < _MAX_VALUE


class OdometryHistory:
    """Odometry poses of the last HISTORY_S seconds by tick, and the trail: all poses of the last `trail_s` seconds."""

    def __init__(self, tick_rate: int, trail_s: float = HISTORY_S) -> None:
        """Create an empty history. `tick_rate` is in Hz. `trail_s` must be at least HISTORY_S."""
        self._history_ticks, self._trail_ticks = HISTORY_S * tick_rate, trail_s * tick_rate
        self._max_ticks = (trail_s + 1) * tick_rate  # old poses are removed only once per second
        self.clear()

    def clear(self) -> None:
        """Remove all poses, for example to switch to another source of odometry."""
        self._readings: list[tuple[int, Pose2]] = []
        self._newest: float = -math.inf
        self._next_prune_tick: float = -math.inf
        self.latest_pose = Pose2(0.0, 0.0)
        """The latest pose; the origin if there is none."""

    @property
    def has_pose(self) -> bool:
        """Whether there is any pose."""
        return bool(self._readings)

    def add(self, tick: int, pose: Pose2) -> bool:
        """Add a pose. Return False if the pose is rejected: not plausible, or not newer than the latest pose."""
        if tick <= self._newest or not is_plausible(pose):
            return False
        self._newest, self.latest_pose = tick, pose
        self._readings.append((tick, pose))
        if tick > self._next_prune_tick:
            self._prune()
        return True

    def _prune(self) -> None:
        """Remove poses that are older than the trail, and set the tick of the next call of this method."""
        del self._readings[: bisect_left(self._readings, (self._newest - self._trail_ticks,))]
        self._next_prune_tick = self._readings[0][0] + self._max_ticks

    def _oldest_index(self) -> int:
        """Return the index of the oldest pose within HISTORY_S."""
        return bisect_left(self._readings, (self._newest - self._history_ticks,))

    def trail(self) -> list[Pose2]:
        """Return the poses of the trail, oldest first. Poses up to one second older may be included."""
        return [pose for _, pose in self._readings]

    def reaches(self, tick: int) -> bool:
        """Return whether there is odometry at `tick` or later."""
        return self._newest >= tick

    def latest_until(self, tick: int) -> Pose2:
        """Return the latest pose up to `tick`, without interpolation; the oldest pose if all poses are later."""
        if tick >= self._newest:
            return self.latest_pose
        first = self._oldest_index()
        return self._readings[max(first, bisect_left(self._readings, (tick + 1,), first) - 1)][1]

    def at(self, tick: int) -> Pose2 | None:
        """Return the pose at `tick`, interpolated linearly; None before the oldest or after the latest pose."""
        if tick == self._newest:
            return self.latest_pose
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
        """Return `latest_until(tick)` in another frame. `latest` is the latest pose in the other frame."""
        past = self.latest_until(tick)
        return latest if past is self.latest_pose else latest.compose(self.latest_pose.between(past))
