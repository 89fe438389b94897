"""Search for likely causes of failed findings in the trace of the run. Causes are added to findings as lines of text.

Lines with "why" state a cause that follows from geometry or physics, such as an object that blocks the path. Lines with
"meanwhile" list faults and events at or shortly before the time of the failure.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from simscen.core.records.case import Case
from simscen.core.records.disturbances import BELIEF, WHEELS
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.blocked_path import Diagnosis
from simscen.judge.goal_failure_causes import diagnose_goal_failure
from simscen.judge.movable_objects import MovableObject, movable_objects

GOAL_CRITERIA = frozenset({"goals_reached", "result", "error_code", "time_to_goal", "stuck"})
"""Criteria that can fail because something blocks the robot."""
LOCALIZATION_CRITERIA = GOAL_CRITERIA | {
    *("localization_error", "relocalized_within", "localization_consistency", "no_false_success"),
}
"""Criteria that can fail because the estimated pose is wrong."""
MAX_LINES = 6
"""Maximum number of lines for a finding."""


def explain_failures(verdicts: Sequence[Verdict], trace: Trace, case: Case) -> tuple[Verdict, ...]:
    """Return the verdicts, with likely causes before the other details of each failed finding that has a tick."""
    return tuple(
        replace(
            verdict, findings=tuple(_with_causes(verdict.criterion, each, trace, case) for each in verdict.findings)
        )
        for verdict in verdicts
    )


def _with_causes(criterion: str, finding: Finding, trace: Trace, case: Case) -> Finding:
    if finding.status is not Status.FAIL or finding.tick is None:
        return finding
    lines = causes(criterion, finding.tick, trace, case)
    return replace(finding, detail=(*lines, *finding.detail)) if lines else finding


def causes(criterion: str, tick: int, trace: Trace, case: Case) -> list[str]:
    """Return at most MAX_LINES lines about the likely causes of the failure of a criterion at `tick`."""
    lines: list[str] = []
    mentioned: set[str] = set()
    diagnoses: list[Diagnosis] = []
    if criterion in GOAL_CRITERIA:
        diagnoses.append(diagnose_goal_failure(trace, case, tick))
    if criterion == "collisions":
        diagnoses.append(diagnose_collision(trace, tick))
    if criterion in LOCALIZATION_CRITERIA:
        error_is_reported = criterion not in {*GOAL_CRITERIA, "localization_consistency"}
        diagnoses.append(diagnose_localization(trace, tick, error_is_reported))
    for sentences, names in diagnoses:
        lines += [f"why: {text}" for text in sentences]
        mentioned |= names
    disturbances = (*_recent_faults(trace, tick), *_recent_events(trace, tick))
    lines += [f"meanwhile: {text}" for name, text in disturbances if name not in mentioned]
    return lines[:MAX_LINES]


RECENT_FAULT_S, RECENT_EVENT_S = 3.0, 5.0
"""Maximum age of a disturbance in a "meanwhile" line: time since the end of a fault, and time since an event."""


def _recent_faults(trace: Trace, tick: int) -> Iterator[tuple[str, str]]:
    """Yield name and description of each fault that had an effect and was active at or shortly before `tick`."""
    effects = [event for event in trace.of_kind(EventKind.FAULT_TOOK_EFFECT) if event.tick <= tick]
    for start in trace.of_kind(EventKind.FAULT_STARTED):
        ends = [event.tick for event in trace.of_kind(EventKind.FAULT_ENDED) if _is_same_fault(event, start)]
        end = next((end for end in ends if end > start.tick), None)
        if not any(
            _is_same_fault(start, event) and start.tick <= event.tick and (end is None or event.tick <= end)
            for event in effects
        ):
            continue
        if end is None or end > tick:
            since = f"since t = {trace.seconds(start.tick):.2f} s" if start.tick else "since the start"
            yield start.name, f"{start.name} was active {since}, for {trace.seconds(tick - start.tick):.2f} s"
        elif trace.seconds(tick - end) <= RECENT_FAULT_S:
            after = f"after {trace.seconds(end - start.tick):.2f} s"
            yield start.name, f"{start.name} had ended {trace.seconds(tick - end):.2f} s before, {after}"


def _is_same_fault(event: Event, other: Event) -> bool:
    """Return whether both events are about the same fault: equal name and equal index in the scenario (`entry`)."""
    return (event.name, event.data.get("entry")) == (other.name, other.data.get("entry"))


def _recent_events(trace: Trace, tick: int) -> Iterator[tuple[str, str]]:
    """Yield name and description of each event that had an effect shortly before `tick`."""
    for event in trace.of_kind(EventKind.EVENT_ENDED):
        ago = trace.seconds(tick - event.tick)
        effects = event.data.get("effects")
        if not 0 <= ago <= RECENT_EVENT_S or not isinstance(effects, list):
            continue
        changes = [str(one["what"]) for one in effects if isinstance(one, dict) and one["happened"]]
        if changes:
            yield event.name, f"event `{event.name}` happened {ago:.2f} s before: {', '.join(changes)}"


OBJECT_MOVING_SPEED_M_S = 0.0625
"""Speed from which an object counts as moving."""
OBJECT_SPEED_WINDOW_S = 0.25
"""Time before a collision over which the speed of an object is averaged."""


def diagnose_collision(trace: Trace, tick: int) -> Diagnosis:
    """Return sentences on the movable objects that the robot began to touch at `tick`, and names of their events."""
    hits = {hit.name: hit for hit in trace.of_kind(EventKind.COLLISION_STARTED) if hit.tick == tick}
    touched = [each for each in movable_objects(trace, tick) if each.name in hits]
    described = [(each, _describe_hit(trace, each, hits[each.name])) for each in touched]
    return [text for _, text in described if text], {each.event_name for each, text in described if text}


def _describe_hit(trace: Trace, touched: MovableObject, hit: Event) -> str:
    """Return a sentence on how an object came to touch the robot; "" if no event changed the object and it stands."""
    ago = f"{trace.seconds(hit.tick - touched.change_tick):.2f} s before"
    parts = []
    if touched.event_name:
        if touched.was_moved:
            change = "moved it"
        else:
            distance = touched.distance(np.array([trace.place(touched.change_tick)]))[0]
            change = f"spawned it {distance:.2f} m from the robot's center"
        parts.append(f"event `{touched.event_name}` had {change} {ago}")
    if (speed := _speed(trace, touched, hit.tick)) >= OBJECT_MOVING_SPEED_M_S:
        parts.append(f"it moved at {speed:.2f} m/s")
    if hit.data.get("robot_caused") is False and parts:
        parts.append("and ran into the robot")
    return f"{touched.name}: {', '.join(parts)}" if parts else ""


def _speed(trace: Trace, touched: MovableObject, tick: int) -> float:
    """Return the mean speed of an object in m/s over OBJECT_SPEED_WINDOW_S before `tick`, or since its last change."""
    samples = trace.objects.get(touched.name)
    if samples is None:
        return 0.0
    # The sample at the tick of a change, such as a teleportation, precedes the change.
    later = samples.ticks[samples.ticks > touched.change_tick]
    begin = max(tick - round(OBJECT_SPEED_WINDOW_S * trace.tick_rate), int(later[0])) if len(later) else tick
    if begin >= tick:
        return 0.0
    (x0, y0), (x1, y1) = samples.at(np.array([begin, tick]))[:, :2].tolist()
    return float(np.hypot(x1 - x0, y1 - y0)) / trace.seconds(tick - begin)


ODOMETRY_FAULTS = frozenset({"bias", "slip", "scale", "drift", "noise"})
"""Kinds of faults whose effect on the odometry pose remains after the end of the fault."""
ODOMETRY_TARGETS = frozenset({"Odometry", WHEELS})
"""Values of `affects` for which the ODOMETRY_FAULTS falsify the odometry."""
LOST_DISTANCE_M = 0.5
"""Localization error from which a robot counts as lost."""


def diagnose_localization(trace: Trace, tick: int, error_is_reported: bool) -> Diagnosis:
    """Return sentences on a large localization error and its causes, and the names of the causing disturbances.

    If `error_is_reported`, the failed finding already states the error, and no sentence repeats it.
    """
    error = _position_error(trace, tick)
    if not error >= LOST_DISTANCE_M:  # also for nan: unknown
        return [], set()
    lines = [] if error_is_reported else [f"the estimated position was {error:.2f} m from the true position"]
    causing: set[str] = set()
    current_event = ""
    for event in trace.events:
        if event.tick > tick:
            continue
        if event.kind == EventKind.EVENT_STARTED:
            current_event = event.name
        elif event.kind == EventKind.EVENT_ENDED:
            current_event = ""
        elif event.kind == EventKind.ROBOT_PLACED:
            ago = trace.seconds(tick - event.tick)
            lines.append(f"event `{current_event}` had moved the robot elsewhere {ago:.2f} s before")
            causing.add(current_event)
        elif event.kind == EventKind.FAULT_TOOK_EFFECT and (quantity := _falsified_quantity(trace, event.name)):
            lines.append(f"{event.name} falsified {quantity} from t = {trace.seconds(event.tick):.2f} s on")
            causing.add(event.name)
    return lines, causing


def _position_error(trace: Trace, tick: int) -> float:
    """Return the distance in m between the estimated and the true position; nan if either position is unknown."""
    if not len(trace.belief) or not len(trace.truth):
        return math.nan
    bx, by = trace.belief.at(np.array([tick]))[0, :2].tolist()
    x, y = trace.place(tick)
    return float(np.hypot(bx - x, by - y))


def _falsified_quantity(trace: Trace, fault: str) -> str:
    """Return the quantity that a fault falsified: "the belief", "the odometry", or "" for other quantities."""
    starts = [event.data for event in trace.of_kind(EventKind.FAULT_STARTED) if event.name == fault]
    if not starts:
        return ""
    affects = starts[0].get("affects", "Odometry")  # older logs have no `affects`
    if affects == BELIEF:
        return "the belief"
    return "the odometry" if affects in ODOMETRY_TARGETS and starts[0].get("fault") in ODOMETRY_FAULTS else ""
