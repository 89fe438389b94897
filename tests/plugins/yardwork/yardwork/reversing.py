"""`reversing`: the robot drives backwards."""

from simscen.plugin import Condition, PositiveSpeed, Situation, Value


class Reversing(Value[PositiveSpeed], Condition):
    """True while the robot truly drives backwards faster than this.

    Example: `when: {reversing: 0.05 m/s}`
    """

    def holds(self, now: Situation) -> bool:
        """Its true speed along its own nose is below the negative of it."""
        return now.twist.vx < -self.root
