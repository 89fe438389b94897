"""Conditions on the position of the robot: `robot_in`, `robot_within`, and `clearance_below`."""

from pydantic import model_validator

from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.core.stage import Situation
from simscen.spec.base import Spec, Value
from simscen.spec.named_places import PlaceOrPoint
from simscen.spec.quantities import NonNegativeLength, PositiveLength
from simscen.spec.references import MoverName, RegionName
from simscen.triggers.base import Condition


class RobotIn(Spec, Condition):
    """True while the robot's center is inside a named region of the world.

    Example: `when: {robot_in: {region: hall}}`
    """

    region: RegionName
    """A region of the world, by name."""

    def holds(self, now: Situation) -> bool:
        """The robot's true center is inside or on the edge."""
        return distance_to_polygon(now.robot, now.region(self.region)) <= 0


class RobotWithin(Spec, Condition):
    """True while the robot's center is at most `distance` from a point, an object or a region.

    Example: `when: {robot_within: {of: [2, 2], distance: 1.5 m}}`
    """

    of: PlaceOrPoint | None = None
    """A point [x, y] in the world, or a place of it by name."""
    object: MoverName | None = None
    """An object of the world or of the scenario's events, or another robot, by name; false while it is not there."""
    region: RegionName | None = None
    """A region of the world, by name."""
    distance: NonNegativeLength
    """From the robot's center."""

    @model_validator(mode="after")
    def _one_target(self) -> "RobotWithin":
        if sum(target is not None for target in (self.of, self.object, self.region)) != 1:
            raise ValueError("expected exactly one of: of, object, region")
        return self

    def holds(self, now: Situation) -> bool:
        """The robot's true center is near."""
        if self.region is not None:
            return distance_to_polygon(now.robot, now.region(self.region)) <= self.distance
        target = Pose2(self.of[0], self.of[1]) if self.of else now.object(self.object or "")
        return target is not None and now.robot.distance(target) <= self.distance


class ClearanceBelow(Value[PositiveLength], Condition):
    """True while anything is nearer to the robot's hull than this (m).

    For what goes wrong where there is no room left: a scan that drops out in the doorway, a push beside the shelf.
    Walls, objects and other robots count; measured with each sample of the truth (`physics.truth_rate`).

    Example: `when: {clearance_below: 30 cm}`
    """

    def holds(self, now: Situation) -> bool:
        """The newest sample of the true clearance is below."""
        return now.clearance is not None and now.clearance < self.root
