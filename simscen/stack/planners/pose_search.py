"""OMPL search for a path over poses (position and heading), for cars and long robots."""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.stack.planners.endpoints import MAX_ESCAPE_M
from simscen.stack.planners.ompl_search import FIRST_PATH_PLANNERS, PLANNERS, stop_after
from simscen.stack.protocols import CostmapView

Space = Literal["se2", "dubins", "reeds_shepp"]
"""State spaces of OMPL over poses."""
PoseCheck = Callable[[float, float, float], bool]
"""Function that returns whether a pose (x, y, yaw) is valid."""
POSE_SPACING_M = 0.05
"""Maximum distance between the poses of a path."""
MIN_CHORD_RATIO = 0.995
"""Ratio of the distance of two successive poses to the path length between them, below which a cusp (change of the
driving direction) between both poses is searched for."""
CUSP_TOLERANCE_M = 1e-4
"""Maximum error of the position of a cusp along the path."""
SHORTCUT_ATTEMPTS = 60
"""Maximum number of attempts to shorten the path by removing states."""


def search_poses(
    planner_type: str,
    space: Space,
    turning_radius: float,
    bounds: tuple[float, float, float, float],
    start: Pose2,
    goal: Pose2,
    is_valid: PoseCheck,
    seed: int,
    iterations: int,
    check_spacing: float = POSE_SPACING_M,
    configure: Callable[[Any], None] = lambda _: None,
    improving_iterations: int = 0,
) -> list[Pose2] | None:
    """Return poses from start to goal, at most POSE_SPACING_M apart; None if no path is found in `iterations`.

    planner_type:    key of PLANNERS
    space:           driving directions: only forward ("dubins"), also backward ("reeds_shepp"), or all ("se2")
    turning_radius:  minimum radius of arcs in m; without effect for "se2"
    bounds:          (min x, min y, max x, max y) in m
    is_valid:        check of single poses, called every `check_spacing` m
    configure:       sets the parameters of OMPL's planner

    A planner that improves its path stops after `improving_iterations`, or with the first path if that is later.
    """
    ou.RNG.setSeed(seed)
    states = _make_space(space, turning_radius)
    limits = ob.RealVectorBounds(2)
    for axis in (0, 1):
        limits.setLow(axis, bounds[axis])
        limits.setHigh(axis, bounds[axis + 2])
    states.setBounds(limits)
    information = ob.SpaceInformation(states)
    information.setStateValidityChecker(lambda state: is_valid(state.getX(), state.getY(), state.getYaw()))
    information.setStateValidityCheckingResolution(check_spacing / states.getMaximumExtent())
    information.setup()
    ends = _state(information, start), _state(information, goal)
    if not all(information.satisfiesBounds(end) and information.isValid(end) for end in ends):
        return None  # otherwise, a planner waits for a valid goal, 5 ms per iteration
    problem = ob.ProblemDefinition(information)
    problem.setStartAndGoalStates(*ends)
    planner = PLANNERS[planner_type](information)
    configure(planner)
    planner.setProblemDefinition(problem)
    planner.setup()
    termination = stop_after(iterations)
    if planner_type not in FIRST_PATH_PLANNERS:
        termination = stop_after(iterations, lambda: math.isfinite(planner.bestCost().value()), improving_iterations)
    planner.solve(ob.PlannerTerminationCondition(termination))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    og.PathSimplifier(information).reduceVertices(path, SHORTCUT_ATTEMPTS, SHORTCUT_ATTEMPTS, 0.5)
    if space == "reeds_shepp":
        return _reeds_shepp_poses(states, path.getStates())
    path.interpolate(max(2, math.ceil(path.length() / POSE_SPACING_M) + 1))
    return [_pose(state) for state in path.getStates()]


def _reeds_shepp_poses(states: Any, waypoints: Any) -> list[Pose2]:
    """Return poses on the Reeds-Shepp paths between waypoints, at most POSE_SPACING_M apart, including all cusps."""
    state, poses = states.allocState(), [_pose(waypoints[0])]
    for first, last in pairwise(waypoints):
        length = states.distance(first, last)
        if length == 0.0:
            continue
        count = max(1, math.ceil(length / POSE_SPACING_M))

        def pose_at(path_length: float, first: Any = first, last: Any = last, length: float = length) -> Pose2:
            states.interpolate(first, last, path_length / length, state)
            return _pose(state)

        stations = [length * k / count for k in range(count + 1)]
        for low, high in pairwise(stations):
            poses += [pose_at(cusp) for cusp in _cusps(pose_at, low, high)]
            poses.append(pose_at(high))
    return poses


def _cusps(pose_at: Callable[[float], Pose2], low: float, high: float) -> list[float]:
    """Return the path lengths in m, between `low` and `high`, at which the driving direction changes."""
    first_pose, last_pose = pose_at(low), pose_at(high)
    if math.hypot(last_pose.x - first_pose.x, last_pose.y - first_pose.y) > MIN_CHORD_RATIO * (high - low):
        return []
    middle = 0.5 * (low + high)
    if high - low < CUSP_TOLERANCE_M:
        return [middle]
    return [*_cusps(pose_at, low, middle), *_cusps(pose_at, middle, high)] or [middle]


def _pose(state: Any) -> Pose2:
    """Return the pose of a state of OMPL."""
    return Pose2(state.getX(), state.getY(), state.getYaw())


def _make_space(kind: Space, turning_radius: float) -> Any:
    """Return OMPL's state space of this kind. `turning_radius` is in m."""
    if kind == "dubins":
        return ob.DubinsStateSpace(turning_radius)
    if kind == "reeds_shepp":
        return ob.ReedsSheppStateSpace(turning_radius)
    return ob.SE2StateSpace()


def _state(information: Any, pose: Pose2) -> Any:
    """Return a state of OMPL with this pose."""
    state = information.allocState()
    state.setX(pose.x)
    state.setY(pose.y)
    state.setYaw(-math.pi if pose.yaw >= math.pi else pose.yaw)  # OMPL's headings lie in [-π, π)
    return state


ESCAPE_DIRECTIONS = 16
"""Number of directions in which a holonomic base can leave a collision."""
ESCAPE_CURVATURE_RATIOS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Curvatures, relative to the maximum, of the arcs on which all other bases can leave a collision."""


def escape_arcs(space: Space, turning_radius: float, start: Pose2) -> Iterator[Array]:
    """Yield the poses (n, 3) of arcs of MAX_ESCAPE_M on which the robot can leave a collision at `start`."""
    path_lengths = np.linspace(0.0, MAX_ESCAPE_M, round(MAX_ESCAPE_M / POSE_SPACING_M) + 1)
    if space == "se2":
        for heading in np.arange(ESCAPE_DIRECTIONS) * (2.0 * math.pi / ESCAPE_DIRECTIONS):
            yield _arc(start, path_lengths, 0.0, float(heading))
        return
    for signed_lengths in (path_lengths,) if space == "dubins" else (path_lengths, -path_lengths):
        for ratio in ESCAPE_CURVATURE_RATIOS:
            yield _arc(start, signed_lengths, ratio / turning_radius, 0.0)


def _arc(start: Pose2, path_lengths: Array, curvature: float, heading: float) -> Array:
    """Return poses (n, 3) at the given path lengths (n,) in m on an arc with this `curvature` in 1/m.

    Negative path lengths lead backward. `heading` is the initial direction of motion relative to the heading of the
    start, in rad.
    """
    turned = curvature * path_lengths
    chord = path_lengths * np.sinc(turned / (2.0 * math.pi))
    direction = start.yaw + heading + 0.5 * turned
    yaw = wrap_array(start.yaw + turned)
    yaw[0] = start.yaw
    return np.column_stack((start.x + chord * np.cos(direction), start.y + chord * np.sin(direction), yaw))


class DistanceLookup:
    """Fast lookup of the distance to obstacles at single points of a costmap."""

    def __init__(self, costmap: CostmapView) -> None:
        self.costmap = costmap
        self.resolution = costmap.resolution
        self.height, self.width = costmap.distance.shape
        self.origin = costmap.origin
        self._per_meter = 1.0 / costmap.resolution
        flat: Any = np.ascontiguousarray(costmap.distance).reshape(-1)
        self._flat_distances: Any = memoryview(flat)

    def distance(self, x: float, y: float) -> float:
        """Return the distance in m from a point to the nearest lethal cell; -1 outside the map."""
        column = math.floor((x - self.origin[0]) * self._per_meter)
        row = math.floor((y - self.origin[1]) * self._per_meter)
        if 0 <= row < self.height and 0 <= column < self.width:
            return float(self._flat_distances[row * self.width + column])
        return -1.0
