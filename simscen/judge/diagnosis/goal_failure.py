"""Causes of a missed goal: a blocked passage, an occupied goal, an object in front of the robot."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import distance_to_segment, signed_double_area
from simscen.core.messages.navigation import ErrorCode, Goal
from simscen.core.records.case import Case, Passage
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Trace
from simscen.criteria.goal_outcomes import GoalOutcome, code_of, goal_outcomes, outcome_start
from simscen.judge.diagnosis.objects import MovableObject, movable_objects

NEAR_ROBOT_M = 0.3
"""Maximum distance in m from the robot's hull to an object that may block it."""


def diagnose_goal_failure(trace: Trace, case: Case, tick: int) -> tuple[list[str], set[str]]:
    """Return sentences on what blocks the current goal at `tick`, and the events that caused it."""
    outcome = _story(trace, case, tick)
    if outcome is None:
        return [], set()
    goal, there = outcome.goal, movable_objects(trace, tick)
    lines, named = [*_walled_in(case, goal), *_held(trace, tick), *_touching(trace, tick)], set[str]()
    for told, events in (
        _occupied(trace, case, goal, there),
        diagnose_blocked_path(trace, case, goal.name, tick, there),
        _standing_at(trace, case, tick, there),
    ):
        if "" in events or not events <= named:  # of what an event brought, one sentence is enough
            lines += told
            named |= events
    return [*(lines or _given_up(trace, outcome, tick)), *_failed_recoveries(trace, outcome, tick)], named


def _story(trace: Trace, case: Case, tick: int) -> GoalOutcome | None:
    """Return the outcome of the last goal accepted up to `tick`, or None if it is not required."""
    begun = [outcome for outcome in goal_outcomes(trace, case) if outcome_start(outcome) <= tick]
    return begun[-1] if begun and not _over(begun[-1], tick) else None


def _over(outcome: GoalOutcome, tick: int) -> bool:
    """Return whether the goal was reached at `tick` or canceled before. Failed goals do not count."""
    if outcome.reached is not None:
        return outcome.reached <= tick
    return outcome.end is not None and outcome.end.kind == EventKind.GOAL_CANCELED and outcome.end.tick < tick


def _walled_in(case: Case, goal: Goal) -> list[str]:
    if case.shortest.get(goal.name) != math.inf:
        return []
    needed = 2 * case.inscribed_radius
    narrow = [passage for passage in case.passages if passage.goal == goal.name and passage.width < needed]
    where = f": the widest is {narrow[0].description}" if narrow else ""
    return [f"the world itself leaves a robot of {needed:.2f} m no way to goal {goal.name}{where}"]


def _held(trace: Trace, tick: int) -> list[str]:
    """Return what the stack reported to be waiting for, unless it has given up the goal."""
    last = [
        event
        for event in trace.of_kind(EventKind.ROBOT_HELD, EventKind.ROBOT_RELEASED)
        if event.tick <= tick - (event.kind == EventKind.ROBOT_RELEASED)
    ][-1:]
    return [
        f"its {event.name.replace('_', ' ')} holds it, as it said at t = {trace.seconds(event.tick):.2f} s: "
        f"{event.data.get('message', '')}"
        for event in last
        if event.kind == EventKind.ROBOT_HELD
    ]


def _given_up(trace: Trace, outcome: GoalOutcome, tick: int) -> list[str]:
    """Return what the stack reported when it gave up the goal, and what it had tried."""
    end = outcome.end
    if end is None or end.tick > tick or code_of(end) == ErrorCode.NAVIGATE_TIMEOUT.name:  # that only says when
        return []
    message = end.data.get("message")
    if not message:
        return []
    tried = [e.name for e in trace.of_kind(EventKind.RECOVERY_STARTED) if outcome_start(outcome) <= e.tick <= tick]
    return [f"it gave up and said: {message}" + (f"; {', '.join(tried)} had not helped" if tried else "")]


def _failed_recoveries(trace: Trace, outcome: GoalOutcome, tick: int) -> list[str]:
    """Return the recovery behaviors that failed on the way to this goal, with their codes."""
    ended = [e for e in trace.of_kind(EventKind.RECOVERY_ENDED) if outcome_start(outcome) <= e.tick <= tick]
    failed = Counter(f"{e.name} with {code_of(e)}" for e in ended if e.data.get("outcome") == "failed")
    told = (what if times == 1 else f"{what} {times} times" for what, times in failed.items())
    return [f"what it tried failed, too: {', '.join(told)}"] if failed else []


def _touching(trace: Trace, tick: int) -> list[str]:
    """Return what the robot is touching."""
    since: dict[str, int] = {}
    for event in trace.of_kind(EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED):
        if event.tick <= tick and event.kind == EventKind.COLLISION_STARTED:
            since.setdefault(event.name, event.tick)
        elif event.tick <= tick:
            since.pop(event.name, None)
    return [f"it had touched {name or 'something'} since t = {trace.seconds(at):.2f} s" for name, at in since.items()]


def _occupied(trace: Trace, case: Case, goal: Goal, there: list[MovableObject]) -> tuple[list[str], set[str]]:
    place = np.array([[goal.pose.x, goal.pose.y]])
    for thing in there:
        apart = float(thing.distance(place)[0])
        if apart < case.inscribed_radius:
            where = "on" if apart == 0 else f"{apart:.2f} m from the middle of"
            return [f"{thing.told(trace)} stands {where} goal {goal.name}"], {thing.event}
    return [], set()


def _standing_at(trace: Trace, case: Case, tick: int, there: list[MovableObject]) -> tuple[list[str], set[str]]:
    """Return the object nearest to the robot if it is very close."""
    if not there or not len(trace.truth):
        return [], set()
    place = np.array([trace.place(tick)])
    apart, thing = min(((float(t.distance(place)[0]) - case.inscribed_radius, t) for t in there), key=lambda p: p[0])
    if not apart <= NEAR_ROBOT_M:  # nan, too
        return [], set()
    return [f"{thing.told(trace)} was {max(apart, 0.0):.2f} m from the robot"], {thing.event}


SEARCH_STEP_M = 0.005
"""Distance in m between the tested points of a passage."""
NEGLIGIBLE_WIDTH_M = 0.02
"""Resolution in m of the width of passages."""
ON_PATH_DISTANCE_M = 0.5
"""Maximum distance in m from a passage to a robot on its path. Passages are 0.25 m apart."""


def diagnose_blocked_path(
    trace: Trace, case: Case, goal: str, tick: int, there: Sequence[MovableObject]
) -> tuple[list[str], set[str]]:
    """Return a sentence on the objects that block or narrow the path to `goal`, and the events that placed them.

    Passages are only listed if not even the inscribed disc of the robot can cross them.
    """
    needed, turning = 2 * case.inscribed_radius, 2 * _reach(case)
    rooms = [(free_width(passage, there), passage) for passage in _ahead(trace, case, goal, tick)]
    worse = [(left, passage) for left, passage in rooms if left < min(turning, passage.width - NEGLIGIBLE_WIDTH_M)]
    if not worse:
        return [], set()
    left, passage = min(worse, key=lambda pair: (pair[0], pair[1].width))
    guilty = _guilty(passage, there, max(needed, left + NEGLIGIBLE_WIDTH_M))
    verb = "closes" if left < needed else "narrows"
    named = " and ".join(thing.told(trace) for thing in guilty)
    text = (
        f"{named} {verb if len(guilty) == 1 else verb[:-1]} {passage.description} on the shortest way: "
        f"{f'{left:.2f} m are' if left >= NEGLIGIBLE_WIDTH_M else 'nothing is'} left, the robot is {needed:.2f} m wide"
    )
    return [text], {thing.event for thing in guilty}


def free_width(passage: Passage, there: Sequence[MovableObject]) -> float:
    """Return the diameter in m of the largest disc that can pass."""
    ends = np.array(passage.ends)
    share = np.linspace(0.0, 1.0, 2 + round(passage.width / SEARCH_STEP_M))[:, None]
    middles = ends[0] + share * (ends[1] - ends[0])
    near: list[Array] = [np.linalg.norm(middles - end, axis=1) for end in ends]
    near += [thing.distance(middles) for thing in there]
    return 2 * float(np.min(near, axis=0).max())


def _guilty(passage: Passage, there: Sequence[MovableObject], needed: float) -> list[MovableObject]:
    """Return the single object that blocks the passage, or all objects that contribute."""
    alone = [thing for thing in there if free_width(passage, [thing]) < needed]
    return alone[-1:] or [thing for thing in there if free_width(passage, [thing]) < passage.width - NEGLIGIBLE_WIDTH_M]


def _ahead(trace: Trace, case: Case, goal: str, tick: int) -> list[Passage]:
    """Return the passages that the robot still has to cross; all of them if it is not on the path."""
    found = [passage for passage in case.passages if passage.goal == goal]
    if not found or not len(trace.truth):
        return found
    here = trace.place(tick)
    nearest = min(range(len(found)), key=lambda k: distance_to_segment(*here, *found[k].ends))
    if distance_to_segment(*here, *found[nearest].ends) > ON_PATH_DISTANCE_M:
        return found
    ends, beyond = found[nearest].ends, found[nearest + 1 :]
    passed = beyond and signed_double_area(*ends, here) * signed_double_area(*ends, beyond[0].middle) > 0
    return beyond if passed else found[nearest:]


def _reach(case: Case) -> float:
    """Return the circumscribed radius of the robot in m."""
    return max((math.hypot(x, y) for x, y in case.footprint), default=case.inscribed_radius)
