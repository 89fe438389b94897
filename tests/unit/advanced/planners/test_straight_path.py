"""Tests of straight paths with a detour around costly cells."""

import math

import numpy as np
import pytest

from simscen.advanced.planners.straight_path import DETOUR_END_DISTANCE_M, costly_distance, straight_path
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners.ompl_planner import OmplPlanner
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.testing.flatland import round_robot

ROBOT_RADIUS_M, CELL_SIZE_M, CORNER = 0.2, 0.05, (-0.7, 0.3)


def view_of(costs: Array) -> CostmapView:
    return CostmapView(
        costs.astype(np.uint8), np.where(costs > 0, 0.1, 1.0).astype(np.float32), CELL_SIZE_M, CORNER, 1, 0.5
    )


def share_at_last_costly_cell(costs: Array, start: Pose2, goal: Pose2) -> float:
    """Return the share of the straight line at which it leaves the last costly cell, by clipping (Liang, Barsky)."""
    last = 0.0
    for row, column in np.argwhere(costs > 0).tolist():
        low = CORNER[0] + column * CELL_SIZE_M, CORNER[1] + row * CELL_SIZE_M
        enter, leave = 0.0, 1.0
        for begin, end, edge in ((start.x, goal.x, low[0]), (start.y, goal.y, low[1])):
            step = end - begin
            if step == 0.0:
                enter, leave = (enter, leave) if edge < begin < edge + CELL_SIZE_M else (1.0, 0.0)
                continue
            first, second = sorted(((edge - begin) / step, (edge + CELL_SIZE_M - begin) / step))
            enter, leave = max(enter, first), min(leave, second)
        if leave > enter:
            last = max(last, leave)
    return last


def test_costly_distance_ends_with_the_last_costly_cell() -> None:
    rng, distances = np.random.default_rng(5), []
    for _ in range(300):
        costs = (rng.random((30, 40)) < 0.02) * rng.integers(1, 253, (30, 40))
        start, goal = (Pose2(*(rng.uniform((0, 0), (40, 30)) * CELL_SIZE_M + CORNER).tolist()) for _ in range(2))
        distances.append(costly_distance(view_of(costs), start, goal, ROBOT_RADIUS_M))
        assert distances[-1] == pytest.approx(share_at_last_costly_cell(costs, start, goal) * start.distance(goal))
    assert 60 < distances.count(0.0) < 240


@pytest.mark.parametrize("turn", range(8))
def test_costly_distance_along_axes_and_diagonals_is_exact(turn: int) -> None:
    costs = np.zeros((41, 41))
    heading = turn * math.pi / 4
    middle = Pose2(CORNER[0] + 20.5 * CELL_SIZE_M, CORNER[1] + 20.5 * CELL_SIZE_M)
    line_length = CELL_SIZE_M * 20 * (math.sqrt(2) if turn % 2 else 1.0) - 1e-9
    goal = Pose2(middle.x + line_length * math.cos(heading), middle.y + line_length * math.sin(heading))
    assert costly_distance(view_of(costs), middle, goal, ROBOT_RADIUS_M) == 0.0
    costs[20 + 7 * round(math.sin(heading)), 20 + 7 * round(math.cos(heading))] = 1
    expected = CELL_SIZE_M * 7.5 * (math.sqrt(2) if turn % 2 else 1.0)
    assert costly_distance(view_of(costs), middle, goal, ROBOT_RADIUS_M) == pytest.approx(expected)


def test_path_outside_the_costmap_or_near_an_obstacle_is_costly() -> None:
    view = view_of(np.zeros((20, 20)))
    inside = Pose2(CORNER[0] + 0.5, CORNER[1] + 0.5)
    assert costly_distance(view, inside, inside, ROBOT_RADIUS_M) == 0.0
    for x, y in ((1.01, 0.5), (-0.01, 0.5), (0.5, 1.01), (0.5, -0.01)):
        assert costly_distance(view, inside, Pose2(CORNER[0] + x, CORNER[1] + y), ROBOT_RADIUS_M) == math.inf
    assert costly_distance(view, inside, Pose2(CORNER[0] + 0.9, CORNER[1] + 0.5), 1.0) == pytest.approx(0.4)


def test_default_planner_plans_straight_lines_in_free_space() -> None:
    costs = np.zeros((80, 120))
    costs[30:50, 60:70] = 200
    planner, (x, y) = OmplPlanner(PlannerSpec(), round_robot()), CORNER
    start, goal = Pose2(x + 0.5, y + 0.5, 1.0), Pose2(x + 5.4, y + 0.9, -2.0)
    points = planner.plan(view_of(costs), start, goal, 1).points
    heading = math.atan2(0.4, 4.9)
    assert points[0] == pytest.approx([*start[:2], heading])
    assert points[-1].tolist() == pytest.approx(goal)
    assert points[:-1, 2] == pytest.approx(np.full(len(points) - 1, heading))
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    assert steps.max() <= 0.05 + 1e-9
    assert steps.sum() == pytest.approx(math.hypot(4.9, 0.4))


@pytest.mark.parametrize(
    ("detour_m", "lateral_error", "is_accepted"), [(0.09, 0.0, True), (0.11, 0.0, False), (0.09, 0.1, False)]
)
def test_detour_around_costly_cells_is_taken_only_if_cheap(
    detour_m: float, lateral_error: float, is_accepted: bool
) -> None:
    costs = np.zeros((40, 220))
    costs[18:22, 10:30] = 90
    (x, y), goals = CORNER, list[Pose2]()
    start, goal = Pose2(x + 0.2, y + 1.0), Pose2(x + 10.2, y + 1.0)

    def plan_detour(part: CostmapView, part_goal: Pose2) -> tuple[Array, float]:
        goals.append(part_goal)
        assert part.costs.max() == 90
        return np.array((start[:2], (part_goal.x, part_goal.y + lateral_error))), start.distance(part_goal) + detour_m

    points = straight_path(view_of(costs), start, goal, ROBOT_RADIUS_M, plan_detour)
    assert goals[0][:2] == pytest.approx((x + 1.5 + DETOUR_END_DISTANCE_M, y + 1.0))
    assert (points is not None) == is_accepted
    if points is not None:
        assert points.tolist() == [list(start[:2]), list(goals[0][:2]), list(goal[:2])]


def test_no_straight_plan_without_a_cheap_detour() -> None:
    costs = np.zeros((40, 220))
    costs[18:22, 10:30] = 90
    (x, y), start = CORNER, Pose2(CORNER[0] + 0.2, CORNER[1] + 1.0)

    def find_no_path(part: CostmapView, part_goal: Pose2) -> tuple[Array, float]:
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, "blocked")

    def must_not_plan(part: CostmapView, part_goal: Pose2) -> tuple[Array, float]:
        raise AssertionError

    assert straight_path(view_of(costs), start, Pose2(x + 10.2, y + 1.0), ROBOT_RADIUS_M, find_no_path) is None
    assert straight_path(view_of(costs), start, Pose2(x + 5.2, y + 1.0), ROBOT_RADIUS_M, must_not_plan) is None
