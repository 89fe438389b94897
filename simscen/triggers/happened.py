"""`event`, `replan`, `recovery`, `collision`: something was logged often enough."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.core.records.events import EventKind
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.bytype import BehaviorName
from simscen.spec.references import HappeningName, ObjectName
from simscen.triggers.base import Condition

Count = Annotated[int, Field(ge=1, le=10_000)]


def _seen(now: Situation, kind: EventKind, name: str | None) -> int:
    return sum(e.kind == kind and name in (None, e.name) for e in now.events)


class EventStatus(Spec, Condition):
    """True once another event, or a fault, of this scenario has started or ended, or a mark has been set.

    For one trouble that brings the next: the lidar falls silent, and a second later somebody steps in the way.

    Example: `when: {event: {name: pallet falls, status: started}}`
    """

    of_a_robot: ClassVar[bool] = False

    name: HappeningName
    """The `name` of the event, fault or mark; a fault without one is called `<sensor>.<fault>`, e.g. `lidar.off`."""
    status: Literal["started", "ended"] = "started"
    """What it must have done."""

    def holds(self, now: Situation) -> bool:
        """It has."""
        kinds = [EventKind(f"{what}.{self.status}") for what in ("event", "fault")]
        return any(_seen(now, kind, self.name) > 0 for kind in (*kinds, EventKind.MARK))


class Replan(Spec, Condition):
    """True once the robot has replanned so often because its plan was blocked or outdated.

    Example: `when: {replan: {count: 2}}`
    """

    count: Count = 1
    """How many replans."""

    def holds(self, now: Situation) -> bool:
        """Plans beyond the first one of each goal."""
        return sum(e.kind == EventKind.PLAN_MADE and e.data.get("reason") != "goal" for e in now.events) >= self.count


class RecoveryStatus(Spec, Condition):
    """True once a recovery behavior has started or ended so often.

    Example: `when: {recovery: {status: started}}`
    """

    status: Literal["started", "ended"] = "started"
    """What it must have done."""
    name: BehaviorName | None = None
    """Which one; default: any."""
    count: Count = 1
    """How often."""

    def holds(self, now: Situation) -> bool:
        """Often enough."""
        return _seen(now, EventKind(f"recovery.{self.status}"), self.name) >= self.count


class Collided(Spec, Condition):
    """True once the robot has touched something.

    Example: `when: {collision: {}}`
    """

    object: ObjectName | None = Field(default=None, alias="with")
    """By name; default: anything."""

    def holds(self, now: Situation) -> bool:
        """It has."""
        return _seen(now, EventKind.COLLISION_STARTED, self.object) > 0
