"""`result` and `error_code`: how the navigation ended, in Nav2's words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from simscen.core.messages.goal_names import matches_goal_name
from simscen.core.records.events import Event, EventKind
from simscen.core.records.evidence import Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.error_codes import Code, code_of
from simscen.criteria.findings import held, missed, undecided
from simscen.criteria.timeline import end_reason, has_ended
from simscen.spec.base import Spec
from simscen.spec.references import GoalName

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class Result(Spec, Criterion):
    """Navigation ended the way it should: an expected failure is a pass.

    What is measured: the result the robot reports at the end, and its error code.
    When it fails: another result, another code, or none at all when the run ended.
    Why this: that a robot refuses a goal inside an obstacle, and says why, is a thing to test like any other.
    Source: nav2_simple_commander's TaskResult; the error codes of nav2_msgs' actions.

    Example: `result: {status: FAILED, error_code: GOAL_OCCUPIED}`
    """

    status: Literal["SUCCEEDED", "FAILED", "CANCELED"]
    """What it must report."""
    error_code: Code | None = None
    """Nav2's error code that it must give, by name or number."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        codes = set() if self.error_code is None else {Evidence.ERROR_CODES}
        return frozenset({Evidence.NAVIGATION, *codes})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for the result, one for the code if it is asked for."""
        end = _last(trace, EventKind.NAVIGATION_ENDED)
        if end is None:
            return [_no_answer(trace, "result", self.status)]
        findings = [_compare(trace, end, "result", end.name, self.status)]
        if self.error_code is not None:
            findings.append(_compare(trace, end, "error code", code_of(end), self.error_code.name))
        return findings


class ErrorCodeIs(Spec, Criterion):
    """The robot gave this error code, for a goal or for the navigation as a whole.

    What is measured: the error code of the last report about the goal, or of the end of navigation.
    When it fails: another code, or no report when the run ended.
    Why this: with several goals the end of navigation tells only one of their codes.
    Source: the error codes of nav2_msgs' actions.

    Example: `error_code: {code: NO_VALID_PATH, goal: shelf}`
    """

    code: Code
    """By name or number; NONE = no error."""
    goal: GoalName | None = None
    """Of this goal; default: of the navigation as a whole."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return frozenset({Evidence.NAVIGATION, Evidence.ERROR_CODES})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding."""
        kinds = (
            [EventKind.NAVIGATION_ENDED]
            if self.goal is None
            else [EventKind.GOAL_REACHED, EventKind.GOAL_PASSED, EventKind.GOAL_FAILED, EventKind.GOAL_CANCELED]
        )
        what = "error code" if self.goal is None else f"error code of goal {self.goal}"
        end = _last(trace, *kinds, name=self.goal)
        if end is None:
            return [_no_answer(trace, what, self.code.name)]
        return [_compare(trace, end, what, code_of(end), self.code.name)]


def _last(trace: Trace, *kinds: EventKind, name: str | None = None) -> Event | None:
    events = [event for event in trace.of_kind(*kinds) if matches_goal_name(event.name, name)]
    return events[-1] if events else None


def _compare(trace: Trace, end: Event, what: str, got: str, expected: str) -> Finding:
    if got == expected:
        return held(what, got, expected, (trace, end.tick))
    message = end.data.get("message")
    details = [f"it ended with {end.name}, {code_of(end)}"] + ([str(message)] if message else [])
    return missed(what, got, expected, (trace, end.tick), details)


def _no_answer(trace: Trace, what: str, expected: str) -> Finding:
    when = f"t = {trace.seconds(trace.end):.2f} s"
    if has_ended(trace):
        return missed(
            what, "no answer", expected, (trace, trace.end), [f"the run ended at {when}: {end_reason(trace)}"]
        )
    return undecided(what, f"the log stops at {when}, before navigation ended", expected)
