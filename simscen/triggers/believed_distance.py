"""`believed_distance_remaining`: how far the robot thinks it still has to go."""

from simscen.core.stage import Situation
from simscen.spec.base import Value
from simscen.spec.quantities import NonNegativeLength
from simscen.triggers.base import Condition


class BelievedDistanceRemaining(Value[NonNegativeLength], Condition):
    """True while the robot believes itself at most this far from its goal, as the crow flies (m).

    For a robot that is wrong about where it is: it slows down, parks or reports where it thinks the goal is.
    `distance_remaining` measures from where it truly is.

    Example: `when: {believed_distance_remaining: 1 m}`
    """

    def holds(self, now: Situation) -> bool:
        """There is a goal, and a belief that is near it."""
        return now.goal is not None and now.belief is not None and now.belief.pose.distance(now.goal.pose) <= self.root
