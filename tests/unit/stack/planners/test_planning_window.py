"""Tests of planning in a window around start and goal on large costmaps."""

import numpy as np
import pytest

from simscen.advanced.planners.medial_axis_planner import MedialAxisPlanner
from simscen.advanced.spec import MedialAxisPlanner as PlannerSpec
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.planners.planning_window import MAX_FULL_SEARCH_CELLS, plan_in_windows
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.testing.flatland import round_robot

EDGE_CELLS = 1200
START, GOAL = Pose2(20.0, 30.0, 0.0), Pose2(26.0, 30.0, 0.0)


def hall(wall: int = 0) -> CostmapView:
    """Return a free costmap of 60 x 60 m with a wall between START and GOAL that extends `wall` cells to both sides."""
    shape = (EDGE_CELLS, EDGE_CELLS)
    costs, distance = np.zeros(shape, dtype=np.uint8), np.full(shape, 5.0, dtype=np.float32)
    if wall:
        costs[600 - wall : 600 + wall, 455:465], distance[600 - wall : 600 + wall, 455:465] = 254, 0.0
    return CostmapView(costs, distance, 0.05, (0.0, 0.0))


class ScriptedPlanner:
    """Planner that records its costmaps, and returns paths of the given lengths, or fails for None."""

    def __init__(self, *lengths: float | None) -> None:
        self.lengths, self.views = list(lengths), list[CostmapView]()

    def plan(self, view: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        self.views.append(view)
        length = self.lengths.pop(0)
        if length is None:
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, "none")
        return Path(np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]]))


def test_small_costmap_is_searched_completely():
    costs = np.zeros((1000, MAX_FULL_SEARCH_CELLS // 1000), dtype=np.uint8)
    small, planner = CostmapView(costs, costs.astype(np.float32), 0.05, (0.0, 0.0)), ScriptedPlanner(7.0)
    plan_in_windows(planner.plan, small, START, GOAL, 1)
    assert planner.views == [small]


def test_path_in_the_window_is_used_if_no_outside_path_can_be_shorter():
    planner = ScriptedPlanner(20.0)
    assert plan_in_windows(planner.plan, hall(), START, GOAL, 1).length() == 20.0
    (view,) = planner.views
    assert view.origin == pytest.approx((10.0, 20.0))
    assert view.costs.shape == view.distance.shape == (400, 520)


@pytest.mark.parametrize("first_length", [20.95, None])
def test_window_grows_up_to_the_whole_map_for_longer_or_missing_paths(first_length):
    """The shortest path that leaves the window at its upper side is 20.88 m long: 10 m up and down, and 6 m along x."""
    planner = ScriptedPlanner(first_length, 50.0, 50.0)
    assert plan_in_windows(planner.plan, hall(), START, GOAL, 1).length() == 50.0
    assert [view.costs.size for view in planner.views] == [400 * 520, EDGE_CELLS * EDGE_CELLS]


def test_edge_of_the_map_needs_no_larger_window():
    """A path from the corner can leave the window only at sides inside the map, so it is longer than 19.9 m."""
    planner = ScriptedPlanner(19.9)
    assert plan_in_windows(planner.plan, hall(), Pose2(1.0, 1.0, 0.0), Pose2(1.0, 4.0, 0.0), 1).length() == 19.9
    assert planner.views[0].origin == (0.0, 0.0)


def test_missing_path_on_the_whole_costmap_fails():
    with pytest.raises(NavigationFailure) as failure:
        plan_in_windows(ScriptedPlanner(None, None, None).plan, hall(), START, GOAL, 1)
    assert failure.value.code == ErrorCode.NO_VALID_PATH


def test_start_or_goal_outside_the_map_is_reported_by_the_planner():
    planner = ScriptedPlanner(None)
    with pytest.raises(NavigationFailure):
        plan_in_windows(planner.plan, hall(), START, Pose2(-3.0, 0.0, 0.0), 1)
    assert len(planner.views) == 1


@pytest.mark.parametrize("wall", [60, 300])
def test_path_around_a_wall_is_found_in_and_outside_the_window(wall):
    """A wall of 3 m to both sides ends within the window, and a wall of 15 m outside of it."""
    planner = MedialAxisPlanner(PlannerSpec(type="medial_axis"), round_robot())
    path = planner.plan(hall(wall), START, GOAL, seed=1)
    shortest = 2 * np.hypot(wall * 0.05, 3.0)
    assert shortest - 0.1 < path.length() < shortest + 1.0
