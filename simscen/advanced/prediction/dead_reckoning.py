"""Where the robot has rolled to, with the gyroscope's word for how it turned where there is one.

Wheels that skid while they turn, as those of a skid-steered robot do, say little of the turn: everything would seem to
swing around the robot, and so to move. This frame need not agree with anybody else's: it is for comparing scans that
were taken a second apart.
"""

from collections import deque
from collections.abc import Callable
from math import cos, remainder, sin, tau

from simscen.core.geometry import Pose2, wrap
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.stack.odometry_history import HISTORY_S

FASTEST = 100.0
"""rad/s: no robot turns faster; a gyroscope that says so is broken."""
WAITING = 10_000
"""Readings that may wait to be added up: of minutes, after which nobody compares scans."""


class DeadReckoning:
    """Adds up the wheels' steps along the gyroscope's heading, when it is asked: a scan is rarer than a step."""

    def __init__(self, tick_rate: int) -> None:
        self._rate = tick_rate
        self._last: Odometry | None = None
        self._turned, self._turns = 0.0, 0
        self._waiting: deque[Odometry | Imu] = deque(maxlen=WAITING)
        self._poses = deque([(-1, 0.0, 0.0, 0.0)])
        self._now = _pose(self._poses[-1])
        self.take: Callable[[Odometry | Imu], None] = self._waiting.append
        """Takes a reading in; there are eighty a second, so that is all that it does."""

    @property
    def now(self) -> Pose2:
        """The newest pose, the same object until there is another; the origin before there is any."""
        self._add_up()
        return self._now

    def at(self, tick: int) -> Pose2:
        """The newest pose up to a tick; the oldest known before that."""
        self._add_up()
        poses = self._poses
        if poses[-1][0] <= tick:
            return self._now
        return _pose(next((each for each in reversed(poses) if each[0] <= tick), poses[0]))

    def _add_up(self) -> None:
        if not self._waiting:
            return
        poses = self._poses
        newest, x, y, yaw = poses[-1]
        last, turned, turns = self._last, self._turned, self._turns
        for reading in self._waiting:
            if isinstance(reading, Imu):
                rate = reading.angular_velocity[2]
                if -FASTEST < rate < FASTEST:
                    turned += rate
                    turns += 1
                continue
            tick = reading.tick
            if last is not None and newest < tick > last.tick:
                (there_x, there_y, heading), (before_x, before_y, before) = reading.pose, last.pose
                step = remainder(heading - before, tau)
                turn = turned / turns * (tick - last.tick) / self._rate if turns else step
                # The wheels' step, turned into this frame, and by half of what they know too little of the turn.
                into = yaw - before + (turn - step) / 2
                c, s, dx, dy = cos(into), sin(into), there_x - before_x, there_y - before_y
                x, y, yaw, newest = x + c * dx - s * dy, y + s * dx + c * dy, yaw + turn, tick
                poses.append((tick, x, y, yaw))
            last, turned, turns = reading, 0.0, 0
        self._last, self._turned, self._turns = last, turned, turns
        self._waiting.clear()
        self._now = _pose(poses[-1])
        oldest = newest - HISTORY_S * self._rate
        while poses[0][0] < oldest:
            poses.popleft()


def _pose(kept: tuple[int, float, float, float]) -> Pose2:
    return Pose2(kept[1], kept[2], wrap(kept[3]))
