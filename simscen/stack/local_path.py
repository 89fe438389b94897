"""The plan as a controller follows it: in the odom frame, in which its costmap is."""

from simscen.core.geometry import Pose2
from simscen.core.navigation import Path
from simscen.stack.frames import Frames, placed
from simscen.stack.protocols import Controller
from simscen.stack.replanning import PlanInForce

REACH = 1.0
"""Metres ahead at which the way a controller takes is decided."""
MOVED = 0.01
"""Metres by which the path may lie beside where it belongs before the controller is told of it. The localizer's
corrections are larger, and those of every beat that follow an odometry's drift smaller."""


class LocalPath:
    """Tells the controller a new plan, and the rest of the one it follows whenever map→odom has moved.

    Nav2's controllers transform the plan in each cycle; here one that is told nothing new can keep what it knows of it.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._plan: PlanInForce | None = None
        self._odom_from_map = Pose2(0.0, 0.0)

    def tell(self, plan: PlanInForce, frames: Frames) -> None:
        """The plan in force, while the robot is here."""
        if plan is not self._plan:
            points = plan.path.points
        elif frames.moved(self._odom_from_map, REACH) > MOVED:
            plan.locate(frames.pose)
            points = plan.ahead
        else:
            return
        self._plan, self._odom_from_map = plan, frames.odom_from_map
        self._controller.set_path(Path(placed(frames.odom_from_map, points), plan.path.tick))
