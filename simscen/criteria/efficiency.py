"""The criteria `time_to_goal` and `path_length`: the robot arrived in time and without detours."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import model_validator

from simscen.core.messages.goals import matches_goal_name
from simscen.core.records.events import EventKind
from simscen.core.records.verdict import Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, missed, undecided
from simscen.criteria.goal_outcomes import GoalOutcome, first_acceptance, goal_outcomes
from simscen.criteria.timeline import has_ended
from simscen.criteria.trace_signals.ground_truth import DrivenPath, drive
from simscen.spec.base import Spec
from simscen.spec.places import GoalName
from simscen.spec.quantities import PositiveDuration, PositiveLength, Ratio

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class TimeToGoal(Spec, Criterion):
    """The robot reached its goals in time.

    What is measured: the simulated time from the acceptance of the first goal to the report that the last goal is
        reached. With `goal`, the time from the acceptance of this goal to the report that it is reached. Goals that
        events send count as well. Preempted goals and goals that are expected to fail need not be reached.
    When it fails: the time is longer than `max`, or a goal was not reached.
    Why this: a robot that hesitates arrives too, but late. Use goals_reached to check the true position on arrival.
    Source: the time of the BARN challenge and of Nav2's own benchmarks (nav2#3239).

    Example: `time_to_goal: {max: 45 s}`
    """

    max: PositiveDuration
    """Maximum simulated time in seconds."""
    goal: GoalName | None = None
    """Measure the time of the goal with this name; default: the time of all goals together."""

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.NAVIGATION})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for all goals. With `goal`, return one finding for each goal of this name."""
        outcomes = goal_outcomes(trace, case)
        if self.goal is not None:
            chosen = [outcome for outcome in outcomes if matches_goal_name(outcome.goal.name, self.goal)]
            if not chosen:
                is_known = any(matches_goal_name(goal.name, self.goal) for goal in case.every_goal)
                because = "never sent" if is_known else f"the scenario has no goal `{self.goal}`"
                return [undecided(f"goal {self.goal}", because)]
            return [self._judge_time(trace, f"goal {each.goal.name}", each.accepted_tick, each) for each in chosen]
        if not outcomes:
            return [undecided("time_to_goal", "the scenario has no goals")]
        required = [outcome for outcome in outcomes if outcome.must_be_reached]
        if not required:
            return [undecided("time_to_goal", "every goal was preempted or is expected to fail")]
        unreached = [outcome for outcome in required if outcome.reached_tick is None]
        decisive = unreached[0] if unreached else required[-1]
        return [self._judge_time(trace, "time_to_goal", first_acceptance(outcomes), decisive)]

    def _judge_time(self, trace: Trace, what: str, start: int | None, outcome: GoalOutcome) -> Finding:
        """Return the finding for the time from the tick `start` until the goal was reached."""
        if outcome.expected_failure:
            return undecided(what, "the robot is expected to fail at this goal")
        expected = f"reached within {self.max:.2f} s"
        detail = [f"goal {outcome.goal.name}: {outcome.summary}"]
        if start is None:
            if outcome.end is None and has_ended(trace):
                return missed(what, "never reached", expected, (trace, trace.end), detail)
            return undecided(what, "the acceptance of the goal was not recorded", expected)
        if outcome.reached_tick is not None:
            elapsed = trace.seconds(outcome.reached_tick - start)
            return at_most(what, elapsed, self.max, "s", at=(trace, outcome.reached_tick))
        if outcome.was_preempted:
            return undecided(what, outcome.summary)
        so_far = trace.seconds(trace.end - start)
        if outcome.end is None and so_far > self.max:
            return at_most(what, so_far, self.max, "s", at=(trace, trace.end), detail=detail)
        if outcome.end is None and not has_ended(trace):
            return undecided(what, f"the log stops {so_far:.2f} s after the start, {outcome.summary}", expected)
        tick = trace.end if outcome.end is None else outcome.end.tick
        return missed(what, "never reached", expected, (trace, tick), detail)


class PathLength(Spec, Criterion):
    """The robot drove no farther than allowed.

    What is measured: the length of the robot's true path in the plane over the whole run, and the ratio of this length
        to the length of the shortest path. The path has a point whenever the robot is 1 cm from the last point, so that
        jitter does not count. Teleportation does not count. The shortest path is for a disc with the robot's inscribed
        radius, from the start through all goals. Goals that are expected to fail are left out.
    When it fails: the path is longer than `max`, or longer than `max_ratio` times the shortest path.
    Why this: detours and search patterns cost energy and time although every goal is reached.
    Source: HuNavSim and bench-mr for the length; SEAN's "path efficiency" for the ratio. SPL (Anderson 2018) is the
        inverse of the ratio, averaged over many runs.

    The ratio is inconclusive if the shortest path is unknown: if an event sent a goal or moved the robot (`kidnap`), if
    several goals have the same name, or if there is no path to a goal. It is also inconclusive if the shortest path has
    no length, or if a goal was not reached, unless the path is already too long.

    Example: `path_length: {max_ratio: 1.4}`
    """

    max: PositiveLength | None = None
    """Maximum length in meters."""
    max_ratio: Ratio | None = None
    """Maximum ratio to the shortest path; 1 is a drive along the shortest path."""

    @model_validator(mode="after")
    def _check_bounds(self) -> PathLength:
        if self.max is None and self.max_ratio is None:
            raise ValueError("expected max or max_ratio")
        return self

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.TRUTH})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each given bound: the length and the ratio. The margins of both are in m."""
        path = drive(trace)
        findings = [] if self.max is None else [_judge_length(trace, path, "path_length", self.max)]
        if self.max_ratio is not None:
            findings.append(self._judge_ratio(trace, case, path))
        return findings

    def _judge_ratio(self, trace: Trace, case: Case, path: DrivenPath) -> Finding:
        assert self.max_ratio is not None
        what = "path_length ratio"
        shortest, because = shortest_path_length(trace, case)
        if because:
            return undecided(what, because, f"≤ {self.max_ratio:g}")
        limit = self.max_ratio * shortest
        context = f"({self.max_ratio:g} times the shortest path of {shortest:.2f} m)"
        outcomes = goal_outcomes(trace, case)
        unreached = [each for each in outcomes if each.reached_tick is None and not each.expected_failure]
        if unreached and path.length <= limit:
            name = unreached[0].goal.name
            return undecided(what, f"goal {name} was not reached, so the path is incomplete", context)
        return _judge_length(trace, path, what, limit, context)


def shortest_path_length(trace: Trace, case: Case) -> tuple[float, str]:
    """Return the length in m of the shortest path through all goals, and the reason if it is unknown.

    The length is nan if it is unknown. The reason is "" if the length is known.
    """
    names = [goal.name for goal in case.goals if goal.name not in case.expected]
    repeated = sorted({name for name in names if names.count(name) > 1})
    unknown = [name for name in names if not math.isfinite(case.shortest.get(name, math.nan))]
    length = sum(case.shortest.get(name, math.nan) for name in names)
    sent = trace.of_kind(EventKind.GOAL_ACCEPTED)
    sent_by_events = sorted({event.name for event in sent} & {goal.name for goal in case.sent})
    if trace.of_kind(EventKind.ROBOT_PLACED):
        return math.nan, "an event moved the robot to another place"
    if sent_by_events:
        return math.nan, f"{', '.join(sent_by_events)} was sent by an event, from a position not known in advance"
    if repeated:
        return math.nan, f"several goals are called {', '.join(repeated)}, so their shortest paths are ambiguous"
    if unknown:
        return math.nan, f"no shortest path to {', '.join(unknown)} is known"
    return (length, "") if length > 0 else (math.nan, "the shortest path has no length")


def _judge_length(trace: Trace, path: DrivenPath, what: str, limit: float, context: str = "") -> Finding:
    """Return the finding for the length of a path. Its tick is the first one above the limit, or else the last one."""
    decisive = int(np.argmax(path.travelled > limit)) if path.length > limit else len(path.ticks) - 1
    at = (trace, int(path.ticks[decisive])) if len(path.ticks) else None
    return at_most(what, path.length, limit, "m", at=at, context=context)
