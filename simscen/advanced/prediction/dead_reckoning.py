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

MAX_TURN_RATE = 100.0
"""Turn rate in rad/s above which readings of a broken gyroscope are ignored."""
MAX_PENDING = 10_000
"""Maximum number of readings that wait for integration."""


class DeadReckoning:
    """Integrates wheel odometry along the gyroscope's heading, only when a pose is requested."""

    def __init__(self, tick_rate: int) -> None:
        """Take the tick rate in Hz."""
        self._rate = tick_rate
        self._last: Odometry | None = None
        self._rate_sum, self._rate_count = 0.0, 0
        self._pending: deque[Odometry | Imu] = deque(maxlen=MAX_PENDING)
        self._poses = deque([(-1, 0.0, 0.0, 0.0)])
        self._now = _pose(self._poses[-1])
        self.add: Callable[[Odometry | Imu], None] = self._pending.append
        """Append a reading; called so often that it does nothing else."""

    @property
    def now(self) -> Pose2:
        """The latest pose; the same object until it changes."""
        self._integrate()
        return self._now

    def at(self, tick: int) -> Pose2:
        """Return the latest pose up to a tick, or the oldest one."""
        self._integrate()
        poses = self._poses
        if poses[-1][0] <= tick:
            return self._now
        return _pose(next((each for each in reversed(poses) if each[0] <= tick), poses[0]))

    def _integrate(self) -> None:
        if not self._pending:
            return
        poses = self._poses
        newest, x, y, yaw = poses[-1]
        last, rate_sum, rate_count = self._last, self._rate_sum, self._rate_count
        for reading in self._pending:
            if isinstance(reading, Imu):
                rate = reading.angular_velocity[2]
                if -MAX_TURN_RATE < rate < MAX_TURN_RATE:
                    rate_sum += rate
                    rate_count += 1
                continue
            tick = reading.tick
            if last is not None and newest < tick > last.tick:
                (new_x, new_y, new_heading), (old_x, old_y, old_heading) = reading.pose, last.pose
                step = remainder(new_heading - old_heading, tau)
                turn = rate_sum / rate_count * (tick - last.tick) / self._rate if rate_count else step
                # Rotate the step of the wheels into this frame, with half of the additional turn of the gyroscope.
                rotation = yaw - old_heading + (turn - step) / 2
                c, s, dx, dy = cos(rotation), sin(rotation), new_x - old_x, new_y - old_y
                x, y, yaw, newest = x + c * dx - s * dy, y + s * dx + c * dy, yaw + turn, tick
                poses.append((tick, x, y, yaw))
            last, rate_sum, rate_count = reading, 0.0, 0
        self._last, self._rate_sum, self._rate_count = last, rate_sum, rate_count
        self._pending.clear()
        self._now = _pose(poses[-1])
        oldest = newest - HISTORY_S * self._rate
        while poses[0][0] < oldest:
            poses.popleft()


def _pose(entry: tuple[int, float, float, float]) -> Pose2:
    return Pose2(entry[1], entry[2], wrap(entry[3]))
