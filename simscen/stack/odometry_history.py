"""Where odometry was at any recent tick, as tf knows it: a scan that comes late was taken from there."""

from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Iterable

from simscen.core.geometry import Pose2

KEPT = 10
"""s of readings: what tf2 keeps."""
# No odometry frame is this far from its origin; squares of what a broken encoder may say would overflow.
_LARGEST = 1e6


def believable(values: Iterable[float]) -> bool:
    """Whether these are numbers that a position, or a velocity, can have."""
    return all(-_LARGEST < value < _LARGEST for value in values)


class OdometryHistory:
    """The poses of one odometry of the last KEPT seconds, by tick."""

    def __init__(self, tick_rate: int) -> None:
        self._span = KEPT * tick_rate
        self._ticks: deque[int] = deque()
        self._poses: deque[Pose2] = deque()

    def __bool__(self) -> bool:
        return bool(self._poses)

    @property
    def now(self) -> Pose2:
        """The newest pose; the origin before there is any."""
        return self._poses[-1] if self._poses else Pose2(0.0, 0.0)

    def add(self, tick: int, pose: Pose2) -> bool:
        """Take a reading in; False when it is of no use: not a place, or not newer than the last one."""
        if not believable(pose) or (self._ticks and tick <= self._ticks[-1]):
            return False
        self._ticks.append(tick)
        self._poses.append(pose)
        while self._ticks[0] < tick - self._span:
            self._ticks.popleft()
            self._poses.popleft()
        return True

    def reaches(self, tick: int) -> bool:
        """Whether there is odometry at `tick` or later."""
        return bool(self._ticks) and self._ticks[-1] >= tick

    def held(self, tick: int) -> Pose2:
        """The newest pose up to `tick`, for who cannot wait for the next; the oldest known before that."""
        place = bisect_right(self._ticks, tick)
        return self._poses[max(0, place - 1)] if self._poses else Pose2(0.0, 0.0)

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
        return now.compose(self.now.between(self.held(tick)))
