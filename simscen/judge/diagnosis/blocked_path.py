"""What stands in the way: which passage of the shortest way is closed, and by what."""

import math
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import distance_to_segment, signed_double_area
from simscen.core.records.case import Case, Passage
from simscen.core.records.trace import Trace
from simscen.judge.diagnosis.objects import MovableObject

SEARCH_STEP_M = 0.005
"""Meters between the places in a passage that are tried."""
NEGLIGIBLE_WIDTH_M = 0.02
"""Meters that are as good as nothing, and as no change: passages are measured to that."""
ON_PATH_DISTANCE_M = 0.5
"""Meters from a passage within which a robot is on the way that leads through it; passages lie 0.25 m apart."""


def diagnose_blocked_path(
    trace: Trace, case: Case, goal: str, tick: int, there: Sequence[MovableObject]
) -> tuple[list[str], set[str]]:
    """Which things close the way to `goal`, or make it tight, as a sentence; and the events that brought them.

    Only what is certain is said: a disc that fits into the robot cannot cross the passage at any place.
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
        f"{named} {verb if len(guilty) == 1 else verb[:-1]} {passage.told} on the shortest way: "
        f"{f'{left:.2f} m are' if left >= NEGLIGIBLE_WIDTH_M else 'nothing is'} left, the robot is {needed:.2f} m wide"
    )
    return [text], {thing.event for thing in guilty}


def free_width(passage: Passage, there: Sequence[MovableObject]) -> float:
    """The diameter in meters of the largest disc that can cross the passage."""
    ends = np.array(passage.ends)
    share = np.linspace(0.0, 1.0, 2 + round(passage.width / SEARCH_STEP_M))[:, None]
    middles = ends[0] + share * (ends[1] - ends[0])
    near: list[Array] = [np.linalg.norm(middles - end, axis=1) for end in ends]
    near += [thing.distance(middles) for thing in there]
    return 2 * float(np.min(near, axis=0).max())


def _guilty(passage: Passage, there: Sequence[MovableObject], needed: float) -> list[MovableObject]:
    """The one thing that does it alone, or all that have a part in it."""
    alone = [thing for thing in there if free_width(passage, [thing]) < needed]
    return alone[-1:] or [thing for thing in there if free_width(passage, [thing]) < passage.width - NEGLIGIBLE_WIDTH_M]


def _ahead(trace: Trace, case: Case, goal: str, tick: int) -> list[Passage]:
    """The passages that the robot has still to cross; all of them when it is not on the way."""
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
    """How far in meters the robot extends from its own origin."""
    return max((math.hypot(x, y) for x, y in case.footprint), default=case.inscribed_radius)
