"""Why a finding failed: the root cause before the symptom, from the trace and the case alone.

"why" is said of what follows from the geometry or the physics: a thing that closes the way, that was put in front of
the robot, a robot that was set down elsewhere. "meanwhile" is said of what was under way, be it the cause or not.
Where nothing is known, nothing is said.
"""

from collections.abc import Iterator, Sequence, Set
from dataclasses import replace

from simscen.core.records.case import Case
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.diagnosis.collision import diagnose_collision
from simscen.judge.diagnosis.goal_failure import diagnose_goal_failure
from simscen.judge.diagnosis.localization import diagnose_localization

GOAL_CRITERIA = frozenset({"goals_reached", "result", "error_code", "time_to_goal", "stuck"})
"""Criteria that fail when something keeps the robot from its goal."""
LOCALIZATION_CRITERIA = frozenset({"localization_error", "relocalized_within", "no_false_success", *GOAL_CRITERIA})
"""Criteria that fail when the robot is not where it believes to be."""
MAX_LINES = 6
"""Lines for a finding."""


def explain_failures(verdicts: Sequence[Verdict], trace: Trace, case: Case) -> tuple[Verdict, ...]:
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
        diagnose_goal_failure(trace, case, tick) if criterion in GOAL_CRITERIA else ([], set()),
        diagnose_collision(trace, tick) if criterion == "collisions" else ([], set()),
        diagnose_localization(trace, tick, known=criterion not in GOAL_CRITERIA)
        if criterion in LOCALIZATION_CRITERIA
        else ([], set()),
    ]
    for told, events in parts:
        lines += [f"why: {text}" for text in told]
        named |= events
    lines += [f"meanwhile: {text}" for text in concurrent_disturbances(trace, tick, named)]
    return lines[:MAX_LINES]


RECENT_FAULT_S, RECENT_EVENT_S = 3.0, 5.0
"""Seconds after the end of a fault, and after an event, in which it is still told."""


def concurrent_disturbances(trace: Trace, tick: int, known: Set[str] = frozenset()) -> list[str]:
    """Faults, then events, each in the order in which they began; those that are `known` already are left out."""
    return [text for name, text in (*_faults(trace, tick), *_events(trace, tick)) if name not in known]


def _faults(trace: Trace, tick: int) -> Iterator[tuple[str, str]]:
    felt = [event for event in trace.of_kind(EventKind.FAULT_TOOK_EFFECT) if event.tick <= tick]
    for start in trace.of_kind(EventKind.FAULT_STARTED):
        end = _end(trace, start)
        if start.tick > tick or not any(_same(start, event) and event.tick >= start.tick for event in felt):
            continue
        if end is None or end > tick:
            since = f"since t = {trace.seconds(start.tick):.2f} s" if start.tick else "since the start"
            yield start.name, f"{start.name} was at work {since}, for {trace.seconds(tick - start.tick):.2f} s"
        elif trace.seconds(tick - end) <= RECENT_FAULT_S:
            after = f"after {trace.seconds(end - start.tick):.2f} s"
            yield start.name, f"{start.name} had ended {trace.seconds(tick - end):.2f} s before, {after}"


def _end(trace: Trace, start: Event) -> int | None:
    ends = [event.tick for event in trace.of_kind(EventKind.FAULT_ENDED) if _same(event, start)]
    return next((end for end in ends if end > start.tick), None)


def _same(one: Event, other: Event) -> bool:
    return (one.name, one.data.get("entry")) == (other.name, other.data.get("entry"))


def _events(trace: Trace, tick: int) -> Iterator[tuple[str, str]]:
    for event in trace.of_kind(EventKind.EVENT_ENDED):
        ago = trace.seconds(tick - event.tick)
        effects = event.data.get("effects")
        if not 0 <= ago <= RECENT_EVENT_S or not isinstance(effects, list):
            continue
        told = [str(one["what"]) for one in effects if isinstance(one, dict) and one["happened"]]
        if told:
            yield event.name, f"event `{event.name}` came {ago:.2f} s before: {', '.join(told)}"
