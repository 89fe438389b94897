"""Recorded events of a run, scheduled events and faults of a scenario (disturbances), and targets of faults."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

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
    RECOVERY_ENDED = "recovery.ended"  # behavior; outcome
    ROBOT_HELD = "robot.held"  # what it waits for: collision_monitor, planner, controller; message: why
    ROBOT_RELEASED = "robot.released"  # what it waited for
    COLLISION_STARTED = "collision.started"  # what was hit; x, y, impulse (N s), speed (m/s), robot_caused, …
    COLLISION_ENDED = "collision.ended"  # what was hit; impulse (N s), ticks (duration)
    FAULT_STARTED = "fault.started"  # label, e.g. "lidar.off"; entry (number of the fault, from 0), sensor, fault, …
    FAULT_TOOK_EFFECT = "fault.took_effect"  # label, at the first message or command it changed; entry
    FAULT_ENDED = "fault.ended"  # label; entry, touched (how many messages and commands it changed)
    EVENT_STARTED = "event.started"  # the scenario's event; entry (number of the event, from 0), actions
    EVENT_ENDED = "event.ended"  # the scenario's event; entry, effects (happened, what: of each action)
    OBJECT_SPAWNED = "object.spawned"  # object; its pose, mass, shape, parts (outlines in its own frame), person, …
    OBJECT_REMOVED = "object.removed"  # object
    OBJECT_MOVED = "object.moved"  # object; waypoints (x, y, yaw), times, repeat, ease, start, phase
    OBJECT_PLACED = "object.placed"  # object; x, y, yaw; its script has ended
    OBJECT_PUSHED = "object.pushed"  # object; impulse (N s), seconds (duration; absent for one tick)
    PEDESTRIAN_REACHED = "pedestrian.reached"  # pedestrian; goal (its number, from 1)
    PEDESTRIAN_REACTED = "pedestrian.reacted"  # pedestrian; behavior, robot ("" for a single one)
    PEDESTRIAN_CALMED = "pedestrian.calmed"  # pedestrian; behavior, robot: the reaction is over
    ROBOT_PLACED = "robot.placed"  # ""; x, y, yaw
    ROBOT_PUSHED = "robot.pushed"  # ""; impulse (N s), seconds (duration; absent for one tick)
    ZONE_SWITCHED = "zone.switched"  # region, or "" for a mask; filter (keepout, speed), enabled, speed_limit (m/s)
    FLOOR_CHANGED = "floor.changed"  # region or patch; outline, friction, until (s; absent if permanent)
    MARK = "mark"  # the mark; note
    RUN_ENDED = "run.ended"  # why: navigation ended, time limit

    def __str__(self) -> str:
        """Return the value, as it is written in logs."""
        return self.value


@dataclass(frozen=True)
class Event:
    """Recorded event. The meaning of `name` and `data` depends on `kind`."""

    tick: int
    kind: EventKind
    name: str = ""
    data: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Disturbance:
    """Event or fault that a scenario schedules.

    `when` is the trigger as text from the scenario; "" for a fault that is active from the start, and for a step of
    `then` that follows at once. If `required`, the run fails unless the disturbance takes place. `line` is the line in
    the scenario file; 0 if unknown. `after` is the index of the previous event in a sequence (`then`); None for other
    disturbances.
    """

    name: str
    kind: Literal["event", "fault"]
    when: str = ""
    required: bool = True
    line: int = 0
    after: int | None = None

    @property
    def trigger(self) -> str:
        """Trigger as text, e.g. "when time: 10 s" or "from the start"."""
        if self.after is not None:
            return f"then when {self.when}" if self.when else "then at once"
        return f"when {self.when}" if self.when else "from the start"


@dataclass(frozen=True)
class DisturbanceOutcome:
    """Outcome of a disturbance.

    `fired` contains the ticks at which the trigger fired. `happened` is True if the fault, or each action of the event,
    took effect at least once. `effect` describes the change, or the reason why it did not happen. `tick` is the tick of
    the first change, or of the first attempt if the disturbance did not happen; None without an attempt.
    """

    disturbance: Disturbance
    fired: tuple[int, ...]
    happened: bool
    effect: str
    tick: int | None = None

    @property
    def missing(self) -> bool:
        """Whether the disturbance was required but did not take place."""
        return self.disturbance.required and not self.happened


READING_KINDS = ("Scan", "Odometry", "Imu", "Bump", "Image")
"""Kinds of fault targets that are sensors: names of the classes of their readings in core.messages.sensor_data."""
COMMAND = "Command"
"""Kind of the fault target `cmd_vel`: velocity commands from the stack to the base."""
WHEELS = "Wheels"
"""Kind of the fault target `wheels`: the motion that the motors execute, and the motion that odometry measures."""
BELIEF = "Belief"
"""Kind of the fault target `localizer`: the estimated pose that the navigator receives."""
MAP = "Map"
"""Kind of the fault target `map`: the map that the stack receives."""
KIND_BY_TARGET_NAME = {"cmd_vel": COMMAND, "wheels": WHEELS, "localizer": BELIEF, "map": MAP}
"""Kinds of fault targets by name in a scenario. A sensor of the same name takes precedence."""
FAULT_TARGET_KINDS = (*READING_KINDS, *KIND_BY_TARGET_NAME.values())
"""All kinds of fault targets. The attribute `affects` of a fault contains some of them."""
