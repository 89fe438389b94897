"""Where odometry was at any recent tick, as tf knows it: a scan that comes late was taken from there."""

import math
from bisect import bisect_left

from simscen.core.geometry import Pose2

HISTORY_S = 10
"""s of readings: what tf2 keeps."""
TRAIL_S = 60
"""s of the way that a stack remembers having come: longer than a robot that is stuck waits between two tries."""
# No odometry frame is this far from its origin; squares of what a broken encoder may say would overflow.
_LARGEST = 1e6


def is_plausible(values: tuple[float, float, float]) -> bool:
    """Whether these are numbers that a position, or a velocity, can have."""
    x, y, yaw = values
    return -_LARGEST < x < _LARGEST and -_LARGEST < y < _LARGEST and -_LARGEST < yaw < _LARGEST


class OdometryHistory:
    """The poses of one odometry of the last KEPT seconds, by tick; what is older is thrown away a second at a time."""

    def __init__(self, tick_rate: int, way: float = HISTORY_S) -> None:
        """`way`: seconds for which poses are remembered beyond that, as the way that the robot came."""
        self._span, self._way, self._most = HISTORY_S * tick_rate, way * tick_rate, (way + 1) * tick_rate
        self.forget()

    def forget(self) -> None:
        """Begin anew, with another odometry."""
        self._readings: list[tuple[int, Pose2]] = []
        self._newest: float = -math.inf
        self._full: float = -math.inf
        self.now = Pose2(0.0, 0.0)
        """The newest pose; the origin before there is any."""

    @property
    def begun(self) -> bool:
        """Whether there is any."""
        return self._full > -math.inf

    def add(self, tick: int, pose: Pose2) -> bool:
        """Take a reading in; False when it is of no use: not a place, or not newer than the last one."""
        x, y, yaw = pose
        here = -_LARGEST < x < _LARGEST and -_LARGEST < y < _LARGEST and -_LARGEST < yaw < _LARGEST
        if tick <= self._newest or not here:
            return False
        self._newest, self.now = tick, pose
        self._readings.append((tick, pose))
        if tick > self._full:
            self._throw_away()
        return True

    def _throw_away(self) -> None:
        """Throw away what is too old, and note when the oldest of the rest will be."""
        del self._readings[: bisect_left(self._readings, (self._newest - self._way,))]
        self._full = self._readings[0][0] + self._most

    def _first(self) -> int:
        """Where what counts still begins."""
        return bisect_left(self._readings, (self._newest - self._span,))

    def way(self) -> list[Pose2]:
        """The poses that the robot came by, the oldest first."""
        return [pose for _, pose in self._readings]

    def reaches(self, tick: int) -> bool:
        """Whether there is odometry at `tick` or later."""
        return self._newest >= tick

    def held(self, tick: int) -> Pose2:
        """The newest pose up to `tick`, for who cannot wait for the next; the oldest known before that."""
        if tick >= self._newest:
            return self.now
        first = self._first()
        return self._readings[max(first, bisect_left(self._readings, (tick + 1,), first) - 1)][1]

    def at(self, tick: int) -> Pose2 | None:
        """The pose at `tick`, interpolated along a constant twist's chord; None before the oldest, after the newest."""
        if tick == self._newest:
            return self.now
        first = self._first()
        after = bisect_left(self._readings, (tick,), first)
        if after == len(self._readings):
            return None
        then, there = self._readings[after]
        if then == tick:
            return there
        if after == first:
            return None
        earlier, before = self._readings[after - 1]
        share = (tick - earlier) / (then - earlier)
        step = before.between(there)
        return before.compose(Pose2(share * step.x, share * step.y, share * step.yaw))

    def then(self, now: Pose2, tick: int) -> Pose2:
        """Where a robot that is at `now` was at `tick`, in whatever frame `now` is given; held, not interpolated."""
        held = self.held(tick)
        return now if held is self.now else now.compose(self.now.between(held))
