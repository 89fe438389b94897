"""Outcomes of disturbances (events and faults of a scenario), and verdicts on disturbances that did not happen.

A disturbance does not happen if its trigger never fires or if it has no effect. For example, an action finds no object
to act on, or a fault ends before its sensor sends a message.
"""

from collections.abc import Iterator, Sequence

from simscen.core.records.case import Case
from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Verdict, unique_name
from simscen.criteria.findings import missed, undecided
from simscen.criteria.timeline import end_reason, has_ended
from simscen.judge.finding_text import DISTURBANCE

FINDING_NAME = "disturbance did not happen"
"""`Finding.what` for a disturbance that did not happen."""


def disturbance_outcomes(trace: Trace, case: Case) -> tuple[DisturbanceOutcome, ...]:
    """Return the outcome of each disturbance of the scenario, in the order of `case.disturbances`."""
    return tuple(
        _event_outcome(trace, case, disturbance, entry)
        if disturbance.kind == "event"
        else _fault_outcome(trace, disturbance, entry)
        for entry, disturbance in _enumerate_by_kind(case.disturbances)
    )


def missing_disturbances(
    trace: Trace, outcomes: Sequence[DisturbanceOutcome], others: Sequence[Verdict] = ()
) -> tuple[tuple[Verdict, int], ...]:
    """Return a verdict for each required disturbance that did not happen, with the line of the disturbance.

    The verdict is inconclusive if the log is truncated. A step of a sequence that was not due, because a required
    earlier step never started, gets no verdict. The ID of the verdict is the name of the disturbance, with a number
    appended if another verdict, also one of `others`, has this ID.
    """
    missing = [one for one in outcomes if one.missing and not _was_never_due(one, outcomes)]
    used_ids = {verdict.id for verdict in others}
    verdicts = []
    for outcome in missing:
        name = unique_name(outcome.disturbance.name, used_ids)
        verdict = Verdict(DISTURBANCE, name, "fail", (_finding(trace, outcome),))
        verdicts.append((verdict, outcome.disturbance.line))
    return tuple(verdicts)


def _was_never_due(outcome: DisturbanceOutcome, outcomes: Sequence[DisturbanceOutcome]) -> bool:
    """Return whether the outcome belongs to a step of a sequence, and a required earlier step never started."""
    after = outcome.disturbance.after
    if after is None or outcome.fired:
        return False
    previous_step = [other for other in outcomes if other.disturbance.kind == "event"][after]
    return not previous_step.fired and (previous_step.missing or _was_never_due(previous_step, outcomes))


def _enumerate_by_kind(disturbances: Sequence[Disturbance]) -> Iterator[tuple[int, Disturbance]]:
    """Yield (index, disturbance). Events and faults have separate indices, as `entry` in the log."""
    counts = {"event": 0, "fault": 0}
    for one in disturbances:
        yield counts[one.kind], one
        counts[one.kind] += 1


def _finding(trace: Trace, outcome: DisturbanceOutcome) -> Finding:
    """Return the finding on a missing disturbance: a failure, or inconclusive if the log is truncated."""
    text = f"{outcome.disturbance.name} ({outcome.disturbance.trigger})"
    if not has_ended(trace):
        reason = f"{text}, until the log stops at t = {trace.seconds(trace.end):.2f} s"
        return undecided(FINDING_NAME, reason, detail=(outcome.effect,))
    return missed(FINDING_NAME, text, "", None if outcome.tick is None else (trace, outcome.tick), (outcome.effect,))


def _events_of_entry(trace: Trace, kind: EventKind, entry: int) -> list[Event]:
    return [event for event in trace.of_kind(kind) if event.data.get("entry") == entry]


def _event_outcome(trace: Trace, case: Case, disturbance: Disturbance, entry: int) -> DisturbanceOutcome:
    """Return the outcome of an event. An event happened if each action took effect at least once before the run ended.

    An event without actions happened if its trigger fired.
    """
    started = _events_of_entry(trace, EventKind.EVENT_STARTED, entry)
    fired = tuple(event.tick for event in started)
    ended = _events_of_entry(trace, EventKind.EVENT_ENDED, entry)
    if not started:
        return DisturbanceOutcome(
            disturbance, (), False, _due_text(trace, case, disturbance) + _never_began_text(trace)
        )
    in_time = [event for event in ended if event.tick < trace.end]
    if not in_time:
        return DisturbanceOutcome(disturbance, fired, False, _no_effect_text(trace, fired[0]), fired[0])
    effects_by_firing = [_effects(event) for event in in_time]
    for action in range(len(effects_by_firing[0])):
        if not any(effects[action][0] for effects in effects_by_firing):
            return DisturbanceOutcome(disturbance, fired, False, effects_by_firing[0][action][1], in_time[0].tick)
    if not effects_by_firing[0]:  # an event without actions
        return DisturbanceOutcome(disturbance, fired, True, "its trigger fired", in_time[0].tick)
    first = next(k for k, effects in enumerate(effects_by_firing) if any(happened for happened, _ in effects))
    text = "; ".join(text for happened, text in effects_by_firing[first] if happened)
    return DisturbanceOutcome(disturbance, fired, True, text, in_time[first].tick)


def _due_text(trace: Trace, case: Case, disturbance: Disturbance) -> str:
    """Return when a step of a sequence was due, or which earlier step did not happen; "" for other events."""
    if disturbance.after is None:
        return ""
    events = [one for one in case.disturbances if one.kind == "event"]
    previous_step = events[disturbance.after]
    started = _events_of_entry(trace, EventKind.EVENT_STARTED, disturbance.after)
    if started:
        return f"it was due from t = {trace.seconds(started[0].tick):.2f} s, after {previous_step.name}; "
    while previous_step.after is not None and not _events_of_entry(trace, EventKind.EVENT_STARTED, previous_step.after):
        previous_step = events[previous_step.after]
    return f"it was not due, because {previous_step.name} had not happened; "


def _effects(ended: Event) -> list[tuple[bool, str]]:
    """Return (True if it had an effect, text on the effect or the lack of one) for each action of an event."""
    effects = ended.data.get("effects")
    assert isinstance(effects, list)
    return [(bool(one["happened"]), str(one["what"])) for one in effects if isinstance(one, dict)]


def _fault_outcome(trace: Trace, disturbance: Disturbance, entry: int) -> DisturbanceOutcome:
    """Return the outcome of a fault. A fault happened if it changed a message or command before the end of the run."""
    started = _events_of_entry(trace, EventKind.FAULT_STARTED, entry)
    fired = tuple(event.tick for event in started)
    if not started:
        return DisturbanceOutcome(disturbance, (), False, _never_began_text(trace))
    sensor, ended = started[0].data.get("sensor"), _events_of_entry(trace, EventKind.FAULT_ENDED, entry)
    effect_ticks = [
        event.tick for event in _events_of_entry(trace, EventKind.FAULT_TOOK_EFFECT, entry) if event.tick < trace.end
    ]
    if effect_ticks:
        counts = [event.data.get("touched") for event in ended]
        total = sum(count for count in counts if isinstance(count, int))
        times = (" once" if total == 1 else f" {total} times") if len(ended) == len(started) else ""
        delay = f", first at t = {trace.seconds(effect_ticks[0]):.2f} s" if effect_ticks[0] > fired[0] else ""
        return DisturbanceOutcome(disturbance, fired, True, f"disturbed {sensor}{times}{delay}", effect_ticks[0])
    if fired[0] >= trace.end:
        return DisturbanceOutcome(disturbance, fired, False, _too_late_text(trace), fired[0])
    until = f"to t = {trace.seconds(ended[0].tick):.2f} s" if ended else "on"
    more = f", the first of {len(fired)} times" if len(fired) > 1 else ""
    reason = f"it changed no message of {sensor} from t = {trace.seconds(fired[0]):.2f} s {until}{more}"
    return DisturbanceOutcome(disturbance, fired, False, reason, fired[0])


def _never_began_text(trace: Trace) -> str:
    """Return the text for a disturbance whose trigger never fired."""
    return f"it never began; the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})"


def _no_effect_text(trace: Trace, start: int) -> str:
    """Return the text for an event that began at the tick `start` and has no recorded effect before the end."""
    if start < trace.end:
        return f"its effect is not in the log, which ends at t = {trace.seconds(trace.end):.2f} s"
    return _too_late_text(trace)


def _too_late_text(trace: Trace) -> str:
    """Return the text for a disturbance whose trigger fired only at the end of the run."""
    return f"it began only when the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})"
