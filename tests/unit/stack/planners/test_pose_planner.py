"""Tests of plans of cars and long hulls."""

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


def planned(view: CostmapView, start: Pose2, goal: Pose2, robot: RobotModel = CAR, **options: object) -> np.ndarray:
    return ompl_planner(Spec(max_iterations=5000, **options), setting(robot)).plan(view, start, goal, 1).points


def hits(view: CostmapView, points: np.ndarray, robot: RobotModel = CAR) -> np.ndarray:
    return ~Footprint(robot, view.resolution).free(view, points)


def test_a_goal_where_only_the_inscribed_circle_fits_is_moved_to_where_the_hull_does() -> None:
    view, goal = hall(), Pose2(8.7, 3.0, 0.0)  # 0.3 m from a wall; the nose is 0.45 m ahead
    assert hits(view, np.array([goal]))[0]
    points = planned(view, Pose2(2.0, 2.0, 0.0), goal)
    assert not hits(view, points).any()
    assert np.hypot(*(points[-1, :2] - goal[:2])) <= 0.5 and points[-1, 2] == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(NavigationFailure) as failed:
        planned(view, Pose2(2.0, 2.0, 0.0), goal, tolerance=0.1)
    assert failed.value.code is ErrorCode.GOAL_OCCUPIED


@pytest.mark.parametrize("start", [Pose2(8.62, 3.0, 0.0), Pose2(3.0, 0.26, 0.15)])
def test_plan_of_a_car_in_contact_leads_away_from_the_obstacle(start: Pose2) -> None:
    """The nose in a wall, and a flank along one: it was START_OCCUPIED at once."""
    view = hall()
    footprint = Footprint(CAR, view.resolution)
    points = planned(view, start, Pose2(2.0, 4.0, 0.0))
    touching = hits(view, points)
    away = int(np.argmin(touching))
    assert touching[0] and not touching[away:].any() and points[0] == pytest.approx(start)
    assert np.hypot(*np.diff(points[: away + 1, :2], axis=0).T).sum() <= 0.55
    rooms = footprint.clearance(view, points[: away + 1])
    assert rooms.min() > rooms[0] - 0.02  # no deeper on the way


def test_a_holonomic_long_hull_is_led_away_sideways() -> None:
    view = hall(robot=OMNI)
    points = planned(view, Pose2(3.0, 0.18, 0.0), Pose2(3.0, 4.0, 0.0), OMNI)
    touching = hits(view, points, OMNI)
    assert touching[0] and not touching[int(np.argmin(touching)) :].any()


def test_enclosed_hull_cannot_start() -> None:
    stakes = ((2.65, 2.4, 2.7, 2.75), (2.65, 3.25, 2.7, 3.6), (3.3, 2.4, 3.35, 2.75), (3.3, 3.25, 3.35, 3.6))
    pocket = (*stakes, (2.45, 2.6, 2.6, 3.4), (3.4, 2.6, 3.55, 3.4))
    with pytest.raises(NavigationFailure) as failed:
        planned(hall(*pocket), Pose2(3.0, 3.0, 0.0), Pose2(7.0, 3.0, 0.0))
    assert failed.value.code is ErrorCode.START_OCCUPIED


def test_no_pose_is_in_unknown_space_without_allow_unknown() -> None:
    """Not on a single cell either: the blocks in which ways are looked for hold known ones beside it."""
    view = hall()
    view.costs[np.random.default_rng(1).random(view.costs.shape) < 0.02] = 255
    points = planned(view, Pose2(2.0, 3.0, 0.0), Pose2(7.0, 3.0, 0.0), allow_unknown=False)
    columns, rows = ((points[:, i] - view.origin[i]) / view.resolution for i in (0, 1))
    assert (view.costs[rows.astype(int), columns.astype(int)] != 255).all()


BOX = (4.0, 0.0, 4.4, 3.0)
ENDS = Pose2(1.5, 1.5, 0.0), Pose2(7.0, 1.5, 0.0)


def tightest_turn(points: np.ndarray) -> float:
    """Largest curvature of a path in 1/m, away from its cusps."""
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    turns = np.abs(np.angle(np.exp(1j * np.diff(points[:, 2]))))
    return float((turns[steps > 0.03] / steps[steps > 0.03]).max())


def test_minimum_turning_radius_limits_the_curvature() -> None:
    view = hall(BOX)
    usual, wide = planned(view, *ENDS), planned(view, *ENDS, minimum_turning_radius=1.4)
    assert tightest_turn(usual) == pytest.approx(1.0 / (1.15 * CAR.turning_radius), rel=0.02)
    assert tightest_turn(wide) <= 1.02 / 1.4


def test_pose_searches_and_cusp_penalty_decide_between_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    """A path of 4.2 m without a cusp, then one of 4 m that drives past the goal and back."""
    bend = np.concatenate((np.linspace((2.0, 3.0), (3.5, 4.5), 44), np.linspace((3.5, 4.5), (5.0, 3.0), 44)[1:]))
    past = np.concatenate((np.linspace((2.0, 3.0), (5.5, 3.0), 71), np.linspace((5.5, 3.0), (5.0, 3.0), 11)[1:]))
    yaw = np.arctan2(*np.diff(bend, axis=0)[:, ::-1].T)
    bend = np.column_stack((bend, [0.0, *yaw[1:], 0.0]))
    past = np.column_stack((past, np.zeros(len(past))))
    found: list[np.ndarray] = []

    def search(*_: object) -> list[Pose2]:
        found.append((bend, past)[len(found) % 2])
        return [Pose2(*pose) for pose in found[-1].tolist()]

    monkeypatch.setattr(ompl_planner_module, "search_poses", search)
    for searches, penalty, expected in ((1, 0.0, bend), (2, 0.0, past), (2, 0.1, past), (2, 1.0, bend)):
        found.clear()
        points = planned(hall(), Pose2(2, 3), Pose2(5, 3), pose_searches=searches, cusp_penalty=penalty)
        assert len(found) == searches
        assert np.allclose(points, expected)


def test_hull_clearance_is_kept_where_possible() -> None:
    view = hall((4.0, 0.0, 4.4, 2.6), (4.0, 4.6, 4.4, 6.0))
    footprint = Footprint(CAR, view.resolution)

    def clearance(required: float) -> float:
        points = planned(view, Pose2(1.5, 3.0), Pose2(7.5, 3.0), hull_clearance=required, cost_travel_multiplier=0.0)
        return float(footprint.clearance(view, points[np.abs(points[:, 0] - 4.2) < 1.0]).min())

    assert clearance(0.0) < 0.3
    assert clearance(0.5) > 0.5
    assert clearance(1.0) > 0.5  # half of it fits


def test_range_and_goal_bias_apply_to_poses() -> None:
    view = hall(BOX)
    usual = planned(view, *ENDS, type="kpiece", pose_searches=1)
    assert not np.array_equal(usual, planned(view, *ENDS, type="kpiece", pose_searches=1, range=0.8))
    assert not np.array_equal(usual, planned(view, *ENDS, type="kpiece", pose_searches=1, goal_bias=0.5))
