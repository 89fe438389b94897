"""Search for movable objects that narrow or close a passage of the shortest path to a goal."""

import math
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import distance_to_segment, signed_double_area
from simscen.core.records.case import Case, Passage
from simscen.core.records.trace import Trace
from simscen.judge.movable_objects import MovableObject

Diagnosis = tuple[list[str], set[str]]
"""(sentences on causes, names of the disturbances in the sentences). The name "" stands for an object that no event
spawned or moved."""

SEARCH_STEP_M = 0.005
"""Distance between the points of a passage at which its free width is computed."""
NEGLIGIBLE_WIDTH_M = 0.02
"""Smaller widths and changes of widths are ignored."""
MAX_PATH_DISTANCE_M = 0.5
"""Maximum distance from the nearest passage up to which a robot counts as on the path."""


def diagnose_blocked_path(
    trace: Trace, case: Case, goal: str, tick: int, objects: Sequence[MovableObject]
) -> Diagnosis:
    """Return a sentence on the narrowest passage of the shortest path to `goal` that objects narrow or close.

    Objects close a passage if the inscribed circle of the robot does not fit through. Objects narrow a passage if the
    circumscribed circle does not fit through, so that the robot cannot turn there.
    """
    circumscribed_radius = max((math.hypot(x, y) for x, y in case.footprint), default=case.inscribed_radius)
    robot_width, turning_width = 2 * case.inscribed_radius, 2 * circumscribed_radius
    narrowed = []
    for passage in _remaining_passages(trace, case, goal, tick):
        width = free_width(passage, objects)
        if width < min(turning_width, passage.width - NEGLIGIBLE_WIDTH_M):
            narrowed.append((width, passage))
    if not narrowed:
        return [], set()
    width, passage = min(narrowed, key=lambda pair: (pair[0], pair[1].width))
    blocking = _blocking_objects(passage, objects, max(robot_width, width + NEGLIGIBLE_WIDTH_M))
    verb = "closes" if width < robot_width else "narrows"
    names = " and ".join(each.describe(trace) for each in blocking)
    text = (
        f"{names} {verb if len(blocking) == 1 else verb[:-1]} {passage.description} on the shortest path: "
        f"{f'{width:.2f} m are' if width >= NEGLIGIBLE_WIDTH_M else 'nothing is'} left, "
        f"the robot is {robot_width:.2f} m wide"
    )
    return [text], {each.event_name for each in blocking}


def free_width(passage: Passage, objects: Sequence[MovableObject]) -> float:
    """Return the diameter in m of the largest circle that can pass between the objects and the ends of a passage."""
    ends = np.array(passage.ends)
    share = np.linspace(0.0, 1.0, 2 + round(passage.width / SEARCH_STEP_M))[:, None]
    centers = ends[0] + share * (ends[1] - ends[0])
    distances: list[Array] = [np.linalg.norm(centers - end, axis=1) for end in ends]
    distances += [each.distance(centers) for each in objects]
    return 2 * float(np.min(distances, axis=0).max())


def _blocking_objects(passage: Passage, objects: Sequence[MovableObject], width: float) -> list[MovableObject]:
    """Return the last spawned object that alone leaves less than `width` m.

    If there is no such object, return all objects that narrow the passage.
    """
    single = [each for each in objects if free_width(passage, [each]) < width]
    return single[-1:] or [each for each in objects if free_width(passage, [each]) < passage.width - NEGLIGIBLE_WIDTH_M]


def _remaining_passages(trace: Trace, case: Case, goal: str, tick: int) -> list[Passage]:
    """Return the passages ahead of the robot on the path to `goal`; all passages if the robot is not on this path."""
    passages = [passage for passage in case.passages if passage.goal == goal]
    if not passages or not len(trace.truth):
        return passages
    robot = trace.place(tick)
    nearest = min(range(len(passages)), key=lambda k: distance_to_segment(*robot, *passages[k].ends))
    if distance_to_segment(*robot, *passages[nearest].ends) > MAX_PATH_DISTANCE_M:
        return passages
    ends, later = passages[nearest].ends, passages[nearest + 1 :]
    has_passed = later and signed_double_area(*ends, robot) * signed_double_area(*ends, later[0].middle) > 0
    return later if has_passed else passages[nearest:]
