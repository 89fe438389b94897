"""`goal`: a goal was accepted, reached or failed."""

from typing import Annotated, Literal

from pydantic import Field

from simscen.core.events import EventKind
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.references import GoalName
from simscen.triggers.base import Condition


class GoalStatus(Spec, Condition):
    """True once a goal was accepted, reached or failed, as the robot reports it.

    Example: `when: {goal: {name: shelf, status: reached}}`
    """

    status: Literal["accepted", "reached", "failed", "canceled"]
    """What must have been reported."""
    name: GoalName | None = None
    """Of this goal; default: of any."""
    count: Annotated[int, Field(ge=1, le=10_000)] = 1
    """How often."""

    def holds(self, now: Situation) -> bool:
        """Enough such reports have come."""
        kind = EventKind(f"goal.{self.status}")
        return sum(e.kind == kind and self.name in (None, e.name) for e in now.events) >= self.count
