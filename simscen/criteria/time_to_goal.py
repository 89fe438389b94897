"""`time_to_goal`: how long the drive took."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.messages.goal_names import matches_goal_name
from simscen.core.records.evidence import Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, missed, undecided
from simscen.criteria.goal_outcomes import GoalOutcome, goal_outcomes
from simscen.criteria.timeline import has_ended
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveDuration
from simscen.spec.references import GoalName

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class TimeToGoal(Spec, Criterion):
    """The robot was at its goal in time.

    What is measured: simulated time from the first goal's acceptance to the report that the last one is reached; with
        `goal`, from that goal's acceptance to the report that it is reached. Goals that events send count too; those
        that they preempt, and goals that are expected to fail, need not be reached.
    When it fails: it took longer, or the goal was never reached.
    Why this: a robot that dithers arrives, too. That it truly arrived is what goals_reached asks.
    Source: the time of the BARN challenge and of Nav2's own benchmarks (nav2#3239).

    Example: `time_to_goal: {max: 45 s}`
    """

    max: PositiveDuration
    """Seconds of simulated time."""
    goal: GoalName | None = None
    """Of this goal alone; default: of the whole tour."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return frozenset({Evidence.NAVIGATION})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding; one for each goal if several share the name."""
        told = goal_outcomes(trace, case)
        if self.goal is not None:
            own = [outcome for outcome in told if matches_goal_name(outcome.goal.name, self.goal)]
            if not own:
                known = any(matches_goal_name(goal.name, self.goal) for goal in case.every_goal)
                because = "never sent" if known else f"the scenario has no goal `{self.goal}`"
                return [undecided(f"goal {self.goal}", because)]
            return [self._timed(trace, f"goal {outcome.goal.name}", outcome.accepted, outcome) for outcome in own]
        if not told:
            return [undecided("time_to_goal", "the scenario has no goals")]
        start = next((outcome.accepted for outcome in told if outcome.accepted is not None), None)
        awaited = [outcome for outcome in told if outcome.must_be_reached]
        if not awaited:
            return [undecided("time_to_goal", "every goal was preempted, or is to fail")]
        unreached = [outcome for outcome in awaited if outcome.reached is None]
        return [self._timed(trace, "time_to_goal", start, unreached[0] if unreached else awaited[-1])]

    def _timed(self, trace: Trace, what: str, start: int | None, outcome: GoalOutcome) -> Finding:
        if outcome.failure:
            return undecided(what, "the robot is to fail there, not to arrive")
        if start is None:
            return self._never_begun(trace, what, outcome)
        if outcome.reached is not None:
            return at_most(what, trace.seconds(outcome.reached - start), self.max, "s", at=(trace, outcome.reached))
        if outcome.preempted:
            return undecided(what, outcome.summary)
        expected = f"to be there within {self.max:.2f} s"
        so_far = trace.seconds(trace.end - start)
        if outcome.end is None and so_far > self.max:
            return at_most(
                what,
                so_far,
                self.max,
                "s",
                at=(trace, trace.end),
                detail=[f"goal {outcome.goal.name}: {outcome.summary}"],
            )
        if outcome.end is None and not has_ended(trace):
            return undecided(what, f"the log stops {so_far:.2f} s after the start, {outcome.summary}", expected)
        tick = trace.end if outcome.end is None else outcome.end.tick
        fate = f"goal {outcome.goal.name}: {outcome.summary}"
        return missed(what, "never reached", expected, (trace, tick), [fate])

    def _never_begun(self, trace: Trace, what: str, outcome: GoalOutcome) -> Finding:
        """Without an acceptance no clock runs; a log that begins later may still hold the arrival."""
        expected = f"to be there within {self.max:.2f} s"
        if outcome.end is None and has_ended(trace):
            return missed(
                what, "never reached", expected, (trace, trace.end), [f"goal {outcome.goal.name}: {outcome.summary}"]
            )
        return undecided(what, "when its goal was accepted was not recorded", expected)
