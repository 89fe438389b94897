"""The criteria `result`, `error_code`, and `no_false_success`, which judge the reported result of navigation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal

from simscen.core.messages.goals import matches_goal_name
from simscen.core.records.events import GOAL_END_KINDS, Event, EventKind
from simscen.core.records.verdict import POSITION_EVIDENCE, Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.error_codes import ErrorCodeValue, error_code_name, has_error_code
from simscen.criteria.findings import at_most, held, missed, undecided
from simscen.criteria.goal_outcomes import GoalOutcome, closest_approach, goal_outcomes, outcome_start
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.ground_truth import true_pose
from simscen.spec.base import Spec
from simscen.spec.places import GoalName
from simscen.spec.quantities import PositiveLength

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class Result(Spec, Criterion):
    """Navigation ended with the required result, for example a failure.

    What is measured: the result that the robot reports at the end of navigation, and its error code.
    When it fails: the result or the error code is not the required one, or the run ended without a result.
    Why this: a robot must reject a goal inside an obstacle with the correct error code.
    Source: nav2_simple_commander's TaskResult; the error codes of nav2_msgs' actions.

    Example: `result: {status: FAILED, error_code: GOAL_OCCUPIED}`
    """

    status: Literal["SUCCEEDED", "FAILED", "CANCELED"]
    """Required result."""
    error_code: ErrorCodeValue | None = None
    """Required error code of Nav2, by name or number."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        codes = set() if self.error_code is None else {Evidence.ERROR_CODES}
        return frozenset({Evidence.NAVIGATION, *codes})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for the result, and one for the error code if one is required."""
        end = _last(trace, EventKind.NAVIGATION_ENDED)
        if end is None:
            return [_missing_result(trace, "result", self.status)]
        findings = [_compare(trace, end, "result", end.name, self.status)]
        if self.error_code is not None:
            findings.append(_compare(trace, end, "error code", error_code_name(end), self.error_code.name))
        return findings


class ErrorCodeIs(Spec, Criterion):
    """The robot reported the required error code, for a goal or for the whole navigation.

    What is measured: the error code of the last report about the goal or, without `goal`, of the end of navigation.
    When it fails: the error code is not the required one, or the run ended without a report.
    Why this: with several goals, the end of navigation has the error code of only one of them.
    Source: the error codes of nav2_msgs' actions.

    Example: `error_code: {code: NO_VALID_PATH, goal: shelf}`
    """

    code: ErrorCodeValue
    """Required error code of Nav2, by name or number; NONE for no error."""
    goal: GoalName | None = None
    """Name of the goal; default: the whole navigation."""

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.NAVIGATION, Evidence.ERROR_CODES})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding."""
        kinds = [EventKind.NAVIGATION_ENDED] if self.goal is None else GOAL_END_KINDS
        what = "error code" if self.goal is None else f"error code of goal {self.goal}"
        end = _last(trace, *kinds, name=self.goal)
        if end is None:
            return [_missing_result(trace, what, self.code.name)]
        return [_compare(trace, end, what, error_code_name(end), self.code.name)]


def _last(trace: Trace, *kinds: EventKind, name: str | None = None) -> Event | None:
    """Return the last event of these kinds that belongs to the goal `name`; None if there is no such event.

    If `name` is None, events with any name count.
    """
    events = [event for event in trace.of_kind(*kinds) if matches_goal_name(event.name, name)]
    return events[-1] if events else None


def _compare(trace: Trace, end: Event, what: str, reported: str, expected: str) -> Finding:
    """Return a finding that passes if `reported`, a text from the event `end`, is the expected text."""
    if reported == expected:
        return held(what, reported, expected, (trace, end.tick))
    message = end.data.get("message")
    code = f", {error_code_name(end)}" if has_error_code(end) else ""
    details = [f"it ended with {end.name}{code}"] + ([str(message)] if message else [])
    return missed(what, reported, expected, (trace, end.tick), details)


def _missing_result(trace: Trace, what: str, expected: str) -> Finding:
    """Return a failed finding for a result that was never reported; inconclusive if the log is truncated."""
    when = f"t = {trace.seconds(trace.end):.2f} s"
    if has_ended(trace):
        detail = [f"the run ended at {when}: {end_reason(trace)}"]
        return missed(what, "no result", expected, (trace, trace.end), detail)
    return undecided(what, f"the log stops at {when}, before navigation ended", expected)


class NoFalseSuccess(Spec, Criterion):
    """The robot did not report a false success. A reported failure is allowed.

    What is measured: the true distance to each goal when the robot reports the goal as reached; for a via pose, the
        distance at the closest approach. When the robot reports that navigation SUCCEEDED, also whether every goal was
        reached, except goals that were preempted or are expected to fail.
    When it fails: the robot was farther than `tolerance` from a goal that it reported as reached, or it reported
        SUCCEEDED although a goal was not reached.
    Why this: a failed delivery is repeated, but a false success remains unnoticed. Arena, for example, reports
        GOAL_REACHED without ever checking the goal.
    Source: BARN challenge, run.py, for the default tolerance of 1 m.

    Example: `no_false_success: {tolerance: 0.5 m}`
    """

    tolerance: PositiveLength = 1.0
    """True distance from the goal above which a reported success is false."""

    evidence: ClassVar[frozenset[Evidence]] = POSITION_EVIDENCE | {Evidence.NAVIGATION}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return findings for all goals that were reported as reached, and for all false reports of SUCCEEDED."""
        outcomes = goal_outcomes(trace, case)
        ends = trace.of_kind(EventKind.NAVIGATION_ENDED)
        names = {goal.name for goal in case.every_goal}
        arrivals = trace.of_kind(EventKind.GOAL_REACHED, EventKind.GOAL_PASSED)
        unknown = [event for event in arrivals if event.name not in names]
        if not ends and not unknown and all(outcome.end is None for outcome in outcomes):
            return [undecided("no_false_success", "the robot reported nothing that could be false")]
        arrived = [outcome for outcome in outcomes if outcome.reached_tick is not None]
        findings = [self._judge_goal(trace, outcome, outcomes) for outcome in arrived]
        findings += [
            undecided(f"goal {event.name}", "reported as reached, but the scenario has no such goal")
            for event in unknown
        ]
        findings += [finding for k in range(len(ends)) if (finding := _judge_success(trace, case, outcomes, ends, k))]
        return findings or [held("no_false_success", "no success was claimed", "no false success")]

    def _judge_goal(self, trace: Trace, outcome: GoalOutcome, outcomes: list[GoalOutcome]) -> Finding:
        """Return the finding for the true distance from a goal that the robot reported as reached or passed."""
        assert outcome.reached_tick is not None
        if outcome.goal.via:
            tick, distance = closest_approach(trace, outcome, outcomes)
            context = "from the via pose at the closest approach (reported as passed)"
        else:
            tick = outcome.reached_tick
            distance = true_pose(trace, tick).distance(outcome.goal.pose)
            context = "from the goal when the robot reported it as reached"
        return at_most(f"goal {outcome.goal.name}", distance, self.tolerance, "m", at=(trace, tick), context=context)


def _judge_success(
    trace: Trace, case: Case, outcomes: list[GoalOutcome], ends: tuple[Event, ...], k: int
) -> Finding | None:
    """Return a failed finding if the robot falsely reported SUCCEEDED at the k-th of the `ends` of navigation.

    The report is false if a goal since the previous end of navigation was not reached. The first end of navigation
    covers all goals of the scenario. Return None if the report is true, or if the robot did not report SUCCEEDED.
    """
    end = ends[k]
    if end.name != "SUCCEEDED":
        return None
    unreached = [
        outcome
        for outcome in outcomes
        if (_end_index(outcome, ends) == k or (k == 0 and outcome.goal in case.goals))
        and outcome.must_be_reached
        and (outcome.reached_tick is None or outcome.reached_tick > end.tick)
    ]
    if not unreached:
        return None
    names = ", ".join(outcome.goal.name for outcome in unreached)
    expected = "SUCCEEDED only with every goal reached"
    return missed("result", "SUCCEEDED", expected, (trace, end.tick), [f"not reached: {names}"])


def _end_index(outcome: GoalOutcome, ends: tuple[Event, ...]) -> int | None:
    """Return the index of the end of navigation to which a goal belongs; None if there is no such end.

    A goal belongs to the first of `ends` that is later than the acceptance of the goal, or not earlier than its end.
    """
    end_tick = math.inf if outcome.end is None else outcome.end.tick
    return next((k for k, end in enumerate(ends) if outcome_start(outcome) < end.tick or end_tick <= end.tick), None)
