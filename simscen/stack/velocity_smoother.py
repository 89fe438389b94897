"""Accelerations the base can follow: nav2_velocity_smoother, open loop."""

from simscen.core.motion import Twist
from simscen.model.stack import VelocitySmoother as SmootherSpec
from simscen.stack.protocols import RobotModel


class VelocitySmoother:
    """Changes the command by no more than the limits allow in a period; slowing down uses the full deceleration."""

    def __init__(self, spec: SmootherSpec, robot: RobotModel, period: float) -> None:
        self._enabled = spec.enabled
        faster = min(spec.max_accel or robot.linear_acceleration, robot.linear_acceleration)
        self._faster, self._slower = faster * period, robot.linear_deceleration * period
        turn = min(spec.max_angular_accel or robot.angular_acceleration, robot.angular_acceleration)
        self._turn = turn * period
        self._steered = robot.turning_radius > 0.0
        self._last = Twist()

    def reset(self, twist: Twist) -> None:
        """What the base is doing now, after somebody else decided."""
        self._last = twist

    def smooth(self, wanted: Twist, periods: int = 1) -> Twist:
        """The velocity to send now, so many periods after the last one."""
        if not self._enabled:
            return wanted
        last = self._last
        vx = self._towards(last.vx, wanted.vx, periods)
        if self._steered and wanted.vx != 0.0:
            turn = vx * wanted.wz / wanted.vx  # nav2's scale_velocities: a car keeps to the curve while it speeds up
        else:
            turn = self._turned(last.wz, wanted.wz, periods)
        self._last = Twist(vx, self._towards(last.vy, wanted.vy, periods), turn)
        return self._last

    def _towards(self, now: float, wanted: float, periods: int) -> float:
        if now * wanted < 0.0:
            wanted = 0.0
        step = periods * (self._faster if abs(wanted) > abs(now) else self._slower)
        return min(max(wanted, now - step), now + step)

    def _turned(self, now: float, wanted: float, periods: int) -> float:
        return min(max(wanted, now - periods * self._turn), now + periods * self._turn)
