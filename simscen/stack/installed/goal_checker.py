"""A goal checker behind its door."""

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Goal
from simscen.model.checkers import GoalCheckerSpec
from simscen.stack.installed.guarded_calls import Watched
from simscen.stack.protocols import GoalChecker
from simscen.stack.setting import Setting


class InstalledGoalChecker(Watched):
    """Asks the goal checker, and takes nothing but yes or no for an answer."""

    may_fail = False

    def __init__(self, spec: GoalCheckerSpec, setting: Setting) -> None:
        super().__init__("goal_checker", spec, setting, GoalChecker)

    def reset(self) -> None:
        """A new goal."""
        self.ask(self.inner.reset)

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Whether the goal is reached. Raises RunError when the answer is neither yes nor no."""
        reached = self.ask(self.inner.reached, goal, pose, twist)
        if reached not in (True, False):
            self.broke(f"answered {reached!r} to whether a goal is reached")
        return bool(reached)
