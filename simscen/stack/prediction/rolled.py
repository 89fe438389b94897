"""Where the robot has rolled to, with the gyroscope's word for how it turned where there is one.

Wheels that skid while they turn, as those of a skid-steered robot do, say little of the turn: everything would seem to
swing around the robot, and so to move. This frame need not agree with anybody else's: it is for comparing scans that
were taken a second apart.
"""

import math
from collections import deque

from simscen.core.geometry import Pose2, wrap
from simscen.core.sensing import Imu
from simscen.stack.odometry_history import KEPT

FASTEST = 100.0
"""rad/s: no robot turns faster; a gyroscope that says so is broken."""
WAITING = 100
"""Steps that may wait to be added up."""


class Rolled:
    """Adds up the wheels' steps along the gyroscope's heading, when it is asked: a scan is rarer than a step."""

    def __init__(self, tick_rate: int) -> None:
        self._rate = tick_rate
        self._last: tuple[int, Pose2] | None = None
        self._turned, self._turns = 0.0, 0
        self._waiting: list[tuple[int, Pose2, float | None]] = []
        self._poses = deque([(-1, 0.0, 0.0, 0.0)])

    @property
    def now(self) -> Pose2:
        """The newest pose; the origin before there is any."""
        self._add_up()
        return _pose(self._poses[-1])

    def at(self, tick: int) -> Pose2:
        """The newest pose up to a tick; the oldest known before that."""
        self._add_up()
        kept = next((each for each in reversed(self._poses) if each[0] <= tick), self._poses[0])
        return _pose(kept)

    def on_imu(self, imu: Imu) -> None:
        """Keep a turn rate until the next odometry."""
        rate = imu.angular_velocity[2]
        if abs(rate) < FASTEST:
            self._turned += rate
            self._turns += 1

    def on_odometry(self, tick: int, pose: Pose2) -> None:
        """Take a step, from one pose of the wheels' odometry to the next."""
        self._waiting.append((tick, pose, self._turned / self._turns if self._turns else None))
        self._turned, self._turns = 0.0, 0
        if len(self._waiting) >= WAITING:
            self._add_up()

    def _add_up(self) -> None:
        if not self._waiting:
            return
        newest, x, y, yaw = self._poses[-1]
        for tick, pose, rate in self._waiting:
            last, self._last = self._last, (tick, pose)
            if last is not None and tick > last[0] and tick > newest:
                before = last[1]
                step = math.remainder(pose.yaw - before.yaw, math.tau)
                turn = step if rate is None else rate * (tick - last[0]) / self._rate
                # The wheels' step, turned into this frame, and by half of what they know too little of the turn.
                into = yaw - before.yaw + (turn - step) / 2
                c, s = math.cos(into), math.sin(into)
                dx, dy = pose.x - before.x, pose.y - before.y
                x, y, yaw, newest = x + c * dx - s * dy, y + s * dx + c * dy, yaw + turn, tick
                self._poses.append((tick, x, y, yaw))
        self._waiting.clear()
        while self._poses[0][0] < newest - KEPT * self._rate:
            self._poses.popleft()


def _pose(kept: tuple[int, float, float, float]) -> Pose2:
    return Pose2(kept[1], kept[2], wrap(kept[3]))
