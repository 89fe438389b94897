"""Tests of the OMPL planner: path length, clearance, error codes, walls, and narrow gaps."""

import math

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from simscen.advanced.planners.path_refinement import refine, smooth_path
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.planners.ompl_planner import OmplPlanner
from simscen.stack.planners.ompl_search import OmplSearch
from simscen.stack.planners.path_postprocessing import SPACING_M, densify
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, round_robot

ROBOT = round_robot()


def house() -> Flatland:
    """Return a house with six rooms and doors that are 0.9 m wide."""
    world = Flatland().room(14, 10)
    for x, doors in ((4.5, (1.0, 7.0)), (9.5, (3.5, 8.5))):
        for low, door in zip((0.0, 5.0), doors, strict=True):
            world.boxes += [(x, low, x + 0.12, door), (x, door + 0.9, x + 0.12, low + 5.0)]
    for low, high, door in ((0.0, 4.5, 2.0), (4.5, 9.5, 8.0), (9.5, 14.0, 11.0)):
        world.boxes += [(low, 5.0, door, 5.12), (door + 0.9, 5.0, high, 5.12)]
    return world


def view_of(world: Flatland, robot: RobotModel = ROBOT, size: tuple[float, float] = (14, 10)) -> CostmapView:
    grid = world.grid((-0.5, -0.5, size[0] + 0.5, size[1] + 0.5))
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, grid, TICK_RATE_HZ)).view


def shortest_length(view: CostmapView, start: Pose2, goal: Pose2, radius: float) -> float:
    """Return the length in m of the shortest path of a disc by Dijkstra with 16 neighbors (error up to 2.8 %)."""
    free = view.distance > radius
    index = np.arange(free.size).reshape(free.shape)
    a, b, w = [], [], []
    for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1)):
        left = max(0, -dc)
        from_cells = (slice(0, free.shape[0] - dr), slice(left, free.shape[1] - max(0, dc)))
        to_cells = (slice(dr, free.shape[0]), slice(left + dc, free.shape[1] + min(0, dc)))
        is_free = free[from_cells] & free[to_cells]
        a.append(index[from_cells][is_free])
        b.append(index[to_cells][is_free])
        w.append(np.full(len(a[-1]), math.hypot(dr, dc) * view.resolution))
    graph = csr_matrix((np.concatenate(w), (np.concatenate(a), np.concatenate(b))), shape=(free.size, free.size))
    ends = [
        index[int((p.y - view.origin[1]) / view.resolution), int((p.x - view.origin[0]) / view.resolution)]
        for p in (start, goal)
    ]
    return float(dijkstra(graph, directed=False, indices=ends[0])[ends[1]])


def planner(kind: str = "bit_star", robot: RobotModel = ROBOT, **options: object) -> OmplPlanner:
    return OmplPlanner(PlannerSpec(type=kind, **options), robot)


ENDPOINTS = [
    ((1, 1), (13, 9)),
    ((1, 9), (13, 1)),
    ((2, 3), (7, 8)),
    ((6, 2), (12, 7)),
    ((1, 1), (1, 9)),
    ((8, 1), (3, 8)),
]


def test_plans_are_within_ten_percent_of_the_shortest_path() -> None:
    view = view_of(house())
    ratios = []
    for seed, (a, b) in enumerate(ENDPOINTS):
        start, goal = Pose2(*a), Pose2(*b, 1.0)
        ratios.append(planner().plan(view, start, goal, seed + 1).length() / shortest_length(view, start, goal, 0.22))
    assert np.mean(ratios) < 1.10
    assert max(ratios) < 1.20


def test_plan_comes_from_the_ompl_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """If the search returns another path, the plan is this path."""
    view, detour = view_of(Flatland().room(14, 10)), [(2.0, 2.0), (3.0, 8.0), (11.0, 8.0), (12.0, 2.0)]
    ends = Pose2(2.0, 2.0), Pose2(12.0, 2.0)
    assert planner().plan(view, *ends, 1).points[:, 1].max() < 2.5
    monkeypatch.setattr(OmplSearch, "solve", lambda self, *, simplify: detour)
    points = planner().plan(view, *ends, 1).points[:, :2]
    assert points == pytest.approx(densify(np.array(detour), SPACING_M))


def test_plan_keeps_the_preferred_clearance_where_possible() -> None:
    view = view_of(house())
    path = planner().plan(view, Pose2(1, 1), Pose2(13, 9), 1)
    columns, rows = ((path.points[:, i] - view.origin[i]) / view.resolution for i in (0, 1))
    assert view.distance[rows.astype(int), columns.astype(int)].min() > 0.22 + 0.05


def test_start_near_a_wall_is_planned_for() -> None:
    path = planner().plan(view_of(house()), Pose2(0.12, 1.0), Pose2(3.0, 1.0), 1)
    assert path.points[0, :2] == pytest.approx((0.12, 1.0))


def test_goal_beside_a_wall_is_moved_within_the_tolerance() -> None:
    path = planner().plan(view_of(house()), Pose2(1.0, 1.0), Pose2(0.1, 3.0), 1)
    assert 0.05 < math.hypot(path.points[-1, 0] - 0.1, path.points[-1, 1] - 3.0) <= 0.5


@pytest.mark.parametrize(
    ("start", "goal", "code"),
    [
        ((-5, 1), (1, 1), ErrorCode.START_OUTSIDE_MAP),
        ((1, 1), (20, 1), ErrorCode.GOAL_OUTSIDE_MAP),
        ((4.55, 0.5), (1, 1), ErrorCode.START_OCCUPIED),
        ((1, 1), (4.55, 0.5), ErrorCode.GOAL_OCCUPIED),
        ((1, 1), (17, 3), ErrorCode.NO_VALID_PATH),
    ],
)
def test_planning_failures_have_nav2_error_codes(
    start: tuple[float, float], goal: tuple[float, float], code: ErrorCode
) -> None:
    world = house()
    world.boxes += [(16.0, 0.0, 16.1, 5.0), (16.0, 5.0, 19.0, 5.1), (18.9, 0.0, 19.0, 5.0), (16.0, 0.0, 19.0, 0.1)]
    grid = world.grid((-0.5, -0.5, 19.5, 10.5))
    view = LayeredCostmap(CostmapSpec(), Surroundings(ROBOT, grid, TICK_RATE_HZ)).view
    with pytest.raises(NavigationFailure) as failure:
        planner().plan(view, Pose2(*start), Pose2(*goal), 1)
    assert failure.value.code == code


def test_too_few_iterations_fail_with_no_valid_path() -> None:
    with pytest.raises(NavigationFailure) as failure:
        planner(max_iterations=1).plan(view_of(house()), Pose2(1, 1), Pose2(13, 9), 1)
    assert failure.value.code == ErrorCode.NO_VALID_PATH


def test_long_robot_takes_a_path_on_which_it_can_turn() -> None:
    world = Flatland().room(8, 6)
    world.boxes += [(4.0, 0.0, 4.1, 2.8), (4.0, 3.25, 4.1, 3.8)]  # a slit of 0.45 m ahead, and a gap at larger y
    path = planner(robot=box_robot()).plan(view_of(world, box_robot(), (8, 6)), Pose2(3, 3), Pose2(5, 3), 1)
    assert path.points[:, 1].max() > 3.8


def test_plan_uses_a_tight_gap_without_an_alternative() -> None:
    world = Flatland().room(8, 6)
    world.boxes += [(4.0, 0.0, 4.1, 2.8), (4.0, 3.25, 4.1, 6.0)]
    path = planner(robot=box_robot()).plan(view_of(world, box_robot(), (8, 6)), Pose2(3, 3), Pose2(5, 3), 1)
    assert path.length() < 2.5


@pytest.mark.slow
def test_path_of_hundreds_of_meters_through_many_doors_is_found() -> None:
    world = Flatland().room(60, 20)
    for k in range(1, 15):  # walls with doors at alternating ends
        low, high = (0.0, 18.6) if k % 2 else (1.4, 20.0)
        world.boxes.append((4.0 * k, low, 4.0 * k + 0.1, high))
    view = view_of(world, size=(60, 20))
    start, goal = Pose2(2, 2), Pose2(58, 10)
    path = planner().plan(view, start, goal, 1)
    assert path.length() > 200
    assert path.length() < 1.15 * shortest_length(view, start, goal, 0.22)


def hall(*boxes: tuple[float, float, float, float]) -> CostmapView:
    """Return the costmap of a room of 14 x 10 m with walls."""
    world = Flatland().room(14, 10)
    world.boxes += boxes
    return view_of(world)


def hits_wall(view: CostmapView, points: np.ndarray) -> bool:
    """Return whether any of the points (n, 2) lies on a lethal cell."""
    columns, rows = np.floor((points - view.origin) / view.resolution).astype(int).T
    return bool((view.distance[rows, columns] == 0.0).any())


def test_path_too_close_to_a_wall_is_not_smoothed_through_it() -> None:
    view = hall((4.0, 0.0, 4.1, 6.0))
    rates = TraversalCosts(view, ROBOT, 2.0, True)
    path = np.array([(2.0, 2.0), (2.0, 6.15), (4.05, 6.15), (6.0, 6.15), (6.0, 2.0)])  # the robot has a radius of 22 cm
    assert np.isinf(rates.along(path)) and not hits_wall(view, densify(path, SPACING_M))
    for smoothed in (smooth_path(rates, path), refine(rates, path)):
        assert not hits_wall(view, densify(smoothed, SPACING_M))


def test_robot_near_a_wall_is_not_sent_through_it() -> None:
    pocket = ((5.0, 3.0, 5.05, 7.0), (5.35, 3.0, 5.4, 7.0))
    start, goal = Pose2(5.2, 6.75, 0.0), Pose2(12.0, 5.0, 0.0)
    path = planner().plan(hall(*pocket), start, goal, 1)
    assert not hits_wall(hall(*pocket), path.points[:, :2])
    with pytest.raises(NavigationFailure) as failure:
        planner().plan(hall(*pocket, (5.0, 7.0, 5.4, 7.05)), start, goal, 1)
    assert failure.value.code is ErrorCode.START_OCCUPIED


# Narrow gaps


def two_rooms(width: float, detour: bool = True) -> Flatland:
    """Return a room with a wall at x = 4 that has a gap at y = 2 and, with `detour`, a wide opening at its end."""
    world = Flatland().room(8, 8)
    world.boxes += [(4.0, 0.0, 4.1, 2.0 - width / 2), (4.0, 2.0 + width / 2, 4.1, 6.5 if detour else 8.0)]
    return world


def plan_through(world: Flatland, **parameters: float) -> float:
    """Return the length of the plan from one room to the other."""
    spec = PlannerSpec.model_validate(parameters)
    view = view_of(world, size=(8, 8))
    return OmplPlanner(spec, ROBOT).plan(view, Pose2(1.5, 2.0), Pose2(6.5, 2.0), 1).length()


@pytest.mark.parametrize(("margin", "is_used"), [(0.1, False), (0.4, True)])
def test_a_plan_avoids_a_gap_with_too_little_clearance(margin: float, is_used: bool) -> None:
    length = plan_through(two_rooms(2 * ROBOT.inscribed_radius + margin))
    assert (length < 6.0) == is_used
    assert length > 10.0 or is_used


def test_a_plan_leads_through_a_narrow_gap_if_there_is_no_other_path() -> None:
    assert plan_through(two_rooms(2 * ROBOT.inscribed_radius + 0.1, detour=False)) < 6.0


def test_any_gap_is_used_without_gap_clearance() -> None:
    assert plan_through(two_rooms(2 * ROBOT.inscribed_radius + 0.1), gap_clearance=0.0) < 6.0


def test_start_in_a_narrow_gap_and_goal_beside_a_wall_are_allowed() -> None:
    view = view_of(two_rooms(2 * ROBOT.inscribed_radius + 0.1), size=(8, 8))
    path = OmplPlanner(PlannerSpec(), ROBOT).plan(view, Pose2(4.05, 2.0), Pose2(6.5, 0.15 + ROBOT.inscribed_radius), 1)
    assert path.length() < 4.0


@pytest.mark.sample(1)
@pytest.mark.parametrize("clearance", [0.03, 0.07, 0.2])
def test_blocked_gaps_equal_brute_force(clearance: float) -> None:
    """A cell is blocked if no cell within the clearance is farther from obstacles than required."""
    rng = np.random.default_rng(3)
    world = Flatland().room(5, 5)
    world.boxes += [(x, y, x + 0.2, y + 0.3) for x, y in rng.uniform(0.3, 4.5, (14, 2)).tolist()]
    view = view_of(world, size=(5, 5))
    costs = TraversalCosts(view, ROBOT, 2.0, True)
    start = (0.5, 0.5)
    without_gaps = costs.without_narrow_gaps(clearance, [start])
    cells = np.argwhere(view.distance >= 0)
    wide = cells[(view.distance > np.float32(ROBOT.inscribed_radius + clearance)).ravel()]
    reach = math.ceil(clearance / view.resolution)
    narrow = (KDTree(wide).query(cells)[0] > reach).reshape(view.distance.shape)
    exempt = np.zeros_like(narrow)
    row, column = costs.cell(start)
    exempt[max(0, row - 10) : row + 11, max(0, column - 10) : column + 11] = True
    blocked = (narrow & ~exempt) | ~np.isfinite(costs.rates)
    assert 0 < (blocked & np.isfinite(costs.rates)).sum() < blocked.size / 2
    np.testing.assert_array_equal(np.isfinite(without_gaps.rates), ~blocked)
    np.testing.assert_array_equal(without_gaps.rates[~blocked], costs.rates[~blocked])
