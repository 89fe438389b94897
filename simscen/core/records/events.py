"""Recorded events of a run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

Value = str | int | float | bool | None | list["Value"] | dict[str, "Value"]
"""JSON data."""


class EventKind(str, Enum):
    """Kinds of recorded events. The comment beside a kind describes `Event.name` ("" if empty), then `Event.data`."""

    GOAL_ACCEPTED = "goal.accepted"  # goal; x, y, yaw, index
    GOAL_REACHED = "goal.reached"  # goal; index
    GOAL_PASSED = "goal.passed"  # goal that is passed without a stop; index
    GOAL_FAILED = "goal.failed"  # goal; index, error_code, error_name, message
    GOAL_CANCELED = "goal.canceled"  # goal; index, preempted_by
    NAVIGATION_ENDED = "navigation.ended"  # result; error_code, error_name
    PLAN_MADE = "plan.made"  # ""; reason (goal, blocked, …), length
    PLAN_FAILED = "plan.failed"  # ""; error_code, error_name, message
    RECOVERY_STARTED = "recovery.started"  # behavior: clear_costmap, spin, wait, …; error_code, error_name, message
    RECOVERY_ENDED = "recovery.ended"  # behavior; outcome: succeeded, failed, or canceled
    ROBOT_HELD = "robot.held"  # component that the robot waits for: collision_monitor, planner, …; message
    ROBOT_RELEASED = "robot.released"  # component that the robot waited for
    COLLISION_STARTED = "collision.started"  # object that was hit; x, y, impulse (N s), speed (m/s), robot_caused, …
    COLLISION_ENDED = "collision.ended"  # object that was hit; impulse (N s), ticks (duration)
    FAULT_STARTED = "fault.started"  # label, e.g. "lidar.off"; entry (number of the fault, from 0), sensor, fault, …
    FAULT_TOOK_EFFECT = "fault.took_effect"  # label, at the first changed message or command; entry
    FAULT_ENDED = "fault.ended"  # label; entry, touched (number of changed messages and commands)
    EVENT_STARTED = "event.started"  # event of the scenario; entry (number of the event, from 0), actions
    EVENT_ENDED = "event.ended"  # event of the scenario; entry, effects (of each action: happened, what)
    OBJECT_SPAWNED = "object.spawned"  # object; its pose, mass, shape, parts (outlines in its own frame), person, …
    OBJECT_REMOVED = "object.removed"  # object
    OBJECT_MOVED = "object.moved"  # object; waypoints (x, y, yaw), times, repeat, ease, start, phase
    OBJECT_PLACED = "object.placed"  # object; x, y, yaw; it no longer follows a path
    OBJECT_PUSHED = "object.pushed"  # object; impulse (N s), seconds (duration; absent for one tick)
    PEDESTRIAN_REACHED = "pedestrian.reached"  # pedestrian; goal (its number, from 1)
    PEDESTRIAN_REACTED = "pedestrian.reacted"  # pedestrian; behavior, robot ("" for a single one)
    PEDESTRIAN_CALMED = "pedestrian.calmed"  # pedestrian; behavior, robot: the reaction is over
    ROBOT_PLACED = "robot.placed"  # ""; x, y, yaw
    ROBOT_PUSHED = "robot.pushed"  # ""; impulse (N s), seconds (duration; absent for one tick)
    ZONE_SWITCHED = "zone.switched"  # region, or "" for a mask; filter (keepout, speed), enabled, speed_limit (m/s)
    FLOOR_CHANGED = "floor.changed"  # region or patch; outline, friction, until (s; absent if permanent)
    MARK = "mark"  # the mark; note
    RUN_ENDED = "run.ended"  # reason: navigation ended, time limit, or (log of another recorder) the recording ends

    def __str__(self) -> str:
        """Return the value, as it is written in logs."""
        return self.value


GOAL_END_KINDS = (EventKind.GOAL_REACHED, EventKind.GOAL_PASSED, EventKind.GOAL_FAILED, EventKind.GOAL_CANCELED)
"""Kinds of events that end the drive to a goal."""


@dataclass(frozen=True)
class Event:
    """Recorded event. The meaning of `name` and `data` depends on `kind`."""

    tick: int
    kind: EventKind
    name: str = ""
    data: Mapping[str, Value] = field(default_factory=dict)
