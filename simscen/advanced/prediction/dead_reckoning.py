"""Dead reckoning with wheel odometry and the gyroscope's heading, for comparing scans within about a second.

The heading of skidding wheels is wrong, so that everything would seem to rotate around the robot and to move. The frame
is independent of the odom frame.
"""

from collections import deque
from collections.abc import Callable
from math import cos, remainder, sin, tau

from simscen.core.geometry import Pose2, wrap
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.stack.frames import HISTORY_S

FASTEST = 100.0
"""Turn rates above this (rad/s) come from a broken gyroscope."""
WAITING = 10_000
"""Maximum number of readings that wait for integration."""


class DeadReckoning:
    """Integrates wheel odometry along the gyroscope's heading, only when a pose is requested."""

    def __init__(self, tick_rate: int) -> None:
        """Take the tick rate in Hz."""
        self._rate = tick_rate
        self._last: Odometry | None = None
        self._turned, self._turns = 0.0, 0
        self._waiting: deque[Odometry | Imu] = deque(maxlen=WAITING)
        self._poses = deque([(-1, 0.0, 0.0, 0.0)])
        self._now = _pose(self._poses[-1])
        self.take: Callable[[Odometry | Imu], None] = self._waiting.append
        """Append a reading; called so often that it does nothing else."""

    @property
    def now(self) -> Pose2:
        """The latest pose; the same object until it changes."""
        self._add_up()
        return self._now

    def at(self, tick: int) -> Pose2:
        """Return the latest pose up to a tick, or the oldest one."""
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
                # Rotate the step of the wheels into this frame, with half of the additional turn of the gyroscope.
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
