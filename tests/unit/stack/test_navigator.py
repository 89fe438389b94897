"""Tests of whole drives with the navigator."""

import math

import pytest
from two_rooms import ADVANCED, BOUNDS, DOOR, FAR, START, TRUTH, reasons, rooms, start

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.model.costmaps import Costmap
from simscen.model.planners import OmplPlanner
from simscen.model.stack import StackSpec
from simscen.stack.protocols import RobotModel
from simscen.testing.flatland import Flatland, box_robot, drive, round_robot


def test_navigator_drives_through_a_door_and_stops_at_the_goal() -> None:
    d = start(rooms()).run(60)
    assert d.result == "SUCCEEDED"
    assert d.pose.distance(FAR.pose) < 0.2
    assert abs(d.pose.yaw - math.pi / 2) < 0.2
    assert d.min_clearance > 0.05
    assert reasons(d) == ["goal"]
    d.run(1.0)
    assert set(d.commands[-30:]) == {STOP}


def test_navigator_visits_goals_in_order() -> None:
    d = start(rooms(), Goal("a", Pose2(3, 5)), Goal("b", Pose2(8, 3)), Goal("c", Pose2(1, 1))).run(120)
    assert [e.name for e in d.events_of_kind("goal.reached")] == ["a", "b", "c"]
    assert [e.data["index"] for e in d.events_of_kind("goal.accepted")] == [0, 1, 2]
    assert len(d.events_of_kind("navigation.ended")) == 1


def test_navigator_drives_around_an_unmapped_obstacle_without_recovery() -> None:
    world = rooms()
    world.discs.append((7.5, 2.0, 0.3))
    d = start(world, grid=rooms()).run(60)
    assert d.result == "SUCCEEDED"
    assert "blocked" in reasons(d)
    assert not d.events_of_kind("recovery.started")
    assert d.min_clearance > 0.02


def test_opened_path_is_taken_if_clearly_shorter() -> None:
    mapped = Flatland().room(10, 6)
    mapped.boxes += [(4.9, 0.0, 5.0, 2.5), (4.9, 3.5, 5.0, 5.0)]  # a door, and a detour at the top
    world = Flatland([*mapped.boxes, DOOR])
    d = drive(
        world, Pose2(2.0, 1.0), Goal("g", Pose2(8.0, 1.0), timeout=90.0), grid=mapped.grid(BOUNDS), spec=ADVANCED
    ).run(4.0)
    assert "blocked" in reasons(d)
    world.boxes.remove(DOOR)
    d.run(60)
    assert d.result == "SUCCEEDED"
    assert "better" in reasons(d)


def test_cancel_stops_at_once_and_ends_the_task() -> None:
    d = start(rooms()).run(3.0)
    d.stack.cancel(d.tick)
    before = len(d.commands)
    d.run(1.0, until="")
    assert [e.name for e in d.events_of_kind("goal.canceled")] == ["far"]
    assert d.result == "CANCELED"
    assert set(d.commands[before:]) == {STOP}
    assert d.stack.goal is None


def test_new_goal_preempts_the_current_goal_and_the_later_goals_follow() -> None:
    d = start(rooms(), FAR, Goal("last", Pose2(1.0, 1.0))).run(2.0)
    d.stack.preempt(d.tick, Goal("new", Pose2(3.0, 5.0)))
    d.run(60)
    assert [e.name for e in d.events_of_kind("goal.canceled")] == ["far"]
    assert [e.name for e in d.events_of_kind("goal.reached")] == ["new", "last"]


def test_new_goal_after_the_end_of_a_task_is_reached() -> None:
    d = start(rooms(), Goal("a", Pose2(2.0, 1.0))).run(30)
    d.stack.preempt(d.tick, Goal("b", Pose2(1.0, 2.0)))
    d.run(30)
    assert [e.name for e in d.events_of_kind("goal.reached")] == ["a", "b"]


def test_replanning_at_a_rate_replans_at_that_rate() -> None:
    planner = OmplPlanner(type="rrt_connect", replanning="rate", replanning_rate=0.5)
    d = start(rooms(), spec=StackSpec(localizer=TRUTH, planner=planner)).run(10)
    assert reasons(d).count("rate") == pytest.approx(d.tick / 480, abs=1)


def test_nav2_replans_through_poses_at_a_third_of_its_usual_rate() -> None:
    spec = StackSpec(localizer=TRUTH, planner=OmplPlanner(type="rrt_connect", replanning="rate"))
    goals = [Goal("by", Pose2(3.0, 5.0), via=True, xy_tolerance=0.7), FAR]
    assert reasons(start(rooms(), spec=spec).run(6.5)).count("rate") == 6
    assert reasons(start(rooms(), *goals, spec=spec).run(6.5)).count("rate") == 2


def test_navigator_drives_without_a_map() -> None:
    world = Flatland(discs=[(3.0, 0.1, 0.3), (5.0, -0.4, 0.4), (4.0, 1.0, 0.3)])
    d = drive(world, Pose2(0, 0), Goal("g", Pose2(8.0, 0.0)), grid=None).run(60)
    assert d.result == "SUCCEEDED"
    assert d.min_clearance > 0.02


def test_navigator_reaches_a_goal_beyond_the_rolling_window_without_a_map() -> None:
    spec = StackSpec(localizer=TRUTH, costmap=Costmap(rolling_size=6.0))
    d = drive(Flatland(discs=[(3.0, 0.1, 0.3)]), Pose2(0, 0), Goal("g", Pose2(9.0, 0.0)), grid=None, spec=spec).run(60)
    assert d.result == "SUCCEEDED"


def test_long_robot_drives_through_a_gap_ten_centimeters_wider() -> None:
    world = Flatland().room(6, 3)
    world.boxes += [(3.0, 0.0, 3.1, 1.24), (3.0, 1.76, 3.1, 3.0)]
    grid = world.grid((-0.5, -0.5, 6.5, 3.5))
    d = drive(world, Pose2(1, 1), Goal("g", Pose2(5, 1)), grid=grid, robot=box_robot(speed=0.8)).run(40)
    assert d.result == "SUCCEEDED"
    assert d.min_clearance > 0.02


def test_same_seed_gives_the_same_drive() -> None:
    first, second = (start(rooms(), seed=3).run(10) for _ in range(2))
    assert first.track == second.track
    assert first.log == second.log


def test_commands_respect_velocity_and_acceleration_limits() -> None:
    robot = round_robot(linear_acceleration=1.0, linear_deceleration=2.0)
    d = start(rooms(), robot=robot).run(20)
    steps = [b.vx - a.vx for a, b in zip(d.commands, d.commands[1:], strict=False)]
    assert max(steps) <= 1.0 / 20 + 1e-9
    assert all(abs(c.vx) <= 0.5 and abs(c.wz) <= 1.9 for c in d.commands)


def test_no_goal_means_no_motion() -> None:
    world = rooms()
    d = drive(world, START, grid=world.grid(BOUNDS)).run(1.0)
    assert set(d.commands) == {Twist()}
    assert not d.log


def test_a_car_drives_to_a_goal_behind_it() -> None:
    car = RobotModel(box_robot(0.6, 0.4).footprint, None, 0.8, 0.5, 0.0, 1.5, 2.0, 2.0, 3.0, turning_radius=0.6)
    world = Flatland().room(10, 6)
    d = drive(world, Pose2(5, 3, 0), Goal("g", Pose2(2, 4, 0.0)), grid=world.grid(BOUNDS), robot=car).run(60)
    assert d.result == "SUCCEEDED"
    assert d.min_clearance > 0.02
    assert min(command.vx for command in d.commands) < -0.1
    assert all(abs(c.wz) <= abs(c.vx) / 0.6 * 1.5 + 0.05 for c in d.commands)


def test_late_scans_mark_obstacles_at_their_true_position() -> None:
    world = Flatland(discs=[(3.0, 0.0, 0.3)])
    d = drive(world, Pose2(0, 0), Goal("g", Pose2(2.5, 0.0)), grid=None, robot=round_robot(speed=0.5))
    scans: list = []
    scan, stack = d.scan, d.stack
    d.scan = lambda: (scans.append(scan()), scans[max(0, len(scans) - 4)])[1]  # 0.3 s old
    d.run(3.0)
    view = stack.inner._costmaps.global_costmap.view
    columns = (view.costs == 254).nonzero()[1]
    x = view.origin[0] + (columns + 0.5) * view.resolution
    assert len(x)
    assert x.min() > 2.6  # the disc begins at 2.7; an error of 0.3 s at 0.5 m/s would be 0.15 m
    assert x.min() < 2.75


@pytest.mark.parametrize("offset", [0.04, -0.04])
def test_navigator_passes_a_wall_displaced_by_centimeters(offset: float) -> None:
    """An error of the pose estimate has the same effect. The planner prefers short paths to clearance."""
    mapped, world = (Flatland([(2.5 + x, 2.7, 9.5, 2.8)]).room(12, 5) for x in (0.0, offset))
    spec = StackSpec(
        profile="advanced", localizer=TRUTH, planner={"type": "medial_axis", "cost_travel_multiplier": 0.2}
    )
    goal = Goal("g", Pose2(4.0, 1.8), timeout=60.0)
    d = drive(world, Pose2(3.5, 3.2, math.pi), goal, grid=mapped.grid((-0.5, -0.5, 12.5, 5.5)), spec=spec).run(61)
    assert d.result == "SUCCEEDED"
    assert len(d.events_of_kind("recovery.started")) <= 2


def test_slow_measured_motion_counts_as_rest() -> None:
    """The controller server of Nav2 replaces components of the measured velocity up to their thresholds by 0."""
    spec = StackSpec(
        localizer=TRUTH,
        min_x_velocity_threshold=0.1,
        min_y_velocity_threshold=0.2,
        min_theta_velocity_threshold=0.3,
    )
    d = start(rooms(), spec=spec)
    controller, twists = d.stack.inner._navigator._controller, list[Twist]()
    command = controller.command

    def record(pose: Pose2, twist: Twist, *args: object) -> Twist:
        twists.append(twist)
        return command(pose, twist, *args)

    controller.command = record
    d.run(1.0)
    twists.clear()
    for twist in (Twist(0.1, -0.2, 0.3), Twist(0.2, 0.1, -0.4), Twist(-0.2, -0.3, 0.0)):
        d._move = lambda _command, _dt, twist=twist: setattr(d, "twist", twist)
        d.run(0.2)
    measured = list(dict.fromkeys(twists))[1:]  # the first twist was measured before
    assert measured == [STOP, Twist(0.2, 0.0, -0.4), Twist(-0.2, -0.3, 0.0)]
