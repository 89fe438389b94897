"""`reversing`: the robot drives backwards."""

from simscen.core.stage import Situation
from simscen.spec.base import Value
from simscen.spec.quantities import PositiveSpeed
from simscen.triggers.base import Condition


class Reversing(Value[PositiveSpeed], Condition):
    """True while the robot truly drives backwards faster than this.

    Example: `when: {reversing: 0.05 m/s}`
    """

    def holds(self, now: Situation) -> bool:
        """Its true speed along its own nose is below the negative of it."""
        return now.twist.vx < -self.root
