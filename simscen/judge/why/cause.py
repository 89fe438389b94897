"""Why a finding failed: the root cause before the symptom, from the trace and the case alone.

"why" is said of what follows from the geometry or the physics: a thing that closes the way, that was put in front of
the robot, a robot that was set down elsewhere. "meanwhile" is said of what was under way, be it the cause or not.
Where nothing is known, nothing is said.
"""

from collections.abc import Sequence
from dataclasses import replace

from simscen.core.case import Case
from simscen.core.trace import Trace
from simscen.core.verdict import Finding, Status, Verdict
from simscen.judge.why.astray import astray
from simscen.judge.why.halted import halted
from simscen.judge.why.meanwhile import meanwhile
from simscen.judge.why.struck import struck

GOALS = frozenset({"goals_reached", "result", "error_code", "time_to_goal", "stuck"})
"""Criteria that fail when something keeps the robot from its goal."""
PLACES = frozenset({"localization_error", "relocalized_within", "no_false_success", *GOALS})
"""Criteria that fail when the robot is not where it believes to be."""
MOST = 6
"""Lines for a finding."""


def explained(verdicts: Sequence[Verdict], trace: Trace, case: Case) -> tuple[Verdict, ...]:
    """The verdicts, and before the details of each failed finding what is known of its cause."""
    return tuple(
        replace(one, findings=tuple(_explained(one.criterion, finding, trace, case) for finding in one.findings))
        for one in verdicts
    )


def _explained(criterion: str, finding: Finding, trace: Trace, case: Case) -> Finding:
    if finding.status is not Status.FAIL or finding.tick is None:
        return finding
    lines = causes(criterion, finding.tick, trace, case)
    return replace(finding, detail=(*lines, *finding.detail)) if lines else finding


def causes(criterion: str, tick: int, trace: Trace, case: Case) -> list[str]:
    """What is known of the cause of a failure of this kind at this tick, a line each."""
    lines: list[str] = []
    named: set[str] = set()
    parts = [
        halted(trace, case, tick) if criterion in GOALS else ([], set()),
        struck(trace, tick) if criterion == "collisions" else ([], set()),
        astray(trace, tick, known=criterion not in GOALS) if criterion in PLACES else ([], set()),
    ]
    for told, events in parts:
        lines += [f"why: {text}" for text in told]
        named |= events
    lines += [f"meanwhile: {text}" for text in meanwhile(trace, tick, named)]
    return lines[:MOST]
