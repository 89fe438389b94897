"""Search over poses: for a car that cannot turn in place, and for hulls whose heading decides where they fit."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, Literal

from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from simscen.core.geometry import Pose2
from simscen.stack.planners.ompl_search import PLANNERS, stop_after

Space = Literal["se2", "dubins", "reeds_shepp"]
Valid = Callable[[float, float, float], bool]
SPACING = 0.05
"""Meters between the states of an answer."""
STRAIGHT = 0.995
"""Of a way of `SPACING`, how much of it an arc of 0.2 m gets from its begin at least."""
EXACT = 1e-4
"""Meters to which the place of a change of direction is told."""
SHORTCUTS = 60
"""Attempts to leave out states of the found path; counted, as OMPL's own simplify() stops by the clock."""


def search_poses(
    kind: str,
    space: Space,
    turning_radius: float,
    bounds: tuple[float, float, float, float],
    start: Pose2,
    goal: Pose2,
    valid: Valid,
    seed: int,
    iterations: int,
    looks: float = SPACING,
) -> list[Pose2] | None:
    """Poses from start to goal, `SPACING` apart, `valid` every `looks` meters; None if iterations did not suffice.

    "dubins" drives forward only, "reeds_shepp" also backward, both on arcs of at least `turning_radius`; "se2" moves
    in any direction.
    """
    ou.RNG.setSeed(seed)
    states = _space(space, turning_radius)
    limits = ob.RealVectorBounds(2)
    for axis in (0, 1):
        limits.setLow(axis, bounds[axis])
        limits.setHigh(axis, bounds[axis + 2])
    states.setBounds(limits)
    information = ob.SpaceInformation(states)
    information.setStateValidityChecker(lambda state: valid(state.getX(), state.getY(), state.getYaw()))
    information.setStateValidityCheckingResolution(looks / states.getMaximumExtent())
    information.setup()
    ends = _state(information, start), _state(information, goal)
    if not all(information.satisfiesBounds(end) and information.isValid(end) for end in ends):
        return None  # a planner would wait for a better goal, 5 ms an iteration
    problem = ob.ProblemDefinition(information)
    problem.setStartAndGoalStates(*ends)
    planner = PLANNERS[kind](information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(ob.PlannerTerminationCondition(stop_after(iterations)))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    og.PathSimplifier(information).reduceVertices(path, SHORTCUTS, SHORTCUTS, 0.5)
    if space == "reeds_shepp":
        return _driven(states, path.getStates())
    path.interpolate(max(2, math.ceil(path.length() / SPACING) + 1))
    return [_pose(state) for state in path.getStates()]


def _driven(states: Any, stops: Any) -> list[Pose2]:
    """The Reeds-Shepp paths from stop to stop, at most `SPACING` apart, and each pose where the direction changes.

    Between two poses on both sides of such a change less way would be told than is driven. OMPL's bindings tell
    nothing of the arcs that a path is made of (2.0.1), but on one way between is shorter than way driven.
    """
    between, poses = states.allocState(), [_pose(stops[0])]
    for first, last in pairwise(stops):
        length = states.distance(first, last)
        if length == 0.0:
            continue
        count = max(1, math.ceil(length / SPACING))

        def at(along: float, first: Any = first, last: Any = last, length: float = length) -> Pose2:
            states.interpolate(first, last, along / length, between)
            return _pose(between)

        marks = [length * k / count for k in range(count + 1)]
        for low, high in pairwise(marks):
            poses += [at(cusp) for cusp in _cusps(at, low, high)]
            poses.append(at(high))
    return poses


def _cusps(at: Callable[[float], Pose2], low: float, high: float) -> list[float]:
    """How far along (m) the direction changes on a piece of way."""
    one, other = at(low), at(high)
    if math.hypot(other.x - one.x, other.y - one.y) > STRAIGHT * (high - low):
        return []
    middle = 0.5 * (low + high)
    if high - low < EXACT:
        return [middle]
    return [*_cusps(at, low, middle), *_cusps(at, middle, high)] or [middle]


def _pose(state: Any) -> Pose2:
    return Pose2(state.getX(), state.getY(), state.getYaw())


def _space(kind: Space, turning_radius: float) -> Any:
    if kind == "dubins":
        return ob.DubinsStateSpace(turning_radius)
    if kind == "reeds_shepp":
        return ob.ReedsSheppStateSpace(turning_radius)
    return ob.SE2StateSpace()


def _state(information: Any, pose: Pose2) -> Any:
    state = information.allocState()
    state.setX(pose.x)
    state.setY(pose.y)
    state.setYaw(-math.pi if pose.yaw >= math.pi else pose.yaw)  # OMPL's headings lie in [-π, π)
    return state
