"""`recoveries`: how often the robot had to help itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.events import EventKind
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.counts import Counts
from simscen.spec.bytype import BehaviorName

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Recoveries(Counts, Criterion):
    """Recovery behaviours ran as often as they should.

    What is measured: the number of recovery behaviours that started.
    When it fails: fewer than `min` or more than `max`.
    Why this: a scenario about getting unstuck proves something only if the robot was stuck; in all others recoveries
        are the first sign of trouble.
    Source: Nav2's recovery node and behaviour server (spin, wait, backup, clear costmap).

    Example: `recoveries: {min: 1, name: spin}`
    """

    name: BehaviorName | None = None
    """Only this behaviour."""

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound."""
        every = trace.of_kind(EventKind.RECOVERY_STARTED)
        counting = [start for start in every if self.name in (None, start.name)]
        told = [f"t = {trace.seconds(start.tick):.2f} s: {start.name}" for start in every[:8]]
        noun = "recovery" if self.name is None else f"{self.name} recovery"
        return self.bound(trace, "recoveries", noun, counting, told)
