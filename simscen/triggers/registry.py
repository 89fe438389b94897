"""Registry of the trigger conditions, their combinations, and `when`."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.spec.choice import Choice
from simscen.spec.lazy import LazySpec
from simscen.spec.places import RobotName
from simscen.spec.quantities import Duration, PositiveDuration, Probability
from simscen.triggers.base import Condition

if TYPE_CHECKING:
    from simscen.core.stage import Situation


class Test(Choice):
    """One condition, or several combined."""

    group: ClassVar[str] = "trigger"
    modifiers: ClassVar[frozenset[str]] = frozenset({"for_", "robot"})

    time: Annotated[Condition | None, LazySpec("simscen.triggers.timing", "Time")] = None
    robot_within: Annotated[Condition | None, LazySpec("simscen.triggers.position", "RobotWithin")] = None
    robot_in: Annotated[Condition | None, LazySpec("simscen.triggers.position", "RobotIn")] = None
    travelled: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "Travelled")] = None
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
    clearance_below: Annotated[Condition | None, LazySpec("simscen.triggers.position", "ClearanceBelow")] = None
    scan_age: Annotated[Condition | None, LazySpec("simscen.triggers.timing", "ScanAge")] = None
    localization_error: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "LocalizationError")] = (
        None
    )
    localization_lost: Annotated[Condition | None, LazySpec("simscen.triggers.robot_state", "LocalizationLost")] = None
    goal: Annotated[Condition | None, LazySpec("simscen.triggers.events", "GoalStatus")] = None
    waypoint: Annotated[Condition | None, LazySpec("simscen.triggers.events", "Waypoint")] = None
    replan: Annotated[Condition | None, LazySpec("simscen.triggers.events", "Replan")] = None
    recovery: Annotated[Condition | None, LazySpec("simscen.triggers.events", "RecoveryStatus")] = None
    collision: Annotated[Condition | None, LazySpec("simscen.triggers.events", "Collided")] = None
    pedestrian: Annotated[Condition | None, LazySpec("simscen.triggers.events", "PedestrianStatus")] = None
    event: Annotated[Condition | None, LazySpec("simscen.triggers.events", "EventStatus")] = None
    all: Annotated[list["Test"], Field(min_length=1, max_length=50)] | None = None
    """True while all of these are."""
    any: Annotated[list["Test"], Field(min_length=1, max_length=50)] | None = None
    """True while at least one of these is."""
    not_: "Test | None" = Field(default=None, alias="not")
    """True while this is not."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """Count it as true only once it has been true for this long without a break; default: at once."""
    robot: RobotName | None = None
    """Which of several robots it is about; default: the only one."""

    @property
    def inner(self) -> "list[Test]":
        """The conditions that this one combines; none where it is a single one."""
        return self.all or self.any or ([self.not_] if self.not_ is not None else [])

    def parts(self) -> "Iterator[Test]":
        """This condition, then all that are in it."""
        yield self
        for test in self.inner:
            yield from test.parts()

    def seen(self, now: "Situation") -> "Situation":
        """The situation of the robot that it is about."""
        return now if self.robot is None else now.of(self.robot)

    def holds(self, now: "Situation") -> bool:
        """Whether the condition is true at this beat; how long it has been (`for`) is not its to know."""
        now = self.seen(now)
        if self.all is not None:
            return all_hold(self.all, now)
        if self.any is not None:
            return any_holds(self.any, now)
        if self.not_ is not None:
            return not self.not_.holds(now)
        condition = self.chosen
        assert isinstance(condition, Condition)
        answer: object = condition.holds(now)
        if not isinstance(answer, bool | np.bool_):
            raise RunError(BROKEN_COMPONENT, f"a condition says neither True nor False, but {answer!r}{self.added_by}")
        return bool(answer)


def all_hold(tests: list[Test], now: "Situation") -> bool:
    """Conjunction."""
    return all(test.holds(now) for test in tests)


def any_holds(tests: list[Test], now: "Situation") -> bool:
    """Disjunction."""
    return any(test.holds(now) for test in tests)


class Trigger(Test):
    """A condition, and how it makes an event start."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"for_", "robot", "edge", "delay", "times", "probability"})

    edge: Literal["rising", "falling"] = "rising"
    """Start when the condition becomes true (rising) or stops being true (falling)."""
    delay: Duration = 0.0
    """Start this long after the edge."""
    times: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Start at most so often."""
    probability: Probability = 1.0
    """The chance that an edge counts, drawn from the scenario's seed."""
