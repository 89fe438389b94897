"""What is done when planning or control has failed: the recovery branch of Nav2's default tree, and its behaviors."""

from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from simscen.core.messages.navigation import RecoveryBehavior
from simscen.spec.base import Spec, Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import (
    Angle,
    Duration,
    NonNegativeLength,
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
"""Codes with which a planner fails."""


class BehaviorSpec(Typed):
    """What a robot does when planning or control has failed."""

    turns_in_place: ClassVar[bool] = False
    """Whether only a base that turns in place can do it; others leave it out."""


class Spin(BehaviorSpec):
    """Turn in place, to see what is around (nav2_behaviors::Spin)."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:Spin"
    turns_in_place: ClassVar[bool] = True
    type: Literal["spin"] = "spin"
    spin_dist: Angle = 1.57
    """How far it turns."""
    max_rotational_vel: PositiveAngularSpeed = 1.0
    """Greatest turn rate of a spin."""
    simulate_ahead_time: PositiveDuration = 2.0
    """How far ahead it looks for collisions."""


class Wait(BehaviorSpec):
    """Stand still: what is in the way may go by itself (nav2_behaviors::Wait)."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:Wait"
    type: Literal["wait"] = "wait"
    wait_duration: Duration = 5.0
    """How long it waits."""


class BackUp(BehaviorSpec):
    """Drive straight back (nav2_behaviors::BackUp)."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:BackUp"
    type: Literal["backup"] = "backup"
    backup_dist: NonNegativeLength = 0.30
    """How far it backs up."""
    backup_speed: PositiveSpeed = 0.15
    """How fast it backs up."""
    simulate_ahead_time: PositiveDuration = 2.0
    """How far ahead it looks for collisions."""
    backup_partial: bool = False
    """Whether it backs up as far as there is room, if that is less. Nav2 does not."""


class Retrace(BehaviorSpec):
    """Drive back the way it came, turns included, until there is room to turn. Nav2 has nothing like it.

    Backs up straight where nobody knows that way.
    """

    component: ClassVar[str] = "simscen.advanced.recovery.retrace:Retrace"
    type: Literal["retrace"] = "retrace"
    backup_dist: NonNegativeLength = 0.30
    """How far it drives back at least."""
    retrace_dist: NonNegativeLength = 1.0
    """How far at most: beyond `backup_dist` only until it has room to turn in place."""
    backup_speed: PositiveSpeed = 0.15
    """How fast it drives back."""


class ClearCostmap(BehaviorSpec):
    """Forget live obstacles that are not seen any more."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:ClearCostmap"
    type: Literal["clear_costmap"] = "clear_costmap"
    clear_entirely: bool = True
    """Whether all of the global costmap is cleared, as in Nav2, or as much as the local one covers."""


_Behaviors = Annotated[
    Annotated[Spin, Tag("spin")]
    | Annotated[Wait, Tag("wait")]
    | Annotated[BackUp, Tag("backup")]
    | Annotated[Retrace, Tag("retrace")]
    | Annotated[ClearCostmap, Tag("clear_costmap")],
    Field(discriminator="type"),
]


_NamedOrWhole = Annotated[
    Annotated[RecoveryBehavior, Tag("a name")] | Annotated[_Behaviors, Tag("a behavior")],
    Discriminator(lambda value: "a name" if isinstance(value, str) else "a behavior"),
]


Behavior = Annotated[str | BehaviorSpec, ExtensibleUnion("behavior", _NamedOrWhole, named=True)]


class Recovery(Spec):
    """Behaviors of Nav2's default tree, taken in turn when planning or control fails."""

    number_of_retries: Annotated[int, Field(ge=0, le=100)] = 6
    """How often a goal is tried again before it fails."""
    retries_since_progress: bool = False
    """Whether that is counted anew, and the first behavior is next, once the robot is a meter nearer to its goal than
    at any recovery before. Nav2 counts for the whole goal."""
    planner_codes: Annotated[list[PlannerCode], Field(max_length=20)] = [
        "PLANNER_UNKNOWN",
        "PLANNER_TIMEOUT",
        "NO_VALID_PATH",
    ]
    """Planner failures after which recovery is tried (WouldAPlannerRecoveryHelp); after others the goal fails at once.
    The advanced stack adds START_OUTSIDE_MAP, START_OCCUPIED and GOAL_OCCUPIED."""
    behaviors: Annotated[list[Behavior], Field(max_length=20)] = [
        "clear_costmap",
        "spin",
        "wait",
        "backup",
    ]
    """What is done in turn, by name or with parameters of its own."""
    clear_entirely: bool = True
    """Whether all of the global costmap is cleared each time, as in Nav2. With false only as much as the local costmap
    covers, and more and more rarely when planning fails: a dead end that is forgotten is driven into again."""
    spin_dist: Angle = 1.57
    """How far it turns."""
    wait_duration: Duration = 5.0
    """How long it waits."""
    backup_dist: NonNegativeLength = 0.30
    """How far it backs up."""
    backup_speed: PositiveSpeed = 0.15
    """How fast it backs up."""
    backup_partial: bool = False
    """Whether it backs up as far as there is room, if that is less. Nav2 does not."""
    retrace_dist: NonNegativeLength = 1.0
    """How far it drives back the way it came: beyond `backup_dist` only until it has room to turn in place."""
    simulate_ahead_time: PositiveDuration = 2.0
    """How far ahead it looks for collisions."""
    max_rotational_vel: PositiveAngularSpeed = 1.0
    """Greatest turn rate of a spin."""

    @property
    def names(self) -> list[str]:
        """What the behaviors are called, in turn."""
        return [entry if isinstance(entry, str) else entry.type for entry in self.behaviors]

    def chosen(self) -> list[BehaviorSpec]:
        """The behaviors in turn; each takes what it does not say itself from the parameters of the same name here."""
        return [self._completed(entry) for entry in self.behaviors]

    def _completed(self, entry: str | BehaviorSpec) -> BehaviorSpec:
        model = _SHIPPED[entry] if isinstance(entry, str) else type(entry)
        shared = type(self).model_fields.keys() & model.model_fields.keys()
        own = {} if isinstance(entry, str) else {name: getattr(entry, name) for name in entry.model_fields_set}
        return model.model_validate({**{name: getattr(self, name) for name in sorted(shared)}, **own})


_SHIPPED: dict[str, type[BehaviorSpec]] = {
    "clear_costmap": ClearCostmap,
    "spin": Spin,
    "wait": Wait,
    "backup": BackUp,
    "retrace": Retrace,
}


_HERE = "simscen.model.recovery:"
BEHAVIORS = {
    "clear_costmap": _HERE + "ClearCostmap",
    "spin": _HERE + "Spin",
    "wait": _HERE + "Wait",
    "backup": _HERE + "BackUp",
    "retrace": _HERE + "Retrace",
}
