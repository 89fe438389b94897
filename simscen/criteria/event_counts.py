"""The criteria `replans` and `recoveries`, which count events."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field, model_validator

from simscen.core.messages.navigation import ReplanReason
from simscen.core.records.events import Event, EventKind
from simscen.core.records.verdict import Evidence, Finding, Status
from simscen.criteria.base import Criterion
from simscen.criteria.findings import MissingEvidence, counted, undecided
from simscen.criteria.timeline import has_ended
from simscen.criteria.trace_signals.event_readers import recoveries, replans
from simscen.spec.base import Spec
from simscen.spec.extensible_union import BehaviorName

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

Count = Annotated[int, Field(ge=0, le=100_000)]
"""Number of events."""
MAX_DETAILS = 8
"""Maximum number of events that a finding lists."""


class CountBounds(Spec):
    """Bounds on a number of events."""

    min: Count | None = None
    """Minimum number."""
    max: Count | None = None
    """Maximum number."""

    @model_validator(mode="after")
    def _check_bounds(self) -> CountBounds:
        if self.min is None and self.max is None:
            raise ValueError("expected min or max")
        if self.max is None and self.min == 0:
            raise ValueError("`min: 0` is always met; expected a larger min, or max")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min {self.min} is above max {self.max}, so no number is allowed")
        return self

    def judge_count(
        self, trace: Trace, what: str, noun: str, events: Sequence[Event], detail: Sequence[str]
    ) -> list[Finding]:
        """Return one finding for each bound on the number of `events`.

        `what` is the measured quantity, e.g. "replans". `noun` is the name of one event, e.g. "replan". `detail` are
        lines that explain a failure. In a truncated log, a number below `min` is inconclusive.
        """
        decisive = len(events) - 1 if self.max is None else min(self.max, len(events) - 1)
        at = (trace, events[decisive].tick) if events else None
        findings = counted(what, len(events), noun, self.min, self.max, at=at, detail=detail)
        if self.min is not None and findings[0].status is Status.FAIL and not has_ended(trace):
            findings[0] = undecided(what, f"{findings[0].measured} so far", findings[0].limit, detail)
        return findings


class Replans(CountBounds, Criterion):
    """The number of replans was within its bounds.

    What is measured: the number of plans that were made for another reason than a new goal.
    When it fails: the number is below `min` or above `max`.
    Why this: a scenario that drops a pallet on the plan proves something only if the robot had to replan. A robot that
        replans all the time does not follow any plan.
    Source: Nav2's navigate_to_pose_w_replanning trees.

    Inconclusive if an external stack reports plans without a reason, or reports a reached goal but no plan.

    Example: `replans: {min: 1}`
    """

    reason: ReplanReason | None = None
    """Count only plans that were made for this reason: `blocked` (the old plan was blocked), `missed` (the robot had
    left the old plan), `tight` (an obstacle had come too near to the old plan), `better` (obstacles had gone away),
    `window` (the local window of a robot without a map had moved), `recovery` (after a recovery), `rate` (periodic
    replanning), or `moving` (a moving obstacle would be on the old plan, with the advanced stack)."""

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.PLANNING})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each bound. Raises MissingEvidence if it is unknown why plans were computed."""
        counted_replans = [plan for plan in replans(trace) if self.reason in (None, plan.data["reason"])]
        plans = trace.of_kind(EventKind.PLAN_MADE)[:MAX_DETAILS]
        details = [f"t = {trace.seconds(plan.tick):.2f} s: {plan.data.get('reason', 'goal')}" for plan in plans]
        return self.judge_count(trace, "replans", "replan", counted_replans, details or ["no plan was ever made"])


class Recoveries(CountBounds, Criterion):
    """The number of recovery behaviors was within its bounds.

    What is measured: the number of recovery behaviors that started.
    When it fails: the number is below `min` or above `max`.
    Why this: a scenario about getting unstuck proves something only if the robot was stuck. In other scenarios,
        recoveries are the first sign of trouble.
    Source: Nav2's recovery node and behavior server (spin, wait, backup, clear costmap).

    Inconclusive if an external stack reports neither that it accepts a goal nor recoveries.

    Example: `recoveries: {min: 1, name: spin}`
    """

    name: BehaviorName | None = None
    """Count only the recovery behavior with this name."""

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.RECOVERIES})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each bound."""
        try:
            starts = recoveries(trace, case)
        except MissingEvidence as reason:
            return [undecided("recoveries", str(reason))]
        counted_starts = [start for start in starts if self.name in (None, start.name)]
        details = [f"t = {trace.seconds(start.tick):.2f} s: {start.name}" for start in starts[:MAX_DETAILS]]
        noun = "recovery" if self.name is None else f"{self.name} recovery"
        return self.judge_count(trace, "recoveries", noun, counted_starts, details)
