"""Search over poses: for a car that cannot turn in place, and for hulls whose heading decides where they fit."""

import math
from collections.abc import Callable
from typing import Any, Literal

from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from simscen.core.geometry import Pose2
from simscen.stack.planners.search import PLANNERS, after

Space = Literal["se2", "dubins", "reeds_shepp"]
Valid = Callable[[float, float, float], bool]
SPACING = 0.05
"""Metres between the states of an answer, and between those that are checked on the way."""
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
) -> list[Pose2] | None:
    """Poses from start to goal, `SPACING` apart, all of them `valid`; None when the iterations did not suffice.

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
    information.setStateValidityCheckingResolution(SPACING / states.getMaximumExtent())
    information.setup()
    ends = _state(information, start), _state(information, goal)
    if not all(information.satisfiesBounds(end) and information.isValid(end) for end in ends):
        return None  # a planner would wait for a better goal, 5 ms an iteration
    problem = ob.ProblemDefinition(information)
    problem.setStartAndGoalStates(*ends)
    planner = PLANNERS[kind](information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(ob.PlannerTerminationCondition(after(iterations)))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    og.PathSimplifier(information).reduceVertices(path, SHORTCUTS, SHORTCUTS, 0.5)
    path.interpolate(max(2, math.ceil(path.length() / SPACING) + 1))
    return [Pose2(state.getX(), state.getY(), state.getYaw()) for state in path.getStates()]


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
