"""Accelerations the base can follow: nav2_velocity_smoother, open loop."""

import math

from simscen.core.geometry.kinematics import Twist
from simscen.model.guards import VelocitySmoother as SmootherSpec
from simscen.stack.protocols import RobotModel


class VelocitySmoother:
    """Changes the command by no more than the limits allow in a period; slowing down uses the full deceleration."""

    def __init__(self, spec: SmootherSpec, robot: RobotModel, period: float) -> None:
        self._enabled = spec.enabled
        faster = min(spec.max_accel or robot.linear_acceleration, robot.linear_acceleration)
        slower = min(spec.max_decel or robot.linear_deceleration, robot.linear_deceleration)
        self._faster, self._slower = faster * period, slower * period
        turn = min(spec.max_angular_accel or robot.angular_acceleration, robot.angular_acceleration)
        self._turn = turn * period
        self._most, self._most_turn = spec.max_velocity or math.inf, spec.max_angular_velocity or math.inf
        self._limits = math.isfinite(min(self._most, self._most_turn))
        self._steered = robot.turning_radius > 0.0
        self._last = Twist()

    def reset(self, twist: Twist) -> None:
        """What the base is doing now, after somebody else decided."""
        self._last = twist

    def smooth(self, wanted: Twist, periods: int = 1) -> Twist:
        """The velocity to send now, so many periods after the last one."""
        if not self._enabled:
            return wanted
        ahead, left, turn = self._within(wanted)
        was_ahead, was_left, was_turn = self._last
        vx = ahead if ahead == was_ahead else self._towards(was_ahead, ahead, periods)
        vy = left if left == was_left else self._towards(was_left, left, periods)
        if self._steered and ahead != 0.0:
            turn = vx * turn / ahead  # nav2's scale_velocities: a car keeps to the curve while it speeds up
        else:
            step = periods * self._turn
            turn = min(max(turn, was_turn - step), was_turn + step)
        self._last = Twist(vx, vy, turn)
        return self._last

    def _within(self, wanted: Twist) -> Twist:
        """No faster than it may be; a base that steers keeps to its curve."""
        if not self._limits or (
            max(abs(wanted.vx), abs(wanted.vy)) <= self._most and abs(wanted.wz) <= self._most_turn
        ):
            return wanted
        vx, vy = (min(max(part, -self._most), self._most) for part in (wanted.vx, wanted.vy))
        wz = min(max(wanted.wz, -self._most_turn), self._most_turn)
        if self._steered and wanted.vx != 0.0:
            share = min(abs(vx / wanted.vx), abs(wz / wanted.wz) if wanted.wz else 1.0)
            return Twist(wanted.vx * share, vy, wanted.wz * share)
        return Twist(vx, vy, wz)

    def _towards(self, now: float, wanted: float, periods: int) -> float:
        if now * wanted < 0.0:
            wanted = 0.0
        step = periods * (self._faster if abs(wanted) > abs(now) else self._slower)
        return min(max(wanted, now - step), now + step)
