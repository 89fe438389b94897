"""What a base's firmware makes of velocity commands: clipped, and never faster than it can accelerate."""

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.robot import Limits


class VelocityRamp:
    """Follows commands within the limits of a base, one step every `period` seconds."""

    def __init__(self, limits: Limits, period: float, holonomic: bool) -> None:
        self._limits = limits
        self._lateral = (limits.lateral or limits.linear) if holonomic else 0.0
        self._speed_up = limits.linear_acceleration * period
        self._slow_down = (limits.linear_deceleration or limits.linear_acceleration) * period
        self._turn = limits.angular_acceleration * period
        self._asked = self.target = STOP
        self.velocity = STOP

    def command(self, twist: Twist) -> None:
        """What to drive from now on."""
        if twist == self._asked:
            return
        limits, self._asked = self._limits, twist
        self.target = Twist(
            min(limits.linear, max(-(limits.reverse or limits.linear), twist.vx)),
            min(self._lateral, max(-self._lateral, twist.vy)),
            min(limits.angular, max(-limits.angular, twist.wz)),
        )

    def advance(self) -> bool:
        """Take one step towards the command; whether there was one to take."""
        (vx, vy, wz), (to_x, to_y, to_w) = now, target = self.velocity, self.target
        if now == target:
            return False
        self.velocity = Twist(
            vx if vx == to_x else _towards(vx, to_x, self._speed_up, self._slow_down),
            vy if vy == to_y else _towards(vy, to_y, self._speed_up, self._slow_down),
            wz if wz == to_w else _towards(wz, to_w, self._turn, self._turn),
        )
        return True

    def rest(self) -> None:
        """Stand still now; the command stays."""
        self.velocity = STOP


def _towards(now: float, target: float, speed_up: float, slow_down: float) -> float:
    """One step; a change of direction brakes to zero first."""
    step = speed_up if now * target >= 0 and abs(target) > abs(now) else slow_down
    if now * target < 0:
        target = 0.0
    return target if abs(target - now) <= step else now + (step if target > now else -step)
