"""Conditions on the motion of the robot and on its localization."""

import math

from simscen.core.geometry import wrap
from simscen.core.messages.navigation import Belief
from simscen.core.stage import Situation
from simscen.spec.base import Spec, Value
from simscen.spec.quantities import (
    NonNegativeLength,
    PositiveAngle,
    PositiveAngularSpeed,
    PositiveLength,
    PositiveSpeed,
)
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


class Travelled(Value[NonNegativeLength], Condition):
    """True once the robot has truly driven this far since the start; being kidnapped is no drive.

    Example: `when: {travelled: 2.5 m}`
    """

    def holds(self, now: Situation) -> bool:
        """The driven distance has reached the length."""
        return now.travelled >= self.root


class BelievedDistanceRemaining(Value[NonNegativeLength], Condition):
    """True while the robot believes itself at most this far from its goal, as the crow flies (m).

    For a robot that is wrong about where it is: it slows down, parks or reports where it thinks the goal is.
    `distance_remaining` measures from where it truly is.

    Example: `when: {believed_distance_remaining: 1 m}`
    """

    def holds(self, now: Situation) -> bool:
        """There is a goal, and a belief that is near it."""
        return now.goal is not None and now.belief is not None and now.belief.pose.distance(now.goal.pose) <= self.root


class LocalizationLost(Spec, Condition):
    """True while the robot is lost: its belief is off by more than a planner can bear, or it says so itself.

    For what follows a kidnapping or a slip: stairs, a person, a new order while the robot drives by a wrong map in its
    head. `localization_error` looks at the position alone. Without any belief nothing is known to be lost.

    Example: `when: {localization_lost: {tolerance: 0.5 m, yaw_tolerance: 30 deg}, for: 1 s}`
    """

    tolerance: PositiveLength = 0.5
    """How far the believed position may be off (m)."""
    yaw_tolerance: PositiveAngle = 0.5236
    """How far the believed heading may be off (rad); 30° unless said otherwise."""
    std: PositiveLength | None = None
    """Lost, too, while the belief's own standard deviation of the position is larger than this (m), be it right or
    not; default: whatever it says of itself."""

    def holds(self, now: Situation) -> bool:
        """There is a belief, and it is off or unsure."""
        belief = now.belief
        if belief is None:
            return False
        off = now.robot.distance(belief.pose) > self.tolerance
        turned = abs(wrap(now.robot.yaw - belief.pose.yaw)) > self.yaw_tolerance
        return off or turned or (self.std is not None and _spread(belief) > self.std)


def _spread(belief: Belief) -> float:
    """Standard deviation of the position where it is least sure: the root of the larger eigenvalue of x and y."""
    xx, xy, yy = (float(belief.covariance[at]) for at in ((0, 0), (0, 1), (1, 1)))
    return math.sqrt(max(0.0, (xx + yy) / 2 + math.hypot((xx - yy) / 2, xy)))
