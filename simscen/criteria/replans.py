"""`replans`: how often the robot changed its plan."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, model_validator

from simscen.core.events import EventKind
from simscen.core.navigation import ReplanReason
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import counted
from simscen.spec.base import Spec

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace

Count = Annotated[int, Field(ge=0, le=100_000)]


class Replans(Spec, Criterion):
    """The robot replanned as often as it should.

    What is measured: the number of plans made for any reason but a new goal.
    When it fails: fewer than `min` or more than `max`.
    Why this: a scenario that drops a pallet on the plan proves nothing unless the robot had to plan again; and one
        that replans at every beat has no plan.
    Source: Nav2's navigate_to_pose_w_replanning trees.

    Example: `replans: {min: 1}`
    """

    min: Count | None = None
    """At least so often."""
    max: Count | None = None
    """At most so often."""
    reason: ReplanReason | None = None
    """Only plans made for this reason: the plan was `blocked`, the robot had left it (`missed`), an obstacle came too
    near (`tight`), obstacles went away (`better`), a mapless robot's `window` moved on, after a `recovery`, or at the
    planner's `rate`."""

    @model_validator(mode="after")
    def _some_bound(self) -> Replans:
        if self.min is None and self.max is None:
            raise ValueError("expected min or max")
        return self

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound."""
        plans = trace.of_kind(EventKind.PLAN_MADE)
        again = [plan for plan in plans if plan.data.get("reason", "goal") != "goal"]
        if self.reason is not None:
            again = [plan for plan in again if plan.data.get("reason") == self.reason]
        told = [f"t = {trace.seconds(plan.tick):.2f} s: {plan.data.get('reason', 'goal')}" for plan in plans[:8]]
        at = (trace, again[-1].tick) if again else None
        detail = told or ["no plan was ever made"]
        return counted("replans", len(again), "replan", self.min, self.max, at=at, detail=detail)
