"""The plan as a controller follows it: in the odom frame, in which its costmap is."""

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Goal, Path
from simscen.stack.followed_plan import FollowedPlan
from simscen.stack.frames import Frames, placed
from simscen.stack.protocols import Controller

REACH = 1.0
"""Meters ahead at which the way a controller takes is decided."""
MOVED = 0.01
"""Meters by which the path may lie beside where it belongs before the controller is told of it. The localizer's
corrections are larger, and those of every beat that follow an odometry's drift smaller."""
STANDS = 1e-9
"""Meters by which rounding alone may seem to move it."""


class LocalPath:
    """Tells the controller a new plan, and the rest of the one it follows whenever map→odom has moved.

    Nav2's controllers transform the plan in each cycle; here one that is told nothing new can keep what it knows of it.
    Most of the time map→odom stands still, and nothing is to be done.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._plan: FollowedPlan | None = None
        self._told = self._odom_from_map = Pose2(0.0, 0.0)
        self._goal: Goal | None = None
        self._local_goal: Goal | None = None

    def tell(self, plan: FollowedPlan, goal: Goal, frames: Frames) -> Goal:
        """The plan in force, while the robot is here. Returns the goal in the odom frame."""
        stands = frames.moved(self._odom_from_map, REACH) <= STANDS
        if not stands:
            self._odom_from_map = frames.odom_from_map
        if plan is not self._plan:
            self._follow(plan, plan.path.points)
        elif not stands and frames.moved(self._told, REACH) > MOVED:
            plan.locate(frames.pose)
            self._follow(plan, plan.ahead)
        local = self._local_goal
        if local is None or goal is not self._goal or not stands:
            self._goal, self._local_goal = goal, (local := goal.at(self._odom_from_map.compose(goal.pose)))
        return local

    def _follow(self, plan: FollowedPlan, points: Array) -> None:
        self._plan, self._told = plan, self._odom_from_map
        self._controller.set_path(Path(placed(self._told, points), plan.path.tick))
