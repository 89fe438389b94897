"""`goals_reached`: the robot truly was where it was sent."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from simscen.core.geometry import wrap
from simscen.core.messages.navigation import FAILED, matches_goal_name
from simscen.core.records.verdict import POSITION, Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_least, at_most, held, missed, undecided
from simscen.criteria.goal_outcomes import GoalOutcome, closest_approach, goal_outcomes, outcome_start
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.ground_truth import check_samples, true_pose
from simscen.spec.base import Spec
from simscen.spec.places import GoalName
from simscen.spec.quantities import NonNegativeAngle, NonNegativeLength, PositiveAngle, PositiveDuration, PositiveLength

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class GoalsReached(Spec, Criterion):
    """Every goal was reached: the robot says so, and at that moment it truly was there.

    A goal with `expect` is judged by that: one at which the robot is to fail has to fail, with the code that is asked
    for. Poses that navigate_through_poses passes have to be come near to, at whatever heading. Where a goal has
    `on_reached: {wait: …}`, the robot has to stay so long before it goes on.

    Goals that events send count from when they are sent. A goal that such a goal preempted is dropped, as in Nav2: it
    is told as preempted and need not be reached, but those that remain must be. Named in `goals`, it is inconclusive.

    The stack decides with its estimated pose. The true pose may therefore be beyond the goal's tolerance by a margin
    for localization. To require accuracy, give a `tolerance`, or set the margin to 0.

    What is measured: distance and heading error between the goal and the robot's true pose at the tick of the
        robot's report, for each goal.
    When it fails: a goal was not reported reached, or was reported while the true pose was out of tolerance, or later
        than `within`.
    Why this: the robot's own word is worth as much as its localization. Arena's metrics count the word alone, BARN's
        the distance alone, so that neither sees a robot that is lost and content.
    Source: Nav2's SimpleGoalChecker for the tolerances; BARN challenge, run.py, for judging by the truth.

    Example: `goals_reached: {goals: [shelf], tolerance: 0.3 m, within: 60 s}`
    """

    goals: Annotated[list[GoalName], Field(min_length=1, max_length=1000)] | None = None
    """Only these, by name, in every loop (`shelf#2`: in the second one); default: all of the scenario, and all that
    events have sent."""
    tolerance: PositiveLength | None = None
    """How far the true position may be off; default: the goal's own tolerance plus `localization_margin`."""
    yaw_tolerance: PositiveAngle | None = None
    """How far the true heading may be off; default: the goal's own tolerance plus `localization_yaw_margin`."""
    localization_margin: NonNegativeLength = 0.15
    """Added to the goal's own tolerance, because a robot stops where its estimated position is within the tolerance.
    With 0 the true position has to be."""
    localization_yaw_margin: NonNegativeAngle = 0.1
    """Added to the goal's own tolerance of the heading."""
    within: PositiveDuration | None = None
    """Each goal at most this long after the robot accepted it."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return POSITION | {Evidence.NAVIGATION}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Distance, heading and, if asked for, time of each goal; one finding for a goal that was not reached."""
        told = goal_outcomes(trace, case)
        chosen = [
            outcome
            for outcome in told
            if any(matches_goal_name(outcome.goal.name, name) for name in self.goals or (None,))
        ]
        findings = self._untold(trace, case, {outcome.goal.name for outcome in chosen})
        if not chosen and not findings:
            return [undecided("goals_reached", "the scenario has no goals", "reached")]
        for outcome in chosen:
            if outcome.failure and not outcome.preempted:
                findings.append(_failed(trace, outcome))
            elif outcome.reached is None:
                findings.append(self._missing(trace, outcome))
            else:
                findings += self._passed(trace, outcome, told) if outcome.goal.via else self._reached(trace, outcome)
                findings += _waited(trace, case, outcome, told)
        if self.goals is None and all(outcome.preempted for outcome in chosen):
            findings.append(undecided("goals_reached", "every goal was preempted", "reached"))
        return findings

    def _untold(self, trace: Trace, case: Case, told: set[str]) -> list[Finding]:
        """Return findings for goals that the criterion names and that have no outcome."""
        names = [goal.name for goal in case.every_goal]
        findings = []
        for name in dict.fromkeys(self.goals or ()):
            if not any(matches_goal_name(each, name) for each in names):
                because, detail = f"the scenario has no goal `{name}`", [f"goals: {', '.join(names)}"]
                findings.append(undecided(f"goal {name}", because, "reached", detail))
            elif not any(matches_goal_name(each, name) for each in told):
                tell = missed if has_ended(trace) else undecided
                findings.append(tell(f"goal {name}", "never sent", "reached"))
        return findings

    def _missing(self, trace: Trace, outcome: GoalOutcome) -> Finding:
        if not outcome.preempted:
            return _not_reached(trace, outcome)
        assert outcome.end is not None
        if self.goals is None:
            return held(f"goal {outcome.goal.name}", outcome.summary, "reached", (trace, outcome.end.tick))
        return undecided(f"goal {outcome.goal.name}", outcome.summary, "reached")

    def _reached(self, trace: Trace, outcome: GoalOutcome) -> list[Finding]:
        goal, tick = outcome.goal, outcome.reached
        assert tick is not None
        what, pose = f"goal {goal.name}", true_pose(trace, tick)
        believed = _believed(trace, outcome)
        findings = [
            at_most(
                what,
                pose.distance(goal.pose),
                self._limit(outcome),
                "m",
                at=(trace, tick),
                context="from the goal when the robot said it was there",
                detail=believed,
            ),
            at_most(
                f"{what} heading",
                abs(wrap(pose.yaw - goal.pose.yaw)),
                self.yaw_tolerance or goal.yaw_tolerance + self.localization_yaw_margin,
                "rad",
                at=(trace, tick),
                context="from the goal's heading when the robot said it was there",
                detail=believed,
            ),
        ]
        if self.within is not None:
            findings.append(self._time(trace, outcome, self.within))
        return findings

    def _passed(self, trace: Trace, outcome: GoalOutcome, told: list[GoalOutcome]) -> list[Finding]:
        """Of a pose that is passed on the way the heading is free, and how near the robot came to it at all counts."""
        tick, apart = closest_approach(trace, outcome, told)
        limit, context = self._limit(outcome), "from the pose where it came nearest to it"
        findings = [at_most(f"goal {outcome.goal.name}", apart, limit, "m", at=(trace, tick), context=context)]
        if self.within is not None:
            findings.append(self._time(trace, outcome, self.within))
        return findings

    def _limit(self, outcome: GoalOutcome) -> float:
        """Return the largest true distance from a goal that passes, in m."""
        return self.tolerance or outcome.goal.xy_tolerance + self.localization_margin

    def _time(self, trace: Trace, outcome: GoalOutcome, within: float) -> Finding:
        what = f"goal {outcome.goal.name} time"
        if outcome.accepted is None or outcome.reached is None:
            return undecided(what, "when it was accepted was not recorded", f"≤ {within:.2f} s")
        taken = trace.seconds(outcome.reached - outcome.accepted)
        return at_most(what, taken, within, "s", at=(trace, outcome.reached))


def _failed(trace: Trace, outcome: GoalOutcome) -> Finding:
    """Of a goal at which the robot is to fail: whether it did, and with the code that is asked for."""
    what, expected = f"goal {outcome.goal.name}", _expected(outcome)
    if outcome.end is None and not has_ended(trace):
        return undecided(what, f"the log stops at t = {trace.seconds(trace.end):.2f} s, {outcome.summary}", expected)
    at = (trace, trace.end if outcome.end is None else outcome.end.tick)
    on_the_way = outcome.goal.via and outcome.reached is not None  # it may come past some poses before it fails
    return (held if outcome.failed_as_expected or on_the_way else missed)(what, outcome.summary, expected, at)


def _expected(outcome: GoalOutcome) -> str:
    return FAILED if outcome.failure == FAILED else f"failed with {outcome.failure}"


def _waited(trace: Trace, case: Case, outcome: GoalOutcome, told: list[GoalOutcome]) -> list[Finding]:
    """Whether the robot stayed as long as it was to, before it went on to another goal of the list."""
    later = next(
        (each for each in told if outcome_start(each) > outcome_start(outcome) and each.goal in case.goals), None
    )
    if not outcome.goal.wait or outcome.reached is None or later is None or later.accepted is None:
        return []
    stayed = trace.seconds(later.accepted - outcome.reached)
    return [at_least(f"goal {outcome.goal.name} wait", stayed, outcome.goal.wait, "s", at=(trace, later.accepted))]


def _not_reached(trace: Trace, outcome: GoalOutcome) -> Finding:
    what = f"goal {outcome.goal.name}"
    if outcome.end is None and not has_ended(trace):
        return undecided(what, f"the log stops at t = {trace.seconds(trace.end):.2f} s, {outcome.summary}", "reached")
    tick = trace.end if outcome.end is None else outcome.end.tick
    why = f"the run ended at t = {trace.seconds(trace.end):.2f} s: {end_reason(trace)}"
    details = [why] if outcome.end is None else []
    if len(trace.truth):
        details.insert(0, f"{true_pose(trace, tick).distance(outcome.goal.pose):.2f} m from the goal then")
    return missed(what, outcome.summary, "reached", (trace, tick), details)


def _believed(trace: Trace, outcome: GoalOutcome) -> list[str]:
    tick, goal = outcome.reached, outcome.goal.pose
    if tick is None or not len(trace.belief):
        return []
    x, y, yaw = check_samples(trace.belief, "the belief", trace).at(np.array([tick]))[0, :3].tolist()
    off = math.degrees(abs(wrap(yaw - goal.yaw)))
    return [f"it believed itself {math.hypot(x - goal.x, y - goal.y):.2f} m and {off:.0f}° from the goal"]
