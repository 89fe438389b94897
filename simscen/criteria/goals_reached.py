"""The criterion `goals_reached`: the true pose of the robot at its goals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry import wrap
from simscen.core.messages.goals import FAILED, matches_goal_name
from simscen.core.records.verdict import POSITION_EVIDENCE, Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_least, at_most, held, missed, undecided
from simscen.criteria.goal_outcomes import GoalOutcome, closest_approach, goal_outcomes, outcome_start
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.ground_truth import check_samples, true_pose
from simscen.spec.base import Spec
from simscen.spec.places import GoalName
from simscen.spec.quantities import NonNegativeAngle, NonNegativeLength, PositiveAngle, PositiveDuration, PositiveLength

if TYPE_CHECKING:
    from simscen.core.messages.goals import Goal
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class GoalsReached(Spec, Criterion):
    """Every goal was reached: the robot reported the goal as reached, and its true pose was then at the goal.

    A goal with `expect` must fail as expected instead. With navigate_through_poses, the robot must pass close to the
    poses, with any heading. After a goal with `on_reached: {wait: …}`, it must wait this long before the next goal.

    Goals that events send must be reached as well. A preempted goal need not be reached. If `goals` names a preempted
    goal, the result is inconclusive.

    The stack uses its estimated pose to decide that a goal is reached. Therefore, a margin for the localization is
    added to the goal's tolerance. To require accuracy, set a `tolerance`, or set the margin to 0.

    What is measured: for each goal, the distance and the heading error between the goal and the robot's true pose at
        the tick at which the robot reports that the goal is reached.
    When it fails: the robot did not report a goal as reached, reported it while the true pose was out of tolerance, or
        reported it later than `within`.
    Why this: the report of a robot is only as good as its localization. Arena uses only the report, and BARN only the
        distance. Neither compares the report with the true pose.
    Source: Nav2's SimpleGoalChecker for the tolerances; BARN challenge, run.py, for judging by the true pose.

    Example: `goals_reached: {goals: [shelf], tolerance: 0.3 m, within: 60 s}`
    """

    goals: Annotated[list[GoalName], Field(min_length=1, max_length=1000)] | None = None
    """Names of the goals to check; default: all goals, including goals that events send. `shelf` is checked in every
    loop, `shelf#2` only in the second loop."""
    tolerance: PositiveLength | None = None
    """Maximum distance of the true position; default: the goal's own tolerance plus `localization_margin`."""
    yaw_tolerance: PositiveAngle | None = None
    """Maximum error of the true heading; default: the goal's own tolerance plus `localization_yaw_margin`."""
    localization_margin: NonNegativeLength = 0.15
    """Distance added to the goal's own tolerance, because a robot stops when its estimated position is within the
    tolerance. With 0, the true position must be within the tolerance."""
    localization_yaw_margin: NonNegativeAngle = 0.1
    """Angle added to the goal's own tolerance of the heading."""
    within: PositiveDuration | None = None
    """Maximum time from the acceptance of each goal to the report that it is reached."""

    evidence: ClassVar[frozenset[Evidence]] = POSITION_EVIDENCE | {Evidence.NAVIGATION}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return findings for distance, heading, and time of each reached goal, and one finding for each other goal."""
        outcomes = goal_outcomes(trace, case)
        names: Sequence[str | None] = self.goals or (None,)
        chosen = [each for each in outcomes if any(matches_goal_name(each.goal.name, name) for name in names)]
        findings = self._judge_unsent(trace, case, {outcome.goal.name for outcome in chosen})
        if not chosen and not findings:
            return [undecided("goals_reached", "the scenario has no goals", "reached")]
        for outcome in chosen:
            if outcome.expected_failure and not outcome.was_preempted:
                findings.append(_judge_expected_failure(trace, outcome))
            elif outcome.reached_tick is None:
                findings.append(self._judge_unreached(trace, outcome))
            else:
                is_via = outcome.goal.via
                findings += self._judge_via(trace, outcome, outcomes) if is_via else self._judge_reached(trace, outcome)
                if self.within is not None:
                    findings.append(_judge_time(trace, outcome, self.within))
                findings += _judge_wait(trace, case, outcome, outcomes)
        if self.goals is None and all(outcome.was_preempted for outcome in chosen):
            findings.append(undecided("goals_reached", "every goal was preempted", "reached"))
        return findings

    def _judge_unsent(self, trace: Trace, case: Case, sent_names: set[str]) -> list[Finding]:
        """Return one finding for each name in `goals` under which no goal was sent."""
        names = [goal.name for goal in case.every_goal]
        findings = []
        for name in dict.fromkeys(self.goals or ()):
            if not any(matches_goal_name(each, name) for each in names):
                because, detail = f"the scenario has no goal `{name}`", [f"goals: {', '.join(names)}"]
                findings.append(undecided(f"goal {name}", because, "reached", detail))
            elif not any(matches_goal_name(each, name) for each in sent_names):
                make_finding = missed if has_ended(trace) else undecided
                findings.append(make_finding(f"goal {name}", "never sent", "reached"))
        return findings

    def _judge_unreached(self, trace: Trace, outcome: GoalOutcome) -> Finding:
        """Return the finding for a goal that the robot did not report as reached.

        The finding fails, unless the goal was preempted or the log is truncated.
        """
        what = f"goal {outcome.goal.name}"
        if outcome.end is None and not has_ended(trace):
            return _truncated_log_finding(trace, outcome, "reached")
        tick = trace.end if outcome.end is None else outcome.end.tick
        if outcome.was_preempted:
            if self.goals is None:
                return held(what, outcome.summary, "reached", (trace, tick))
            return undecided(what, outcome.summary, "reached")
        details = []
        if len(trace.truth):
            details.append(f"{true_pose(trace, tick).distance(outcome.goal.pose):.2f} m from the goal at that time")
        if outcome.end is None:
            details.append(f"the run ended at t = {trace.seconds(trace.end):.2f} s: {end_reason(trace)}")
        return missed(what, outcome.summary, "reached", (trace, tick), details)

    def _judge_reached(self, trace: Trace, outcome: GoalOutcome) -> list[Finding]:
        """Return findings for distance and heading at the report that the goal is reached."""
        goal, tick = outcome.goal, outcome.reached_tick
        assert tick is not None
        what, pose = f"goal {goal.name}", true_pose(trace, tick)
        details = _describe_estimated_pose(trace, goal, tick)
        return [
            at_most(
                what,
                pose.distance(goal.pose),
                self._limit(outcome),
                "m",
                at=(trace, tick),
                context="from the goal when the robot reported it as reached",
                detail=details,
            ),
            at_most(
                f"{what} heading",
                abs(wrap(pose.yaw - goal.pose.yaw)),
                self.yaw_tolerance or goal.yaw_tolerance + self.localization_yaw_margin,
                "rad",
                at=(trace, tick),
                context="from the goal's heading when the robot reported it as reached",
                detail=details,
            ),
        ]

    def _judge_via(self, trace: Trace, outcome: GoalOutcome, outcomes: list[GoalOutcome]) -> list[Finding]:
        """Return the finding for the smallest distance from a via pose."""
        tick, distance = closest_approach(trace, outcome, outcomes)
        limit, context = self._limit(outcome), "from the pose at the closest approach"
        return [at_most(f"goal {outcome.goal.name}", distance, limit, "m", at=(trace, tick), context=context)]

    def _limit(self, outcome: GoalOutcome) -> float:
        """Return the maximum true distance from a goal in m."""
        return self.tolerance or outcome.goal.xy_tolerance + self.localization_margin


def _judge_time(trace: Trace, outcome: GoalOutcome, within: float) -> Finding:
    """Return the finding for the time from the acceptance of a goal to the report that it is reached."""
    what = f"goal {outcome.goal.name} time"
    if outcome.accepted_tick is None or outcome.reached_tick is None:
        return undecided(what, "the acceptance of the goal was not recorded", f"≤ {within:.2f} s")
    elapsed = trace.seconds(outcome.reached_tick - outcome.accepted_tick)
    return at_most(what, elapsed, within, "s", at=(trace, outcome.reached_tick))


def _judge_expected_failure(trace: Trace, outcome: GoalOutcome) -> Finding:
    """Return the finding for a goal with `expect`, which passes if the goal failed as expected."""
    expected = FAILED if outcome.expected_failure == FAILED else f"failed with {outcome.expected_failure}"
    if outcome.end is None and not has_ended(trace):
        return _truncated_log_finding(trace, outcome, expected)
    if outcome.failed_for_unknown_reason and outcome.expected_failure != FAILED:
        return undecided(f"goal {outcome.goal.name}", "failed, but the log has no error code", expected)
    at = (trace, trace.end if outcome.end is None else outcome.end.tick)
    is_passed_via = outcome.goal.via and outcome.reached_tick is not None  # the drive may fail after some via poses
    make_finding = held if outcome.failed_as_expected or is_passed_via else missed
    return make_finding(f"goal {outcome.goal.name}", outcome.summary, expected, at)


def _truncated_log_finding(trace: Trace, outcome: GoalOutcome, expected: str) -> Finding:
    """Return the inconclusive finding for a goal that had not ended when the log stopped."""
    because = f"the log stops at t = {trace.seconds(trace.end):.2f} s, {outcome.summary}"
    return undecided(f"goal {outcome.goal.name}", because, expected)


def _judge_wait(trace: Trace, case: Case, outcome: GoalOutcome, outcomes: list[GoalOutcome]) -> list[Finding]:
    """Return a finding for the wait at a goal, which ends when the next goal of the scenario is accepted.

    The list is empty if no wait is required, or if no later goal was accepted.
    """
    later = next(
        (each for each in outcomes if outcome_start(each) > outcome_start(outcome) and each.goal in case.goals), None
    )
    if not outcome.goal.wait or outcome.reached_tick is None or later is None or later.accepted_tick is None:
        return []
    waited = trace.seconds(later.accepted_tick - outcome.reached_tick)
    at = (trace, later.accepted_tick)
    return [at_least(f"goal {outcome.goal.name} wait", waited, outcome.goal.wait, "s", at=at)]


def _describe_estimated_pose(trace: Trace, goal: Goal, tick: int) -> list[str]:
    """Return a line with the distance of the estimated pose from the goal at `tick`; no line without a belief."""
    if not len(trace.belief):
        return []
    x, y, yaw = check_samples(trace.belief, "the belief", trace).at(np.array([tick]))[0, :3].tolist()
    angle = math.degrees(abs(wrap(yaw - goal.pose.yaw)))
    distance = math.hypot(x - goal.pose.x, y - goal.pose.y)
    return [f"its estimated pose was {distance:.2f} m and {angle:.0f}° from the goal"]
