"""Search for the causes of a missed goal, such as a blocked passage, an occupied goal, or an object near the robot."""

import math
from collections import Counter

import numpy as np

from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode
from simscen.core.records.case import Case
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Trace
from simscen.criteria.error_codes import error_code_name
from simscen.criteria.goal_outcomes import GoalOutcome, goal_outcomes, outcome_start
from simscen.judge.blocked_path import Diagnosis, diagnose_blocked_path
from simscen.judge.movable_objects import MovableObject, movable_objects

MAX_NEARBY_GAP_M = 0.3
"""Maximum gap between the inscribed circle of the robot and an object that may block the robot."""


def diagnose_goal_failure(trace: Trace, case: Case, tick: int) -> Diagnosis:
    """Return why the robot has not reached its current goal at `tick`; an empty diagnosis without a current goal."""
    outcome = _current_goal(trace, case, tick)
    if outcome is None:
        return [], set()
    goal, objects = outcome.goal, movable_objects(trace, tick)
    lines = [*_unreachable_goal(case, goal), *_robot_hold(trace, tick), *_touched_objects(trace, tick)]
    mentioned: set[str] = set()
    for sentences, events in (
        _occupied_goal(trace, case, goal, objects),
        diagnose_blocked_path(trace, case, goal.name, tick, objects),
        _nearby_object(trace, case, tick, objects),
    ):
        if "" in events or not events <= mentioned:  # one sentence for each event is enough
            lines += sentences
            mentioned |= events
    return [*(lines or _reported_failure(trace, outcome, tick)), *_failed_recoveries(trace, outcome, tick)], mentioned


def _current_goal(trace: Trace, case: Case, tick: int) -> GoalOutcome | None:
    """Return the outcome of the last goal that started until `tick`; None if this goal was reached or canceled."""
    started = [outcome for outcome in goal_outcomes(trace, case) if outcome_start(outcome) <= tick]
    if not started:
        return None
    reached, end = started[-1].reached_tick, started[-1].end
    is_reached = reached is not None and reached <= tick
    is_canceled = end is not None and end.kind == EventKind.GOAL_CANCELED and end.tick < tick
    return None if is_reached or is_canceled else started[-1]


def _unreachable_goal(case: Case, goal: Goal) -> list[str]:
    """Return a sentence if the static world has no path to the goal."""
    if case.shortest.get(goal.name) != math.inf:
        return []
    needed = 2 * case.inscribed_radius
    narrow = [passage for passage in case.passages if passage.goal == goal.name and passage.width < needed]
    where = f"; {narrow[0].description} is too narrow" if narrow else ""
    return [f"the world has no path to goal {goal.name} for a robot {needed:.2f} m wide{where}"]


def _robot_hold(trace: Trace, tick: int) -> list[str]:
    """Return a sentence on the part of the stack that has stopped the robot, such as the collision monitor, and why."""
    events = trace.of_kind(EventKind.ROBOT_HELD, EventKind.ROBOT_RELEASED)
    earlier = [event for event in events if event.tick <= tick - (event.kind == EventKind.ROBOT_RELEASED)]
    if not earlier or earlier[-1].kind != EventKind.ROBOT_HELD:
        return []
    last = earlier[-1]
    when = f"as reported at t = {trace.seconds(last.tick):.2f} s"
    return [f"the {last.name.replace('_', ' ')} has stopped the robot, {when}: {last.data.get('message', '')}"]


def _reported_failure(trace: Trace, outcome: GoalOutcome, tick: int) -> list[str]:
    """Return a sentence with the message of a stack that gave up the goal, and with the recoveries before."""
    end = outcome.end
    # A timeout has no message with a reason.
    if end is None or end.tick > tick or error_code_name(end) == ErrorCode.NAVIGATE_TIMEOUT.name:
        return []
    message = end.data.get("message")
    if not message:
        return []
    tried = [e.name for e in trace.of_kind(EventKind.RECOVERY_STARTED) if outcome_start(outcome) <= e.tick <= tick]
    return [f"the stack gave up and reported: {message}" + (f"; {', '.join(tried)} had not helped" if tried else "")]


def _failed_recoveries(trace: Trace, outcome: GoalOutcome, tick: int) -> list[str]:
    """Return a sentence on the recoveries that failed on the way to this goal, with their error codes."""
    ended = [e for e in trace.of_kind(EventKind.RECOVERY_ENDED) if outcome_start(outcome) <= e.tick <= tick]
    failed = Counter(f"{e.name} with {error_code_name(e)}" for e in ended if e.data.get("outcome") == "failed")
    counted = (text if count == 1 else f"{text} {count} times" for text, count in failed.items())
    return [f"recoveries failed: {', '.join(counted)}"] if failed else []


def _touched_objects(trace: Trace, tick: int) -> list[str]:
    """Return sentences on the objects that the robot touches at `tick`."""
    start_ticks: dict[str, int] = {}
    for event in trace.of_kind(EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED):
        if event.tick <= tick and event.kind == EventKind.COLLISION_STARTED:
            start_ticks.setdefault(event.name, event.tick)
        elif event.tick <= tick:
            start_ticks.pop(event.name, None)
    return [
        f"the robot had touched {name or 'something'} since t = {trace.seconds(start):.2f} s"
        for name, start in start_ticks.items()
    ]


def _occupied_goal(trace: Trace, case: Case, goal: Goal, objects: list[MovableObject]) -> Diagnosis:
    """Return a sentence on an object that is nearer to the goal than the inscribed radius of the robot."""
    place = np.array([[goal.pose.x, goal.pose.y]])
    for each in objects:
        distance = float(each.distance(place)[0])
        if distance < case.inscribed_radius:
            where = "on" if distance == 0 else f"{distance:.2f} m from the center of"
            return [f"{each.describe(trace)} stands {where} goal {goal.name}"], {each.event_name}
    return [], set()


def _nearby_object(trace: Trace, case: Case, tick: int, objects: list[MovableObject]) -> Diagnosis:
    """Return a sentence on the object nearest to the robot, if the gap is at most MAX_NEARBY_GAP_M."""
    if not objects or not len(trace.truth):
        return [], set()
    place = np.array([trace.place(tick)])
    gaps = ((float(each.distance(place)[0]) - case.inscribed_radius, each) for each in objects)
    gap, nearest = min(gaps, key=lambda pair: pair[0])
    if not gap <= MAX_NEARBY_GAP_M:  # also for nan
        return [], set()
    return [f"{nearest.describe(trace)} was {max(gap, 0.0):.2f} m from the robot"], {nearest.event_name}
