"""Tests of when the advanced stack replaces its plan."""

import math

import numpy as np
import pytest

from simscen.advanced.replanning import AdvancedPlanManager
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.core.messages.sensor_data import Scan
from simscen.core.records.events import Event
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES, MovingObstacle, MovingObstacles
from simscen.stack.protocols import CostmapView, NavigationFailure, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot

GOAL = Goal("g", Pose2(7.0, 3.0))
START = Pose2(1.0, 3.0)
WORLD = Flatland().room(8, 6)


class ScriptedPlanner:
    """Planner and controller that return a path with a lateral `bulge` in m, or fail if `fails` is set."""

    def __init__(self) -> None:
        self.seeds: list[int] = []
        self.bulge, self.fails = 0.0, False
        self.local_plan = None

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        self.seeds.append(seed)
        if self.fails:
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, "scripted failure")
        x = np.linspace(start.x, goal.x, 121)
        y = start.y + self.bulge * np.sin(np.linspace(0, math.pi, 121))
        return Path(np.column_stack((x, y, np.zeros(121))))

    def set_path(self, path: Path) -> None:
        pass

    def set_speed_limit(self, limit: float | None) -> None:
        pass

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        return STOP


class PlanManagerSetup:
    """Plan manager with a costmap and a scripted planner. `latency` is the planning time in ticks."""

    def __init__(self, latency: int = 0, **options: object) -> None:
        self.script = ScriptedPlanner()
        grid = WORLD.grid((-0.5, -0.5, 8.5, 6.5))
        self.costmap = LayeredCostmap(CostmapSpec(), Surroundings(round_robot(), grid, TICK_RATE_HZ))
        self.journal: list[Event] = []
        self.now = 0.0
        self.manager = AdvancedPlanManager(
            PlannerSpec(**{"cautious": True, **options}),
            self.script,
            self.costmap,
            lambda k: 100 + k,
            0.22,
            latency=latency,
        )

    def steps(self, count: int, goal: Goal = GOAL) -> list[object]:
        """Return the reasons of the plans made in `count` steps of the navigator."""
        before = len(self.journal)
        for _ in range(count):
            self.journal += self.manager.step(round(self.now * TICK_RATE_HZ), self.now, goal, START)
            self.now += 0.05
        return [event.data["reason"] for event in self.journal[before:]]

    def see(self, *discs: tuple[float, float, float]) -> None:
        """Update the costmap with a scan of the room with these discs."""
        step = 2 * math.pi / 360
        angles = -math.pi + step * np.arange(360)
        ranges = Flatland(WORLD.boxes, list(discs)).cast((START.x, START.y), angles)
        self.costmap.update(START, Scan("lidar", 0, ranges, -math.pi, step, 0.05, 12.0))


def test_goal_is_planned_once_and_each_plan_has_its_own_seed() -> None:
    setup = PlanManagerSetup()
    assert setup.steps(40) == ["goal"]
    setup.manager.drop("recovery")
    assert setup.steps(40) == ["recovery"]
    assert setup.script.seeds == [101, 102]


def test_blocked_plan_is_replaced_or_fails() -> None:
    setup = PlanManagerSetup()
    setup.steps(4)
    setup.see((2.5, 3.0, 0.2))
    setup.script.fails = True
    with pytest.raises(NavigationFailure):
        setup.steps(4)
    setup.script.fails, setup.script.bulge = False, 1.0
    assert setup.steps(4) == ["blocked"]


def test_plan_that_was_blocked_while_it_was_made_is_replaced() -> None:
    setup = PlanManagerSetup(latency=round(0.2 * TICK_RATE_HZ))
    setup.steps(2)
    setup.see((2.5, 3.0, 0.2))  # the planner does not know this obstacle
    setup.script.bulge = 1.0
    assert setup.steps(20) == ["goal", "blocked"]


def test_obstacle_next_to_the_plan_does_not_cause_replanning() -> None:
    setup = PlanManagerSetup()
    setup.steps(4)
    setup.see((2.5, 4.5, 0.2))
    assert setup.steps(80) == []


def test_removed_obstacle_leads_to_a_clearly_shorter_plan() -> None:
    setup = PlanManagerSetup()
    setup.script.bulge = 2.5
    setup.see((2.5, 3.0, 0.4))
    setup.steps(4)
    setup.see()
    assert setup.steps(60) == []  # one search, but its plan was no shorter
    setup.see((2.5, 3.0, 0.4))
    setup.steps(4)
    setup.script.bulge = 0.0
    setup.see()
    assert setup.steps(60) == ["better"]


def test_no_better_plan_is_searched_if_the_straight_line_is_not_clearly_shorter() -> None:
    """A useless search would delay the replacement of a blocked plan."""
    for bulge, is_searched in ((1.0, False), (2.5, True)):  # paths of 6.4 m and 8.5 m instead of 6 m
        setup = PlanManagerSetup()
        setup.script.bulge = bulge
        setup.see((2.5, 3.0, 0.2))
        setup.steps(4)
        setup.see()
        assert setup.steps(60) == []
        assert (len(setup.script.seeds) == 2) == is_searched


def test_failed_search_for_a_better_plan_is_ignored() -> None:
    setup = PlanManagerSetup()
    setup.script.bulge = 2.5
    setup.see((2.5, 3.0, 0.4))
    setup.steps(4)
    setup.script.fails = True
    setup.see()
    assert setup.steps(60) == []
    assert len(setup.script.seeds) == 2
    assert setup.manager.plan is not None


def test_replanning_at_a_rate_is_unconditional() -> None:
    setup = PlanManagerSetup(replanning="rate", replanning_rate=2.0)
    assert setup.steps(40) == ["goal", "rate", "rate", "rate"]


def test_replanning_at_a_rate_near_the_goal_replaces_only_blocked_plans() -> None:
    """As with IsGoalNearby and ValidatePath in Nav2's default behavior trees."""
    setup, near = PlanManagerSetup(replanning="rate", replanning_rate=2.0), Goal("near", Pose2(4.5, 3.0))
    assert setup.steps(40, near) == ["goal"]
    setup.see((3.0, 3.0, 0.3))
    assert setup.steps(12, near) == ["rate"]


def test_plan_that_ends_too_far_from_the_goal_fails_with_goal_occupied() -> None:
    setup = PlanManagerSetup()
    setup.script.plan = lambda *_: Path(np.array([[1.0, 3.0, 0.0], [6.5, 3.0, 0.0]]))
    with pytest.raises(NavigationFailure) as failure:
        setup.steps(1)
    assert failure.value.code == ErrorCode.GOAL_OCCUPIED


def test_plans_keep_more_clearance_after_a_control_failure() -> None:
    setup = PlanManagerSetup()
    plan_straight, clearance_increases = setup.script.plan, list[float]()

    def plan(costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        row, column = (
            round((center - low) / costmap.resolution) for center, low in zip((3.0, 1.0), costmap.origin, strict=True)
        )
        clearance_increases.append(float(setup.costmap.view.distance[row, column] - costmap.distance[row, column]))
        return plan_straight(costmap, start, goal, seed)

    setup.script.plan = plan
    setup.steps(2)
    setup.manager.report_control_failure()
    setup.manager.drop("recovery")
    setup.steps(2)
    setup.manager.reset(setup.now)
    setup.steps(2)
    assert clearance_increases == pytest.approx([0.0, 0.1, 0.15, 0.0])


@pytest.mark.parametrize(("xy_tolerance", "end_x"), [(0.25, 6.9), (0.05, 7.0)])
def test_clearance_does_not_move_the_end_of_the_plan_beyond_the_tolerance(xy_tolerance: float, end_x: float) -> None:
    setup = PlanManagerSetup()
    plan_straight = setup.script.plan

    def plan(costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        is_grown = costmap.distance is not setup.costmap.view.distance
        return plan_straight(costmap, start, Pose2(goal.x - 0.1, goal.y) if is_grown else goal, seed)

    setup.script.plan = plan
    setup.manager.report_control_failure()
    assert setup.steps(2, Goal("g", GOAL.pose, xy_tolerance=xy_tolerance)) == ["goal"]
    assert setup.manager.plan.path.points[-1, 0] == pytest.approx(end_x)


@pytest.mark.parametrize(("bulge", "is_accepted"), [(0.3, True), (2.5, False)])
def test_clearance_increases_if_the_path_is_hardly_longer(bulge: float, is_accepted: bool) -> None:
    setup = PlanManagerSetup()
    setup.steps(2)
    setup.manager.report_control_failure()
    setup.manager.drop("recovery")
    plan, bulges = setup.script.plan, iter([0.0, bulge])

    def wider_plan(*arguments: object) -> Path:
        setup.script.bulge = next(bulges)
        return plan(*arguments)

    setup.script.plan = wider_plan
    setup.steps(2)
    assert (setup.manager.plan.path.points[:, 1].max() > 3.2) == is_accepted


def test_tight_path_is_retried_if_there_is_no_wider_one() -> None:
    setup = PlanManagerSetup()
    setup.steps(2)
    setup.manager.report_control_failure()
    setup.manager.drop("recovery")
    plan_straight, is_unchanged = setup.script.plan, list[bool]()

    def plan(costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        is_unchanged.append(costmap.distance is setup.costmap.view.distance)
        if not is_unchanged[-1]:
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, "too tight")
        return plan_straight(costmap, start, goal, seed)

    setup.script.plan = plan
    assert setup.steps(2) == ["recovery"]
    assert is_unchanged == [False, False, True]


def obstacle_at(y: float, vy: float) -> MovingObstacles:
    """Return an obstacle at (2, y) that moves along y."""
    return MovingObstacles([MovingObstacle(complex(2.0, y), complex(0.0, vy), 0.3, 1e-4, 0.0, 1e-4)], 0.3)


def test_plan_that_meets_a_moving_obstacle_is_renewed_twice_a_second() -> None:
    setup = PlanManagerSetup()
    assert setup.steps(20) == ["goal"]
    setup.costmap.moving = obstacle_at(5.0, -1.0)  # meets the robot at (2, 3) in 2 s
    assert setup.steps(20) == ["moving", "moving"]
    setup.costmap.moving = NO_MOVING_OBSTACLES
    assert setup.steps(40) == ["moving"]  # back to the straight path


def test_rejected_plan_around_a_moving_obstacle_causes_no_more_replanning() -> None:
    setup = PlanManagerSetup()
    setup.script.bulge = 2.5
    setup.see((2.5, 3.0, 0.4))
    setup.steps(4)
    setup.costmap.moving = obstacle_at(2.2, -0.2)  # not on the plan, but on alternative paths
    setup.see()
    assert setup.steps(60) == []
    assert len(setup.script.seeds) == 2  # one search for a better plan


def test_departing_obstacle_does_not_cause_replanning() -> None:
    setup = PlanManagerSetup()
    assert setup.steps(20) == ["goal"]
    setup.costmap.moving = obstacle_at(4.5, 1.0)
    assert setup.steps(40) == []


def test_plan_is_kept_without_a_path_around_a_moving_obstacle() -> None:
    setup = PlanManagerSetup()
    assert setup.steps(20) == ["goal"]
    setup.costmap.moving, setup.script.fails = obstacle_at(5.0, -1.0), True
    assert setup.steps(20) == []
    assert setup.manager.plan is not None
