"""Tests of goal checker, progress checker, speed limits, and retries with exact answers."""

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


def checker_that(*, stateful: bool) -> SimpleGoalChecker:
    return SimpleGoalChecker(CheckerSpec(stateful=stateful, well_inside=0.5), setting(round_robot()))


def view_of(world: Flatland, robot: RobotModel) -> CostmapView:
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-2.0, -2.0, 6.0, 2.0)), TICK_RATE_HZ)).view


@pytest.mark.parametrize(
    ("pose", "twist", "reached"),
    [
        (Pose2(0.85, 0.0, 0.0), DRIVING, False),  # inside, but not well inside
        (Pose2(0.85, 0.0, 0.0), STOP, True),
        (Pose2(0.95, 0.0, 0.0), DRIVING, True),
        (Pose2(0.95, 0.0, 0.15), DRIVING, False),
        (Pose2(0.95, 0.0, 0.15), STOP, True),
        (Pose2(0.95, 0.0, 0.3), STOP, False),
        (Pose2(0.75, 0.0, 0.0), STOP, False),
    ],
)
def test_goal_is_reached_well_inside_the_tolerance_or_stopped_inside_it(
    pose: Pose2, twist: Twist, reached: bool
) -> None:
    checker = checker_that(stateful=True)
    assert [checker.reached(GOAL, pose, twist) for _ in range(STANDSTILL_CHECKS)][-1] == reached


def test_nav2_goal_checker_accepts_the_edge_of_the_tolerance_while_moving() -> None:
    checker = SimpleGoalChecker(CheckerSpec(well_inside=1.0), setting(round_robot()))
    assert checker.reached(GOAL, Pose2(0.81, 0.0, 0.19), DRIVING)
    assert not checker.reached(GOAL, Pose2(0.81, 0.0, 0.21), DRIVING)


def test_short_stop_before_turning_does_not_reach_the_goal() -> None:
    assert not checker_that(stateful=True).reached(GOAL, Pose2(0.95, 0.0, 0.15), STOP)


def test_stateful_goal_checker_ignores_position_while_turning() -> None:
    stateful, forgetful = checker_that(stateful=True), checker_that(stateful=False)
    for checker in (stateful, forgetful):
        checker.reached(GOAL, Pose2(0.95, 0.0, 1.0), DRIVING)
    assert stateful.reached(GOAL, Pose2(0.85, 0.0, 0.05), DRIVING)
    assert not forgetful.reached(GOAL, Pose2(0.85, 0.0, 0.05), DRIVING)


def test_progress_means_the_radius_within_the_allowance() -> None:
    checker = ProgressChecker(ProgressSpec(required_movement_radius=0.5, movement_time_allowance=10.0))
    assert not checker.is_stuck(Pose2(0, 0), 0.0)
    assert not checker.is_stuck(Pose2(0.49, 0), 10.0)
    assert checker.is_stuck(Pose2(0.49, 0), 10.1)
    assert not checker.is_stuck(Pose2(0.5, 0), 10.2)


def test_turning_is_progress_only_if_an_angle_is_given() -> None:
    for angle, stuck in ((None, True), (0.5, False)):
        checker = ProgressChecker(ProgressSpec(required_movement_angle=angle))
        checker.is_stuck(Pose2(0, 0, 0), 0.0)
        checker.is_stuck(Pose2(0, 0, 0.6), 9.0)
        assert checker.is_stuck(Pose2(0, 0, 0.6), 11.0) == stuck


def test_recoveries_alternate_until_the_retries_are_used_up() -> None:
    class Named(Wait):
        def __init__(self, name: str) -> None:
            self.name = name

    robin = BehaviorSequence([Named("a"), Named("b"), Named("c")], Recovery(number_of_retries=4))
    assert [b.name for b in iter(lambda: robin.next_behavior(5.0), None)] == ["a", "b", "c", "a"]
    robin.reset()
    assert robin.next_behavior(5.0).name == "b"
    assert BehaviorSequence([], Recovery(number_of_retries=3)).next_behavior(5.0) is None


@pytest.mark.parametrize(
    ("anew", "there_are"), [(True, [True, True, False, True, True, False]), (False, [True, True, *[False] * 4])]
)
def test_progress_of_a_meter_resets_the_retries(anew: bool, there_are: list[bool]) -> None:
    robin = BehaviorSequence(
        [Wait(WaitSpec(), setting(round_robot()))], Recovery(number_of_retries=2, retries_since_progress=anew)
    )
    assert [robin.next_behavior(to_go) is not None for to_go in (5.0, 6.0, 4.5, 3.4, 8.0, 3.4)] == there_are


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
def test_recoveries_follow_the_listed_and_unknown_codes(code: int, advanced: bool, nav2: bool) -> None:
    failure = NavigationFailure(code, "")
    assert BehaviorSequence([], Recovery()).can_help(failure) == nav2
    assert BehaviorSequence([], StackSpec(profile="advanced").recovery).can_help(failure) == advanced


def test_plan_is_blocked_only_by_obstacles_ahead() -> None:
    robot = round_robot()
    line = np.column_stack((np.arange(0.0, 4.0, 0.05), np.zeros(80), np.zeros(80)))
    plan = FollowedPlan(Path(line), robot.inscribed_radius, view_of(Flatland(), robot))
    for x, blocked in ((2.0, True), (-0.5, False)):
        plan.locate(Pose2(1.0, 0.0))
        plan.update_occupied(view_of(Flatland(discs=[(x, 0.1, 0.1)]), robot))
        assert plan.is_blocked() == blocked
    assert plan.remaining() == pytest.approx(2.95, abs=0.05)


@pytest.mark.parametrize(("length", "better"), [(1.0, True), (2.4, True), (2.6, False)])
def test_another_plan_must_be_clearly_shorter(length: float, better: bool) -> None:
    line = np.column_stack((np.linspace(0, 3, 61), np.zeros(61), np.zeros(61)))
    plan = ClearancePlan(Path(line), 0.2, view_of(Flatland(), round_robot()))
    assert plan.is_longer_than(length) == better


def test_plan_is_tight_only_where_clearance_was_lost_nearby() -> None:
    robot = round_robot()
    line = Path(np.column_stack((np.arange(0.0, 4.0, 0.05), np.zeros(80), np.zeros(80))))
    roomy, narrow = (view_of(Flatland(discs=discs), robot) for discs in ((), [(2.0, 0.45, 0.1)]))
    for made, now, tighter in ((roomy, narrow, True), (narrow, narrow, False), (narrow, roomy, False)):
        plan = ClearancePlan(line, robot.inscribed_radius, made)
        plan.update_occupied(now)
        assert plan.has_lost_clearance() == tighter


def test_lowest_speed_limit_of_overlapping_zones_applies() -> None:
    zones = ((((0, 0), (2, 0), (2, 2), (0, 2)), 0.3), (((1, 0), (3, 0), (3, 2), (1, 2)), 0.2))
    mask = SpeedLimits(OccupancyGrid(np.full((2, 1), 50, np.int8), 1.0), True, 0.0, 1.0)
    found = SpeedFilter(
        Surroundings(round_robot(), None, TICK_RATE_HZ, speed_zones=zones, masks=FilterMasks(speed=mask))
    )
    assert found.limit(Pose2(0.5, 1), 0.5) == 0.25
    assert found.limit(Pose2(0.5, 1), 1.0) == 0.3
    assert found.limit(Pose2(1.5, 1), 0.5) == 0.2
    assert found.limit(Pose2(5, 1), 0.5) is None


def test_ended_task_has_the_code_of_the_last_failure() -> None:
    task = Task(False)
    task.start((Goal("a", Pose2(0, 0)), Goal("b", Pose2(1, 0))))
    failed = *task.accept_next(1), *task.record_failed(5, ErrorCode.GOAL_OCCUPIED, "in a wall")
    text = *failed, *task.accept_next(6), *task.record_reached(9)
    assert [(e.tick, e.kind, e.name) for e in text] == [
        (1, "goal.accepted", "a"),
        (5, "goal.failed", "a"),
        (6, "goal.accepted", "b"),
        (9, "goal.reached", "b"),
        (9, "navigation.ended", "FAILED"),
    ]
    assert text[-1].data == {"error_code": 206, "error_name": "GOAL_OCCUPIED"}
