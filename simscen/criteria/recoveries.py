"""`recoveries`: how often the robot had to help itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, model_validator

from simscen.core.events import EventKind
from simscen.core.navigation import RecoveryBehavior
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import counted
from simscen.spec.base import Spec

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace

Count = Annotated[int, Field(ge=0, le=100_000)]


class Recoveries(Spec, Criterion):
    """Recovery behaviours ran as often as they should.

    What is measured: the number of recovery behaviours that started.
    When it fails: fewer than `min` or more than `max`.
    Why this: a scenario about getting unstuck proves something only if the robot was stuck; in all others recoveries
        are the first sign of trouble.
    Source: Nav2's recovery node and behaviour server (spin, wait, backup, clear costmap).

    Example: `recoveries: {min: 1, name: spin}`
    """

    min: Count | None = None
    """At least so often."""
    max: Count | None = None
    """At most so often."""
    name: RecoveryBehavior | None = None
    """Only this behaviour."""

    @model_validator(mode="after")
    def _some_bound(self) -> Recoveries:
        if self.min is None and self.max is None:
            raise ValueError("expected min or max")
        return self

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound."""
        every = trace.of_kind(EventKind.RECOVERY_STARTED)
        counting = [start for start in every if self.name in (None, start.name)]
        told = [f"t = {trace.seconds(start.tick):.2f} s: {start.name}" for start in every[:8]]
        noun = "recovery" if self.name is None else f"{self.name} recovery"
        at = (trace, counting[-1].tick) if counting else None
        return counted("recoveries", len(counting), noun, self.min, self.max, at=at, detail=told)
