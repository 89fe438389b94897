"""`replans`: how often the robot changed its plan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.events import EventKind
from simscen.core.navigation import ReplanReason
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.counts import Counts

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Replans(Counts, Criterion):
    """The robot replanned as often as it should.

    What is measured: the number of plans made for any reason but a new goal.
    When it fails: fewer than `min` or more than `max`.
    Why this: a scenario that drops a pallet on the plan proves nothing unless the robot had to plan again; and one
        that replans at every beat has no plan.
    Source: Nav2's navigate_to_pose_w_replanning trees.

    Example: `replans: {min: 1}`
    """

    reason: ReplanReason | None = None
    """Only plans made for this reason: the plan was `blocked`, the robot had left it (`missed`), an obstacle came too
    near (`tight`), obstacles went away (`better`), a mapless robot's `window` moved on, after a `recovery`, or at the
    planner's `rate`."""

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound."""
        plans = trace.of_kind(EventKind.PLAN_MADE)
        again = [plan for plan in plans if plan.data.get("reason", "goal") != "goal"]
        if self.reason is not None:
            again = [plan for plan in again if plan.data.get("reason") == self.reason]
        told = [f"t = {trace.seconds(plan.tick):.2f} s: {plan.data.get('reason', 'goal')}" for plan in plans[:8]]
        return self.bound(trace, "replans", "replan", again, told or ["no plan was ever made"])
