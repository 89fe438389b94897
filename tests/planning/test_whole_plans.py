"""Tests that complete plans of all planners are free of collisions, checked at every half millimeter."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from generated_worlds import ROBOT, costmap_of, forest, maze, random_query, rooms

from simscen.core.geometry import Array, Pose2
from simscen.model.planners import Navfn, Smac2d
from simscen.model.planners import OmplPlanner as Spec
from simscen.stack.footprint import Footprint
from simscen.stack.planners.endpoints import find_endpoints
from simscen.stack.planners.grid_planner import navfn, smac_2d
from simscen.stack.planners.ompl_planner import ompl_planner
from simscen.stack.planners.path_postprocessing import densify
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, RobotModel
from simscen.testing.flatland import box_robot, setting

WORLDS = {"rooms": rooms, "forest": forest, "maze": maze}
CAR = RobotModel(box_robot(0.6, 0.35).footprint, None, 1.0, 1.0, 0.0, 1.5, 2.0, 2.0, 3.0, turning_radius=0.5)
QUERIES = [("maze", 302), ("rooms", 306), ("maze", 311), ("forest", 317), ("forest", 321), ("maze", 325)]
"""Kind of world and seed of the queries, out of ninety, in which a planner once cut a corner, by up to 4.6 cm."""
KINDS = get_args(Spec.model_fields["type"].annotation)


def query(
    kind: str, number: int, robot: RobotModel = ROBOT, clearance: float = 0.0
) -> tuple[CostmapView, Pose2, Pose2]:
    """Return the costmap of a random world, and a start and goal with more than `clearance` m to obstacles."""
    rng = np.random.default_rng((number, len(kind), 5))
    view = costmap_of(*WORLDS[kind](rng), robot=robot)
    rates = TraversalCosts(view, robot, 2.0, True)
    free = np.argwhere(rates.free & (view.distance > clearance))
    inside = Pose2(*((free[len(free) // 2][::-1] + 0.5) * view.resolution + view.origin).tolist())
    reachable = find_endpoints(rates, inside, inside, 0.5).reachable & (view.distance > clearance)
    return view, *random_query(rates, reachable, rng)


def costs_along(rates: TraversalCosts, points: Array) -> np.ndarray:
    """Return the traversal cost at each half millimeter of a path."""
    return rates.at(densify(points[:, :2], 0.0005))


def spec(kind: str, **options: object) -> Spec:
    """Return the specification of an OMPL planner of this type."""
    return Spec(type=kind, improving_iterations=100, **options)


@pytest.mark.sample(3)
@pytest.mark.parametrize("kind", [*KINDS, "not simplified", "navfn", "smac_2d"])
def test_plan_never_crosses_a_blocked_cell(kind: str) -> None:
    """Regression: a motion cut a corner between two samples of the collision check, in search or simplification."""
    planners = {name: ompl_planner(spec(name), setting(ROBOT)) for name in KINDS} | {
        "not simplified": ompl_planner(Spec(simplify=False), setting(ROBOT)),
        "navfn": navfn(Navfn(type="navfn"), setting(ROBOT)),
        "smac_2d": smac_2d(Smac2d(type="smac_2d"), setting(ROBOT)),
    }
    for world, number in QUERIES:
        view, start, goal = query(world, number)
        points = planners[kind].plan(view, start, goal, number).points
        assert np.isfinite(costs_along(TraversalCosts(view, ROBOT, 2.0, True), points)).all(), (world, number)


@pytest.mark.parametrize("kind", ["bit_star", "rrt_connect"])
def test_plan_never_crosses_an_unknown_cell(kind: str) -> None:
    for world, number in QUERIES:
        view, *ends = query(world, number)
        costs = np.where(np.random.default_rng(number).random(view.costs.shape) < 0.01, np.uint8(255), view.costs)
        for end in ends:
            column, row = (np.array(end[:2]) - view.origin) / view.resolution
            costs[int(row), int(column)] = 0
        view = replace(view, costs=costs)
        points = ompl_planner(spec(kind, allow_unknown=False), setting(ROBOT)).plan(view, *ends, number).points
        assert np.isfinite(costs_along(TraversalCosts(view, ROBOT, 2.0, False), points)).all(), (world, number)


@pytest.mark.slow
@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("space", "kind", "world", "numbers"),
    [("reeds_shepp", "kpiece", "rooms", (506, 520)), ("dubins", "aorrtc", "forest", (501,))],
)
def test_hull_of_a_car_is_collision_free_along_the_plan(
    space: str, kind: str, world: str, numbers: tuple[int, ...]
) -> None:
    """Regression: these plans, out of thirty random ones, had collisions."""
    for number in numbers:
        view, start, goal = query(world, number, CAR, 0.45)
        car = ompl_planner(spec(kind, state_space=space, max_iterations=20_000), setting(CAR))
        points = car.plan(view, with_random_yaw(start, number), with_random_yaw(goal, number + 1), number).points
        points[:, 2] = np.unwrap(points[:, 2])
        shares = (np.arange(50) / 50)[:, None]
        dense_points = (points[:-1, None] + shares * np.diff(points, axis=0)[:, None]).reshape(-1, 3)
        assert Footprint(CAR, view.resolution).free(view, dense_points).all(), number


@pytest.mark.parametrize(("world", "number"), [("forest", 601), ("forest", 604), ("rooms", 607), ("forest", 609)])
def test_aorrtc_never_returns_a_path_of_only_the_goal(world: str, number: int) -> None:
    """Regression: OMPL calls a path that contains only the goal an exact solution."""
    view, start, goal = query(world, number, CAR, 0.45)
    ends = with_random_yaw(start, number), with_random_yaw(goal, number + 1)
    points = ompl_planner(spec("aorrtc", max_iterations=300), setting(CAR)).plan(view, *ends, number).points
    assert points[0] == pytest.approx(ends[0]) and points[-1] == pytest.approx(ends[1])
    assert np.hypot(*np.diff(points[:, :2], axis=0).T).max() < 0.1


def with_random_yaw(pose: Pose2, number: int) -> Pose2:
    return Pose2(pose.x, pose.y, float(np.random.default_rng(number).uniform(-3, 3)))
