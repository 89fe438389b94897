"""Tests of the costs at the predicted positions of moving obstacles, which the planner avoids."""

import numpy as np
import pytest

from simscen.advanced.predicted_costs import add_predicted_costs, meets_moving_obstacle
from simscen.core.geometry import Pose2
from simscen.model.planners import OmplPlanner as Spec
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES, MovingObstacle, MovingObstacles
from simscen.stack.planners.ompl_planner import OmplPlanner
from simscen.stack.protocols import CostmapView
from simscen.testing.flatland import round_robot

START = Pose2(0.0, 0.0)
SPEED_M_S, RADIUS_M = 1.0, 0.22


def crossing(x: float, y: float, vy: float) -> MovingObstacles:
    return MovingObstacles([MovingObstacle(complex(x, y), complex(0.0, vy), 0.3, 1e-4, 0.0, 1e-4)], 0.3)


def costmap_with(moving: MovingObstacles, resolution: float = 0.05) -> CostmapView:
    cells = round(12 / resolution), round(12 / resolution)
    costs, distance = np.zeros(cells, np.uint8), np.full(cells, 2.0, np.float32)
    return CostmapView(costs, distance, resolution, (-6.0, -6.0), moving=moving)


def cost_at(view: CostmapView, x: float, y: float) -> int:
    return int(view.costs[int((y + 6.0) / view.resolution), int((x + 6.0) / view.resolution)])


@pytest.mark.parametrize("resolution", [0.05, 0.03, 0.25])
def test_crossing_obstacle_is_marked_at_its_predicted_position(resolution: float) -> None:
    """The obstacle starts at (2, 2) and crosses the path 2 m ahead after 2 s, when the robot is there."""
    view = add_predicted_costs(costmap_with(crossing(2.0, 2.0, -1.0), resolution), START, SPEED_M_S, RADIUS_M)
    assert cost_at(view, 2.0, 0.0) > 50
    assert cost_at(view, 2.0, 2.0) == 0  # current position of the obstacle
    assert cost_at(view, 2.0, 1.2) == 0  # the obstacle has left this point when the robot arrives
    assert cost_at(view, 0.0, -2.0) == 0
    assert view.costs.max() < 253  # expensive, but never lethal


def test_no_cost_is_added_for_static_or_distant_obstacles() -> None:
    static = costmap_with(NO_MOVING_OBSTACLES)
    assert add_predicted_costs(static, START, SPEED_M_S, RADIUS_M) is static
    far = costmap_with(crossing(5.0, 5.0, -1.0))
    # A new costmap would cause replanning.
    assert add_predicted_costs(far, START, SPEED_M_S, RADIUS_M) is far
    passed = costmap_with(crossing(2.0, 2.0, -1.0))
    assert add_predicted_costs(passed, Pose2(40.0, 0.0), SPEED_M_S, RADIUS_M) is passed


def test_plan_passes_behind_an_obstacle_that_arrives_first() -> None:
    for vy in (-1.0, 1.0):
        view = add_predicted_costs(costmap_with(crossing(2.0, -1.6 * vy, vy)), START, SPEED_M_S, RADIUS_M)
        points = OmplPlanner(Spec(), round_robot(RADIUS_M)).plan(view, START, Pose2(4.5, 0.0), 1).points
        passed = points[np.abs(points[:, 0] - 2.0) < 0.1, 1]
        assert (np.sign(passed) == -np.sign(vy)).all()
        assert np.abs(passed).min() > 0.3


def test_path_meets_only_obstacles_at_their_predicted_time() -> None:
    path = [complex(x) for x in np.linspace(0.1, 4.5, 45)]
    assert meets_moving_obstacle(crossing(2.0, 2.0, -1.0), START, path, SPEED_M_S, RADIUS_M)
    assert not meets_moving_obstacle(crossing(2.0, 2.0, 1.0), START, path, SPEED_M_S, RADIUS_M)
    assert not meets_moving_obstacle(crossing(2.0, 0.9, -2.0), START, path, SPEED_M_S, RADIUS_M)  # passes first
    assert not meets_moving_obstacle(crossing(2.0, 2.0, -1.0), START, path[:0], SPEED_M_S, RADIUS_M)
