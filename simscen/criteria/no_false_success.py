"""`no_false_success`: the robot does not claim what is not so."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from simscen.core.records.events import Event, EventKind
from simscen.core.records.evidence import POSITION, Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, held, missed, undecided
from simscen.criteria.goal_outcomes import GoalOutcome, closest_approach, goal_outcomes, outcome_start
from simscen.criteria.trace_signals.ground_truth import true_pose
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveLength

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class NoFalseSuccess(Spec, Criterion):
    """The robot never says that it is at a goal when it is not; that it fails honestly is fine.

    What is measured: the true distance to the goal whenever the robot reports it reached; and whether navigation was
        reported SUCCEEDED with every goal reached that was not preempted by another.
    When it fails: a goal was reported reached from further away than `tolerance`, or SUCCEEDED with a goal missing.
    Why this: a failed delivery is retried; one that was reported done is not even noticed. Arena's result says
        GOAL_REACHED without ever checking the goal.
    Source: BARN challenge, run.py, for the meter.

    Example: `no_false_success: {tolerance: 0.5 m}`
    """

    tolerance: PositiveLength = 1.0
    """From here on a success is false; larger than the goal's own tolerance, which goals_reached judges."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return POSITION | {Evidence.NAVIGATION}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each goal reported reached, one for the end of navigation."""
        told = goal_outcomes(trace, case)
        ended = trace.of_kind(EventKind.NAVIGATION_ENDED)
        strange = [
            event
            for event in trace.of_kind(EventKind.GOAL_REACHED, EventKind.GOAL_PASSED)
            if event.name not in _names(case)
        ]
        if not ended and not strange and all(outcome.end is None for outcome in told):
            return [undecided("no_false_success", "the robot reported nothing that could be false")]
        findings = [self._at_goal(trace, outcome, told) for outcome in told if outcome.reached is not None]
        findings += [
            undecided(f"goal {event.name}", "reported reached, but the scenario has no such goal") for event in strange
        ]
        findings += [finding for k in range(len(ended)) if (finding := _success(trace, case, ended, k)) is not None]
        return findings or [held("no_false_success", "no success was claimed", "no false success")]

    def _at_goal(self, trace: Trace, outcome: GoalOutcome, told: list[GoalOutcome]) -> Finding:
        assert outcome.reached is not None
        what, at = f"goal {outcome.goal.name}", (trace, outcome.reached)
        if outcome.goal.via:
            tick, apart = closest_approach(trace, outcome, told)
            context = "from the pose where it came nearest to it, which it says it has passed"
            return at_most(what, apart, self.tolerance, "m", at=(trace, tick), context=context)
        context = "from the goal when the robot said it was there"
        return at_most(
            what,
            true_pose(trace, outcome.reached).distance(outcome.goal.pose),
            self.tolerance,
            "m",
            at=at,
            context=context,
        )


def _names(case: Case) -> set[str]:
    return {goal.name for goal in case.every_goal}


def _success(trace: Trace, case: Case, ended: tuple[Event, ...], k: int) -> Finding | None:
    """What is wrong with the k-th end of navigation: it answers for the goals since the one before it.

    The first answers for all goals of the scenario, which its task held, accepted by then or not.
    """
    end = ended[k]
    if end.name != "SUCCEEDED":
        return None
    own = [s for s in goal_outcomes(trace, case) if _task(s, ended) == k or (k == 0 and s.goal in case.goals)]
    late = [s for s in own if s.must_be_reached and (s.reached is None or s.reached > end.tick)]
    if not late:
        return None
    names = ", ".join(outcome.goal.name for outcome in late)
    expected = "SUCCEEDED only with every goal reached"
    return missed("result", "SUCCEEDED", expected, (trace, end.tick), [f"not reached: {names}"])


def _task(outcome: GoalOutcome, ended: tuple[Event, ...]) -> int | None:
    """Which end of navigation answers for a goal: the first after it began, or at which it is over, too."""
    over = math.inf if outcome.end is None else outcome.end.tick
    return next((k for k, end in enumerate(ended) if outcome_start(outcome) < end.tick or over <= end.tick), None)
