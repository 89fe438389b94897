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
    """The poses of one odometry of the last KEPT seconds, by tick; what is older is thrown away a second at a time."""

    def __init__(self, tick_rate: int) -> None:
        self._span, self._most = KEPT * tick_rate, (KEPT + 1) * tick_rate
        self._ticks: list[int] = []
        self._poses: list[Pose2] = []
        self._newest: float = -math.inf
        self.now = Pose2(0.0, 0.0)
        """The newest pose; the origin before there is any."""

    def __bool__(self) -> bool:
        return bool(self._poses)

    def add(self, tick: int, pose: Pose2) -> bool:
        """Take a reading in; False when it is of no use: not a place, or not newer than the last one."""
        x, y, yaw = pose
        here = -_LARGEST < x < _LARGEST and -_LARGEST < y < _LARGEST and -_LARGEST < yaw < _LARGEST
        if tick <= self._newest or not here:
            return False
        ticks = self._ticks
        ticks.append(tick)
        self._poses.append(pose)
        self._newest, self.now = tick, pose
        if ticks[0] < tick - self._most:
            old = self._first()
            del ticks[:old], self._poses[:old]
        return True

    def _first(self) -> int:
        """Where what counts still begins."""
        return bisect_left(self._ticks, self._newest - self._span)

    def reaches(self, tick: int) -> bool:
        """Whether there is odometry at `tick` or later."""
        return self._newest >= tick

    def held(self, tick: int) -> Pose2:
        """The newest pose up to `tick`, for who cannot wait for the next; the oldest known before that."""
        if tick >= self._newest:
            return self.now
        first = self._first()
        return self._poses[max(first, bisect_right(self._ticks, tick, first) - 1)]

    def at(self, tick: int) -> Pose2 | None:
        """The pose at `tick`, interpolated along a constant twist's chord; None before the oldest, after the newest."""
        if tick == self._newest:
            return self.now
        first = self._first()
        after = bisect_left(self._ticks, tick, first)
        if after == len(self._ticks):
            return None
        if self._ticks[after] == tick:
            return self._poses[after]
        if after == first:
            return None
        share = (tick - self._ticks[after - 1]) / (self._ticks[after] - self._ticks[after - 1])
        before = self._poses[after - 1]
        step = before.between(self._poses[after])
        return before.compose(Pose2(share * step.x, share * step.y, share * step.yaw))

    def then(self, now: Pose2, tick: int) -> Pose2:
        """Where a robot that is at `now` was at `tick`, in whatever frame `now` is given; held, not interpolated."""
        held = self.held(tick)
        return now if held is self.now else now.compose(self.now.between(held))
