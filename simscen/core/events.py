"""Things that happen once, on the lockstep clock."""

from collections.abc import Mapping
from dataclasses import dataclass, field

Value = str | int | float | bool | None | list["Value"] | dict[str, "Value"]


@dataclass(frozen=True)
class Event:
    """Something that happened at `tick`: `kind` from the table below, `name` of the thing, `data` that JSON can hold.

    goal.accepted / goal.reached / goal.failed / goal.canceled   name = goal; data: index, error_code, error_name, …
    plan.made / plan.failed     data: reason (goal, blocked, …), length, error_code, error_name
    recovery.started / recovery.ended   name = behaviour (spin, wait, backup, clear_costmap); data: outcome
    collision.started / collision.ended name = what was hit; data: x, y, impulse (N s), speed (m/s), robot_part
    fault.started / fault.ended  name = "<sensor>.<kind>", e.g. "lidar.off"
    event.started / event.ended  name = the scenario event
    object.spawned / object.removed / object.moved   name = object; data: shape and pose
    navigation.ended             name = result; data: error_code, error_name
    run.ended                    name = why (goals done, time limit, …)
    """

    tick: int
    kind: str
    name: str = ""
    data: Mapping[str, Value] = field(default_factory=dict)
