"""`pedestrian`: somebody reacted to the robot, lost interest, or reached a goal."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.core.records.events import EventKind
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.references import MovableName
from simscen.triggers.base import Condition


class PedestrianStatus(Spec, Condition):
    """True once a pedestrian reacted to the robot, calmed down again, or reached a goal of theirs.

    For what follows from how people take the robot: a second comes to look as well, a door opens for who has arrived.

    Example: `when: {pedestrian: {name: anna, status: reacted}}`
    """

    of_a_robot: ClassVar[bool] = False

    status: Literal["reacted", "calmed", "reached"]
    """What they must have done."""
    name: MovableName | None = None
    """Who; default: anybody."""
    count: Annotated[int, Field(ge=1, le=10_000)] = 1
    """How often."""

    def holds(self, now: Situation) -> bool:
        """Often enough."""
        kind = EventKind(f"pedestrian.{self.status}")
        return sum(e.kind == kind and self.name in (None, e.name) for e in now.events) >= self.count
