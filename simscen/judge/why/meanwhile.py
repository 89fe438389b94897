"""Which faults and events were under way when something failed, or had just been."""

from collections.abc import Iterator, Set

from simscen.core.events import Event, EventKind
from simscen.core.trace import Trace

FAULTS_LAST, EVENTS_LAST = 3.0, 5.0
"""Seconds after the end of a fault, and after an event, in which it is still told."""


def meanwhile(trace: Trace, tick: int, known: Set[str] = frozenset()) -> list[str]:
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
        elif trace.seconds(tick - end) <= FAULTS_LAST:
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
        if not 0 <= ago <= EVENTS_LAST or not isinstance(effects, list):
            continue
        told = [str(one["what"]) for one in effects if isinstance(one, dict) and one["happened"]]
        if told:
            yield event.name, f"event `{event.name}` came {ago:.2f} s before: {', '.join(told)}"
