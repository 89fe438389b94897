"""Intervals of a run in which faults, events, or zones were active, and how the run ended."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.records.events import EventKind

if TYPE_CHECKING:
    from simscen.core.environment.costmap_filters import Filter
    from simscen.core.records.trace import Samples, Ticks, Trace
    from simscen.criteria.trace_signals.ground_truth import Flags

START_KINDS = (EventKind.FAULT_STARTED, EventKind.EVENT_STARTED, EventKind.MARK)
"""Kinds of recorded events that start a fault, an event of the scenario, or a mark."""
_END_KINDS = (EventKind.FAULT_ENDED, EventKind.EVENT_ENDED)
NEVER_ENABLED = "no event enabled the zone for longer than `grace`: leave `while_on` out to judge the whole run"
"""Reason of inconclusive findings with `while_on` if there is no interval in which the zone was enabled."""


@dataclass(frozen=True)
class Span:
    """Interval from tick `start` to tick `end` in which a fault, event, or mark was active.

    `has_end_event` is False if the interval lasts to the end of the run, because no recorded event ended it.
    """

    start: int
    end: int
    has_end_event: bool


def spans(trace: Trace, label: str) -> list[Span]:
    """Return the intervals in which faults, events, or marks (of the action `mark`) with this label were active.

    The intervals are sorted by start. If the end was not recorded, or was recorded at the tick of the start, the
    interval lasts to the end of the run.
    """
    starts = [event for event in trace.of_kind(*START_KINDS) if event.name == label]
    ends = [event for event in trace.of_kind(*_END_KINDS) if event.name == label]
    found = []
    # Several faults or events can have the same label. `entry` is the index of one of them in the scenario.
    for entry in dict.fromkeys(start.data.get("entry") for start in starts):
        start_ticks = [start.tick for start in starts if start.data.get("entry") == entry]
        end_ticks = [end.tick for end in ends if end.data.get("entry") == entry]
        for start, end in zip_longest(start_ticks, end_ticks[: len(start_ticks)]):
            found.append(Span(start, end, True) if end and end > start else Span(start, trace.end, False))
    return sorted(found, key=lambda span: span.start)


def never_started(trace: Trace, label: str) -> tuple[str, list[str]]:
    """Return a message that the fault or event `label` never started, and detail lines with other labels."""
    started = sorted({event.name for event in trace.of_kind(*START_KINDS)})
    names = ", ".join(f"`{name}`" for name in started) or "nothing"
    return f"`{label}` never started; the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})", [
        f"started in this run: {names}"
    ]


def end_reason(trace: Trace) -> str:
    """Return the reason why the run ended; "the log stops there" for a truncated log."""
    ends = trace.of_kind(EventKind.RUN_ENDED)
    return ends[-1].name if ends else "the log stops there"


def has_ended(trace: Trace) -> bool:
    """Return whether the log contains the end of the run; False for a truncated log."""
    return bool(trace.of_kind(EventKind.RUN_ENDED))


def enabled_spans(trace: Trace, costmap_filter: Filter, region: str | None, grace: float) -> list[tuple[int, int]]:
    """Return the intervals (first tick, last tick) in which a zone of a costmap filter was enabled.

    `region` is the region of the zone; None for the mask of the filter. Intervals begin `grace` seconds after an
    event enabled the zone, or at tick 0 if the first event disabled the zone. The list is empty if no event switched
    the zone.
    """
    zone = (region or "", costmap_filter)
    switches = [e for e in trace.of_kind(EventKind.ZONE_SWITCHED) if (e.name, e.data["filter"]) == zone]
    if not switches:
        return []
    begin: int | None = None if switches[0].data["enabled"] else 0
    found: list[tuple[int, int]] = []
    for switch in switches:
        if not switch.data["enabled"] and begin is not None:
            found.append((begin, switch.tick))
            begin = None
        elif switch.data["enabled"] and begin is None:
            begin = switch.tick + round(grace * trace.tick_rate)
    found += [] if begin is None else [(begin, trace.end)]
    return [(first, last) for first, last in found if first <= last]


def clip_samples(samples: Samples, first: int, last: int) -> Samples:
    """Return the samples from tick `first` to tick `last`, including samples at exactly these two ticks.

    A sample that is added at one of the two ticks repeats the sample before it. No sample is added before the first or
    after the last of `samples`.
    """
    inner = samples.ticks[(samples.ticks > first) & (samples.ticks < last)]
    ticks = np.unique(np.concatenate(([first], inner, [last])))
    ticks = ticks[(ticks >= samples.ticks[0]) & (ticks <= samples.ticks[-1])]
    return type(samples)(ticks, samples.at(ticks))


def first_sustained(ticks: Ticks, is_true: Flags, hold: int, end: int) -> tuple[int | None, bool]:
    """Return (tick, True) for the first tick from which a state is true for at least `hold` ticks.

    `is_true` contains the state at each of the `ticks`; the last state lasts until the tick `end`. If the state is
    never true for so long, return (tick, False) if it is true from `tick` until `end`, and otherwise (None, False).
    """
    begins = np.flatnonzero(is_true & ~np.concatenate(([False], is_true[:-1])))
    breaks = np.flatnonzero(~is_true & np.concatenate(([False], is_true[:-1])))
    stops = np.full(len(begins), end, dtype=np.int64)
    stops[: len(breaks)] = ticks[breaks]
    lasting = stops - ticks[begins] >= hold
    if lasting.any():
        return int(ticks[begins[int(np.argmax(lasting))]]), True
    return (int(ticks[begins[-1]]), False) if len(is_true) and is_true[-1] else (None, False)
