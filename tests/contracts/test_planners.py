"""Every planner keeps the promises of simscen.stack.protocols.Planner."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "stack"))
from simscen.core.geometry import Pose2
from simscen.core.navigation import ErrorCode
from simscen.model.stack import Costmap as CostmapSpec
from simscen.model.stack import OmplPlanner as Spec
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner, RobotModel, Surroundings
from simscen.testing.flatland import RATE, Flatland, box_robot, round_robot, setting

CAR = RobotModel(box_robot(0.6, 0.4).footprint, None, 1.0, 1.0, 0.0, 1.5, 2.0, 2.0, 3.0, turning_radius=0.6)
SPECS: dict[str, tuple[Spec, RobotModel]] = {
    **{
        kind: (Spec(type=kind, max_iterations=5000), round_robot())
        for kind in ("rrt_connect", "rrt_star", "informed_rrt_star", "bit_star", "aorrtc", "kpiece")
    },
    "long robot": (Spec(), box_robot()),
    "se2": (Spec(state_space="se2"), box_robot(0.9, 0.3)),
    "reeds_shepp": (Spec(), CAR),
    "dubins": (Spec(state_space="dubins"), CAR),
}
every = pytest.mark.parametrize(("spec", "robot"), SPECS.values(), ids=SPECS)
START, GOAL = Pose2(1.5, 1.5, 0.3), Pose2(10.0, 5.5, 0.5)


def world() -> Flatland:
    room = Flatland().room(12, 7)
    room.boxes += [(4.0, 0.0, 4.1, 4.5), (8.0, 2.5, 8.1, 7.0), (14.0, 1.0, 16.0, 1.1), (14.0, 1.0, 14.1, 6.0)]
    room.boxes += [(14.0, 5.9, 16.0, 6.0), (15.9, 1.0, 16.0, 6.0), (1.0, 5.0, 2.5, 6.0)]
    return room


def view_of(robot: RobotModel) -> CostmapView:
    grid = world().grid((-0.5, -0.5, 17.0, 7.5))
    return Costmap(CostmapSpec(), Surroundings(robot, grid, RATE)).view


def planner(spec: Spec, robot: RobotModel, view: CostmapView) -> Planner:
    return spec.implementation()(spec, setting(robot))


@every
def test_success_begins_at_the_start_ends_near_the_goal_and_never_puts_the_footprint_on_a_lethal_cell(
    spec: Spec, robot: RobotModel
) -> None:
    view = view_of(robot)
    footprint = Footprint(robot, view.resolution)
    for seed in (1, 2, 3):
        points = planner(spec, robot, view).plan(view, START, GOAL, seed).points
        assert np.hypot(*(points[0, :2] - START[:2])) < 1e-9
        assert np.hypot(*(points[-1, :2] - GOAL[:2])) <= spec.tolerance
        assert np.hypot(*np.diff(points[:, :2], axis=0).T).max() <= 0.1 + 1e-9
        assert footprint.free(view, points)[1:].all()


@every
@pytest.mark.parametrize(
    ("start", "goal", "code"),
    [
        (Pose2(-3, 1), GOAL, ErrorCode.START_OUTSIDE_MAP),
        (START, Pose2(30, 1), ErrorCode.GOAL_OUTSIDE_MAP),
        (Pose2(4.05, 1), GOAL, ErrorCode.START_OCCUPIED),
        (START, Pose2(8.05, 5), ErrorCode.GOAL_OCCUPIED),
        (START, Pose2(15, 3.5), ErrorCode.NO_VALID_PATH),
    ],
)
def test_what_cannot_be_fails_with_its_code(
    spec: Spec, robot: RobotModel, start: Pose2, goal: Pose2, code: ErrorCode
) -> None:
    view = view_of(robot)
    with pytest.raises(NavigationFailure) as failed:
        planner(spec, robot, view).plan(view, start, goal, 1)
    assert failed.value.code == code


@every
def test_the_same_seed_gives_the_same_path_bit_for_bit_whatever_was_planned_before(
    spec: Spec, robot: RobotModel
) -> None:
    view = view_of(robot)
    one = planner(spec, robot, view).plan(view, START, GOAL, 7)
    again = planner(spec, robot, view)
    again.plan(view, GOAL, START, 3)
    assert np.array_equal(again.plan(view, START, GOAL, 7).points, one.points)


@every
def test_a_costmap_is_not_changed(spec: Spec, robot: RobotModel) -> None:
    view = view_of(robot)
    costs, distance = view.costs.copy(), view.distance.copy()
    planner(spec, robot, view).plan(view, START, GOAL, 1)
    assert np.array_equal(view.costs, costs)
    assert np.array_equal(view.distance, distance)


@pytest.mark.parametrize("kind", ["reeds_shepp", "dubins"])
def test_a_car_is_never_asked_to_turn_tighter_than_it_can(kind: str) -> None:
    view = view_of(CAR)
    points = planner(Spec(state_space=kind), CAR, view).plan(view, START, GOAL, 1).points
    step = np.hypot(*np.diff(points[:, :2], axis=0).T)
    turn = np.abs((np.diff(points[:, 2]) + np.pi) % (2 * np.pi) - np.pi)
    moving = step > 1e-6
    too_tight = turn[moving] > step[moving] / CAR.turning_radius * 1.1 + 0.02
    assert too_tight.sum() <= (0 if kind == "dubins" else 4)  # a step across a cusp goes there and back
    heading = np.arctan2(*np.diff(points[:, :2], axis=0).T[::-1])
    off = np.abs((heading - points[:-1, 2] + np.pi) % (2 * np.pi) - np.pi)
    along = off < 0.2 if kind == "dubins" else (off < 0.2) | (off > np.pi - 0.2)
    assert (~along[moving]).sum() <= (0 if kind == "dubins" else 4)
