"""`waypoint`: the robot has a waypoint behind it."""

from typing import Annotated

from pydantic import Field

from simscen.core.messages.goal_names import matches_goal_name
from simscen.core.records.events import EventKind
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.references import GoalName
from simscen.triggers.base import Condition

BEHIND = frozenset({EventKind.GOAL_REACHED, EventKind.GOAL_PASSED})


class Waypoint(Spec, Condition):
    """True once so many waypoints are behind the robot, be they reached at a stop or passed, as it reports.

    For what comes at a certain point of a tour, however that is driven: after the second shelf a door shuts. Every loop
    of the tour counts on.

    Example: `when: {waypoint: {count: 2}}`
    """

    name: GoalName | None = None
    """Only this goal, in any loop (`shelf#2`: in the second one); default: whichever."""
    count: Annotated[int, Field(ge=1, le=10_000)] = 1
    """How many."""

    def holds(self, now: Situation) -> bool:
        """Enough of them."""
        return sum(e.kind in BEHIND and matches_goal_name(e.name, self.name) for e in now.events) >= self.count
