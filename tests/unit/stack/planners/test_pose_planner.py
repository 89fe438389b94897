"""Tests of plans over poses, for cars and long robots."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.planners import OmplPlanner as Spec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.footprint import Footprint
from simscen.stack.planners import ompl_planner as ompl_planner_module
from simscen.stack.planners.ompl_planner import ompl_planner
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, setting

CAR = RobotModel(box_robot(0.9, 0.4).footprint, None, 1.0, 1.0, 0.0, 1.5, 2.0, 2.0, 3.0, turning_radius=0.8)
OMNI = replace(CAR, turning_radius=0.0, max_lateral=1.0, holonomic=True)


def hall(*boxes: tuple[float, float, float, float], robot: RobotModel = CAR) -> CostmapView:
    world = Flatland().room(9, 6)
    world.boxes += boxes
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-0.5, -0.5, 9.5, 6.5)), TICK_RATE_HZ)).view


def plan_points(view: CostmapView, start: Pose2, goal: Pose2, robot: RobotModel = CAR, **options: object) -> np.ndarray:
    return ompl_planner(Spec(max_iterations=5000, **options), setting(robot)).plan(view, start, goal, 1).points


def in_collision(view: CostmapView, points: np.ndarray, robot: RobotModel = CAR) -> np.ndarray:
    """Return which of the poses (n, 3) collide."""
    return ~Footprint(robot, view.resolution).free(view, points)


def test_goal_at_which_only_the_inscribed_circle_fits_is_moved_until_the_hull_fits() -> None:
    view, goal = hall(), Pose2(8.7, 3.0, 0.0)  # 0.3 m from a wall; the nose is 0.45 m ahead
    assert in_collision(view, np.array([goal]))[0]
    points = plan_points(view, Pose2(2.0, 2.0, 0.0), goal)
    assert not in_collision(view, points).any()
    assert np.hypot(*(points[-1, :2] - goal[:2])) <= 0.5 and points[-1, 2] == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(NavigationFailure) as failure:
        plan_points(view, Pose2(2.0, 2.0, 0.0), goal, tolerance=0.1)
    assert failure.value.code is ErrorCode.GOAL_OCCUPIED


@pytest.mark.parametrize("start", [Pose2(8.62, 3.0, 0.0), Pose2(3.0, 0.26, 0.15)])
def test_plan_of_a_car_in_contact_leads_away_from_the_obstacle(start: Pose2) -> None:
    """The front or the side of the car touches a wall. Regression: planning failed with START_OCCUPIED."""
    view = hall()
    footprint = Footprint(CAR, view.resolution)
    points = plan_points(view, start, Pose2(2.0, 4.0, 0.0))
    is_touching = in_collision(view, points)
    first_free = int(np.argmin(is_touching))
    assert is_touching[0] and not is_touching[first_free:].any() and points[0] == pytest.approx(start)
    assert np.hypot(*np.diff(points[: first_free + 1, :2], axis=0).T).sum() <= 0.55
    clearances = footprint.clearance(view, points[: first_free + 1])
    assert clearances.min() > clearances[0] - 0.02  # the overlap does not increase


def test_omnidirectional_robot_in_contact_leaves_the_wall() -> None:
    view = hall(robot=OMNI)
    points = plan_points(view, Pose2(3.0, 0.18, 0.0), Pose2(3.0, 4.0, 0.0), OMNI)
    is_touching = in_collision(view, points, OMNI)
    assert is_touching[0] and not is_touching[int(np.argmin(is_touching)) :].any()


def test_enclosed_hull_cannot_start() -> None:
    stakes = ((2.65, 2.4, 2.7, 2.75), (2.65, 3.25, 2.7, 3.6), (3.3, 2.4, 3.35, 2.75), (3.3, 3.25, 3.35, 3.6))
    pocket = (*stakes, (2.45, 2.6, 2.6, 3.4), (3.4, 2.6, 3.55, 3.4))
    with pytest.raises(NavigationFailure) as failure:
        plan_points(hall(*pocket), Pose2(3.0, 3.0, 0.0), Pose2(7.0, 3.0, 0.0))
    assert failure.value.code is ErrorCode.START_OCCUPIED


def test_no_pose_is_in_unknown_space_without_allow_unknown() -> None:
    """This includes single unknown cells, although the search uses blocks of several cells."""
    view = hall()
    view.costs[np.random.default_rng(1).random(view.costs.shape) < 0.02] = 255
    points = plan_points(view, Pose2(2.0, 3.0, 0.0), Pose2(7.0, 3.0, 0.0), allow_unknown=False)
    columns, rows = ((points[:, i] - view.origin[i]) / view.resolution for i in (0, 1))
    assert (view.costs[rows.astype(int), columns.astype(int)] != 255).all()


BOX = (4.0, 0.0, 4.4, 3.0)
ENDS = Pose2(1.5, 1.5, 0.0), Pose2(7.0, 1.5, 0.0)


def max_curvature(points: np.ndarray) -> float:
    """Return the largest curvature of a path in 1/m, except at cusps."""
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    turns = np.abs(np.angle(np.exp(1j * np.diff(points[:, 2]))))
    return float((turns[steps > 0.03] / steps[steps > 0.03]).max())


def test_minimum_turning_radius_limits_the_curvature() -> None:
    view = hall(BOX)
    default, wide = plan_points(view, *ENDS), plan_points(view, *ENDS, minimum_turning_radius=1.4)
    assert max_curvature(default) == pytest.approx(1.0 / (1.15 * CAR.turning_radius), rel=0.02)
    assert max_curvature(wide) <= 1.02 / 1.4


def test_shortest_path_of_several_searches_with_cusp_penalty_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The searches return a path of 4.2 m without a cusp, and then a path of 4 m that passes the goal and reverses."""
    bend = np.concatenate((np.linspace((2.0, 3.0), (3.5, 4.5), 44), np.linspace((3.5, 4.5), (5.0, 3.0), 44)[1:]))
    with_cusp = np.concatenate((np.linspace((2.0, 3.0), (5.5, 3.0), 71), np.linspace((5.5, 3.0), (5.0, 3.0), 11)[1:]))
    yaw = np.arctan2(*np.diff(bend, axis=0)[:, ::-1].T)
    bend = np.column_stack((bend, [0.0, *yaw[1:], 0.0]))
    with_cusp = np.column_stack((with_cusp, np.zeros(len(with_cusp))))
    results: list[np.ndarray] = []

    def search(*_: object) -> list[Pose2]:
        results.append((bend, with_cusp)[len(results) % 2])
        return [Pose2(*pose) for pose in results[-1].tolist()]

    monkeypatch.setattr(ompl_planner_module, "search_poses", search)
    for searches, penalty, expected in ((1, 0.0, bend), (2, 0.0, with_cusp), (2, 0.1, with_cusp), (2, 1.0, bend)):
        results.clear()
        points = plan_points(hall(), Pose2(2, 3), Pose2(5, 3), pose_searches=searches, cusp_penalty=penalty)
        assert len(results) == searches
        assert np.allclose(points, expected)


def test_hull_clearance_is_kept_where_possible() -> None:
    view = hall((4.0, 0.0, 4.4, 2.6), (4.0, 4.6, 4.4, 6.0))
    footprint = Footprint(CAR, view.resolution)

    def clearance(required: float) -> float:
        points = plan_points(
            view, Pose2(1.5, 3.0), Pose2(7.5, 3.0), hull_clearance=required, cost_travel_multiplier=0.0
        )
        return float(footprint.clearance(view, points[np.abs(points[:, 0] - 4.2) < 1.0]).min())

    assert clearance(0.0) < 0.3
    assert clearance(0.5) > 0.5
    assert clearance(1.0) > 0.5  # half of the required clearance is available


def test_range_and_goal_bias_change_searches_over_poses() -> None:
    view = hall(BOX)
    default = plan_points(view, *ENDS, type="kpiece", pose_searches=1)
    assert not np.array_equal(default, plan_points(view, *ENDS, type="kpiece", pose_searches=1, range=0.8))
    assert not np.array_equal(default, plan_points(view, *ENDS, type="kpiece", pose_searches=1, goal_bias=0.5))
