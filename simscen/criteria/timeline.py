"""When things happened that criteria refer to by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.events import Event, EventKind, Value
from simscen.core.goalnames import FAILED
from simscen.core.navigation import Goal
from simscen.core.samples import Samples
from simscen.criteria.error_codes import code_of

if TYPE_CHECKING:
    from simscen.core.trace import Trace
    from simscen.core.zones import Filter

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace

_STARTS = (EventKind.FAULT_STARTED, EventKind.EVENT_STARTED, EventKind.MARK)
_ARRIVED = (EventKind.GOAL_REACHED, EventKind.GOAL_PASSED)
_GOAL_ENDS = (*_ARRIVED, EventKind.GOAL_FAILED, EventKind.GOAL_CANCELED)
_ENDS = (EventKind.FAULT_ENDED, EventKind.EVENT_ENDED)


@dataclass(frozen=True)
class Span:
    """From `start` to `end` in ticks; `lasting` says that it has an end of its own, as a fault with `for` does."""

    start: int
    end: int
    lasting: bool


def spans(trace: Trace, label: str) -> list[Span]:
    """Each time the fault, event or mark `label` happened. What never ended, or takes no time, goes on to the end.

    Several entries of a scenario may share a label; the end of one is not that of another.
    """
    starts = [event for event in trace.of_kind(*_STARTS) if event.name == label]
    ends = [event for event in trace.of_kind(*_ENDS) if event.name == label]
    found = []
    for entry in dict.fromkeys(_entry(start) for start in starts):
        begun = [start.tick for start in starts if _entry(start) == entry]
        over = [end.tick for end in ends if _entry(end) == entry]
        found += [_span(trace, *pair) for pair in zip_longest(begun, over[: len(begun)])]
    return sorted(found, key=lambda span: span.start)


def _entry(event: Event) -> Value:
    """Which entry of the scenario it is about."""
    return event.data.get("entry")


def _span(trace: Trace, start: int, end: int | None) -> Span:
    return Span(start, end, True) if end and end > start else Span(start, trace.end, False)


def never_started(trace: Trace, label: str) -> tuple[str, list[str]]:
    """Why there is nothing to judge after `label`, and what there would have been."""
    started = sorted({event.name for event in trace.of_kind(*_STARTS)})
    names = ", ".join(f"`{name}`" for name in started) or "nothing"
    return f"`{label}` never started; the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})", [
        f"started in this run: {names}"
    ]


def end_reason(trace: Trace) -> str:
    """Why the run ended, in words."""
    ends = trace.of_kind(EventKind.RUN_ENDED)
    return ends[-1].name if ends else "the log stops there"


def has_ended(trace: Trace) -> bool:
    """Whether the run came to its own end, be it the time limit; a log that was cut off did not."""
    return bool(trace.of_kind(EventKind.RUN_ENDED))


@dataclass(frozen=True)
class GoalOutcome:
    """What became of a goal, as the robot reported it: when it was accepted, and the event that ended it.

    `failure` is how the scenario has it fail: "failed", or the name of an error code; "" where it is to be reached.
    """

    goal: Goal
    accepted: int | None
    end: Event | None
    failure: str = ""

    @property
    def reached(self) -> int | None:
        """The tick at which the robot said that it was there, or came past it."""
        return self.end.tick if self.end is not None and self.end.kind in _ARRIVED else None

    @property
    def awaited(self) -> bool:
        """Whether the robot is to arrive there: no other goal was sent instead, and it is not to fail."""
        return not self.preempted and not self.failure

    @property
    def failed_as_expected(self) -> bool:
        """Whether it failed, and in the way that the scenario asks for."""
        if self.end is None or self.end.kind != EventKind.GOAL_FAILED:
            return False
        return self.failure in (FAILED, code_of(self.end))

    @property
    def preempted(self) -> bool:
        """Whether another goal was sent before it was reached: Nav2 drops a goal then, and nobody waits for it."""
        return self.end is not None and bool(self.end.data.get("preempted_by"))

    @property
    def fate(self) -> str:
        """In words: what the robot said of it."""
        if self.end is None:
            return "never accepted" if self.accepted is None else "still under way"
        if self.preempted:
            return f"preempted by {self.end.data['preempted_by']}"
        code = self.end.data.get("error_name") or self.end.data.get("error_code")
        return self.end.kind.removeprefix("goal.") + (f" with {code}" if code else "")


def goal_outcomes(trace: Trace, case: Case) -> list[GoalOutcome]:
    """The story of each goal of the scenario and of each that an event sent, in the order in which they were accepted.

    The k-th goal of a name is the k-th one reported under that name; a goal of the scenario that was never accepted
    comes last, and one that no event sent has no story. Poses that are to be passed, and of which nothing is said, have
    the story of the goal that their drive stops at: Nav2's status tells no more.
    """
    told = _reports(trace)
    before = _counted([goal.name for goal in case.goals])
    found = [
        GoalOutcome(goal, *_nth(told.get(goal.name, []), before[k]), case.expected.get(goal.name, ""))
        for k, goal in enumerate(case.goals)
    ]
    found = [_with_its_drive(story, found[k + 1 :], told) for k, story in enumerate(found)]
    for goal in case.sent:
        reports = told.get(goal.name, [])
        # What it preempted may be several poses of one drive.
        preempting = {event.tick for event in trace.events if event.data.get("preempted_by") == goal.name}
        sent = max(len(reports), len(preempting))
        found += [GoalOutcome(goal, *_nth(reports, k)) for k in range(sent)]
    return sorted(found, key=outcome_start)


def _with_its_drive(story: GoalOutcome, later: list[GoalOutcome], told: Mapping[str, list[_Report]]) -> GoalOutcome:
    stop = next((each for each in later if not each.goal.via), None)
    if not story.goal.via or story.goal.name in told or stop is None or stop.end is None:
        return story
    kind = EventKind.GOAL_PASSED if stop.reached is not None else stop.end.kind
    return replace(story, accepted=stop.accepted, end=replace(stop.end, kind=kind, name=story.goal.name))


def _counted(names: list[str]) -> list[int]:
    """How often each name came before."""
    seen: dict[str, int] = {}
    counts = []
    for name in names:
        counts.append(seen.get(name, 0))
        seen[name] = counts[-1] + 1
    return counts


_Report = tuple[int | None, Event | None]
"""When a goal was accepted, and the event that ended it."""


def _reports(trace: Trace) -> dict[str, list[_Report]]:
    """Of each name the goals that were reported under it, in order."""
    told: dict[str, list[_Report]] = {}
    for event in trace.of_kind(EventKind.GOAL_ACCEPTED, *_GOAL_ENDS):
        reports = told.setdefault(event.name, [])
        if event.kind == EventKind.GOAL_ACCEPTED:
            reports.append((event.tick, None))
        elif reports and reports[-1][1] is None:
            reports[-1] = (reports[-1][0], event)
        else:
            reports.append((None, event))
    return told


def _nth(reports: list[_Report], k: int) -> _Report:
    return reports[k] if k < len(reports) else (None, None)


def outcome_start(story: GoalOutcome) -> float:
    """The tick at which the robot accepted it, or else first said something of it; inf when it never did."""
    if story.accepted is not None:
        return story.accepted
    return math.inf if story.end is None else story.end.tick


# MERGED: When a zone of the stack's costmap filters was on, by the log.
NEVER_SWITCHED = "no event switched the zone on or off: leave `while_on` out to judge the whole run"


def enabled_spans(trace: Trace, what: Filter, region: str | None, grace: float) -> list[tuple[int, int]]:
    """From which tick to which a zone, or the mask of a filter, was on, without `grace` seconds after being switched.

    What is switched off first was on from the start. Empty where nothing was switched.
    """
    switches = [e for e in trace.of_kind(EventKind.ZONE_SWITCHED) if (e.name, e.data["filter"]) == (region or "", what)]
    if not switches:
        return []
    begin: int | None = None if switches[0].data["enabled"] else 0
    spans: list[tuple[int, int]] = []
    for switch in switches:
        if not switch.data["enabled"] and begin is not None:
            spans.append((begin, switch.tick))
            begin = None
        elif switch.data["enabled"] and begin is None:
            begin = switch.tick + round(grace * trace.tick_rate)
    spans += [] if begin is None else [(begin, trace.end)]
    return [(first, last) for first, last in spans if first <= last]


def clip_samples(samples: Samples, first: int, last: int) -> Samples:
    """The samples from one tick to another, and what lies between them at both ends."""
    known = samples.ticks[(samples.ticks > first) & (samples.ticks < last)]
    ticks = np.unique(np.concatenate(([first], known, [last])))
    ticks = ticks[(ticks >= samples.ticks[0]) & (ticks <= samples.ticks[-1])]
    return Samples(ticks, samples.at(ticks))
