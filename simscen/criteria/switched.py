"""When a zone of the stack's costmap filters was on, by the log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.events import EventKind
from simscen.core.samples import Samples

if TYPE_CHECKING:
    from simscen.core.trace import Trace
    from simscen.core.zones import Filter

NEVER = "no event switched the zone on or off: leave `while_on` out to judge the whole run"


def spans_on(trace: Trace, what: Filter, region: str | None, grace: float) -> list[tuple[int, int]]:
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


def within(samples: Samples, first: int, last: int) -> Samples:
    """The samples from one tick to another, and what lies between them at both ends."""
    known = samples.ticks[(samples.ticks > first) & (samples.ticks < last)]
    ticks = np.unique(np.concatenate(([first], known, [last])))
    ticks = ticks[(ticks >= samples.ticks[0]) & (ticks <= samples.ticks[-1])]
    return Samples(ticks, samples.at(ticks))
