"""Conditions on the position of the robot: `robot_in`, `robot_within`, and `clearance_below`."""

from pydantic import model_validator

from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.core.stage import Situation
from simscen.spec.base import Spec, Value
from simscen.spec.places import MoverName, PlaceOrPoint, RegionName
from simscen.spec.quantities import NonNegativeLength, PositiveLength
from simscen.triggers.base import Condition


class RobotIn(Spec, Condition):
    """True while the robot's center is inside a named region of the world.

    Example: `when: {robot_in: {region: hall}}`
    """

    region: RegionName
    """Name of a region of the world."""

    def holds(self, now: Situation) -> bool:
        """Return whether the true position is inside or on the border."""
        return distance_to_polygon(now.robot, now.region(self.region)) <= 0


class RobotWithin(Spec, Condition):
    """True while the robot's center is at most `distance` away from a point, an object, or a region.

    Example: `when: {robot_within: {of: [2, 2], distance: 1.5 m}}`
    """

    of: PlaceOrPoint | None = None
    """A point [x, y] in the world frame, or a place by name."""
    object: MoverName | None = None
    """An object of the world or of the scenario's events, or another robot, by name; false while it does not exist."""
    region: RegionName | None = None
    """Name of a region of the world."""
    distance: NonNegativeLength
    """Maximum distance from the robot's center."""

    @model_validator(mode="after")
    def _check_target(self) -> "RobotWithin":
        if sum(target is not None for target in (self.of, self.object, self.region)) != 1:
            raise ValueError("expected exactly one of: of, object, region")
        return self

    def holds(self, now: Situation) -> bool:
        """Return whether the true position is near the target."""
        if self.region is not None:
            return distance_to_polygon(now.robot, now.region(self.region)) <= self.distance
        target = Pose2(self.of[0], self.of[1]) if self.of else now.object(self.object or "")
        return target is not None and now.robot.distance(target) <= self.distance


class ClearanceBelow(Value[PositiveLength], Condition):
    """True while the distance between the robot's hull and the nearest obstacle is less than this (m).

    Use it for disturbances in narrow places: a scan that drops out in a doorway, a push beside a shelf. Walls, objects,
    and other robots count. The clearance is measured with each truth sample (`physics.truth_rate`).

    Example: `when: {clearance_below: 30 cm}`
    """

    def holds(self, now: Situation) -> bool:
        """Return whether the newest sample of the true clearance is smaller."""
        return now.clearance is not None and now.clearance < self.root
