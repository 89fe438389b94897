"""Conditions on logged events: `event`, `replan`, `recovery`, `collision`, `goal`, `waypoint`, and `pedestrian`."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.core.messages.goals import matches_goal_name
from simscen.core.records.events import EventKind
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.extensible_union import BehaviorName
from simscen.spec.places import DisturbanceName, GoalName, MovableName, ObjectName
from simscen.triggers.base import Condition

Count = Annotated[int, Field(ge=1, le=10_000)]
"""Required number of logged events."""
COMPLETION_KINDS = frozenset({EventKind.GOAL_REACHED, EventKind.GOAL_PASSED})
"""Kinds of events that complete a goal."""


def _count_events(now: Situation, kind: EventKind, name: str | None) -> int:
    """Return the number of logged events with this kind and name; with any name if `name` is None."""
    return sum(e.kind == kind and name in (None, e.name) for e in now.events)


class EventStatus(Spec, Condition):
    """True once another event or a fault of this scenario has started or ended, or a mark has been set.

    Use the condition for disturbances that follow each other: the lidar goes silent, and a second later a person steps
    in the way. A mark is a named time in the log, set by the action `mark`.

    Example: `when: {event: {name: pallet falls, status: started}}`
    """

    is_robot_specific: ClassVar[bool] = False

    name: DisturbanceName
    """The `name` of the event, fault, or mark; an unnamed fault is called `<sensor>.<fault>`, e.g. `lidar.off`."""
    status: Literal["started", "ended"] = "started"
    """The required status of the event or fault; ignored for a mark."""

    def holds(self, now: Situation) -> bool:
        kinds = [EventKind(f"{source}.{self.status}") for source in ("event", "fault")]
        return any(_count_events(now, kind, self.name) > 0 for kind in (*kinds, EventKind.MARK))


class Replan(Spec, Condition):
    """True once the robot has replanned `count` times for any reason. The first plan to each goal does not count.

    Example: `when: {replan: {count: 2}}`
    """

    count: Count = 1
    """Required number of replans."""

    def holds(self, now: Situation) -> bool:
        plans = (event for event in now.events if event.kind == EventKind.PLAN_MADE)
        return sum(plan.data.get("reason", "goal") != "goal" for plan in plans) >= self.count


class RecoveryStatus(Spec, Condition):
    """True once a recovery behavior has started or ended `count` times.

    Example: `when: {recovery: {status: started}}`
    """

    status: Literal["started", "ended"] = "started"
    """The required status."""
    name: BehaviorName | None = None
    """Name of the behavior; default: any."""
    count: Count = 1
    """Required number of starts or ends."""

    def holds(self, now: Situation) -> bool:
        return _count_events(now, EventKind(f"recovery.{self.status}"), self.name) >= self.count


class HasCollided(Spec, Condition):
    """True once the robot has collided with something.

    Example: `when: {collision: {}}`
    """

    object: ObjectName | None = Field(default=None, alias="with")
    """Name of the object; default: any."""

    def holds(self, now: Situation) -> bool:
        return _count_events(now, EventKind.COLLISION_STARTED, self.object) > 0


class GoalStatus(Spec, Condition):
    """True once the robot has reported `count` times that a goal was accepted, reached, passed, failed, or canceled.

    Example: `when: {goal: {name: shelf, status: reached}}`
    """

    status: Literal["accepted", "reached", "passed", "failed", "canceled"]
    """The required status. With navigate_through_poses, intermediate goals are `passed` and the last one `reached`."""
    name: GoalName | None = None
    """Name of the goal, in any loop (`shelf#2`: in the second loop); default: any goal."""
    count: Count = 1
    """Required number of reports."""

    def holds(self, now: Situation) -> bool:
        kind = EventKind(f"goal.{self.status}")
        return sum(e.kind == kind and matches_goal_name(e.name, self.name) for e in now.events) >= self.count


class Waypoint(Spec, Condition):
    """True once the robot has reported `count` waypoints as reached or passed.

    Use the condition for disturbances at a certain point of a tour: after the second shelf, a door closes. The count
    continues over all loops of the tour.

    Example: `when: {waypoint: {count: 2}}`
    """

    name: GoalName | None = None
    """Count only this goal, in any loop (`shelf#2`: in the second loop); default: all goals."""
    count: Count = 1
    """Required number of waypoints."""

    def holds(self, now: Situation) -> bool:
        return (
            sum(e.kind in COMPLETION_KINDS and matches_goal_name(e.name, self.name) for e in now.events) >= self.count
        )


class PedestrianStatus(Spec, Condition):
    """True once a pedestrian has reacted to a robot, stopped reacting, or reached one of the pedestrian's goals.

    Use the condition, for example, for a door that opens when a pedestrian arrives.

    Example: `when: {pedestrian: {name: anna, status: reacted}}`
    """

    is_robot_specific: ClassVar[bool] = False

    status: Literal["reacted", "calmed", "reached"]
    """The required status; `calmed` is the end of a reaction."""
    name: MovableName | None = None
    """Name of the pedestrian; default: any."""
    count: Count = 1
    """Required number of reactions, ends of reactions, or reached goals."""

    def holds(self, now: Situation) -> bool:
        return _count_events(now, EventKind(f"pedestrian.{self.status}"), self.name) >= self.count
