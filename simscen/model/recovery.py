"""Specifications of recovery behaviors, which run after planning or control has failed, as in Nav2."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.spec.base import Spec, Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import (
    Angle,
    Duration,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    PositiveAngularAcceleration,
    PositiveAngularSpeed,
    PositiveDuration,
    PositiveSpeed,
)

PlannerCode = Literal[
    "PLANNER_UNKNOWN",
    "START_OUTSIDE_MAP",
    "GOAL_OUTSIDE_MAP",
    "START_OCCUPIED",
    "GOAL_OCCUPIED",
    "PLANNER_TIMEOUT",
    "NO_VALID_PATH",
]
"""Error codes of planners."""


class BehaviorSpec(Typed):
    """Base class of recovery behavior specifications."""

    turns_in_place: ClassVar[bool] = False
    """Whether the behavior needs a base that can turn in place. Other robots skip the behavior."""


class Spin(BehaviorSpec):
    """Turn in place to see the surroundings (nav2_behaviors::Spin)."""

    component: ClassVar[str] = "simscen.stack.behaviors:Spin"
    turns_in_place: ClassVar[bool] = True
    type: Literal["spin"] = "spin"
    spin_dist: Angle = 1.57
    """Angle of the turn."""
    max_rotational_vel: PositiveAngularSpeed = 1.0
    """Maximum turn rate."""
    min_rotational_vel: NonNegativeAngularSpeed = 0.4
    """Minimum turn rate, unless `max_rotational_vel` is lower."""
    rotational_acc_lim: PositiveAngularAcceleration | None = None
    """Angular deceleration at the end of the turn; default: the limit of the robot (Nav2: 3.2 rad/s²)."""
    simulate_ahead_time: Duration = 2.0
    """Time for which the motion is checked for collisions; 0 = no check."""
    time_allowance: PositiveDuration = 10.0
    """Time after which the behavior fails with SPIN_TIMEOUT."""


class Wait(BehaviorSpec):
    """Wait for a fixed time, so that an obstacle can move away (nav2_behaviors::Wait)."""

    component: ClassVar[str] = "simscen.stack.behaviors:Wait"
    type: Literal["wait"] = "wait"
    wait_duration: Duration = 5.0
    """Duration of the wait."""


class BackUp(BehaviorSpec):
    """Drive straight back (nav2_behaviors::BackUp)."""

    component: ClassVar[str] = "simscen.stack.behaviors:BackUp"
    type: Literal["backup"] = "backup"
    backup_dist: NonNegativeLength = 0.30
    """Distance to back up."""
    backup_speed: PositiveSpeed = 0.15
    """Speed of backing up."""
    simulate_ahead_time: Duration = 2.0
    """Time for which the motion is checked for collisions; 0 = no check."""
    time_allowance: PositiveDuration = 10.0
    """Time after which the behavior fails with BACKUP_TIMEOUT."""
    backup_partial: bool = False
    """Whether to back up a shorter distance if there is not enough room. Nav2 fails instead."""


class ClearCostmap(BehaviorSpec):
    """Remove the obstacles that sensors have seen from the costmaps, except those in current readings. The map
    remains."""

    component: ClassVar[str] = "simscen.stack.behaviors:ClearCostmap"
    type: Literal["clear_costmap"] = "clear_costmap"
    clear_entirely: bool = True
    """Whether to clear the entire global costmap, as in Nav2; otherwise only the area of the local costmap."""


_SHIPPED: dict[str, type[BehaviorSpec]] = {"clear_costmap": ClearCostmap, "spin": Spin, "wait": Wait, "backup": BackUp}
"""Specifications of the behaviors of the reference stack, by type."""
BEHAVIORS = {name: f"{model.__module__}:{model.__name__}" for name, model in _SHIPPED.items()}
"""Specifications of the behaviors of the reference stack as `module:Class`, by type."""
Behavior = Annotated[str | BehaviorSpec, ExtensibleUnion("behavior", allows_names=True)]


class Recovery(Spec):
    """Recovery behaviors, as in Nav2's default behavior tree.

    After planning fails, the global costmap is cleared; after control fails, the local costmap is cleared. If the next
    attempt fails as well, the next behavior runs.
    """

    number_of_retries: Annotated[int, Field(ge=0, le=100)] = 6
    """Number of behaviors before the goal fails (retries after a cleared costmap do not count)."""
    retries_since_progress: bool = False
    """Whether the count of retries and the list of behaviors start again when the robot is one meter nearer to its goal
    than at any earlier recovery. Nav2 counts all retries of a goal."""
    planner_codes: Annotated[list[PlannerCode], Field(max_length=20)] = [
        "PLANNER_UNKNOWN",
        "PLANNER_TIMEOUT",
        "NO_VALID_PATH",
    ]
    """Planner errors that start recovery (WouldAPlannerRecoveryHelp in Nav2). After other errors, the goal fails
    immediately. The advanced stack adds START_OUTSIDE_MAP, START_OCCUPIED, and GOAL_OCCUPIED."""
    behaviors: Annotated[list[Behavior], Field(max_length=20)] = ["clear_costmap", "spin", "wait", "backup"]
    """Behaviors in the order of their use, by name or with parameters."""
    clear_entirely: bool = True
    """Whether `clear_costmap`, and the clearing after a planner error, cover the entire global costmap, as in Nav2.

    With false, only the area of the local costmap is cleared, so that known dead ends are kept. Exception: the entire
    global costmap is cleared after the first planner error, again when the robot is one meter nearer to its goal, and
    otherwise at increasing intervals (10 s, 20 s, 40 s, …)."""
    spin_dist: Angle = 1.57
    """Angle of `spin`."""
    wait_duration: Duration = 5.0
    """Duration of `wait`."""
    backup_dist: NonNegativeLength = 0.30
    """Distance of `backup`, and minimum distance of `retrace`."""
    backup_speed: PositiveSpeed = 0.15
    """Speed of `backup` and `retrace`."""
    backup_partial: bool = False
    """Whether `backup` drives a shorter distance if there is not enough room. Nav2 fails instead."""
    retrace_dist: NonNegativeLength = 1.0
    """Maximum distance of `retrace`, the behavior of the advanced stack that drives back along the robot's own path.
    After `backup_dist`, `retrace` ends as soon as there is room to turn in place."""
    simulate_ahead_time: Duration = 2.0
    """Time for which the motions of `spin` and `backup` are checked for collisions; 0 = no check."""
    max_rotational_vel: PositiveAngularSpeed = 1.0
    """Maximum turn rate of `spin`."""
    min_rotational_vel: NonNegativeAngularSpeed = 0.4
    """Minimum turn rate of `spin`, unless `max_rotational_vel` is lower."""
    rotational_acc_lim: PositiveAngularAcceleration | None = None
    """Angular deceleration at the end of `spin`; default: the limit of the robot (Nav2: 3.2 rad/s²)."""
    time_allowance: PositiveDuration = 10.0
    """Time after which `spin`, `backup`, or `retrace` fails; for `retrace`, at least 1.5 times the duration of driving
    `retrace_dist` at `backup_speed`."""

    @property
    def names(self) -> list[str]:
        """Names of the behaviors in order."""
        return [entry if isinstance(entry, str) else entry.type for entry in self.behaviors]

    def behavior_specs(self) -> list[BehaviorSpec]:
        """Return the behaviors in order. Parameters that a behavior does not set are taken from this specification."""
        return [self._with_shared_parameters(entry) for entry in self.behaviors]

    def _with_shared_parameters(self, entry: str | BehaviorSpec) -> BehaviorSpec:
        """Return the complete specification of a behavior that is given by name or with some of its parameters."""
        model = _SHIPPED[entry] if isinstance(entry, str) else type(entry)
        shared_names = type(self).model_fields.keys() & model.model_fields.keys()
        shared = {name: getattr(self, name) for name in sorted(shared_names)}
        given = {} if isinstance(entry, str) else {name: getattr(entry, name) for name in entry.model_fields_set}
        return model.model_validate({**shared, **given})
