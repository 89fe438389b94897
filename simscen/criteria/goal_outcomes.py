"""Outcome of each goal of a run as reported by the robot: reached, passed, failed, canceled, or none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.messages.goals import FAILED, Goal
from simscen.core.records.events import GOAL_END_KINDS, Event, EventKind
from simscen.criteria.error_codes import error_code_name, has_error_code
from simscen.criteria.trace_signals.ground_truth import truth

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


_ARRIVAL_KINDS = (EventKind.GOAL_REACHED, EventKind.GOAL_PASSED)


@dataclass(frozen=True)
class GoalOutcome:
    """Outcome of one goal, as reported by the robot.

    `accepted_tick` is the tick at which the robot accepted the goal; None if no acceptance was recorded. `end` is the
    event that ended the goal; None if the goal did not end. `expected_failure` is the failure that the scenario
    expects: "failed", or the name of an error code; "" if no failure is expected.
    """

    goal: Goal
    accepted_tick: int | None
    end: Event | None
    expected_failure: str = ""

    @property
    def reached_tick(self) -> int | None:
        """Tick at which the robot reported the goal as reached or passed; None without such a report."""
        return self.end.tick if self.end is not None and self.end.kind in _ARRIVAL_KINDS else None

    @property
    def must_be_reached(self) -> bool:
        """Whether the goal was not preempted and is not expected to fail."""
        return not self.was_preempted and not self.expected_failure

    @property
    def failed_as_expected(self) -> bool:
        """Whether the goal failed as the scenario expects."""
        if self.end is None or self.end.kind != EventKind.GOAL_FAILED:
            return False
        return self.expected_failure in (FAILED, error_code_name(self.end))

    @property
    def failed_for_unknown_reason(self) -> bool:
        """Whether the goal failed and no error code was recorded, as in logs of real robots."""
        return self.end is not None and self.end.kind == EventKind.GOAL_FAILED and not has_error_code(self.end)

    @property
    def was_preempted(self) -> bool:
        """Whether another goal replaced this goal before it was reached."""
        return self.end is not None and bool(self.end.data.get("preempted_by"))

    @property
    def summary(self) -> str:
        """The outcome as text, e.g. "failed with NO_VALID_PATH"."""
        if self.end is None:
            return "never accepted" if self.accepted_tick is None else "still under way"
        if self.was_preempted:
            return f"preempted by {self.end.data['preempted_by']}"
        code = self.end.data.get("error_name") or self.end.data.get("error_code")
        return self.end.kind.removeprefix("goal.") + (f" with {code}" if code else "")


def goal_outcomes(trace: Trace, case: Case) -> list[GoalOutcome]:
    """Return the outcome of each goal of the scenario and of each goal that an event sent, sorted by `outcome_start`.

    Goals without any report come last. A via pose (a pose that the robot passes without a stop) without reports gets
    the outcome of the next goal at which the robot stops, as Nav2 reports only whole actions.
    """
    reports = _reports_by_goal(trace)
    next_reports = {name: iter(goal_reports) for name, goal_reports in reports.items()}
    found = [
        GoalOutcome(goal, *next(next_reports.get(goal.name, iter(())), _NO_REPORT), case.expected.get(goal.name, ""))
        for goal in case.goals
    ]
    found = [_with_outcome_of_next_stop(outcome, found[k + 1 :], reports) for k, outcome in enumerate(found)]
    for goal in case.sent:
        goal_reports = reports.get(goal.name, [])
        # A sent goal may preempt several poses of one drive at the same tick.
        preemption_ticks = {event.tick for event in trace.events if event.data.get("preempted_by") == goal.name}
        missing = [_NO_REPORT] * (len(preemption_ticks) - len(goal_reports))
        found += [GoalOutcome(goal, *report) for report in (*goal_reports, *missing)]
    return sorted(found, key=outcome_start)


def outcome_start(outcome: GoalOutcome) -> float:
    """Return the tick at which the robot accepted the goal, or else the tick of its end; inf if both are unknown."""
    if outcome.accepted_tick is not None:
        return outcome.accepted_tick
    return math.inf if outcome.end is None else outcome.end.tick


def first_acceptance(outcomes: Sequence[GoalOutcome]) -> int | None:
    """Return the tick at which the robot accepted its first goal; None if the log does not contain this acceptance.

    `outcomes` contains the outcomes of all goals in order. A goal that failed without an acceptance was rejected.
    """
    first = next((each for each in outcomes if each.accepted_tick is not None or each.reached_tick is not None), None)
    return None if first is None else first.accepted_tick


def closest_approach(trace: Trace, outcome: GoalOutcome, outcomes: Sequence[GoalOutcome]) -> tuple[int, float]:
    """Return the tick at which the true position was nearest to a via pose, and the distance in m.

    Only the time from the acceptance of the via pose to the end of the next goal at which the robot stops counts; the
    whole run if there is no sample in this time. `outcomes` contains the outcomes of all goals in order.
    """
    later = outcomes[outcomes.index(outcome) :]
    stop = next((each for each in later if not each.goal.via), None)
    last = trace.end if stop is None or stop.end is None else stop.end.tick
    poses = truth(trace)
    first = 0 if outcome.accepted_tick is None else outcome.accepted_tick
    is_in_drive = (poses.ticks >= first) & (poses.ticks <= last)
    if not is_in_drive.any():
        is_in_drive = np.ones(len(poses.ticks), dtype=bool)
    x, y = outcome.goal.pose.x, outcome.goal.pose.y
    distances = np.hypot(poses.values[is_in_drive, 0] - x, poses.values[is_in_drive, 1] - y)
    k = int(np.argmin(distances))
    return int(poses.ticks[is_in_drive][k]), float(distances[k])


def _with_outcome_of_next_stop(
    outcome: GoalOutcome, later: list[GoalOutcome], reports: Mapping[str, list[_Report]]
) -> GoalOutcome:
    """Return `outcome`; for a via pose without reports, the outcome of the next goal at which the robot stops.

    `later` contains the outcomes of the goals after this one.
    """
    stop = next((each for each in later if not each.goal.via), None)
    if not outcome.goal.via or outcome.goal.name in reports or stop is None or stop.end is None:
        return outcome
    kind = EventKind.GOAL_PASSED if stop.reached_tick is not None else stop.end.kind
    end = replace(stop.end, kind=kind, name=outcome.goal.name)
    return replace(outcome, accepted_tick=stop.accepted_tick, end=end)


_Report = tuple[int | None, Event | None]
"""Tick at which a goal was accepted, and the event that ended it; None if not reported."""
_NO_REPORT: _Report = (None, None)


def _reports_by_goal(trace: Trace) -> dict[str, list[_Report]]:
    """Return the reports on goals by name, in order."""
    found: dict[str, list[_Report]] = {}
    for event in trace.of_kind(EventKind.GOAL_ACCEPTED, *GOAL_END_KINDS):
        reports = found.setdefault(event.name, [])
        if event.kind == EventKind.GOAL_ACCEPTED:
            reports.append((event.tick, None))
        elif reports and reports[-1][1] is None:
            reports[-1] = (reports[-1][0], event)
        else:
            reports.append((None, event))
    return found
