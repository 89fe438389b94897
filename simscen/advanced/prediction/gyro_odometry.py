"""Odometry in which obstacles are tracked: driven distance from the wheels, heading from the gyroscope.

With the heading of skidding wheels, everything would seem to rotate around the robot.
"""

from collections import deque
from collections.abc import Callable
from math import cos, remainder, sin, tau

from simscen.core.geometry import Pose2, wrap
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.stack.localizers.ekf import MAX_YAW_RATE_RAD_S
from simscen.stack.odometry_history import OdometryHistory

MAX_PENDING = 10_000
"""Maximum number of readings that wait for integration."""


class GyroOdometry:
    """Odometry with the driven distance of the wheels, and the heading of the gyroscope, or else of the wheels.

    Readings are integrated when a pose is requested, to save time.
    """

    def __init__(self, tick_rate: int) -> None:
        self._rate = tick_rate
        self._history = OdometryHistory(tick_rate)
        self._history.add(-1, Pose2(0.0, 0.0))
        self._yaw = 0.0  # heading of the latest pose, not wrapped
        self._last: Odometry | None = None
        self._rate_sum, self._rate_count = 0.0, 0
        """Sum in rad/s and number of the gyroscope's turn rates since the last wheel reading."""
        self._pending: deque[Odometry | Imu] = deque(maxlen=MAX_PENDING)
        self.add: Callable[[Odometry | Imu], None] = self._pending.append
        """Add a reading."""

    @property
    def now(self) -> Pose2:
        """The latest pose; the same object until it changes."""
        self._integrate()
        return self._history.latest_pose

    def at(self, tick: int) -> Pose2:
        """Return the latest pose up to a tick; the oldest stored pose if all are later."""
        self._integrate()
        return self._history.latest_until(tick)

    def _integrate(self) -> None:
        for reading in self._pending:
            if isinstance(reading, Odometry):
                self._add_step(self._last, reading)
                self._last, self._rate_sum, self._rate_count = reading, 0.0, 0
            elif abs(reading.angular_velocity[2]) < MAX_YAW_RATE_RAD_S:
                self._rate_sum += reading.angular_velocity[2]
                self._rate_count += 1
        self._pending.clear()

    def _add_step(self, last: Odometry | None, reading: Odometry) -> None:
        """Add the pose after the motion between two readings of the wheels."""
        if last is None or reading.tick <= last.tick or self._history.reaches(reading.tick):
            return
        wheel_turn = remainder(reading.pose.yaw - last.pose.yaw, tau)
        ticks = reading.tick - last.tick
        turn = self._rate_sum / self._rate_count * ticks / self._rate if self._rate_count else wheel_turn
        # Rotate the step of the wheels into this frame, with half of the additional turn of the gyroscope.
        rotation = self._yaw - last.pose.yaw + (turn - wheel_turn) / 2
        c, s, dx, dy = cos(rotation), sin(rotation), reading.pose.x - last.pose.x, reading.pose.y - last.pose.y
        x, y, _ = self._history.latest_pose
        self._yaw += turn
        self._history.add(reading.tick, Pose2(x + c * dx - s * dy, y + s * dx + c * dy, wrap(self._yaw)))
