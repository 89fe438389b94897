"""Events of a run, and the disturbances that a scenario schedules with their outcomes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

Value = str | int | float | bool | None | list["Value"] | dict[str, "Value"]


class EventKind(str, Enum):
    """All that can happen. Beside each kind: what the event's name names, and what its data holds."""

    GOAL_ACCEPTED = "goal.accepted"  # goal; x, y, yaw
    GOAL_REACHED = "goal.reached"  # goal; index
    GOAL_PASSED = "goal.passed"  # goal that is passed without a stop; index
    GOAL_FAILED = "goal.failed"  # goal; index, error_code, error_name, message
    GOAL_CANCELED = "goal.canceled"  # goal; index, preempted_by
    NAVIGATION_ENDED = "navigation.ended"  # result; error_code, error_name
    PLAN_MADE = "plan.made"  # goal; reason (goal, blocked, …), length
    PLAN_FAILED = "plan.failed"  # error_code, error_name, message
    RECOVERY_STARTED = "recovery.started"  # behavior: clear_costmap, spin, wait, …; error_code, error_name
    RECOVERY_ENDED = "recovery.ended"  # behavior; outcome
    ROBOT_HELD = "robot.held"  # what it waits for: collision_monitor, planner, controller; message: why
    ROBOT_RELEASED = "robot.released"  # what it waited for
    COLLISION_STARTED = "collision.started"  # what was hit; x, y, impulse (N s), speed (m/s), robot_part
    COLLISION_ENDED = "collision.ended"  # what was hit
    FAULT_STARTED = "fault.started"  # label, e.g. "lidar.off"; entry (number of the fault, from 0), sensor, fault
    FAULT_TOOK_EFFECT = "fault.took_effect"  # label, at the first message or command it changed; entry
    FAULT_ENDED = "fault.ended"  # label; entry, touched (how many messages and commands it changed)
    EVENT_STARTED = "event.started"  # the scenario's event; entry (number of the event, from 0), actions
    EVENT_ENDED = "event.ended"  # the scenario's event; entry, effects (happened, what: of each action)
    OBJECT_SPAWNED = "object.spawned"  # object; its pose, shape, parts (outlines in its own frame), person
    OBJECT_REMOVED = "object.removed"  # object
    OBJECT_MOVED = "object.moved"  # object; waypoints (x, y, yaw), times, repeat, ease, start, phase
    OBJECT_PLACED = "object.placed"  # object; x, y, yaw: set down there, and moved by no script any more
    OBJECT_PUSHED = "object.pushed"  # object; impulse (N s), seconds it is spread over
    PEDESTRIAN_REACHED = "pedestrian.reached"  # pedestrian; goal (its number, from 1)
    PEDESTRIAN_REACTED = "pedestrian.reacted"  # pedestrian; behavior, robot ("" where there is but one)
    PEDESTRIAN_CALMED = "pedestrian.calmed"  # pedestrian; behavior, robot: the reaction is over
    ROBOT_PLACED = "robot.placed"  # x, y, yaw
    ROBOT_PUSHED = "robot.pushed"  # impulse (N s); seconds it is spread over, where it is no blow
    ZONE_SWITCHED = "zone.switched"  # region, or "" for a mask; filter (keepout, speed), enabled, speed_limit (m/s)
    FLOOR_CHANGED = "floor.changed"  # region or patch; outline, friction, until (s; absent for good)
    MARK = "mark"  # the mark; note
    RUN_ENDED = "run.ended"  # why: navigation ended, time limit

    def __str__(self) -> str:
        """As it is written in logs."""
        return self.value


@dataclass(frozen=True)
class Event:
    """Something that happened at `tick`, to the thing called `name`, with `data` that JSON can hold."""

    tick: int
    kind: EventKind
    name: str = ""
    data: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Disturbance:
    """An event or a fault as the scenario orders it.

    `when` is its trigger as written, "" for a fault from the start. `required` says that the run fails unless it
    happens. `line` is where the entry stands in the scenario's own file; 0 = unknown. `after` is the number, among the
    events, of the one after which it is waited for: it is a step of a story.
    """

    name: str
    kind: Literal["event", "fault"]
    when: str = ""
    required: bool = True
    line: int = 0
    after: int | None = None

    @property
    def trigger(self) -> str:
        """The trigger in words: "when time: 10 s"."""
        if self.after is not None:
            return f"then when {self.when}" if self.when else "then at once"
        return f"when {self.when}" if self.when else "from the start"


@dataclass(frozen=True)
class DisturbanceOutcome:
    """What became of a disturbance: the ticks at which it `fired`, and whether it changed anything at any of them.

    `effect` tells in a line what it changed, or why nothing; `tick` is the first at which it did, or tried to.
    """

    ordered: Disturbance
    fired: tuple[int, ...]
    happened: bool
    effect: str
    tick: int | None = None

    @property
    def missing(self) -> bool:
        """Whether it had to happen and did not."""
        return self.ordered.required and not self.happened


READING_KINDS = ("Scan", "Odometry", "Imu", "Bump", "Image")
"""The classes of core.sensing."""
COMMAND = "Command"
"""The kind of cmd_vel: velocity commands on their way to the base."""
WHEELS = "Wheels"
"""The kind of wheels: what the motors make of a command, and what odometry counts of it."""
BELIEF = "Belief"
"""The kind of the localizer: where the navigator is told that the robot is."""
MAP = "Map"
"""The kind of the map that the stack is given."""
KIND_BY_INSTANCE = {"cmd_vel": COMMAND, "wheels": WHEELS, "localizer": BELIEF, "map": MAP}
"""What faults affect besides sensors, by the name that scenarios have for it; a sensor of that name goes before."""
FAULT_TARGET_KINDS = (*READING_KINDS, *KIND_BY_INSTANCE.values())
"""All that `affects` of a fault may name."""
