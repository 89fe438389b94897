"""Tests of complete plans against brute force, every half millimeter."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from grounds import ROBOT, forest, maze, pair, rooms, view_of

from simscen.core.geometry import Array, Pose2
from simscen.model.planners import Navfn, Smac2d
from simscen.model.planners import OmplPlanner as Spec
from simscen.stack.footprint import Footprint
from simscen.stack.planners.endpoints import find_endpoints
from simscen.stack.planners.grid_planner import navfn, smac_2d
from simscen.stack.planners.ompl_planner import ompl_planner
from simscen.stack.planners.path_postprocessing import spaced
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, RobotModel
from simscen.testing.flatland import box_robot, setting

GROUNDS = {"rooms": rooms, "forest": forest, "maze": maze}
CAR = RobotModel(box_robot(0.6, 0.35).footprint, None, 1.0, 1.0, 0.0, 1.5, 2.0, 2.0, 3.0, turning_radius=0.5)
WAYS = [("maze", 302), ("rooms", 306), ("maze", 311), ("forest", 317), ("forest", 321), ("maze", 325)]
"""Of ninety, those on which one planner or another cut corners, by up to 4.6 cm."""
KINDS = get_args(Spec.model_fields["type"].annotation)


def way(kind: str, number: int, robot: RobotModel = ROBOT, room: float = 0.0) -> tuple[CostmapView, Pose2, Pose2]:
    """A ground, and two places with so much room on it."""
    rng = np.random.default_rng((number, len(kind), 5))
    view = view_of(*GROUNDS[kind](rng), robot=robot)
    rates = TraversalCosts(view, robot, 2.0, True)
    free = np.argwhere(rates.free & (view.distance > room))
    inside = Pose2(*((free[len(free) // 2][::-1] + 0.5) * view.resolution + view.origin).tolist())
    reachable = find_endpoints(rates, inside, inside, 0.5).reachable & (view.distance > room)
    return view, *pair(rates, reachable, rng)


def passed(rates: TraversalCosts, points: Array) -> np.ndarray:
    """What a meter costs on each half millimeter of the way."""
    return rates.at(spaced(points[:, :2], 0.0005))


def spec(kind: str, **options: object) -> Spec:
    return Spec(type=kind, improving_iterations=100, **options)


@pytest.mark.sample(3)
@pytest.mark.parametrize("kind", [*KINDS, "not eased", "navfn", "smac_2d"])
def test_plan_never_crosses_a_blocked_cell(kind: str) -> None:
    """A corner was cut between two looks at a motion, where a search or its easing did not look."""
    planners = {name: ompl_planner(spec(name), setting(ROBOT)) for name in KINDS} | {
        "not eased": ompl_planner(Spec(simplify=False), setting(ROBOT)),
        "navfn": navfn(Navfn(type="navfn"), setting(ROBOT)),
        "smac_2d": smac_2d(Smac2d(type="smac_2d"), setting(ROBOT)),
    }
    for ground, number in WAYS:
        view, start, goal = way(ground, number)
        points = planners[kind].plan(view, start, goal, number).points
        assert np.isfinite(passed(TraversalCosts(view, ROBOT, 2.0, True), points)).all(), (ground, number)


@pytest.mark.parametrize("kind", ["bit_star", "rrt_connect"])
def test_plan_never_crosses_an_unknown_cell(kind: str) -> None:
    for ground, number in WAYS:
        view, *ends = way(ground, number)
        costs = np.where(np.random.default_rng(number).random(view.costs.shape) < 0.01, np.uint8(255), view.costs)
        for end in ends:
            column, row = (np.array(end[:2]) - view.origin) / view.resolution
            costs[int(row), int(column)] = 0
        view = replace(view, costs=costs)
        points = ompl_planner(spec(kind, allow_unknown=False), setting(ROBOT)).plan(view, *ends, number).points
        assert np.isfinite(passed(TraversalCosts(view, ROBOT, 2.0, False), points)).all(), (ground, number)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("space", "kind", "ground", "numbers"),
    [("reeds_shepp", "kpiece", "rooms", (506, 520)), ("dubins", "aorrtc", "forest", (501,))],
)
def test_hull_of_a_car_is_collision_free_along_the_plan(
    space: str, kind: str, ground: str, numbers: tuple[int, ...]
) -> None:
    """Plans of the thirty random ones that had collisions before."""
    for number in numbers:
        view, start, goal = way(ground, number, CAR, 0.45)
        car = ompl_planner(spec(kind, state_space=space, max_iterations=20_000), setting(CAR))
        points = car.plan(view, turned(start, number), turned(goal, number + 1), number).points
        points[:, 2] = np.unwrap(points[:, 2])
        part = (np.arange(50) / 50)[:, None]
        whole = (points[:-1, None] + part * np.diff(points, axis=0)[:, None]).reshape(-1, 3)
        assert Footprint(CAR, view.resolution).free(view, whole).all(), number


@pytest.mark.parametrize(("ground", "number"), [("forest", 601), ("forest", 604), ("rooms", 607), ("forest", 609)])
def test_aorrtc_reports_failure_for_a_car_without_a_path(ground: str, number: int) -> None:
    """OMPL calls a path of the goal alone an exact solution."""
    view, start, goal = way(ground, number, CAR, 0.45)
    ends = turned(start, number), turned(goal, number + 1)
    points = ompl_planner(spec("aorrtc", max_iterations=300), setting(CAR)).plan(view, *ends, number).points
    assert points[0] == pytest.approx(ends[0]) and points[-1] == pytest.approx(ends[1])
    assert np.hypot(*np.diff(points[:, :2], axis=0).T).max() < 0.1


def turned(pose: Pose2, number: int) -> Pose2:
    return Pose2(pose.x, pose.y, float(np.random.default_rng(number).uniform(-3, 3)))
