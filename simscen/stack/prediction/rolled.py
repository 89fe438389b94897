"""Where the robot has rolled to, with the gyroscope's word for how it turned where there is one.

Wheels that skid while they turn, as those of a skid-steered robot do, say little of the turn: everything would seem to
swing around the robot, and so to move. This frame need not agree with anybody else's: it is for comparing scans that
were taken a second apart.
"""

import math

from simscen.core.geometry import Pose2
from simscen.core.sensing import Imu
from simscen.stack.odometry_history import OdometryHistory

FASTEST = 100.0
"""rad/s: no robot turns faster; a gyroscope that says so is broken."""


class Rolled:
    """Adds up the wheels' steps along the gyroscope's heading."""

    def __init__(self, tick_rate: int) -> None:
        self._rate = tick_rate
        self._last: tuple[int, Pose2] | None = None
        self._turns: list[float] = []
        self._history = OdometryHistory(tick_rate)

    @property
    def now(self) -> Pose2:
        """The newest pose."""
        return self._history.now

    def at(self, tick: int) -> Pose2:
        """The pose at a tick."""
        return self._history.held(tick)

    def on_imu(self, imu: Imu) -> None:
        """Keep a turn rate until the next odometry."""
        rate = imu.angular_velocity[2]
        if abs(rate) < FASTEST:
            self._turns.append(rate)

    def on_odometry(self, tick: int, pose: Pose2) -> None:
        """Take a step, from one pose of the wheels' odometry to the next."""
        last, self._last = self._last, (tick, pose)
        if last is None or tick <= last[0]:
            self._history.add(tick, self.now)
            return
        step, turn = last[1].between(pose), 0.0
        if self._turns:
            turn = sum(self._turns) / len(self._turns) * (tick - last[0]) / self._rate - step.yaw
            self._turns.clear()
        c, s = math.cos(turn / 2), math.sin(turn / 2)
        moved = Pose2(c * step.x - s * step.y, s * step.x + c * step.y, step.yaw + turn)
        self._history.add(tick, self.now.compose(moved))
