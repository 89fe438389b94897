"""Conditions on logged events: `event`, `replan`, `recovery`, `collision`, `goal`, `waypoint`, and `pedestrian`."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.core.messages.goal_names import matches_goal_name
from simscen.core.records.events import EventKind
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.bytype import BehaviorName
from simscen.spec.references import GoalName, HappeningName, MovableName, ObjectName
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
