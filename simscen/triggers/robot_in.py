"""`robot_in`: the robot is inside a region."""

from simscen.core.geometry.polygons import distance_to_polygon
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.references import RegionName
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
