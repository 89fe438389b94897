"""Where the odometry was at any recent tick, as tf knows it."""

from bisect import bisect_left
from collections import deque
from collections.abc import Iterable

from simscen.core.geometry import Pose2
from simscen.core.sensing import Odometry

# No odometry frame is this far from its origin; squares of what a broken encoder may say would overflow.
_LARGEST = 1e6


def believable(values: Iterable[float]) -> bool:
    """Whether these are numbers that a position, or a velocity, can have."""
    return all(-_LARGEST < value < _LARGEST for value in values)


class OdometryTrack:
    """Odometry poses of the last `span` ticks; tf2 keeps 10 s."""

    def __init__(self, span: int) -> None:
        self._span = span
        self._ticks: deque[int] = deque()
        self._poses: deque[Pose2] = deque()

    def add(self, odometry: Odometry) -> bool:
        """Take a reading in; False when it is of no use: not a number, or not newer than the last one."""
        if not believable(odometry.pose) or (self._ticks and odometry.tick <= self._ticks[-1]):
            return False
        self._ticks.append(odometry.tick)
        self._poses.append(odometry.pose)
        while self._ticks[0] < odometry.tick - self._span:
            self._ticks.popleft()
            self._poses.popleft()
        return True

    @property
    def newest(self) -> Pose2 | None:
        """The newest pose."""
        return self._poses[-1] if self._poses else None

    def reaches(self, tick: int) -> bool:
        """Whether there is odometry at `tick` or later."""
        return bool(self._ticks) and self._ticks[-1] >= tick

    def at(self, tick: int) -> Pose2 | None:
        """The pose at `tick`, interpolated along a constant twist's chord; None when it is out of the track."""
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
