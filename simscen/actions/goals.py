"""`new_goal`, `cancel_goal`: what an operator would do."""

from simscen.actions.base import Action
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.named_places import PlaceOrPose
from simscen.spec.places import Name
from simscen.spec.quantities import PositiveAngle, PositiveDuration, PositiveLength


class NewGoal(Spec, Action):
    """Send another goal; it preempts the one the robot is driving to, and the goals after it follow.

    Criteria judge it like any other goal of the scenario, and the one it preempts as preempted. Every goal that events
    send has a name of its own; sent twice, it has to be reached twice.

    Example: `do: {new_goal: {name: detour, pose: {x: 1, y: 4}}}`
    """

    name: Name
    """What the goal is called."""
    pose: PlaceOrPose
    """In the map frame: a pose, or a place by name."""
    timeout: PositiveDuration | None = None
    """Simulated time it may take."""
    xy_tolerance: PositiveLength | None = None
    """How far off the position may be; default: that of the stack's goal checker."""
    yaw_tolerance: PositiveAngle | None = None
    """How far off the heading may be; default: that of the stack's goal checker."""

    def perform(self, stage: Stage) -> Effect:
        """Send it."""
        stage.send_goal(self.name)
        return Effect(True, f"sent goal {self.name}")


class CancelGoal(Spec, Action):
    """Cancel the goal the robot is driving to, as an action client would; the robot must stop.

    Example: `do: {cancel_goal: {}}`
    """

    def perform(self, stage: Stage) -> Effect:
        """Cancel it; nothing comes of it when the robot drives to no goal."""
        goal = stage.goal
        if goal is None:
            return Effect(False, "the robot was driving to no goal")
        stage.cancel_goal()
        return Effect(True, f"canceled goal {goal.name}")
