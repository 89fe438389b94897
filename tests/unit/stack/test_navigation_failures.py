"""Tests of how the navigator handles failures: retries, recovery behaviors, and error codes."""

import pytest
from two_rooms import ADVANCED, BOUNDS, DOOR, FAR, TRUTH, codes, rooms, start

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.controllers import ProgressChecker, RegulatedPurePursuit
from simscen.model.costmaps import Costmap
from simscen.model.planners import OmplPlanner
from simscen.model.recovery import Recovery
from simscen.model.stack import StackSpec
from simscen.model.velocity_commands import CollisionMonitor
from simscen.stack.protocols import NavigationFailure
from simscen.testing.flatland import Flatland, drive


def test_robot_waits_at_a_closed_door_with_recoveries_and_passes_when_it_opens() -> None:
    world = rooms()
    d = start(world).run(2.0)
    world.boxes.append(DOOR)
    d.run(8.0)
    assert d.events_of_kind("recovery.started")
    world.boxes.remove(DOOR)
    d.run(60.0)
    assert d.result == "SUCCEEDED"
    assert d.min_clearance > 0.02


def test_recoveries_alternate_and_end_after_the_retries() -> None:
    d = start(rooms(DOOR), grid=rooms()).run(90)
    assert [e.name for e in d.events_of_kind("recovery.started")] == [
        "clear_costmap", "spin", "wait", "backup", "clear_costmap", "spin",
    ]  # fmt: skip
    assert codes(d) == ["NO_VALID_PATH"]
    assert d.result == "FAILED"


@pytest.mark.parametrize("end", ["preempt", "cancel", "timeout"])
def test_a_recovery_ends_with_its_goal(end: str) -> None:
    """Otherwise, the signal `recovery_active` would be true until the end of the run."""
    spec = StackSpec(localizer=TRUTH, recovery=Recovery(behaviors=["wait"], wait_duration=20.0))
    goal = Goal("far", Pose2(9.0, 1.0), timeout=20.0 if end == "timeout" else 90.0)
    d = start(rooms(DOOR), goal, Goal("near", Pose2(2.0, 1.0)), grid=rooms(), spec=spec, stop_on_failure=False)
    while not d.events_of_kind("recovery.started"):
        d.run(0.5)
    assert [e.name for e in d.events_of_kind("recovery.started")] == ["wait"]
    assert not d.events_of_kind("recovery.ended")
    tick = d.tick
    if end == "preempt":
        d.stack.preempt(tick, Goal("other", Pose2(1.0, 2.0)))
    if end == "cancel":
        d.stack.cancel(tick)
    d.run(60)
    (event,) = d.events_of_kind("recovery.ended")
    assert (event.name, event.data) == ("wait", {"outcome": "canceled"})
    assert event.tick == (d.events_of_kind("goal.failed")[0].tick if end == "timeout" else tick)
    assert d.result == {"preempt": "SUCCEEDED", "cancel": "CANCELED", "timeout": "FAILED"}[end]


@pytest.mark.parametrize(
    ("goal", "code"), [(Pose2(30.0, 1.0), "GOAL_OUTSIDE_MAP"), (Pose2(4.95, 1.0), "GOAL_OCCUPIED")]
)
def test_goal_outside_the_map_or_in_a_wall_fails_at_once(goal: Pose2, code: str) -> None:
    d = start(rooms(), Goal("bad", goal)).run(10)
    assert codes(d) == [code]
    assert d.tick < 240
    assert not d.events_of_kind("recovery.started")


@pytest.mark.slow
def test_goal_occupied_by_an_unmapped_object_fails() -> None:
    world = rooms()
    world.discs.append((9.0, 1.0, 0.1))
    d = start(world, grid=rooms()).run(90)
    assert codes(d) == ["GOAL_OCCUPIED"]
    assert not d.events_of_kind("recovery.started")  # as with Nav2's recovery codes
    assert d.min_clearance > 0.02
    d = start(world, grid=rooms(), spec=ADVANCED).run(90)
    # The code depends on how much of the object is in the costmap when the retries end.
    assert codes(d)[0] in ("GOAL_OCCUPIED", "NO_VALID_PATH", "PATIENCE_EXCEEDED")
    assert d.events_of_kind("recovery.started")
    assert d.min_clearance > 0.02


def test_start_outside_the_map_fails_with_start_outside_map() -> None:
    world = rooms()
    d = drive(world, Pose2(-3.0, 1.0), FAR, grid=world.grid(BOUNDS)).run(60)
    assert codes(d) == ["START_OUTSIDE_MAP"]


def test_a_goal_takes_no_longer_than_its_timeout() -> None:
    d = start(rooms(), Goal("soon", FAR.pose, timeout=5.0)).run(60)
    assert codes(d) == ["NAVIGATE_TIMEOUT"]
    assert d.tick / 240 == pytest.approx(5.0, abs=0.1)


def test_robot_without_progress_fails() -> None:
    spec = StackSpec(
        localizer=TRUTH, progress_checker=ProgressChecker(movement_time_allowance=1.0),
        recovery=Recovery(number_of_retries=2, wait_duration=0.5),
    )  # fmt: skip
    d = start(rooms(), spec=spec)
    d._move = lambda *_: None
    d.run(60)
    assert codes(d) == ["FAILED_TO_MAKE_PROGRESS"]


def test_sporadic_planning_failures_cause_no_recovery() -> None:
    """Like Nav2's RecoveryNode, the navigator counts failures since the last success."""
    spec = OmplPlanner(type="rrt_connect", replanning="rate", replanning_rate=1.0)
    d = start(rooms(), spec=StackSpec(localizer=TRUTH, planner=spec))
    planner, calls = d.stack.inner._navigator.plans.planner, []
    plan = planner.plan

    def fail_sometimes(*args: object) -> Path:
        calls.append(args)
        if len(calls) in (1, 3, 6):
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, "scripted failure")
        return plan(*args)

    planner.plan = fail_sometimes
    d.run(60)
    assert codes(d, "plan.failed") == ["NO_VALID_PATH"] * 3
    assert not d.events_of_kind("recovery.started")
    assert d.result == "SUCCEEDED"


def test_a_plan_that_fails_twice_in_a_row_leads_to_a_recovery() -> None:
    d = start(rooms())
    planner, calls = d.stack.inner._navigator.plans.planner, []
    plan = planner.plan

    def fail_twice(*args: object) -> Path:
        calls.append(args)
        if len(calls) <= 2:
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, "scripted failure")
        return plan(*args)

    planner.plan = fail_twice
    d.run(60)
    assert [e.name for e in d.events_of_kind("recovery.started")] == ["clear_costmap"]
    assert d.result == "SUCCEEDED"


@pytest.mark.parametrize(
    ("tolerance", "code", "seconds"),
    [(0.3, "PATIENCE_EXCEEDED", 0.6), (1.0, "PATIENCE_EXCEEDED", 2.0), (0.0, "NO_VALID_CONTROL", 0.0)],
)
def test_controller_without_commands_fails_after_failure_tolerance_as_in_nav2(
    tolerance: float, code: str, seconds: float
) -> None:
    spec = StackSpec(localizer=TRUTH, failure_tolerance=tolerance, recovery=Recovery(number_of_retries=0))
    d = start(rooms(), spec=spec)
    d.stack.inner._navigator._controller.command = no_command
    d.run(10)
    assert codes(d) == [code]
    # The controller fails for two periods of `failure_tolerance`: before and after clearing the costmap.
    assert d.tick / 240 == pytest.approx(seconds, abs=0.3)


def test_failure_tolerance_of_minus_one_never_ends() -> None:
    d = start(rooms(), spec=StackSpec(localizer=TRUTH, failure_tolerance=-1.0, recovery=Recovery(number_of_retries=0)))
    d.stack.inner._navigator._controller.command = no_command
    d.run(5)
    assert not codes(d)
    assert set(d.commands) == {STOP}


def no_command(*_: object) -> Twist:
    raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "nothing is free")


def test_task_stops_or_continues_after_a_failed_goal() -> None:
    goals = Goal("bad", Pose2(30, 1)), Goal("good", Pose2(2.5, 1.0))
    stopped = start(rooms(), *goals).run(30)
    assert [e.name for e in stopped.events_of_kind("goal.accepted")] == ["bad"]
    continued = start(rooms(), *goals, stop_on_failure=False).run(30)
    assert [e.name for e in continued.events_of_kind("goal.reached")] == ["good"]
    assert continued.result == "FAILED"


def test_robot_stops_within_half_a_second_without_scans_and_continues_with_them() -> None:
    d = start(rooms()).run(5.0)
    d.is_blind = True
    d.run(0.5)
    assert d.twist.vx < 0.06
    d.run(14.5)
    assert d.commands[-1] == STOP
    assert not d.events_of_kind("recovery.started")  # the time allowance of the progress checker is paused
    (held,) = d.events_of_kind("robot.held")
    assert held.name == "collision_monitor"
    assert held.tick < 6.6 * 240
    assert "`lidar` has been silent" in held.data["message"]
    d.is_blind = False
    d.run(60)
    assert d.result == "SUCCEEDED"
    assert not d.events_of_kind("recovery.started")
    assert [event.name for event in d.events_of_kind("robot.released")] == ["collision_monitor"]


def test_obstacle_seen_only_by_the_collision_monitor_soon_starts_a_recovery() -> None:
    """The costmap marks no obstacles beyond 5 cm, so only the monitor stops the robot in front of the unmapped wall."""
    spec = StackSpec(localizer=TRUTH, costmap=Costmap(obstacle_max_range=0.05))
    d = start(rooms(DOOR), grid=rooms(), spec=spec).run(14)
    recoveries = [e for e in d.events_of_kind("recovery.started") if "monitor holds" in str(e.data["message"])]
    stop_index = next(
        k for k, pose in enumerate(d.track) if pose.distance(d.track[min(k + 40, len(d.track) - 1)]) < 0.01
    )
    assert recoveries
    assert recoveries[0].tick / 240 - stop_index * 14 / len(d.track) < 4.0
    assert d.min_clearance > 0.0


@pytest.mark.parametrize("enabled", [True, False])
def test_slow_controller_is_not_reported_as_held_by_the_collision_monitor(enabled: bool) -> None:
    spec = StackSpec(
        localizer=TRUTH,
        controller=RegulatedPurePursuit(desired_linear_vel=0.015),
        collision_monitor=CollisionMonitor(enabled=enabled),
        progress_checker=ProgressChecker(required_movement_radius=0.1),
    )
    d = start(rooms(), Goal("near", Pose2(1.5, 1.0)), spec=spec).run(60)
    assert d.result == "SUCCEEDED"
    assert not d.events_of_kind("recovery.started")


@pytest.mark.parametrize("seconds", [0.4, 0.8])
def test_seen_dead_end_is_kept_after_a_control_failure_out_of_sight(seconds: float) -> None:
    """A control failure of 0.4 s clears the costmap once; 0.8 s also start a recovery."""
    mapped = Flatland().room(8, 8)
    mapped.boxes += [(3.9, 0.0, 4.0, 1.0), (3.9, 2.0, 4.0, 7.0)]  # a door, and a detour at the top
    world = Flatland([*mapped.boxes, (3.9, 1.0, 4.0, 2.0)])
    goal, grid = Goal("g", Pose2(6.0, 2.5), timeout=90.0), mapped.grid((-0.5, -0.5, 8.5, 8.5))
    d = drive(world, Pose2(2.0, 1.5), goal, grid=grid, spec=ADVANCED)
    while d.pose.y < 4.8:
        d.run(0.1)
    controller, plan_count = d.stack.inner._navigator._controller, len(d.events_of_kind("plan.made"))
    command, steps = controller.command, round(seconds * 20)

    def fail_first(*args: object) -> Twist:
        nonlocal steps
        steps -= 1
        return command(*args) if steps < 0 else no_command()

    controller.command = fail_first
    before = len(d.track)
    d.run(60)
    assert d.result == "SUCCEEDED"
    assert len(d.events_of_kind("plan.made")) > plan_count
    assert len(d.events_of_kind("recovery.started")) == (seconds > 0.6)
    assert min(pose.y for pose in d.track[before:] if pose.x < 3.5) > 4.3
