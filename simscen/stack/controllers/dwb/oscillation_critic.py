"""DWB's OscillationCritic: forbids velocities that reverse direction again and again."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.stack.controllers.dwb.critics import Mask


class Trend:
    """Which way one component of the commands goes, and which way it may go after it has turned round."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Either way again."""
        self._sign = 0.0
        self.only = 0.0
        """1 or -1: the only sign it may have; 0: any."""

    def update(self, velocity: float) -> bool:
        """Record a command; return whether it reversed the direction."""
        if velocity == 0.0:
            return False
        sign = math.copysign(1.0, velocity)
        turned = self._sign == -sign
        if turned:
            self.only = sign
        self._sign = sign
        return turned


class OscillationCritic:
    """Forbids to turn round a second time before the robot has come some way, or has turned by some angle."""

    def __init__(self, distance: float, angle: float, x_only: float) -> None:
        self._distance, self._angle, self._x_only = distance, angle, x_only
        self._trends = (Trend(), Trend(), Trend())
        self._since = Pose2(0.0, 0.0)

    def reset(self) -> None:
        """Forget the directions of the previous path."""
        for trend in self._trends:
            trend.reset()

    def legal(self, velocities: Array) -> Mask:
        """Which of the velocities (n, 3) do not turn round again."""
        legal: Mask = np.ones(len(velocities), dtype=bool)
        for trend, velocity in zip(self._trends, velocities.T, strict=True):
            legal &= velocity * trend.only >= 0.0
        return legal

    def debrief(self, pose: Pose2, command: Twist) -> None:
        """Record the command given at this pose. Lateral and angular reversals only count at low forward speed."""
        x, y, theta = self._trends
        turned = x.update(command.vx)
        if abs(command.vx) <= self._x_only:
            turned |= y.update(command.vy)
            turned |= theta.update(command.wz)
        if turned:
            self._since = pose
        if any(trend.only for trend in self._trends) and self._moved(pose):
            self.reset()

    def _moved(self, pose: Pose2) -> bool:
        return pose.distance(self._since) > self._distance or abs(wrap(pose.yaw - self._since.yaw)) > self._angle
