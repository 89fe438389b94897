"""Base class of conditions, combinations of conditions, and the trigger (`when` in YAML) of an event or a fault."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.spec.base import LazySpec
from simscen.spec.choice import Choice
from simscen.spec.places import RobotName
from simscen.spec.quantities import Duration, PositiveDuration, Probability

if TYPE_CHECKING:
    from simscen.core.stage import Situation


class Condition(ABC):
    """Condition on the state of the run. Has no state itself and draws no random numbers."""

    is_robot_specific: ClassVar[bool] = True
    """Whether a scenario with several robots must name the robot of this condition (key `robot`)."""

    @abstractmethod
    def holds(self, now: Situation) -> bool:
        """Return whether the condition is true in the current situation."""


class AnyCondition(Choice):
    """One condition, chosen by its YAML key, or a combination of conditions (`all`, `any`, `not`)."""

    group: ClassVar[str] = "trigger"
    """Registry group in which installed packages can add conditions."""
    modifiers: ClassVar[frozenset[str]] = frozenset({"for_", "robot"})
    """Fields that can be combined with any condition."""

    time: Annotated[Condition | None, LazySpec("simscen.triggers.timing", "Time")] = None
    robot_within: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "RobotWithin")] = None
    robot_in: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "RobotIn")] = None
    travelled: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "HasTravelled")] = None
    speed_below: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "SpeedBelow")] = None
    speed_above: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "SpeedAbove")] = None
    distance_remaining: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "DistanceRemaining")] = (
        None
    )
    believed_distance_remaining: Annotated[
        Condition | None, LazySpec("simscen.triggers.robot_state", "BelievedDistanceRemaining")
    ] = None
    turning_below: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "TurningBelow")] = None
    turning_above: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "TurningAbove")] = None
    clearance_below: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "ClearanceBelow")] = None
    scan_age: Annotated[Condition | None, LazySpec("simscen.triggers.timing", "ScanAge")] = None
    localization_error: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "LocalizationError")] = (
        None
    )
    localization_lost: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "LocalizationLost")] = None
    goal: Annotated[Condition | None, LazySpec("simscen.triggers.events", "GoalStatus")] = None
    waypoint: Annotated[Condition | None, LazySpec("simscen.triggers.events", "Waypoint")] = None
    replan: Annotated[Condition | None, LazySpec("simscen.triggers.events", "Replan")] = None
    recovery: Annotated[Condition | None, LazySpec("simscen.triggers.events", "RecoveryStatus")] = None
    collision: Annotated[Condition | None, LazySpec("simscen.triggers.events", "HasCollided")] = None
    pedestrian: Annotated[Condition | None, LazySpec("simscen.triggers.events", "PedestrianStatus")] = None
    event: Annotated[Condition | None, LazySpec("simscen.triggers.events", "EventStatus")] = None
    all: Annotated[list[AnyCondition], Field(min_length=1, max_length=50)] | None = None
    """True while all of these conditions are true."""
    any: Annotated[list[AnyCondition], Field(min_length=1, max_length=50)] | None = None
    """True while at least one of these conditions is true."""
    not_: AnyCondition | None = Field(default=None, alias="not")
    """True while this condition is false."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """Time for which the condition must be true without interruption before it counts as true; default: none."""
    robot: RobotName | None = None
    """Name of the robot whose state the condition tests, in a scenario with several robots."""

    @property
    def operands(self) -> list[AnyCondition]:
        """The conditions under `all`, `any`, or `not`; [] for a single condition."""
        return self.all or self.any or ([self.not_] if self.not_ is not None else [])

    def walk(self) -> Iterator[AnyCondition]:
        """Yield this condition and all nested conditions, at any depth."""
        yield self
        for operand in self.operands:
            yield from operand.walk()

    def situation_of_robot(self, now: Situation) -> Situation:
        """Return the situation of the robot that `robot` names; `now` itself if `robot` is None."""
        return now if self.robot is None else now.of(self.robot)

    def holds(self, now: Situation) -> bool:
        """Return whether the condition is true in the current situation, without `for` (see ConditionState).

        Raises RunError if a condition of a plug-in does not return a boolean.
        """
        now = self.situation_of_robot(now)
        if self.all is not None:
            return all(condition.holds(now) for condition in self.all)
        if self.any is not None:
            return any(condition.holds(now) for condition in self.any)
        if self.not_ is not None:
            return not self.not_.holds(now)
        condition = self.chosen
        assert isinstance(condition, Condition)
        result: object = condition.holds(now)
        if not isinstance(result, bool | np.bool_):
            message = f"a condition returned {result!r} instead of True or False{self.plugin_suffix}"
            raise RunError(BROKEN_COMPONENT, message)
        return bool(result)


class Trigger(AnyCondition):
    """Condition that starts an event or a fault when it becomes true; with `edge: falling`, when it becomes false."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"for_", "robot", "edge", "delay", "times", "probability"})

    edge: Literal["rising", "falling"] = "rising"
    """Start the event or fault when the condition becomes true (rising edge) or false (falling edge)."""
    delay: Duration = 0.0
    """Delay between the edge and the start."""
    times: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Maximum number of starts. An edge during an active fault counts as a start, but has no effect."""
    probability: Probability = 1.0
    """Probability that an edge starts the event or fault. The random draw depends on the seed."""
