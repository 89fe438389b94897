"""Where odometry was at any recent tick, as tf knows it: a scan that comes late was taken from there."""

import math
from bisect import bisect_left, bisect_right

from simscen.core.geometry import Pose2

KEPT = 10
"""s of readings: what tf2 keeps."""
# No odometry frame is this far from its origin; squares of what a broken encoder may say would overflow.
_LARGEST = 1e6


def believable(values: tuple[float, float, float]) -> bool:
    """Whether these are numbers that a position, or a velocity, can have."""
    x, y, yaw = values
    return -_LARGEST < x < _LARGEST and -_LARGEST < y < _LARGEST and -_LARGEST < yaw < _LARGEST


class OdometryHistory:
    """The poses of one odometry of the last KEPT seconds, by tick."""

    def __init__(self, tick_rate: int) -> None:
        self._span = KEPT * tick_rate
        self._ticks: list[int] = []
        self._poses: list[Pose2] = []
        self._newest: float = -math.inf
        self.now = Pose2(0.0, 0.0)
        """The newest pose; the origin before there is any."""

    def __bool__(self) -> bool:
        return bool(self._poses)

    def add(self, tick: int, pose: Pose2) -> bool:
        """Take a reading in; False when it is of no use: not a place, or not newer than the last one."""
        if tick <= self._newest or not believable(pose):
            return False
        ticks, oldest = self._ticks, tick - self._span
        ticks.append(tick)
        self._poses.append(pose)
        self._newest, self.now = tick, pose
        if ticks[0] < oldest:
            old = bisect_left(ticks, oldest)
            del ticks[:old], self._poses[:old]
        return True

    def reaches(self, tick: int) -> bool:
        """Whether there is odometry at `tick` or later."""
        return self._newest >= tick

    def held(self, tick: int) -> Pose2:
        """The newest pose up to `tick`, for who cannot wait for the next; the oldest known before that."""
        if tick >= self._newest:
            return self.now
        return self._poses[max(0, bisect_right(self._ticks, tick) - 1)]

    def at(self, tick: int) -> Pose2 | None:
        """The pose at `tick`, interpolated along a constant twist's chord; None before the oldest, after the newest."""
        after = bisect_left(self._ticks, tick)
        if after == len(self._ticks):
            return None
        if self._ticks[after] == tick:
            return self._poses[after]
        if after == 0:
            return None
        share = (tick - self._ticks[after - 1]) / (self._ticks[after] - self._ticks[after - 1])
        before = self._poses[after - 1]
        step = before.between(self._poses[after])
        return before.compose(Pose2(share * step.x, share * step.y, share * step.yaw))

    def then(self, now: Pose2, tick: int) -> Pose2:
        """Where a robot that is at `now` was at `tick`, in whatever frame `now` is given; held, not interpolated."""
        held = self.held(tick)
        return now if held is self.now else now.compose(self.now.between(held))
