"""Efficiency of a drive: `time_to_goal` and `path_length`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from pydantic import model_validator

from simscen.core.messages.navigation import matches_goal_name
from simscen.core.records.events import EventKind
from simscen.core.records.verdict import Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, missed, undecided
from simscen.criteria.goal_outcomes import GoalOutcome, goal_outcomes
from simscen.criteria.timeline import has_ended
from simscen.criteria.trace_signals.ground_truth import Drive, drive
from simscen.spec.base import Spec
from simscen.spec.places import GoalName
from simscen.spec.quantities import PositiveDuration, PositiveLength, Ratio

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class TimeToGoal(Spec, Criterion):
    """The robot was at its goal in time.

    What is measured: simulated time from the first goal's acceptance to the report that the last one is reached; with
        `goal`, from that goal's acceptance to the report that it is reached. Goals that events send count too; those
        that they preempt, and goals that are expected to fail, need not be reached.
    When it fails: it took longer, or the goal was never reached.
    Why this: a robot that hesitates arrives, too. Use goals_reached to check the true arrival.
    Source: the time of the BARN challenge and of Nav2's own benchmarks (nav2#3239).

    Example: `time_to_goal: {max: 45 s}`
    """

    max: PositiveDuration
    """Maximum simulated time in seconds."""
    goal: GoalName | None = None
    """Measure only this goal; default: all goals."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        return frozenset({Evidence.NAVIGATION})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding, or one for each goal with the same name."""
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
        """Return the finding for a goal without an acceptance. A log that starts later can contain the arrival."""
        expected = f"to be there within {self.max:.2f} s"
        if outcome.end is None and has_ended(trace):
            return missed(
                what, "never reached", expected, (trace, trace.end), [f"goal {outcome.goal.name}: {outcome.summary}"]
            )
        return undecided(what, "when its goal was accepted was not recorded", expected)


class PathLength(Spec, Criterion):
    """The robot drove no further than it should.

    What is measured: the length of the true path in the plane, in moves of at least 1 cm, over the whole run; its ratio
        to the shortest path of a disc with the robot's inscribed radius from the start through all goals, except
        those at which the robot is expected to fail.
    When it fails: it is longer than `max`, or than `max_ratio` times the shortest path.
    Why this: detours and search patterns cost energy and time although every goal is reached.
    Source: HuNavSim and bench-mr for the length; SEAN's "path efficiency" is this ratio. SPL (Anderson 2018) is its
        inverse over many runs.

    Example: `path_length: {max_ratio: 1.4}`
    """

    max: PositiveLength | None = None
    """Maximum length in meters."""
    max_ratio: Ratio | None = None
    """Maximum multiple of the shortest path; 1 is a perfect drive."""

    @model_validator(mode="after")
    def _some_bound(self) -> PathLength:
        if self.max is None and self.max_ratio is None:
            raise ValueError("expected max or max_ratio")
        return self

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        return frozenset({Evidence.TRUTH})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return findings for the length and for the ratio, both with margins in m."""
        way = drive(trace)
        findings = [] if self.max is None else [_bound(trace, way, "path_length", self.max)]
        if self.max_ratio is not None:
            findings.append(self._ratio(trace, case, way))
        return findings

    def _ratio(self, trace: Trace, case: Case, way: Drive) -> Finding:
        assert self.max_ratio is not None
        what = "path_length ratio"
        shortest, because = shortest_way(trace, case)
        if because:
            return undecided(what, because, f"≤ {self.max_ratio:g}")
        limit = self.max_ratio * shortest
        context = f"({self.max_ratio:g} times the shortest way of {shortest:.2f} m)"
        unreached = [
            outcome for outcome in goal_outcomes(trace, case) if outcome.reached is None and not outcome.failure
        ]
        if unreached and way.length <= limit:
            name = unreached[0].goal.name
            return undecided(what, f"goal {name} was not reached, so there is no whole way to compare", context)
        return _bound(trace, way, what, limit, context)


def shortest_way(trace: Trace, case: Case) -> tuple[float, str]:
    """Return the length in m of the shortest path through all goals, or nan and the reason why there is none."""
    names = [goal.name for goal in case.goals if goal.name not in case.expected]
    twice = sorted({name for name in names if names.count(name) > 1})
    without = [name for name in names if not math.isfinite(case.shortest.get(name, math.nan))]
    length = sum(case.shortest.get(name, math.nan) for name in names)
    sent = trace.of_kind(EventKind.GOAL_ACCEPTED)
    on_the_way = sorted({event.name for event in sent} & {goal.name for goal in case.sent})
    if on_the_way:
        return math.nan, f"{', '.join(on_the_way)} was sent on the way, from where nobody could know before"
    if twice:
        return math.nan, f"several goals are called {', '.join(twice)}: their shortest ways cannot be told apart"
    if without:
        return math.nan, f"no shortest way to {', '.join(without)} is known"
    return (length, "") if length > 0 else (math.nan, "the shortest way has no length")


def _bound(trace: Trace, way: Drive, what: str, limit: float, context: str = "") -> Finding:
    over = int(np.argmax(way.travelled > limit)) if way.length > limit else len(way.ticks) - 1
    at = (trace, int(way.ticks[over])) if len(way.ticks) else None
    return at_most(what, way.length, limit, "m", at=at, context=context)
