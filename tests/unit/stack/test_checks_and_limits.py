"""Tests of goal checker, progress checker, recovery retries, blocked plans, speed limits, and the end of a task."""

import numpy as np
import pytest

from simscen.advanced.replanning import ClearancePlan
from simscen.core.environment.costmap_filters import FilterMasks, SpeedLimits
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.controllers import ProgressChecker as ProgressSpec
from simscen.model.controllers import SimpleGoalChecker as CheckerSpec
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.recovery import Recovery
from simscen.model.recovery import Wait as WaitSpec
from simscen.model.stack import StackSpec
from simscen.stack.behaviors import BehaviorSequence, Wait
from simscen.stack.checkers import STANDSTILL_CHECKS, ProgressChecker, SimpleGoalChecker
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.costmap.speed_filter import SpeedFilter
from simscen.stack.followed_plan import FollowedPlan
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.stack.tasks import Task
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot, setting

GOAL = Goal("g", Pose2(1.0, 0.0, 0.0), xy_tolerance=0.2, yaw_tolerance=0.2)
DRIVING = Twist(0.3)


def goal_checker(*, stateful: bool) -> SimpleGoalChecker:
    return SimpleGoalChecker(CheckerSpec(stateful=stateful, well_inside=0.5), setting(round_robot()))


def view_of(world: Flatland, robot: RobotModel) -> CostmapView:
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-2.0, -2.0, 6.0, 2.0)), TICK_RATE_HZ)).view


@pytest.mark.parametrize(
    ("pose", "twist", "reached"),
    [
        (Pose2(0.85, 0.0, 0.0), DRIVING, False),  # inside the tolerance, but not within `well_inside` of it
        (Pose2(0.85, 0.0, 0.0), STOP, True),
        (Pose2(0.95, 0.0, 0.0), DRIVING, True),
        (Pose2(0.95, 0.0, 0.15), DRIVING, False),
        (Pose2(0.95, 0.0, 0.15), STOP, True),
        (Pose2(0.95, 0.0, 0.3), STOP, False),
        (Pose2(0.75, 0.0, 0.0), STOP, False),
    ],
)
def test_goal_is_reached_within_half_the_tolerance_or_by_a_stop_within_the_tolerance(
    pose: Pose2, twist: Twist, reached: bool
) -> None:
    checker = goal_checker(stateful=True)
    assert [checker.reached(GOAL, pose, twist) for _ in range(STANDSTILL_CHECKS)][-1] == reached


def test_nav2_goal_checker_accepts_the_edge_of_the_tolerance_while_moving() -> None:
    checker = SimpleGoalChecker(CheckerSpec(well_inside=1.0), setting(round_robot()))
    assert checker.reached(GOAL, Pose2(0.81, 0.0, 0.19), DRIVING)
    assert not checker.reached(GOAL, Pose2(0.81, 0.0, 0.21), DRIVING)


def test_short_stop_before_turning_does_not_reach_the_goal() -> None:
    assert not goal_checker(stateful=True).reached(GOAL, Pose2(0.95, 0.0, 0.15), STOP)


def test_stateful_goal_checker_keeps_the_position_reached_while_turning() -> None:
    stateful, stateless = goal_checker(stateful=True), goal_checker(stateful=False)
    for checker in (stateful, stateless):
        checker.reached(GOAL, Pose2(0.95, 0.0, 1.0), DRIVING)
    assert stateful.reached(GOAL, Pose2(0.85, 0.0, 0.05), DRIVING)
    assert not stateless.reached(GOAL, Pose2(0.85, 0.0, 0.05), DRIVING)


def test_robot_is_stuck_without_the_required_movement_within_the_allowance() -> None:
    checker = ProgressChecker(ProgressSpec(required_movement_radius=0.5, movement_time_allowance=10.0))
    assert not checker.is_stuck(Pose2(0, 0), 0.0)
    assert not checker.is_stuck(Pose2(0.49, 0), 10.0)
    assert checker.is_stuck(Pose2(0.49, 0), 10.1)
    assert not checker.is_stuck(Pose2(0.5, 0), 10.2)


def test_turning_is_progress_only_if_an_angle_is_given() -> None:
    for angle, is_stuck in ((None, True), (0.5, False)):
        checker = ProgressChecker(ProgressSpec(required_movement_angle=angle))
        checker.is_stuck(Pose2(0, 0, 0), 0.0)
        checker.is_stuck(Pose2(0, 0, 0.6), 9.0)
        assert checker.is_stuck(Pose2(0, 0, 0.6), 11.0) == is_stuck


def test_recoveries_alternate_until_the_retries_are_used_up() -> None:
    class NamedWait(Wait):
        def __init__(self, name: str) -> None:
            self.name = name

    behaviors = BehaviorSequence([NamedWait("a"), NamedWait("b"), NamedWait("c")], Recovery(number_of_retries=4))
    assert [b.name for b in iter(lambda: behaviors.next_behavior(5.0), None)] == ["a", "b", "c", "a"]
    behaviors.reset()
    assert behaviors.next_behavior(5.0).name == "b"
    assert BehaviorSequence([], Recovery(number_of_retries=3)).next_behavior(5.0) is None


@pytest.mark.parametrize(
    ("retries_since_progress", "has_behavior"),
    [(True, [True, True, False, True, True, False]), (False, [True, True, *[False] * 4])],
)
def test_progress_of_a_meter_resets_the_retries(retries_since_progress: bool, has_behavior: list[bool]) -> None:
    behaviors = BehaviorSequence(
        [Wait(WaitSpec(), setting(round_robot()))],
        Recovery(number_of_retries=2, retries_since_progress=retries_since_progress),
    )
    assert [
        behaviors.next_behavior(distance) is not None for distance in (5.0, 6.0, 4.5, 3.4, 8.0, 3.4)
    ] == has_behavior


@pytest.mark.parametrize(
    ("code", "advanced", "nav2"),
    [
        (ErrorCode.NO_VALID_PATH, True, True),
        (ErrorCode.START_OCCUPIED, True, False),
        (ErrorCode.GOAL_OUTSIDE_MAP, False, False),
        (ErrorCode.FAILED_TO_MAKE_PROGRESS, True, True),
        (299, True, True),
    ],
)
def test_recoveries_help_against_the_listed_and_unknown_error_codes(code: int, advanced: bool, nav2: bool) -> None:
    failure = NavigationFailure(code, "")
    assert BehaviorSequence([], Recovery()).can_help(failure) == nav2
    assert BehaviorSequence([], StackSpec(profile="advanced").recovery).can_help(failure) == advanced


def test_plan_is_blocked_only_by_obstacles_ahead() -> None:
    robot = round_robot()
    line = np.column_stack((np.arange(0.0, 4.0, 0.05), np.zeros(80), np.zeros(80)))
    plan = FollowedPlan(Path(line), robot.inscribed_radius, view_of(Flatland(), robot))
    for x, is_blocked in ((2.0, True), (-0.5, False)):
        plan.locate(Pose2(1.0, 0.0))
        plan.update_occupied(view_of(Flatland(discs=[(x, 0.1, 0.1)]), robot))
        assert plan.is_blocked() == is_blocked
    assert plan.remaining() == pytest.approx(2.95, abs=0.05)


@pytest.mark.parametrize(("length", "is_better"), [(1.0, True), (2.4, True), (2.6, False)])
def test_another_plan_must_be_clearly_shorter(length: float, is_better: bool) -> None:
    line = np.column_stack((np.linspace(0, 3, 61), np.zeros(61), np.zeros(61)))
    plan = ClearancePlan(Path(line), 0.2, view_of(Flatland(), round_robot()))
    assert plan.is_longer_than(length) == is_better


def test_plan_has_lost_clearance_if_an_obstacle_appears_beside_it() -> None:
    robot = round_robot()
    line = Path(np.column_stack((np.arange(0.0, 4.0, 0.05), np.zeros(80), np.zeros(80))))
    wide, narrow = (view_of(Flatland(discs=discs), robot) for discs in ((), [(2.0, 0.45, 0.1)]))
    for view_of_plan, current_view, has_lost_clearance in (
        (wide, narrow, True),
        (narrow, narrow, False),
        (narrow, wide, False),
    ):
        plan = ClearancePlan(line, robot.inscribed_radius, view_of_plan)
        plan.update_occupied(current_view)
        assert plan.has_lost_clearance() == has_lost_clearance


def test_lowest_speed_limit_of_overlapping_zones_applies() -> None:
    zones = ((((0, 0), (2, 0), (2, 2), (0, 2)), 0.3), (((1, 0), (3, 0), (3, 2), (1, 2)), 0.2))
    mask = SpeedLimits(OccupancyGrid(np.full((2, 1), 50, np.int8), 1.0), True, 0.0, 1.0)
    speed_filter = SpeedFilter(
        Surroundings(round_robot(), None, TICK_RATE_HZ, speed_zones=zones, masks=FilterMasks(speed=mask))
    )
    assert speed_filter.limit(Pose2(0.5, 1), 0.5) == 0.25
    assert speed_filter.limit(Pose2(0.5, 1), 1.0) == 0.3
    assert speed_filter.limit(Pose2(1.5, 1), 0.5) == 0.2
    assert speed_filter.limit(Pose2(5, 1), 0.5) is None


def test_ended_task_has_the_code_of_the_last_failure() -> None:
    task = Task(False)
    task.start((Goal("a", Pose2(0, 0)), Goal("b", Pose2(1, 0))))
    first_events = *task.accept_next(1), *task.record_failed(5, ErrorCode.GOAL_OCCUPIED, "in a wall")
    events = *first_events, *task.accept_next(6), *task.record_reached(9)
    assert [(e.tick, e.kind, e.name) for e in events] == [
        (1, "goal.accepted", "a"),
        (5, "goal.failed", "a"),
        (6, "goal.accepted", "b"),
        (9, "goal.reached", "b"),
        (9, "navigation.ended", "FAILED"),
    ]
    assert events[-1].data == {"error_code": 206, "error_name": "GOAL_OCCUPIED"}
