"""The criterion `collisions`: number and impulse of contacts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from simscen.core.records.events import Event, EventKind
from simscen.core.records.verdict import Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import InvalidTrace, MissingEvidence, at_most, counted, undecided
from simscen.criteria.trace_signals.distances import pedestrian_radii
from simscen.criteria.trace_signals.ground_truth import speed, turn_rate
from simscen.spec.base import Spec
from simscen.spec.places import ObjectName
from simscen.spec.quantities import Impulse

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

MOVING_SPEED_M_S = 0.1
"""Speed in m/s below which the robot did not cause the contact, as in the CollisionTest of CARLA."""

LOOKBACK_S = 0.1
"""Time in s before the contact in which the speed counts, because the contact itself stops the robot."""

MAX_DETAILS = 5


class Collisions(Spec, Criterion):
    """The robot touched no more than it may.

    What is measured: contacts between the robot's body and anything but the ground, each counted when it begins, and
        the impulse of each.
    When it fails: more contacts than `max`, or one with an impulse above `max_impulse`.
    Why this: contacts come from the physics. Counting scans shorter than the robot's radius, as Arena does, misses
        whatever the lidar does not see.
    Source: Arena's get_collisions for counting rising edges; ScenarioRunner's CollisionTest for whose fault it was.

    Example: `collisions: {max: 0}`
    """

    max: Annotated[int, Field(ge=0, le=100_000)] | None = None
    """How many contacts are allowed; default: 0, or any number if `max_impulse` is given."""
    max_impulse: Annotated[Impulse, Field(ge=0)] | None = None
    """No contact may be harder than this, in N s."""
    object: ObjectName | None = Field(default=None, alias="with")
    """Only contacts with this object, by name."""
    people: bool = False
    """Only contacts with people: pedestrians, and those of crowds."""
    caused_by_robot: bool = False
    """Only contacts at which the robot itself was moving: not when something ran into it while it stood."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        speed_needed = {Evidence.TRUTH, Evidence.VELOCITY} if self.caused_by_robot else set()
        people_needed = {Evidence.OBJECTS} if self.people else set()
        return frozenset({Evidence.CONTACTS, *speed_needed, *people_needed})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return findings for the number of collisions and for the largest impulse."""
        if not len(trace.truth) and not trace.of_kind(EventKind.COLLISION_STARTED):
            return [undecided("collisions", "neither the robot's way nor what it touched was recorded")]
        hits = [event for event in trace.of_kind(EventKind.COLLISION_STARTED) if self.object in (None, event.name)]
        if self.people:
            everybody = pedestrian_radii(trace)
            if not everybody:
                return [undecided("collisions", "there were no people")]
            hits = [event for event in hits if event.name in everybody]
        if self.caused_by_robot:
            hits = [event for event in hits if _moving(trace, event, case)]
        limit = 0 if self.max is None and self.max_impulse is None else self.max
        told = [_told(trace, hit) for hit in hits[:MAX_DETAILS]]
        if len(hits) > MAX_DETAILS:
            told.append(f"and {len(hits) - MAX_DETAILS} more")
        decisive = (trace, hits[min(limit or 0, len(hits) - 1)].tick) if hits else None
        findings = counted("collisions", len(hits), "collision", None, limit, at=decisive, detail=told)
        if self.max_impulse is not None:
            findings.append(self._hardest(trace, hits))
        return findings

    def _hardest(self, trace: Trace, hits: list[Event]) -> Finding:
        assert self.max_impulse is not None
        silent = next((hit for hit in hits if "impulse" not in hit.data), None)
        if silent is not None:
            because = f"how hard it touched {silent.name or 'something'} was not recorded"
            return undecided("collision impulse", because, f"≤ {self.max_impulse:.2f} N s")
        worst = max(hits, key=_impulse, default=None)
        value = 0.0 if worst is None else _impulse(worst)
        at = None if worst is None else (trace, worst.tick)
        told = [] if worst is None else [_told(trace, worst)]
        return at_most("collision impulse", value, self.max_impulse, "N s", at=at, detail=told)


def _impulse(hit: Event) -> float:
    value = hit.data["impulse"]
    if not isinstance(value, int | float) or math.isnan(value):
        raise InvalidTrace(f"the impulse of the collision with {hit.name} is not a number")
    return float(value)


def _moving(trace: Trace, hit: Event, case: Case) -> bool:
    """Return whether any point of the robot's hull moved faster than OWN_FAULT before the contact."""
    reach = max((math.hypot(x, y) for x, y in case.footprint), default=case.inscribed_radius)
    linear, turning = speed(trace), turn_rate(trace)
    if not len(linear):
        raise MissingEvidence("the robot's true velocity was not recorded, so whose fault a contact was is not known")
    # From the newest sample before the window on: where samples are rare, none may lie within it.
    since = round(hit.tick - LOOKBACK_S * trace.tick_rate)
    first, last = np.searchsorted(linear.ticks, (since, hit.tick), side="right").tolist()
    window = slice(max(first - 1, 0), max(last, 1))
    fastest = linear.values[window] + reach * turning.values[window]
    return bool(fastest.max() > MOVING_SPEED_M_S)


def _told(trace: Trace, hit: Event) -> str:
    text = f"t = {trace.seconds(hit.tick):.2f} s: touched {hit.name or 'something'}"
    x, y, at, hard = (hit.data.get(key) for key in ("x", "y", "speed", "impulse"))
    if isinstance(x, int | float) and isinstance(y, int | float):
        text += f" at ({x:.2f}, {y:.2f})"
    if isinstance(at, int | float):
        text += f" at {at:.2f} m/s"
    return f"{text}, {hard:.1f} N s" if isinstance(hard, int | float) else text
