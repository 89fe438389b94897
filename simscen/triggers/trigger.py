"""The list of triggers: a new one is one file and one line here."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.core.stage import Situation
from simscen.spec.base import Choice
from simscen.spec.quantities import Duration, Probability
from simscen.triggers.base import Condition
from simscen.triggers.goal import GoalStatus
from simscen.triggers.happened import Collided, EventStatus, RecoveryStatus, Replan
from simscen.triggers.motion import DistanceRemaining, LocalizationError, SpeedAbove, SpeedBelow
from simscen.triggers.robot_in import RobotIn
from simscen.triggers.robot_within import RobotWithin
from simscen.triggers.time import Time
from simscen.triggers.travelled import Travelled


class Test(Choice):
    """One condition, or several combined."""

    time: Time | None = None
    robot_within: RobotWithin | None = None
    robot_in: RobotIn | None = None
    travelled: Travelled | None = None
    speed_below: SpeedBelow | None = None
    speed_above: SpeedAbove | None = None
    distance_remaining: DistanceRemaining | None = None
    localization_error: LocalizationError | None = None
    goal: GoalStatus | None = None
    replan: Replan | None = None
    recovery: RecoveryStatus | None = None
    collision: Collided | None = None
    event: EventStatus | None = None
    all: Annotated[list["Test"], Field(min_length=1, max_length=50)] | None = None
    """True while all of these are."""
    any: Annotated[list["Test"], Field(min_length=1, max_length=50)] | None = None
    """True while at least one of these is."""
    not_: "Test | None" = Field(default=None, alias="not")
    """True while this is not."""

    def holds(self, now: Situation) -> bool:
        """Whether the condition is true at this beat."""
        if self.all is not None:
            return all_hold(self.all, now)
        if self.any is not None:
            return any_holds(self.any, now)
        if self.not_ is not None:
            return not self.not_.holds(now)
        condition = self.chosen
        assert isinstance(condition, Condition)
        return condition.holds(now)


def all_hold(tests: list[Test], now: Situation) -> bool:
    """Conjunction."""
    return all(test.holds(now) for test in tests)


def any_holds(tests: list[Test], now: Situation) -> bool:
    """Disjunction."""
    return any(test.holds(now) for test in tests)


class Trigger(Test):
    """A condition, and how it makes an event start."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"edge", "delay", "times", "probability"})

    edge: Literal["rising", "falling"] = "rising"
    """Start when the condition becomes true (rising) or stops being true (falling)."""
    delay: Duration = 0.0
    """Start this long after the edge."""
    times: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Start at most so often."""
    probability: Probability = 1.0
    """The chance that an edge counts, drawn from the scenario's seed."""
