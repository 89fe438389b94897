"""Conditions on the motion, position, clearance, and localization of the robot."""

import math

from pydantic import model_validator

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.core.messages.navigation import Belief
from simscen.core.stage import Situation
from simscen.spec.base import Spec, Value
from simscen.spec.places import MoverName, PlaceOrPoint, RegionName
from simscen.spec.quantities import (
    NonNegativeLength,
    PositiveAngle,
    PositiveAngularSpeed,
    PositiveLength,
    PositiveSpeed,
)
from simscen.triggers.base import Condition


class SpeedBelow(Value[PositiveSpeed], Condition):
    """True while the true speed of the robot is less than the given speed.

    Example: `when: {speed_below: 0.05 m/s}`
    """

    def holds(self, now: Situation) -> bool:
        return math.hypot(now.twist.vx, now.twist.vy) < self.root


class SpeedAbove(Value[PositiveSpeed], Condition):
    """True while the true speed of the robot is greater than the given speed.

    Example: `when: {speed_above: 0.4 m/s}`
    """

    def holds(self, now: Situation) -> bool:
        return math.hypot(now.twist.vx, now.twist.vy) > self.root


class TurningAbove(Value[PositiveAngularSpeed], Condition):
    """True while the true turn rate of the robot, in either direction, is greater than the given one (rad/s).

    Use the condition for disturbances in a turn: a scan distorted by the motion, slipping wheels, a person in a blind
    corner.

    Example: `when: {turning_above: 30 deg/s}`
    """

    def holds(self, now: Situation) -> bool:
        return abs(now.twist.wz) > self.root


class TurningBelow(Value[PositiveAngularSpeed], Condition):
    """True while the true turn rate of the robot, in either direction, is less than the given one (rad/s).

    Combine the condition with `for` to detect the end of a turn. The condition is also true for a robot that stands
    still.

    Example: `when: {turning_below: 5 deg/s, for: 1 s}`
    """

    def holds(self, now: Situation) -> bool:
        return abs(now.twist.wz) < self.root


class HasTravelled(Value[NonNegativeLength], Condition):
    """True once the robot has driven the given distance since the start; in `then`, since the previous step.

    The distance is measured with the true pose, and does not include kidnapping.

    Example: `when: {travelled: 2.5 m}`
    """

    def holds(self, now: Situation) -> bool:
        return now.travelled >= self.root


class DistanceRemaining(Value[NonNegativeLength], Condition):
    """True while the true straight-line distance from the robot to its goal is at most the given distance.

    The signal `distance_remaining` is the length of the remaining plan instead.

    Example: `when: {distance_remaining: 2 m}`
    """

    def holds(self, now: Situation) -> bool:
        return now.goal is not None and now.robot.distance(now.goal.pose) <= self.root


class BelievedDistanceRemaining(Value[NonNegativeLength], Condition):
    """True while the straight-line distance from the estimated pose to the goal is at most the given distance.

    The condition `distance_remaining` measures from the true position instead.

    Example: `when: {believed_distance_remaining: 1 m}`
    """

    def holds(self, now: Situation) -> bool:
        return now.goal is not None and now.belief is not None and now.belief.pose.distance(now.goal.pose) <= self.root


class LocalizationError(Value[NonNegativeLength], Condition):
    """True while the distance between the estimated and the true position of the robot is greater than the given one.

    Example: `when: {localization_error: 0.5 m}`
    """

    def holds(self, now: Situation) -> bool:
        return now.belief is not None and now.robot.distance(now.belief.pose) > self.root


class LocalizationLost(Spec, Condition):
    """True while the estimated pose has a large error or, with `std`, a large reported uncertainty.

    Use the condition for disturbances while the robot navigates with a wrong pose, for example after kidnapping or
    slip. The condition is false while there is no estimated pose.

    Example: `when: {localization_lost: {tolerance: 0.5 m, yaw_tolerance: 30 deg}, for: 1 s}`
    """

    tolerance: PositiveLength = 0.5
    """Maximum error of the estimated position (m)."""
    yaw_tolerance: PositiveAngle = 0.5236
    """Maximum error of the estimated heading (rad); default: 30°."""
    std: PositiveLength | None = None
    """Maximum standard deviation of the position (m) that the localizer reports; default: no maximum."""

    def holds(self, now: Situation) -> bool:
        belief = now.belief
        if belief is None:
            return False
        is_displaced = now.robot.distance(belief.pose) > self.tolerance
        is_rotated = abs(wrap(now.robot.yaw - belief.pose.yaw)) > self.yaw_tolerance
        return is_displaced or is_rotated or (self.std is not None and _max_position_std(belief) > self.std)


def _max_position_std(belief: Belief) -> float:
    """Return the square root of the larger eigenvalue of the covariance of x and y, in m."""
    xx, xy, yy = (float(belief.covariance[index]) for index in ((0, 0), (0, 1), (1, 1)))
    return math.sqrt(max(0.0, (xx + yy) / 2 + math.hypot((xx - yy) / 2, xy)))


class RobotIn(Spec, Condition):
    """True while the robot's center is inside a named region of the world.

    Example: `when: {robot_in: {region: hall}}`
    """

    region: RegionName
    """Name of a region of the world."""

    def holds(self, now: Situation) -> bool:
        return distance_to_polygon(now.robot, now.region(self.region)) <= 0


class RobotWithin(Spec, Condition):
    """True while the robot's center is at most `distance` away from a point, an object, or a region.

    Set exactly one of `of`, `object`, and `region`.

    Example: `when: {robot_within: {of: [2, 2], distance: 1.5 m}}`
    """

    of: PlaceOrPoint | None = None
    """A point [x, y] in the world frame, or a place by name."""
    object: MoverName | None = None
    """An object of the world or of the scenario's events, or another robot, by name; false while it does not exist."""
    region: RegionName | None = None
    """Name of a region of the world."""
    distance: NonNegativeLength
    """Maximum distance from the robot's center to the point, to the region, or to the origin of the object."""

    @model_validator(mode="after")
    def _check_target(self) -> "RobotWithin":
        if sum(target is not None for target in (self.of, self.object, self.region)) != 1:
            raise ValueError("expected exactly one of: of, object, region")
        return self

    def holds(self, now: Situation) -> bool:
        if self.region is not None:
            return distance_to_polygon(now.robot, now.region(self.region)) <= self.distance
        target = Pose2(self.of[0], self.of[1]) if self.of else now.object(self.object or "")
        return target is not None and now.robot.distance(target) <= self.distance


class ClearanceBelow(Value[PositiveLength], Condition):
    """True while the distance between the robot's hull and the nearest obstacle is less than the given one.

    Walls, objects, and other robots are obstacles. The distance is measured at the rate `physics.truth_rate`. Use the
    condition for disturbances in narrow places: a lidar failure in a doorway, a push beside a shelf.

    Example: `when: {clearance_below: 30 cm}`
    """

    def holds(self, now: Situation) -> bool:
        return now.clearance is not None and now.clearance < self.root
