"""Search for the causes of a missed goal, such as a blocked passage, an occupied goal, or an object near the robot."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.polygons import distance_to_segment, signed_double_area
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode
from simscen.core.records.case import Case, Passage
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.criteria.error_codes import error_code_name
from simscen.criteria.goal_outcomes import GoalOutcome, goal_outcomes, outcome_start

Diagnosis = tuple[list[str], set[str]]
"""Sentences on causes, and names of the disturbances that they mention ("" for an object that no event changed)."""


@dataclass(frozen=True)
class MovableObject:
    """State of a movable object at a tick.

    outlines:   corners (n, 2) in m of each part of the object in the world frame
    event:      name of the event that spawned or last moved the object; "" if no event did
    since:      tick at which the object was spawned or last moved
    was_moved:  whether the object was moved after it was spawned
    """

    name: str
    outlines: tuple[Array, ...]
    event: str
    since: int
    was_moved: bool

    def describe(self, trace: Trace) -> str:
        """Return the name and the last change, e.g. "crate (spawned by event `crate falls` at t = 1.00 s)"."""
        if not self.event:
            return self.name
        verb = "moved" if self.was_moved else "spawned"
        return f"{self.name} ({verb} by event `{self.event}` at t = {trace.seconds(self.since):.2f} s)"

    def distance(self, points: Array) -> Array:
        """Return the distances in m (n,) from points (n, 2) to the object; 0 inside the object."""
        nearest: Array = np.min([_distance(points, outline) for outline in self.outlines], axis=0)
        return nearest


def movable_objects(trace: Trace, tick: int) -> list[MovableObject]:
    """Return the movable objects that exist at `tick`, in the order in which they were spawned."""
    spawned: dict[str, Event] = {}
    last: dict[str, tuple[str, Event]] = {}
    current_event = ""
    for event in trace.events:
        if event.tick > tick:
            continue
        match event.kind:
            case EventKind.EVENT_STARTED:
                current_event = event.name
            case EventKind.EVENT_ENDED:
                current_event = ""
            case EventKind.OBJECT_SPAWNED:
                spawned[event.name], last[event.name] = event, (current_event, event)
            case EventKind.OBJECT_MOVED | EventKind.OBJECT_PLACED:
                last[event.name] = (current_event, event)
            case EventKind.OBJECT_REMOVED:
                spawned.pop(event.name, None)
    return [
        _movable_object(trace, tick, event, *last[name]) for name, event in spawned.items() if event.data.get("parts")
    ]


def pose_at(trace: Trace, spawned: Event, tick: int) -> Pose2:
    """Return the pose at `tick` of an object. `spawned` is the recorded event OBJECT_SPAWNED of this object."""
    x, y, yaw = (spawned.data.get(key) for key in ("x", "y", "yaw"))
    samples = trace.objects.get(spawned.name)
    if samples is not None:
        # The sample at its own tick precedes the spawning and may be that of an earlier object of the same name.
        now = (samples.ticks > spawned.tick) & (samples.ticks <= tick)
        if now.any():
            x, y, yaw = samples.values[now][-1].tolist()
    assert isinstance(x, int | float) and isinstance(y, int | float) and isinstance(yaw, int | float)
    return Pose2(float(x), float(y), float(yaw))


def _movable_object(trace: Trace, tick: int, spawned: Event, by: str, last: Event) -> MovableObject:
    pose, parts = pose_at(trace, spawned, tick), spawned.data["parts"]
    assert isinstance(parts, list)
    outlines = tuple(pose.apply(np.array(part, dtype=np.float64)) for part in parts)
    return MovableObject(spawned.name, outlines, by, last.tick, last.kind != EventKind.OBJECT_SPAWNED)


def _distance(points: Array, corners: Array) -> Array:
    """Return the distances in m (n,) from points (n, 2) to a filled polygon (m, 2)."""
    ends = np.roll(corners, 1, axis=0)
    step, apart = ends - corners, points[:, None] - corners
    along, squared = np.sum(apart * step, axis=2), np.sum(step**2, axis=1)
    along = np.clip(np.divide(along, squared, out=np.zeros_like(along), where=squared > 0), 0.0, 1.0)
    away: Array = np.linalg.norm(apart - along[:, :, None] * step, axis=2).min(axis=1)
    y0, y1 = corners[:, 1], ends[:, 1]
    crosses = (y0 > points[:, 1:]) != (y1 > points[:, 1:])
    x = corners[:, 0] + (points[:, 1:] - y0) / np.where(y1 == y0, 1.0, y1 - y0) * step[:, 0]
    inside = np.sum(crosses & (points[:, :1] < x), axis=1) % 2 == 1
    return np.where(inside, 0.0, away)


NEAR_ROBOT_M = 0.3
"""Maximum distance between the robot and an object that may block the robot."""


def diagnose_goal_failure(trace: Trace, case: Case, tick: int) -> Diagnosis:
    """Return why the robot has not reached its current goal at `tick`; an empty diagnosis without a current goal."""
    outcome = _current_goal(trace, case, tick)
    if outcome is None:
        return [], set()
    goal, objects = outcome.goal, movable_objects(trace, tick)
    lines = [*_unreachable_goal(case, goal), *_robot_hold(trace, tick), *_touched_objects(trace, tick)]
    named: set[str] = set()
    for sentences, events in (
        _occupied_goal(trace, case, goal, objects),
        diagnose_blocked_path(trace, case, goal.name, tick, objects),
        _nearby_object(trace, case, tick, objects),
    ):
        if "" in events or not events <= named:  # one sentence for each event is enough
            lines += sentences
            named |= events
    return [*(lines or _reported_failure(trace, outcome, tick)), *_failed_recoveries(trace, outcome, tick)], named


def _current_goal(trace: Trace, case: Case, tick: int) -> GoalOutcome | None:
    """Return the outcome of the last goal that was accepted until `tick`; None if there is none or if it is over."""
    started = [outcome for outcome in goal_outcomes(trace, case) if outcome_start(outcome) <= tick]
    return started[-1] if started and not _is_over(started[-1], tick) else None


def _is_over(outcome: GoalOutcome, tick: int) -> bool:
    """Return whether the goal was reached until `tick` or canceled before. A failed goal is not over."""
    if outcome.reached is not None:
        return outcome.reached <= tick
    return outcome.end is not None and outcome.end.kind == EventKind.GOAL_CANCELED and outcome.end.tick < tick


def _unreachable_goal(case: Case, goal: Goal) -> list[str]:
    """Return a sentence if the static world has no path to the goal."""
    if case.shortest.get(goal.name) != math.inf:
        return []
    needed = 2 * case.inscribed_radius
    narrow = [passage for passage in case.passages if passage.goal == goal.name and passage.width < needed]
    where = f"; too narrow is {narrow[0].description}" if narrow else ""
    return [f"the world has no path to goal {goal.name} for a robot {needed:.2f} m wide{where}"]


def _robot_hold(trace: Trace, tick: int) -> list[str]:
    """Return a sentence with the reported reason if a part of the stack, such as a monitor, has stopped the robot."""
    last = [
        event
        for event in trace.of_kind(EventKind.ROBOT_HELD, EventKind.ROBOT_RELEASED)
        if event.tick <= tick - (event.kind == EventKind.ROBOT_RELEASED)
    ][-1:]
    return [
        f"its {event.name.replace('_', ' ')} has stopped it, as reported at t = {trace.seconds(event.tick):.2f} s: "
        f"{event.data.get('message', '')}"
        for event in last
        if event.kind == EventKind.ROBOT_HELD
    ]


def _reported_failure(trace: Trace, outcome: GoalOutcome, tick: int) -> list[str]:
    """Return a sentence with the stack's message if it gave up the goal, and with the recoveries before."""
    end = outcome.end
    if end is None or end.tick > tick or error_code_name(end) == ErrorCode.NAVIGATE_TIMEOUT.name:  # it has no reason
        return []
    message = end.data.get("message")
    if not message:
        return []
    tried = [e.name for e in trace.of_kind(EventKind.RECOVERY_STARTED) if outcome_start(outcome) <= e.tick <= tick]
    return [f"it gave up and reported: {message}" + (f"; {', '.join(tried)} had not helped" if tried else "")]


def _failed_recoveries(trace: Trace, outcome: GoalOutcome, tick: int) -> list[str]:
    """Return a sentence on the recoveries that failed on the way to this goal, with their error codes."""
    ended = [e for e in trace.of_kind(EventKind.RECOVERY_ENDED) if outcome_start(outcome) <= e.tick <= tick]
    failed = Counter(f"{e.name} with {error_code_name(e)}" for e in ended if e.data.get("outcome") == "failed")
    counted = (what if times == 1 else f"{what} {times} times" for what, times in failed.items())
    return [f"recoveries failed: {', '.join(counted)}"] if failed else []


def _touched_objects(trace: Trace, tick: int) -> list[str]:
    """Return sentences on the objects that the robot touches at `tick`."""
    since: dict[str, int] = {}
    for event in trace.of_kind(EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED):
        if event.tick <= tick and event.kind == EventKind.COLLISION_STARTED:
            since.setdefault(event.name, event.tick)
        elif event.tick <= tick:
            since.pop(event.name, None)
    return [f"it had touched {name or 'something'} since t = {trace.seconds(at):.2f} s" for name, at in since.items()]


def _occupied_goal(trace: Trace, case: Case, goal: Goal, objects: list[MovableObject]) -> Diagnosis:
    """Return a sentence on an object that occupies the goal."""
    place = np.array([[goal.pose.x, goal.pose.y]])
    for each in objects:
        distance = float(each.distance(place)[0])
        if distance < case.inscribed_radius:
            where = "on" if distance == 0 else f"{distance:.2f} m from the center of"
            return [f"{each.describe(trace)} stands {where} goal {goal.name}"], {each.event}
    return [], set()


def _nearby_object(trace: Trace, case: Case, tick: int, objects: list[MovableObject]) -> Diagnosis:
    """Return a sentence on the object nearest to the robot, if it is within NEAR_ROBOT_M."""
    if not objects or not len(trace.truth):
        return [], set()
    place = np.array([trace.place(tick)])
    gaps = ((float(each.distance(place)[0]) - case.inscribed_radius, each) for each in objects)
    gap, nearest = min(gaps, key=lambda pair: pair[0])
    if not gap <= NEAR_ROBOT_M:  # also for nan
        return [], set()
    return [f"{nearest.describe(trace)} was {max(gap, 0.0):.2f} m from the robot"], {nearest.event}


SEARCH_STEP_M = 0.005
"""Distance between the points of a passage at which its free width is computed."""
NEGLIGIBLE_WIDTH_M = 0.02
"""Smaller widths and changes of widths are ignored."""
ON_PATH_DISTANCE_M = 0.5
"""Maximum distance from the nearest passage up to which a robot counts as on the path."""


def diagnose_blocked_path(
    trace: Trace, case: Case, goal: str, tick: int, objects: Sequence[MovableObject]
) -> Diagnosis:
    """Return a sentence on the passage of the shortest path to `goal` that objects narrow the most.

    A passage is closed if the inscribed circle of the robot cannot pass. It is narrowed if the robot cannot turn there.
    """
    needed, turning = 2 * case.inscribed_radius, 2 * _circumscribed_radius(case)
    widths = [(free_width(passage, objects), passage) for passage in _remaining_passages(trace, case, goal, tick)]
    narrowed = [(left, passage) for left, passage in widths if left < min(turning, passage.width - NEGLIGIBLE_WIDTH_M)]
    if not narrowed:
        return [], set()
    left, passage = min(narrowed, key=lambda pair: (pair[0], pair[1].width))
    blocking = _blocking_objects(passage, objects, max(needed, left + NEGLIGIBLE_WIDTH_M))
    verb = "closes" if left < needed else "narrows"
    named = " and ".join(each.describe(trace) for each in blocking)
    text = (
        f"{named} {verb if len(blocking) == 1 else verb[:-1]} {passage.description} on the shortest path: "
        f"{f'{left:.2f} m are' if left >= NEGLIGIBLE_WIDTH_M else 'nothing is'} left, the robot is {needed:.2f} m wide"
    )
    return [text], {each.event for each in blocking}


def free_width(passage: Passage, objects: Sequence[MovableObject]) -> float:
    """Return the diameter in m of the largest circle that can pass between the objects and the ends of a passage."""
    ends = np.array(passage.ends)
    share = np.linspace(0.0, 1.0, 2 + round(passage.width / SEARCH_STEP_M))[:, None]
    centers = ends[0] + share * (ends[1] - ends[0])
    distances: list[Array] = [np.linalg.norm(centers - end, axis=1) for end in ends]
    distances += [each.distance(centers) for each in objects]
    return 2 * float(np.min(distances, axis=0).max())


def _blocking_objects(passage: Passage, objects: Sequence[MovableObject], needed: float) -> list[MovableObject]:
    """Return the last object that alone leaves less than `needed` m, or else all objects that narrow the passage."""
    single = [each for each in objects if free_width(passage, [each]) < needed]
    return single[-1:] or [each for each in objects if free_width(passage, [each]) < passage.width - NEGLIGIBLE_WIDTH_M]


def _remaining_passages(trace: Trace, case: Case, goal: str, tick: int) -> list[Passage]:
    """Return the passages ahead of the robot on the path to `goal`; all passages if the robot is not on this path."""
    found = [passage for passage in case.passages if passage.goal == goal]
    if not found or not len(trace.truth):
        return found
    here = trace.place(tick)
    nearest = min(range(len(found)), key=lambda k: distance_to_segment(*here, *found[k].ends))
    if distance_to_segment(*here, *found[nearest].ends) > ON_PATH_DISTANCE_M:
        return found
    ends, later = found[nearest].ends, found[nearest + 1 :]
    passed = later and signed_double_area(*ends, here) * signed_double_area(*ends, later[0].middle) > 0
    return later if passed else found[nearest:]


def _circumscribed_radius(case: Case) -> float:
    """Return the circumscribed radius of the robot in m."""
    return max((math.hypot(x, y) for x, y in case.footprint), default=case.inscribed_radius)
