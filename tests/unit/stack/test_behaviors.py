"""Tests of the recovery behaviors spin, backup, wait, and clear_costmap."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.advanced.spec import Retrace
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.model import recovery as model
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.behaviors import BackUp, ClearCostmap, Spin, Wait
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.kinematics import poses_along
from simscen.stack.protocols import Behavior, CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, round_robot, setting

ROUND, RECTANGULAR = round_robot(), box_robot()


def view_of(robot: RobotModel, *boxes: tuple[float, float, float, float]) -> CostmapView:
    grid = Flatland(list(boxes)).grid((-3.0, -3.0, 3.0, 3.0))
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, grid, TICK_RATE_HZ)).view


def run(behavior: Behavior, view: CostmapView, pose: Pose2 = Pose2(0, 0)) -> tuple[Pose2, float, list[Twist]]:
    """Run the behavior to its end; return the final pose, the duration in s, and the commands."""
    behavior.start(pose)
    commands: list[Twist] = []
    while True:
        command = behavior.step(pose, view, 0.05 * len(commands))
        if command is None:
            return pose, 0.05 * len(commands), commands
        commands.append(command)
        pose = Pose2(*poses_along(pose, command, np.array([0.05]))[0].tolist())


@pytest.mark.parametrize("angle", [1.57, -1.57, 4.0])
def test_spin_turns_by_its_angle_within_its_maximum_rate(angle: float) -> None:
    pose, _, commands = run(Spin(model.Spin(spin_dist=angle), setting(ROUND)), view_of(ROUND))
    assert pose.yaw == pytest.approx(angle, abs=0.05)
    assert max(abs(c.wz) for c in commands) <= 1.0
    assert all(c.vx == 0.0 for c in commands)


def test_backup_drives_back_by_its_distance_at_its_speed() -> None:
    pose, seconds, _ = run(BackUp(model.BackUp(), setting(ROUND)), view_of(ROUND), Pose2(0, 0, math.pi / 2))
    assert pose[:2] == pytest.approx((0.0, -0.30), abs=0.01)
    assert seconds == pytest.approx(2.0, abs=0.1)


def test_wait_stops_the_robot_for_its_duration() -> None:
    pose, seconds, commands = run(Wait(model.Wait(wait_duration=1.0), setting(ROUND)), view_of(ROUND))
    assert pose == Pose2(0, 0)
    assert seconds == pytest.approx(1.0)
    assert set(commands) == {STOP}


@pytest.mark.parametrize(("entirely", "area"), [(False, "around the robot"), (True, "everywhere")])
def test_clear_costmap_clears_once_around_the_robot_or_everywhere(entirely: bool, area: str) -> None:
    calls: list[str] = []
    recording_setting = replace(
        setting(ROUND),
        clear_costmap=lambda: calls.append("everywhere"),
        clear_around=lambda: calls.append("around the robot"),
    )
    behavior = ClearCostmap(model.ClearCostmap(clear_entirely=entirely), recording_setting)
    assert run(behavior, view_of(ROUND))[2] == []
    assert calls == [area]


def test_backup_fails_with_an_obstacle_behind() -> None:
    with pytest.raises(NavigationFailure) as failure:
        run(BackUp(model.BackUp(backup_partial=True), setting(ROUND)), view_of(ROUND, (-0.6, -1.0, -0.26, 1.0)))
    assert failure.value.code == ErrorCode.BACKUP_COLLISION_AHEAD


def test_backup_of_a_robot_that_does_not_move_times_out() -> None:
    behavior = BackUp(model.BackUp(), setting(ROUND))
    behavior.start(Pose2(0, 0))
    with pytest.raises(NavigationFailure) as failure:
        behavior.step(Pose2(0, 0), view_of(ROUND), 10.1)
    assert failure.value.code == ErrorCode.BACKUP_TIMEOUT


def test_robot_without_reverse_refuses_to_back_up() -> None:
    robot = replace(ROUND, max_reverse=0.0)
    with pytest.raises(NavigationFailure) as failure:
        run(BackUp(model.BackUp(), setting(robot)), view_of(robot))
    assert failure.value.code == ErrorCode.BACKUP_INVALID_INPUT


def test_backup_uses_the_available_space() -> None:
    pose, _, _ = run(BackUp(model.BackUp(backup_partial=True), setting(ROUND)), view_of(ROUND, (-0.6, -1.0, -0.4, 1.0)))
    assert -0.2 < pose.x < -0.05


def test_nav2_backup_requires_space_for_its_whole_distance() -> None:
    with pytest.raises(NavigationFailure) as failure:
        run(BackUp(model.BackUp(), setting(ROUND)), view_of(ROUND, (-0.6, -1.0, -0.4, 1.0)))
    assert failure.value.code == ErrorCode.BACKUP_COLLISION_AHEAD


def test_rectangular_robot_does_not_spin_beside_a_wall_and_a_round_robot_does() -> None:
    wall = (-3.0, 0.24, 3.0, 0.4)
    with pytest.raises(NavigationFailure) as failure:
        run(Spin(model.Spin(), setting(RECTANGULAR)), view_of(RECTANGULAR, wall))
    assert failure.value.code == ErrorCode.SPIN_COLLISION_AHEAD
    assert run(Spin(model.Spin(), setting(ROUND)), view_of(ROUND, wall))[0].yaw > 1.5


def test_spin_of_a_robot_that_does_not_turn_times_out() -> None:
    spin = Spin(model.Spin(), setting(ROUND))
    spin.start(Pose2(0, 0))
    with pytest.raises(NavigationFailure) as failure:
        spin.step(Pose2(0, 0), view_of(ROUND), 10.1)
    assert failure.value.code == ErrorCode.SPIN_TIMEOUT


def test_default_min_rotational_vel_ends_a_turn_faster_than_a_low_value() -> None:
    rates, times = {}, {}
    for min_rate in (None, 0.1):
        options = {} if min_rate is None else {"min_rotational_vel": min_rate}
        _, times[min_rate], commands = run(
            Spin(model.Spin(rotational_acc_lim=0.5, **options), setting(ROUND)), view_of(ROUND)
        )
        rates[min_rate] = min(command.wz for command in commands)
    assert rates[None] == pytest.approx(0.4, abs=1e-9)
    assert 0.1 <= rates[0.1] < 0.4
    assert times[0.1] > times[None]


def test_lower_max_rotational_vel_limits_the_turn_rate() -> None:
    _, _, commands = run(Spin(model.Spin(max_rotational_vel=0.2), setting(ROUND)), view_of(ROUND))
    assert {command.wz for command in commands} == {0.2}


def test_rotational_acc_lim_is_the_deceleration_at_the_end_of_a_turn() -> None:
    spec = model.Spin(rotational_acc_lim=0.5, min_rotational_vel=0.0)
    pose, behavior = Pose2(0, 0), Spin(spec, setting(ROUND))
    behavior.start(pose)
    for _ in range(60):
        command = behavior.step(pose, view_of(ROUND), 0.0)
        if command is None:
            break
        assert command.wz == pytest.approx(min(1.0, math.sqrt(2 * 0.5 * (1.57 - pose.yaw))))
        pose = Pose2(0, 0, pose.yaw + 0.05 * command.wz)
    unlimited = Spin(model.Spin(rotational_acc_lim=100.0), setting(ROUND))
    unlimited.start(Pose2(0, 0))
    command_near_end = unlimited.step(Pose2(0, 0, 1.5), view_of(ROUND), 0.0)
    assert command_near_end is not None and command_near_end.wz == 1.0


@pytest.mark.parametrize(
    ("behavior", "code"),
    [(Spin(model.Spin(time_allowance=1.0), setting(ROUND)), ErrorCode.SPIN_TIMEOUT),
     (BackUp(model.BackUp(time_allowance=1.0), setting(ROUND)), ErrorCode.BACKUP_TIMEOUT)],
    ids=["spin", "backup"],
)  # fmt: skip
def test_a_behavior_fails_after_its_time_allowance(behavior: Behavior, code: ErrorCode) -> None:
    behavior.start(Pose2(0, 0))
    assert behavior.step(Pose2(0, 0), view_of(ROUND), 1.0) is not None
    with pytest.raises(NavigationFailure) as failure:
        behavior.step(Pose2(0, 0), view_of(ROUND), 1.05)
    assert failure.value.code is code


def test_recovery_passes_its_parameters_to_behaviors_that_do_not_set_them() -> None:
    entries = ["spin", {"type": "backup", "time_allowance": 3.0}, "retrace"]
    spin, backup, retrace = model.Recovery(
        behaviors=entries, time_allowance=7.0, min_rotational_vel=0.2, rotational_acc_lim=2.0
    ).behavior_specs()
    assert isinstance(spin, model.Spin) and isinstance(backup, model.BackUp) and isinstance(retrace, Retrace)
    assert (spin.time_allowance, spin.min_rotational_vel, spin.rotational_acc_lim) == (7.0, 0.2, 2.0)
    assert (backup.time_allowance, retrace.time_allowance) == (3.0, 7.0)


def test_the_default_values_are_those_of_nav2() -> None:
    recovery = model.Recovery()
    assert (recovery.time_allowance, recovery.min_rotational_vel, recovery.max_rotational_vel) == (10.0, 0.4, 1.0)
