import math

import numpy as np
import pytest

from simscen.core.geometry import Array, Pose2
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners.ompl_planner import OmplPlanner
from simscen.stack.planners.straight import free_straight_on
from simscen.stack.protocols import CostmapView
from simscen.testing.flatland import round_robot

RADIUS, SIZE, CORNER = 0.2, 0.05, (-0.7, 0.3)


def view_of(costs: Array) -> CostmapView:
    return CostmapView(costs.astype(np.uint8), np.where(costs > 0, 0.1, 1.0).astype(np.float32), SIZE, CORNER, 1, 0.5)


def touched(costs: Array, start: Pose2, goal: Pose2) -> bool:
    """Whether the straight way meets the inside of any dear cell: each is cut with it by Liang and Barsky's rule."""
    for row, column in np.argwhere(costs > 0).tolist():
        low = CORNER[0] + column * SIZE, CORNER[1] + row * SIZE
        enter, leave = 0.0, 1.0
        for here, there, edge in ((start.x, goal.x, low[0]), (start.y, goal.y, low[1])):
            step = there - here
            if step == 0.0:
                enter, leave = (enter, leave) if edge < here < edge + SIZE else (1.0, 0.0)
                continue
            one, other = sorted(((edge - here) / step, (edge + SIZE - here) / step))
            enter, leave = max(enter, one), min(leave, other)
        if leave > enter:
            return True
    return False


def test_a_straight_way_is_free_just_where_it_meets_no_dear_cell() -> None:
    chance, free = np.random.default_rng(5), 0
    for _ in range(300):
        costs = (chance.random((30, 40)) < 0.02) * chance.integers(1, 253, (30, 40))
        ends = [Pose2(*(chance.uniform((0, 0), (40, 30)) * SIZE + CORNER).tolist()) for _ in range(2)]
        told = free_straight_on(view_of(costs), *ends, RADIUS)
        assert told == (not touched(costs, *ends))
        free += told
    assert 60 < free < 240


@pytest.mark.parametrize("turn", range(8))
def test_along_an_axis_or_a_diagonal_the_cells_are_those_passed(turn: int) -> None:
    costs = np.zeros((41, 41))
    heading = turn * math.pi / 4
    middle = Pose2(CORNER[0] + 20.5 * SIZE, CORNER[1] + 20.5 * SIZE)
    reach = SIZE * 20 * (math.sqrt(2) if turn % 2 else 1.0) - 1e-9
    goal = Pose2(middle.x + reach * math.cos(heading), middle.y + reach * math.sin(heading))
    assert free_straight_on(view_of(costs), middle, goal, RADIUS)
    costs[20 + 7 * round(math.sin(heading)), 20 + 7 * round(math.cos(heading))] = 1
    assert not free_straight_on(view_of(costs), middle, goal, RADIUS)


def test_a_way_that_leaves_the_costmap_or_comes_too_near_is_not_free() -> None:
    view = view_of(np.zeros((20, 20)))
    inside = Pose2(CORNER[0] + 0.5, CORNER[1] + 0.5)
    assert free_straight_on(view, inside, inside, RADIUS)
    for x, y in ((1.01, 0.5), (-0.01, 0.5), (0.5, 1.01), (0.5, -0.01)):
        assert not free_straight_on(view, inside, Pose2(CORNER[0] + x, CORNER[1] + y), RADIUS)
    assert not free_straight_on(view, inside, Pose2(CORNER[0] + 0.9, CORNER[1] + 0.9), 1.0)


def test_the_default_planner_goes_straight_on_where_that_costs_nothing() -> None:
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
