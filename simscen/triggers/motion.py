"""`speed_below`, `speed_above`, `distance_remaining`, `localization_error`: measures of the drive."""

import math

from simscen.core.stage import Situation
from simscen.spec.base import Value
from simscen.spec.quantities import NonNegativeLength, PositiveSpeed
from simscen.triggers.base import Condition


class SpeedBelow(Value[PositiveSpeed], Condition):
    """True while the robot truly drives slower than this.

    Example: `when: {speed_below: 0.05 m/s}`
    """

    def holds(self, now: Situation) -> bool:
        """Its true speed over ground is below."""
        return math.hypot(now.twist.vx, now.twist.vy) < self.root


class SpeedAbove(Value[PositiveSpeed], Condition):
    """True while the robot truly drives faster than this.

    Example: `when: {speed_above: 0.4 m/s}`
    """

    def holds(self, now: Situation) -> bool:
        """Its true speed over ground is above."""
        return math.hypot(now.twist.vx, now.twist.vy) > self.root


class DistanceRemaining(Value[NonNegativeLength], Condition):
    """True while the robot is truly at most this far from its goal, as the crow flies.

    Example: `when: {distance_remaining: 2 m}`
    """

    def holds(self, now: Situation) -> bool:
        """There is a goal and it is near."""
        return now.goal is not None and now.robot.distance(now.goal.pose) <= self.root


class LocalizationError(Value[NonNegativeLength], Condition):
    """True while the robot believes itself further than this from where it is.

    Example: `when: {localization_error: 0.5 m}`
    """

    def holds(self, now: Situation) -> bool:
        """There is a belief and it is off."""
        return now.belief is not None and now.robot.distance(now.belief.pose) > self.root
