"""Tests of goal checker, progress checker, speed limits, and retries with exact answers."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.advanced.replanning import ClearancePlan
from simscen.core.environment.costmap_filters import FilterMasks, SpeedLimits
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode, Goal, Path
from simscen.core.messages.sensor_data import Scan
from simscen.model.controllers import ProgressChecker as ProgressSpec
from simscen.model.controllers import SimpleGoalChecker as CheckerSpec
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.guards import CollisionMonitor as MonitorSpec
from simscen.model.guards import VelocitySmoother as SmootherSpec
from simscen.model.recovery import Recovery
from simscen.model.recovery import Wait as WaitSpec
from simscen.model.stack import StackSpec
from simscen.stack.behaviors import BehaviorSequence, Wait
from simscen.stack.checkers import STANDSTILL_CHECKS, ProgressChecker, SimpleGoalChecker
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.commands import VelocitySmoother
from simscen.stack.controllers.collision_checker import time_to_collision
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.costmap.layers import SpeedFilter
from simscen.stack.followed_plan import FollowedPlan
from simscen.stack.footprint import Footprint
from simscen.stack.kinematics import poses_along
from simscen.stack.moving_obstacles import MovingObstacles
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.stack.tasks import Task
from simscen.testing.flatland import RATE, Flatland, box_robot, round_robot, setting

GOAL = Goal("g", Pose2(1.0, 0.0, 0.0), xy_tolerance=0.2, yaw_tolerance=0.2)
DRIVING = Twist(0.3)


def checker_that(*, stateful: bool) -> SimpleGoalChecker:
    return SimpleGoalChecker(CheckerSpec(stateful=stateful, well_inside=0.5), setting(round_robot()))


def view_of(world: Flatland, robot: RobotModel) -> CostmapView:
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-2.0, -2.0, 6.0, 2.0)), RATE)).view


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
def test_a_goal_is_reached_well_inside_its_tolerance_or_standing_anywhere_inside(
    pose: Pose2, twist: Twist, reached: bool
) -> None:
    checker = checker_that(stateful=True)
    assert [checker.reached(GOAL, pose, twist) for _ in range(STANDSTILL_CHECKS)][-1] == reached


def test_nav2s_goal_checker_takes_the_edge_of_the_tolerance_for_there_while_the_robot_moves() -> None:
    checker = SimpleGoalChecker(CheckerSpec(well_inside=1.0), setting(round_robot()))
    assert checker.reached(GOAL, Pose2(0.81, 0.0, 0.19), DRIVING)
    assert not checker.reached(GOAL, Pose2(0.81, 0.0, 0.21), DRIVING)


def test_a_robot_that_stands_for_a_moment_between_driving_and_turning_is_not_there_yet() -> None:
    assert not checker_that(stateful=True).reached(GOAL, Pose2(0.95, 0.0, 0.15), STOP)


def test_a_stateful_goal_checker_lets_the_robot_turn_without_losing_its_place() -> None:
    stateful, forgetful = checker_that(stateful=True), checker_that(stateful=False)
    for checker in (stateful, forgetful):
        checker.reached(GOAL, Pose2(0.95, 0.0, 1.0), DRIVING)
    assert stateful.reached(GOAL, Pose2(0.85, 0.0, 0.05), DRIVING)
    assert not forgetful.reached(GOAL, Pose2(0.85, 0.0, 0.05), DRIVING)


def test_progress_means_the_radius_within_the_allowance() -> None:
    checker = ProgressChecker(ProgressSpec(required_movement_radius=0.5, movement_time_allowance=10.0))
    assert not checker.stuck(Pose2(0, 0), 0.0)
    assert not checker.stuck(Pose2(0.49, 0), 10.0)
    assert checker.stuck(Pose2(0.49, 0), 10.1)
    assert not checker.stuck(Pose2(0.5, 0), 10.2)


def test_turning_is_progress_only_if_an_angle_is_given() -> None:
    for angle, stuck in ((None, True), (0.5, False)):
        checker = ProgressChecker(ProgressSpec(required_movement_angle=angle))
        checker.stuck(Pose2(0, 0, 0), 0.0)
        checker.stuck(Pose2(0, 0, 0.6), 9.0)
        assert checker.stuck(Pose2(0, 0, 0.6), 11.0) == stuck


def test_the_smoother_speeds_up_gently_and_brakes_with_all_the_base_has() -> None:
    robot = round_robot(linear_acceleration=1.0, linear_deceleration=4.0)
    smoother = VelocitySmoother(SmootherSpec(), robot, 0.1)
    assert [round(smoother.smooth(Twist(0.25)).vx, 6) for _ in range(4)] == [0.1, 0.2, 0.25, 0.25]
    assert smoother.smooth(Twist(0.0)).vx == 0.0
    assert smoother.smooth(Twist(wz=1.0)).wz == pytest.approx(0.32)


def test_the_smoother_passes_zero_before_it_reverses() -> None:
    smoother = VelocitySmoother(SmootherSpec(), round_robot(), 0.05)
    smoother.reset(Twist(0.05))
    assert smoother.smooth(Twist(-0.5)).vx == 0.0
    assert smoother.smooth(Twist(-0.5)).vx == pytest.approx(-0.125)


def test_the_smoother_keeps_to_the_limits_that_it_is_given() -> None:
    spec = SmootherSpec(max_decel=2.0, max_velocity=0.3, max_angular_velocity=0.5)
    smoother = VelocitySmoother(spec, round_robot(linear_deceleration=4.0), 0.1)
    smoother.reset(Twist(0.5))
    assert [round(smoother.smooth(Twist(0.5, 0.0, 2.0)).vx, 6) for _ in range(3)] == [0.3, 0.3, 0.3]
    assert smoother.smooth(Twist(0.5, 0.0, 2.0)).wz == 0.5
    assert smoother.smooth(Twist()).vx == pytest.approx(0.1)


def test_a_car_keeps_to_its_curve_when_the_smoother_slows_it_down() -> None:
    robot = replace(round_robot(), turning_radius=0.5)
    smoother = VelocitySmoother(SmootherSpec(max_velocity=0.2), robot, 0.1)
    smoother.reset(Twist(0.2, 0.0, 0.1))
    assert smoother.smooth(Twist(0.4, 0.0, 0.2)) == Twist(0.2, 0.0, pytest.approx(0.1))


def test_a_disabled_smoother_changes_nothing() -> None:
    assert VelocitySmoother(SmootherSpec(enabled=False), round_robot(), 0.1).smooth(Twist(9.0)) == Twist(9.0)


def scan(*points: tuple[float, float], tick: int = 0) -> Scan:
    """A scan of one beam a point; the lidar is at the base."""
    angles = np.array([math.atan2(y, x) for x, y in points])
    step = 1e-3
    ranges = np.full(7000, np.inf)
    ranges[np.round((angles + 3.5) / step).astype(int)] = [math.hypot(x, y) for x, y in points]
    return Scan("lidar", tick, ranges, -3.5, step, 0.05, 12.0)


def monitor(robot: RobotModel | None = None, **options: float) -> CollisionMonitor:
    return CollisionMonitor(MonitorSpec(**options), robot or round_robot(), ("lidar",), RATE)


@pytest.mark.parametrize(("x", "scale"), [(2.0, 1.0), (0.22 + 0.02 + 0.125, 0.5), (0.23, 0.0)])
def test_the_monitor_keeps_the_time_before_collision(x: float, scale: float) -> None:
    guard = monitor()
    guard.on_scan(scan((x, 0.0)), Pose2(0, 0))
    allowed = guard.allow(Twist(0.5, 0.0, 0.0), Pose2(0, 0))
    assert allowed.vx == pytest.approx(0.5 * scale, abs=0.5 / 8)
    assert allowed.vx <= 0.5 * scale + 1e-9 or scale == 1.0


def test_the_monitor_lets_the_robot_drive_away_from_what_it_nearly_touches() -> None:
    guard = monitor()
    guard.on_scan(scan((0.23, 0.0)), Pose2(0, 0))
    assert guard.allow(Twist(-0.2), Pose2(0, 0)) == Twist(-0.2)
    assert guard.allow(Twist(wz=1.0), Pose2(0, 0)) == Twist(wz=1.0)


def test_the_monitor_counts_what_the_robot_has_driven_since_the_scan() -> None:
    guard = monitor()
    guard.on_scan(scan((0.6, 0.0)), Pose2(5, 5, 1.0))
    assert guard.allow(Twist(0.2), Pose2(5, 5, 1.0)) == Twist(0.2)
    moved = Pose2(5, 5, 1.0).compose(Pose2(0.36, 0.0))
    assert guard.allow(Twist(0.2), moved) == STOP


def test_the_monitor_sees_the_corner_of_a_long_hull_swing() -> None:
    guard = monitor(box_robot())
    guard.on_scan(scan((0.15, 0.19)), Pose2(0, 0))
    assert guard.allow(Twist(wz=1.0), Pose2(0, 0)).wz < 0.5
    assert guard.allow(Twist(0.3), Pose2(0, 0)).vx == 0.3


def test_the_monitor_may_want_more_points_than_one() -> None:
    guard = monitor(min_points=3)
    guard.on_scan(scan((0.3, 0.0), (0.3, 0.01)), Pose2(0, 0))
    assert guard.allow(Twist(0.5), Pose2(0, 0)) == Twist(0.5)
    guard.on_scan(scan((0.3, 0.0), (0.3, 0.01), (0.3, -0.01)), Pose2(0, 0))
    assert guard.allow(Twist(0.5), Pose2(0, 0)).vx < 0.5


def test_silence_is_a_lidar_unheard_for_the_timeout_or_blind() -> None:
    guard = monitor(source_timeout=0.3)
    guard.start(0)
    guard.on_scan(scan((2.0, 0.0)), Pose2(0, 0))
    assert not guard.silent(72)
    assert guard.silent(73)
    guard.on_scan(scan((2.0, 0.0), tick=100), Pose2(0, 0))
    assert not guard.silent(172)
    guard.on_scan(Scan("lidar", 180, np.full(9, np.nan), 0.0, 0.1, 0.05, 12.0), Pose2(0, 0))
    assert guard.silent(181)


def test_robot_waits_for_its_first_scan() -> None:
    guard = monitor(source_timeout=0.3)
    guard.start(12)
    assert guard.silent(12)
    assert guard.silence_reason(24) == "lidar `lidar` has been silent for 0.05 s; source_timeout is 0.3 s"
    guard.on_scan(scan((2.0, 0.0), tick=10), Pose2(0, 0), 30)
    assert not guard.silent(30)
    guard.start(60)
    assert not guard.silent(60)


def test_silent_lidar_has_a_reason() -> None:
    guard = monitor(source_timeout=0.3)
    guard.start(0)
    assert guard.silence_reason(240) == "lidar `lidar` has been silent for 1.00 s; source_timeout is 0.3 s"
    guard.on_scan(scan((2.0, 0.0), tick=120), Pose2(0, 0), 240)
    assert (
        guard.silence_reason(241) == "scans of lidar `lidar` are 0.50 s old when they arrive; source_timeout is 0.3 s"
    )
    guard.on_scan(Scan("lidar", 300, np.full(9, np.nan), 0.0, 0.1, 0.05, 12.0), Pose2(0, 0), 300)
    assert "blind for 0.75 s: its scans contain no returns" in guard.silence_reason(300)
    assert "silent" in guard.silence_reason(400)


def test_arcs_are_those_of_a_fine_integration() -> None:
    twist, pose = Twist(0.7, 0.2, -0.9), Pose2(1.0, 2.0, 0.4)
    x, y, yaw = pose
    for _ in range(200_000):
        dt = 1.5 / 200_000
        x += (twist.vx * math.cos(yaw) - twist.vy * math.sin(yaw)) * dt
        y += (twist.vx * math.sin(yaw) + twist.vy * math.cos(yaw)) * dt
        yaw += twist.wz * dt
    assert poses_along(pose, twist, np.array([1.5]))[0] == pytest.approx((x, y, yaw), abs=1e-5)
    straight = poses_along(pose, Twist(1.0), np.array([2.0]))[0]
    assert straight == pytest.approx((1 + 2 * math.cos(0.4), 2 + 2 * math.sin(0.4), 0.4))


def test_time_free_is_the_way_to_the_obstacle_over_the_speed() -> None:
    robot = round_robot()
    view = view_of(Flatland(boxes=[(2.0, -1.0, 2.5, 1.0)]), robot)
    free = time_to_collision(Footprint(robot, 0.05), view, Pose2(0, 0), Twist(0.5), 10.0)
    assert free == pytest.approx((2.0 - 0.22) / 0.5, abs=0.06 / 0.5)


def test_a_robot_in_collision_may_move_out_but_not_further_in() -> None:
    robot = round_robot()
    view = view_of(Flatland(boxes=[(2.0, -1.0, 2.5, 1.0)]), robot)
    footprint = Footprint(robot, 0.05)
    assert time_to_collision(footprint, view, Pose2(1.85, 0), Twist(-0.5), 1.0) == 1.0
    assert time_to_collision(footprint, view, Pose2(1.85, 0), Twist(0.5), 1.0) < 0.2


def with_posts(*posts: tuple[float, float]) -> CostmapView:
    """Nothing but lethal cells of 5 cm, their middles there."""
    views = [with_a_post(*post) for post in posts]
    return replace(views[0], distance=np.minimum.reduce([view.distance for view in views]))


@pytest.mark.parametrize("robot", [box_robot(0.42, 0.42), round_robot(0.21)])
def test_robot_in_contact_cannot_drive_into_another_obstacle(robot: RobotModel) -> None:
    """It seems to be 4 cm deep in a post at its left, and backs up: to the post behind it, no further."""
    footprint, beside, behind = Footprint(robot, 0.05), (0.025, 0.175), (-0.375, 0.025)
    back = Twist(-0.15, 0.0, 0.0)
    assert time_to_collision(footprint, with_posts(beside), Pose2(0, 0), back, 2.0) == 2.0
    assert not footprint.free(with_posts(beside), np.zeros((1, 3)))[0]
    assert time_to_collision(footprint, with_posts(beside, behind), Pose2(0, 0), back, 2.0) == pytest.approx(
        1.0, abs=0.3
    )


def test_a_footprint_collides_where_its_edge_or_its_inside_is_on_something() -> None:
    robot = box_robot(1.0, 0.4)
    view = view_of(Flatland(discs=[(2.0, 0.0, 0.05)]), robot)
    footprint = Footprint(robot, 0.05)
    poses = np.array([[1.4, 0, 0], [1.55, 0, 0], [2.0, 0, 0], [2.0, 0.35, 0], [2.0, 0.35, 1.57]])
    assert footprint.free(view, poses).tolist() == [True, False, False, True, False]


def with_a_post(x: float, y: float) -> CostmapView:
    """Nothing but one lethal cell of 5 cm, its middle there."""
    rows, columns = np.mgrid[0:80, 0:80]
    row, column = math.floor((y + 2.0) / 0.05), math.floor((x + 2.0) / 0.05)
    apart = (0.05 * np.hypot(rows - row, columns - column)).astype(np.float32)
    return CostmapView(np.where(apart == 0.0, 254, 0).astype(np.uint8), apart, 0.05, (-2.0, -2.0))


@pytest.mark.parametrize(("x", "y", "deep"), [(0.475, 0.125, 0.025), (0.375, -0.075, 0.125), (-0.325, 0.125, 0.075)])
def test_the_clearance_of_a_long_hull_in_collision_is_how_deep_it_is_in_it(x: float, y: float, deep: float) -> None:
    footprint = Footprint(box_robot(1.0, 0.4), 0.05)
    clearance = footprint.clearance(with_a_post(x, y), np.array([[0.0, 0.0, 0.0]]))
    assert clearance == pytest.approx([-deep], abs=0.036)


def test_a_long_robot_that_touches_something_may_turn_out_of_it_but_not_further_in() -> None:
    footprint, view = Footprint(box_robot(1.0, 0.4), 0.05), with_a_post(0.425, 0.19)
    assert not footprint.free(view, np.array([[0.0, 0.0, 0.0]]))[0]
    assert time_to_collision(footprint, view, Pose2(0, 0), Twist(0.0, 0.0, -0.5), 1.0) == 1.0
    assert time_to_collision(footprint, view, Pose2(0, 0), Twist(0.0, 0.0, 0.5), 1.0) < 0.4


def test_discs_cover_the_hull() -> None:
    robot = box_robot(0.9, 0.3)
    discs = Footprint(robot, 0.05).discs
    rng = np.random.default_rng(1)
    inside = rng.uniform((-0.45, -0.15), (0.45, 0.15), (2000, 2))
    near = np.hypot(inside[:, None, 0] - discs.offsets, inside[:, None, 1]).min(axis=1)
    assert near.max() <= discs.radius
    assert discs.radius < 0.25


def test_recoveries_are_handed_out_in_turn_until_the_retries_are_used_up() -> None:
    class Named(Wait):
        def __init__(self, name: str) -> None:
            self.name = name

    robin = BehaviorSequence([Named("a"), Named("b"), Named("c")], Recovery(number_of_retries=4))
    assert [b.name for b in iter(lambda: robin.next(5.0), None)] == ["a", "b", "c", "a"]
    robin.reset()
    assert robin.next(5.0).name == "b"
    assert BehaviorSequence([], Recovery(number_of_retries=3)).next(5.0) is None


@pytest.mark.parametrize(
    ("anew", "there_are"), [(True, [True, True, False, True, True, False]), (False, [True, True, *[False] * 4])]
)
def test_progress_of_a_meter_resets_the_retries(anew: bool, there_are: list[bool]) -> None:
    robin = BehaviorSequence(
        [Wait(WaitSpec(), setting(round_robot()))], Recovery(number_of_retries=2, retries_since_progress=anew)
    )
    assert [robin.next(to_go) is not None for to_go in (5.0, 6.0, 4.5, 3.4, 8.0, 3.4)] == there_are


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
    assert BehaviorSequence([], Recovery()).helps(failure) == nav2
    assert BehaviorSequence([], StackSpec(profile="advanced").recovery).helps(failure) == advanced


def test_a_plan_is_blocked_by_what_comes_to_lie_ahead_on_it_but_not_behind() -> None:
    robot = round_robot()
    line = np.column_stack((np.arange(0.0, 4.0, 0.05), np.zeros(80), np.zeros(80)))
    plan = FollowedPlan(Path(line), robot.inscribed_radius, view_of(Flatland(), robot))
    for x, blocked in ((2.0, True), (-0.5, False)):
        plan.locate(Pose2(1.0, 0.0))
        plan.compare(view_of(Flatland(discs=[(x, 0.1, 0.1)]), robot))
        assert plan.blocked() == blocked
    assert plan.remaining() == pytest.approx(2.95, abs=0.05)


@pytest.mark.parametrize(("length", "better"), [(1.0, True), (2.4, True), (2.6, False)])
def test_another_plan_must_be_clearly_shorter(length: float, better: bool) -> None:
    line = np.column_stack((np.linspace(0, 3, 61), np.zeros(61), np.zeros(61)))
    plan = ClearancePlan(Path(line), 0.2, view_of(Flatland(), round_robot()))
    assert plan.is_longer_than(length) == better


def test_a_plan_is_tight_where_it_has_lost_room_soon_but_not_where_it_never_had_any() -> None:
    robot = round_robot()
    line = Path(np.column_stack((np.arange(0.0, 4.0, 0.05), np.zeros(80), np.zeros(80))))
    roomy, narrow = (view_of(Flatland(discs=discs), robot) for discs in ((), [(2.0, 0.45, 0.1)]))
    for made, now, tighter in ((roomy, narrow, True), (narrow, narrow, False), (narrow, roomy, False)):
        plan = ClearancePlan(line, robot.inscribed_radius, made)
        plan.compare(now)
        assert plan.has_lost_clearance() == tighter


def test_the_lowest_limit_of_the_zones_one_is_in_counts() -> None:
    zones = ((((0, 0), (2, 0), (2, 2), (0, 2)), 0.3), (((1, 0), (3, 0), (3, 2), (1, 2)), 0.2))
    mask = SpeedLimits(OccupancyGrid(np.full((2, 1), 50, np.int8), 1.0), True, 0.0, 1.0)
    found = SpeedFilter(Surroundings(round_robot(), None, RATE, speed_zones=zones, masks=FilterMasks(speed=mask)))
    assert found.limit(Pose2(0.5, 1), 0.5) == 0.25
    assert found.limit(Pose2(0.5, 1), 1.0) == 0.3
    assert found.limit(Pose2(1.5, 1), 0.5) == 0.2
    assert found.limit(Pose2(5, 1), 0.5) is None


def test_a_task_says_how_it_ended_with_the_code_of_the_last_failure() -> None:
    task = Task(False)
    task.start((Goal("a", Pose2(0, 0)), Goal("b", Pose2(1, 0))))
    failed = *task.next(1), *task.failed(5, ErrorCode.GOAL_OCCUPIED, "in a wall")
    told = *failed, *task.next(6), *task.reached(9)
    assert [(e.tick, e.kind, e.name) for e in told] == [
        (1, "goal.accepted", "a"),
        (5, "goal.failed", "a"),
        (6, "goal.accepted", "b"),
        (9, "goal.reached", "b"),
        (9, "navigation.ended", "FAILED"),
    ]
    assert told[-1].data == {"error_code": 206, "error_name": "GOAL_OCCUPIED"}


@pytest.mark.parametrize("robot", [round_robot(), box_robot(1.0, 0.3)])
def test_the_monitor_brakes_for_what_moves_wherever_the_whole_look_at_the_hull_would(
    robot: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    hasty, thorough = (CollisionMonitor(MonitorSpec(), robot, (), RATE) for _ in range(2))
    monkeypatch.setattr(thorough, "_may_meet_moving", lambda *_: True)
    rng, braked, spared = np.random.default_rng(4), 0, 0
    for _ in range(400):
        places, speeds = rng.normal(0.0, 1.2, (2, 2)), rng.normal(0.0, 0.7, (2, 2))
        moving = MovingObstacles(places, speeds, np.array((0.3, 0.1)), np.zeros((2, 4, 4)), 0.0)
        wanted = Twist(*rng.normal(0.0, (0.5, 0.1, 0.8)).tolist())
        hasty.on_moving(moving)
        thorough.on_moving(moving)
        allowed = thorough.allow(wanted, Pose2(0.0, 0.0))
        assert hasty.allow(wanted, Pose2(0.0, 0.0)) == allowed
        braked += allowed != wanted
        spared += not hasty._may_meet_moving(wanted, MonitorSpec().time_before_collision)
    assert braked > 10
    assert spared > 100
