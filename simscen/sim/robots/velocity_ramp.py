"""Velocity ramp of all drives: follows commands within the limits of speed and acceleration."""

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.robot import Limits


class VelocityRamp:
    """Velocity that follows commands within the limits of speed and acceleration.

    Takes one step every `period` seconds. Only a holonomic robot can move sideways.
    """

    def __init__(self, limits: Limits, period: float, is_holonomic: bool) -> None:
        self._limits = limits
        self._max_lateral = (limits.lateral or limits.linear) if is_holonomic else 0.0
        self._speed_up_step = limits.linear_acceleration * period
        self._slow_down_step = (limits.linear_deceleration or limits.linear_acceleration) * period
        self._turn_step = limits.angular_acceleration * period
        self._command = STOP
        self.target = STOP
        """The last command, within the limits of speed."""
        self.velocity = STOP

    def command(self, twist: Twist) -> None:
        """Set the target velocity to `twist`, reduced to the limits of speed."""
        if twist == self._command:
            return
        limits, self._command = self._limits, twist
        self.target = Twist(
            min(limits.linear, max(-(limits.reverse or limits.linear), twist.vx)),
            min(self._max_lateral, max(-self._max_lateral, twist.vy)),
            min(limits.angular, max(-limits.angular, twist.wz)),
        )

    def advance(self) -> bool:
        """Take one step towards the target velocity; return whether the velocity changed."""
        (vx, vy, wz), (target_vx, target_vy, target_wz) = now, target = self.velocity, self.target
        if now == target:
            return False
        up, down, turn = self._speed_up_step, self._slow_down_step, self._turn_step
        self.velocity = Twist(
            vx if vx == target_vx else _step_towards(vx, target_vx, up, down),
            vy if vy == target_vy else _step_towards(vy, target_vy, up, down),
            wz if wz == target_wz else _step_towards(wz, target_wz, turn, turn),
        )
        return True

    def rest(self) -> None:
        """Set the velocity to zero, and keep the target velocity."""
        self.velocity = STOP


def _step_towards(now: float, target: float, speed_up: float, slow_down: float) -> float:
    """Return `now` changed towards `target` by at most `speed_up` or `slow_down`; stops at 0 if the sign differs."""
    step = speed_up if now * target >= 0 and abs(target) > abs(now) else slow_down
    if now * target < 0:
        target = 0.0
    return target if abs(target - now) <= step else now + (step if target > now else -step)
