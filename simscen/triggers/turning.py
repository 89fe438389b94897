"""`turning_above`, `turning_below`: how fast the robot turns."""

from simscen.core.stage import Situation
from simscen.spec.base import Value
from simscen.spec.quantities import PositiveAngularSpeed
from simscen.triggers.base import Condition


class TurningAbove(Value[PositiveAngularSpeed], Condition):
    """True while the robot truly turns faster than this, to either side (rad/s).

    For what hurts a robot in a turn: a scan smeared by the motion, odometry that slips, somebody in the blind corner.

    Example: `when: {turning_above: 30 deg/s}`
    """

    def holds(self, now: Situation) -> bool:
        """Its true turn rate is above."""
        return abs(now.twist.wz) > self.root


class TurningBelow(Value[PositiveAngularSpeed], Condition):
    """True while the robot truly turns slower than this, to either side (rad/s).

    With `for`, for the moment at which a turn is over; a robot that stands turns at 0 rad/s, too.

    Example: `when: {turning_below: 5 deg/s, for: 1 s}`
    """

    def holds(self, now: Situation) -> bool:
        """Its true turn rate is below."""
        return abs(now.twist.wz) < self.root
