"""The criterion `collisions`: number and impulse of contacts."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
from pydantic import Field

from simscen.core.records.events import Event, EventKind
from simscen.core.records.verdict import Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import InvalidTrace, MissingEvidence, at_most, counted, undecided
from simscen.criteria.trace_signals.distances import pedestrian_radii
from simscen.criteria.trace_signals.event_readers import require_object
from simscen.criteria.trace_signals.ground_truth import speed, turn_rate
from simscen.spec.base import Spec
from simscen.spec.places import ObjectName
from simscen.spec.quantities import Impulse

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Trace

MIN_CAUSING_SPEED_M_S = 0.1
"""Speed that a robot must exceed to cause a contact, as in the CollisionTest of CARLA."""

LOOKBACK_S = 0.1
"""Time before a contact in which the robot must exceed MIN_CAUSING_SPEED_M_S to have caused the contact."""

MAX_DETAILS = 5
"""Maximum number of contacts that a finding lists."""


class Collisions(Spec, Criterion):
    """The robot had at most the allowed number of collisions, and no collision was too hard.

    What is measured: the number of contacts that begin between the robot and anything but the ground, and the impulse
        of each contact: the sum over all physics steps from its beginning to its end.
    When it fails: there are more contacts than `max`, or a contact has an impulse above `max_impulse`.
    Why this: the physics engine reports all contacts. Arena counts scans with ranges below the robot's radius instead,
        which misses everything that the lidar does not see.
    Source: Arena's get_collisions, which also counts beginning contacts; ScenarioRunner's CollisionTest for
        `caused_by_robot`.

    With `people`, inconclusive if the run had no people. With `max_impulse`, inconclusive if a contact had not ended or
    its impulse was not recorded, unless another impulse exceeds the limit.

    Example: `collisions: {max: 0}`
    """

    max: Annotated[int, Field(ge=0, le=100_000)] | None = None
    """Maximum number of contacts; default: 0, or any number if `max_impulse` is given."""
    max_impulse: Annotated[Impulse, Field(ge=0)] | None = None
    """Maximum impulse of a contact, from its beginning to its end, in N s."""
    object: ObjectName | None = Field(default=None, alias="with")
    """Count only contacts with the object of this name."""
    people: bool = False
    """Count only contacts with people: pedestrians and members of crowds."""
    caused_by_robot: bool = False
    """Count only contacts of a moving robot, not contacts of a standing robot with a moving object."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        speed_needed = {Evidence.TRUTH, Evidence.VELOCITY} if self.caused_by_robot else set()
        people_needed = {Evidence.OBJECTS} if self.people else set()
        return frozenset({Evidence.CONTACTS, *speed_needed, *people_needed})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return findings for the number of collisions and, with `max_impulse`, for the largest impulse.

        Raises MissingEvidence if there is no object with the name given by `with`, or if the cause of a contact matters
        (`caused_by_robot`) and the trace has no velocity.
        """
        if self.object is not None:
            require_object(case, self.object)
        if not len(trace.truth) and not trace.of_kind(EventKind.COLLISION_STARTED):
            return [undecided("collisions", "neither the robot's path nor its contacts were recorded")]
        contacts = [contact for contact in _contacts(trace) if self.object in (None, contact.start.name)]
        if self.people:
            radii = pedestrian_radii(trace)
            if not radii:
                return [undecided("collisions", "there were no people")]
            contacts = [contact for contact in contacts if contact.start.name in radii]
        if self.caused_by_robot and contacts:
            speeds = _max_point_speed(trace, case)
            contacts = [contact for contact in contacts if _is_caused_by_robot(trace, contact.start, speeds)]
        limit = 0 if self.max is None and self.max_impulse is None else self.max
        details = [_describe_contact(trace, contact) for contact in contacts[:MAX_DETAILS]]
        if len(contacts) > MAX_DETAILS:
            details.append(f"and {len(contacts) - MAX_DETAILS} more")
        decisive = (trace, contacts[min(limit or 0, len(contacts) - 1)].start.tick) if contacts else None
        findings = counted("collisions", len(contacts), "collision", None, limit, at=decisive, detail=details)
        if self.max_impulse is not None:
            findings.append(self._judge_impulse(trace, contacts))
        return findings

    def _judge_impulse(self, trace: Trace, contacts: list[_Contact]) -> Finding:
        assert self.max_impulse is not None
        what, limit = "collision impulse", f"≤ {self.max_impulse:.2f} N s"
        hardest = max((contact for contact in contacts if contact.impulse is not None), key=_impulse, default=None)
        value = 0.0 if hardest is None else _impulse(hardest)
        unknown = next((contact for contact in contacts if contact.impulse is None), None)
        if unknown is not None and value <= self.max_impulse:
            return undecided(what, f"the impulse of the contact with {unknown.name} was not recorded", limit)
        ongoing = next((contact for contact in contacts if contact.end is None), None)
        if ongoing is not None and value <= self.max_impulse:
            return undecided(what, f"the contact with {ongoing.name} had not ended", limit)
        at = None if hardest is None else (trace, hardest.start.tick)
        details = [] if hardest is None else [_describe_contact(trace, hardest)]
        return at_most(what, value, self.max_impulse, "N s", at=at, detail=details)


class _Contact(NamedTuple):
    """Events of the start and the end of a contact; `end` is None if it was not recorded."""

    start: Event
    end: Event | None

    @property
    def name(self) -> str:
        """Name of the touched object for messages."""
        return self.start.name or "something"

    @property
    def impulse(self) -> object:
        """Recorded impulse in N s; if the end was not recorded, the impulse of the first physics step. May be None."""
        return (self.start if self.end is None else self.end).data.get("impulse")


def _contacts(trace: Trace) -> list[_Contact]:
    """Return the contacts of a trace, sorted by their start."""
    found: list[_Contact] = []
    ongoing: dict[str, int] = {}
    for event in trace.of_kind(EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED):
        if event.kind == EventKind.COLLISION_STARTED:
            ongoing[event.name] = len(found)
            found.append(_Contact(event, None))
        elif (index := ongoing.pop(event.name, None)) is not None:
            found[index] = _Contact(found[index].start, event)
    return found


def _impulse(contact: _Contact) -> float:
    """Return the impulse of a contact in N s. Raises InvalidTrace if it is not a number."""
    value = contact.impulse
    if not isinstance(value, int | float) or math.isnan(value):
        raise InvalidTrace(f"the impulse of the collision with {contact.start.name} is not a number")
    return float(value)


def _max_point_speed(trace: Trace, case: Case) -> Samples:
    """Return an upper bound (n, 1) in m/s on the speed of all points of the robot: speed plus turn rate times radius.

    Raises MissingEvidence if the trace has no velocity.
    """
    radius = max((math.hypot(x, y) for x, y in case.footprint), default=case.inscribed_radius)
    linear, turning = speed(trace), turn_rate(trace)
    if not len(linear):
        raise MissingEvidence("it is unknown who caused a contact, because the robot's true velocity was not recorded")
    return replace(linear, values=linear.values + radius * turning.values)


def _is_caused_by_robot(trace: Trace, start: Event, speeds: Samples) -> bool:
    """Return whether the robot may have exceeded MIN_CAUSING_SPEED_M_S shortly before a contact (LOOKBACK_S).

    `start` is the event of the start of the contact, and `speeds` the result of `_max_point_speed`.
    """
    # The newest sample before the window is included, because rare samples may leave the window empty.
    window_start = round(start.tick - LOOKBACK_S * trace.tick_rate)
    first, last = np.searchsorted(speeds.ticks, (window_start, start.tick), side="right").tolist()
    return bool(speeds.values[max(first - 1, 0) : max(last, 1)].max() > MIN_CAUSING_SPEED_M_S)


def _describe_contact(trace: Trace, contact: _Contact) -> str:
    """Return time, object, position, speed, and impulse of a contact as text."""
    text = f"t = {trace.seconds(contact.start.tick):.2f} s: touched {contact.name}"
    x, y, speed_m_s = (contact.start.data.get(key) for key in ("x", "y", "speed"))
    impulse = contact.impulse
    if isinstance(x, int | float) and isinstance(y, int | float):
        text += f" at ({x:.2f}, {y:.2f})"
    if isinstance(speed_m_s, int | float):
        text += f" at {speed_m_s:.2f} m/s"
    return f"{text}, {impulse:.1f} N s" if isinstance(impulse, int | float) else text
