"""`goal`: a goal was accepted, reached, passed or failed."""

from typing import Annotated, Literal

from pydantic import Field

from simscen.core.messages.goal_names import matches_goal_name
from simscen.core.records.events import EventKind
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.references import GoalName
from simscen.triggers.base import Condition


class GoalStatus(Spec, Condition):
    """True once a goal was accepted, reached, passed or failed, as the robot reports it.

    Example: `when: {goal: {name: shelf, status: reached}}`
    """

    status: Literal["accepted", "reached", "passed", "failed", "canceled"]
    """What must have been reported. What navigate_through_poses drives through is `passed`, its last goal `reached`."""
    name: GoalName | None = None
    """Of this goal, in any loop (`shelf#2`: in the second one); default: of any."""
    count: Annotated[int, Field(ge=1, le=10_000)] = 1
    """How often."""

    def holds(self, now: Situation) -> bool:
        """Enough such reports have come."""
        kind = EventKind(f"goal.{self.status}")
        return sum(e.kind == kind and matches_goal_name(e.name, self.name) for e in now.events) >= self.count
