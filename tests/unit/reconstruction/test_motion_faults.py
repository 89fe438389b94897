"""Tests of the faults of odometry, gyroscope, base, and localizer that are found in a recorded drive."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.core.geometry import Pose2
from simscen.reconstruction.drive.motion_steps import motion_steps
from simscen.reconstruction.faults.commands import command_faults
from simscen.reconstruction.faults.localizer import localizer_faults
from simscen.reconstruction.faults.odometry import gyroscope_faults, odometry_faults


def number(fault, key):
    """Return the number of a value of the fault without its unit."""
    return float(str(fault.values[key]).split()[0])


def with_odometry(change):
    """Return a drive with wrong odometry.

    `change(time, distance, turn)` returns the reported distance in m and turn in rad of each step.
    """
    plain = drives.drive()
    times = plain.odometry.times
    steps = np.diff(plain.poses.values, axis=0)
    forward = np.hypot(steps[:, 0], steps[:, 1])
    pose, poses = Pose2(0.0, 0.0, 0.0), [Pose2(0.0, 0.0, 0.0)]
    for time, distance, turn in zip(times.tolist(), forward.tolist(), steps[:, 2].tolist(), strict=False):
        reported_distance, reported_turn = change(time, distance, turn)
        pose = pose.compose(Pose2(reported_distance, 0.0, reported_turn))
        poses.append(pose)
    values = np.column_stack((np.array(poses), plain.odometry.values[:, 3:]))
    return replace(plain, odometry=drives.signal(times, values))


def faults_of_odometry(drive):
    return list(odometry_faults(motion_steps(drive), wheel_separation=0.3))


def test_correct_odometry_has_no_fault():
    assert faults_of_odometry(with_odometry(lambda time, distance, turn: (distance, turn))) == []


def test_odometry_that_scales_all_motion_has_a_scale():
    (fault,) = faults_of_odometry(with_odometry(lambda time, distance, turn: (1.08 * distance, 1.08 * turn)))
    assert (fault.kind, number(fault, "factor")) == ("scale", pytest.approx(108, abs=1))


def test_odometry_that_turns_while_it_drives_has_a_bias():
    (fault,) = faults_of_odometry(
        with_odometry(lambda time, distance, turn: (distance, turn + np.radians(2) * distance))
    )
    assert (fault.kind, number(fault, "turn_per_metre")) == ("bias", pytest.approx(2.0, abs=0.2))


def test_wheels_that_report_too_much_distance_for_a_while_slip():
    (fault,) = faults_of_odometry(
        with_odometry(lambda time, distance, turn: ((1.5 if 4 <= time < 8 else 1.0) * distance, turn))
    )
    assert (fault.kind, fault.begin) == ("slip", pytest.approx(4.0, abs=0.6))
    assert fault.duration == pytest.approx(4.0, abs=0.8)
    assert number(fault, "left") == pytest.approx(33, abs=5)


def standing(odometry_speed, command):
    """Return the drive of a standing robot whose odometry moves; speeds in m/s."""
    plain = drives.drive()
    times = plain.odometry.times
    odometry_values = np.zeros((len(times), 6))
    odometry_values[:, 0] = odometry_speed * times
    poses = np.tile(plain.poses.values[0], (len(times), 1))
    commands = np.tile([command, 0.0, 0.0], (len(times), 1))
    signals = {"poses": poses, "odometry": odometry_values, "commands": commands}
    return replace(plain, **{name: drives.signal(times, values) for name, values in signals.items()})


def test_odometry_that_moves_at_rest_drifts():
    (fault,) = faults_of_odometry(standing(0.05, 0.0))
    assert (fault.kind, number(fault, "linear")) == ("drift", pytest.approx(0.05, abs=0.002))


def test_wheels_that_turn_in_place_against_an_obstacle_are_no_drift():
    assert [fault.kind for fault in faults_of_odometry(standing(0.05, 0.5)) if fault.kind == "drift"] == []


def test_a_correct_gyroscope_has_no_fault():
    assert list(gyroscope_faults(drives.drive())) == []


def test_a_constant_turn_rate_is_a_bias_of_the_gyroscope():
    plain = drives.drive()
    rates = drives.signal(plain.turn_rates.times, plain.turn_rates.values + 0.05)
    (fault,) = gyroscope_faults(replace(plain, turn_rates=rates))
    assert (fault.kind, number(fault, "gyro")) == ("bias", pytest.approx(0.05, abs=0.002))


def test_a_growing_error_of_the_gyroscope_is_a_drift():
    plain = drives.drive()
    grown = 0.02 * np.clip(plain.turn_rates.times - 3.0, 0.0, None)
    rates = drives.signal(plain.turn_rates.times, plain.turn_rates.values[:, 0] + grown)
    (fault,) = gyroscope_faults(replace(plain, turn_rates=rates))
    assert (fault.kind, number(fault, "gyro")) == ("drift", pytest.approx(0.02, rel=0.1))
    assert fault.begin == pytest.approx(3.0, abs=0.8)


def speeds(times):
    """Return a speed in m/s that changes every 2 s."""
    return np.where(times % 4 < 2, 0.5, 0.25)


def with_motion(driven_speed, commanded_speed=speeds):
    """Return a drive with these driven and commanded speeds in m/s, as functions of the times in s."""
    plain = drives.drive()
    times = plain.commands.times
    values = np.zeros((len(times), 3))
    values[:, 0] = commanded_speed(times)
    odometry_values = np.column_stack((plain.odometry.values[:, :3], driven_speed(times), np.zeros((len(times), 2))))
    return replace(plain, commands=drives.signal(times, values), odometry=drives.signal(times, odometry_values))


def test_a_base_that_follows_its_commands_has_no_fault():
    assert list(command_faults(with_motion(speeds))) == []


def test_a_base_that_follows_late_has_a_delay():
    (fault,) = command_faults(with_motion(lambda times: speeds(times - 0.4)))
    assert (fault.kind, number(fault, "latency")) == ("delay", pytest.approx(310, abs=40))


def test_stationary_base_with_nonzero_commands_loses_commands():
    faults = list(command_faults(with_motion(lambda times: np.where((times > 5) & (times < 7), 0.0, speeds(times)))))
    assert [fault.kind for fault in faults] == ["off"]
    assert faults[0].begin == pytest.approx(4.5, abs=0.2)


def test_a_base_that_drives_on_although_it_should_stop_keeps_its_command():
    def commanded_speed(times):
        return np.where((times > 5) & (times < 8), 0.0, 0.5)

    (fault,) = command_faults(with_motion(lambda times: np.full(len(times), 0.5), commanded_speed))
    assert (fault.kind, fault.begin) == ("stuck", pytest.approx(4.6, abs=0.3))
    assert fault.duration == pytest.approx(3.4, abs=0.4)


def test_a_base_that_drives_a_fraction_of_each_command_has_a_gain():
    (fault,) = command_faults(with_motion(lambda times: 0.7 * speeds(times)))
    assert (fault.kind, number(fault, "linear")) == ("gain", pytest.approx(70, abs=3))


def test_wheels_of_one_side_that_drive_less_have_a_gain():
    plain = with_motion(speeds)
    odometry_values = plain.odometry.values.copy()
    left = 0.7 * odometry_values[:, 3]
    right = odometry_values[:, 3].copy()
    odometry_values[:, 3], odometry_values[:, 5] = (left + right) / 2, (right - left) / 0.3
    (fault,) = command_faults(
        replace(plain, odometry=drives.signal(plain.odometry.times, odometry_values)), wheel_separation=0.3
    )
    assert (fault.target, fault.kind) == ("wheels", "gain")
    assert [number(fault, key) for key in ("left", "right")] == pytest.approx([70, 100], abs=4)


def test_a_base_that_never_exceeds_a_speed_is_saturated():
    (fault,) = command_faults(with_motion(lambda times: np.minimum(0.35, speeds(times))))
    assert (fault.kind, number(fault, "linear")) == ("saturation", pytest.approx(0.35, abs=0.02))


def test_a_speed_that_falls_is_a_low_battery():
    def falling(times):
        return np.maximum(0.4 - 0.02 * times, 0.2)

    (fault,) = command_faults(with_motion(falling, lambda times: np.full(len(times), 0.5)))
    assert fault.kind == "low_battery"
    assert [number(fault, key) for key in ("start", "end")] == pytest.approx([0.4, 0.2], abs=0.03)


def test_temporary_jump_of_the_belief_is_a_localizer_fault():
    plain = drives.drive()
    values = plain.belief.values.copy()
    values[(plain.belief.times >= 4.0) & (plain.belief.times < 6.0), 1] += 0.5
    (fault,) = localizer_faults(replace(plain, belief=drives.signal(plain.belief.times, values)))
    assert (fault.kind, fault.begin, fault.duration) == ("jump", pytest.approx(4.0), pytest.approx(2.0))
    assert number(fault, "y") == pytest.approx(0.5, abs=0.1)


def test_a_belief_that_jumps_and_stays_is_a_fault_until_the_end():
    plain = drives.drive()
    values = plain.belief.values.copy()
    values[plain.belief.times >= 4.0, 0] -= 1.0
    (fault,) = localizer_faults(replace(plain, belief=drives.signal(plain.belief.times, values)))
    assert (fault.kind, fault.begin, fault.duration) == ("jump", pytest.approx(4.0), None)


def test_a_localizer_without_messages_while_the_robot_drives_is_off():
    plain = drives.drive()
    is_kept = (plain.belief.times < 3.0) | (plain.belief.times > 8.0)
    silent = drives.signal(plain.belief.times[is_kept], plain.belief.values[is_kept])
    (fault,) = localizer_faults(replace(plain, belief=silent))
    assert (fault.kind, fault.duration) == ("off", pytest.approx(5.1, abs=0.2))


@pytest.mark.parametrize(("end", "duration"), [(6.0, pytest.approx(2.0)), (99.0, None)])
def test_jump_of_the_heading_alone_is_a_localizer_fault(end, duration):
    plain = drives.drive()
    values = plain.belief.values.copy()
    values[:, :2] += np.random.default_rng(1).normal(0.0, 0.02, (len(values), 2))
    values[(plain.belief.times >= 4.0) & (plain.belief.times < end), 2] += np.pi / 2
    (fault,) = localizer_faults(replace(plain, belief=drives.signal(plain.belief.times, values)))
    assert (fault.kind, fault.begin, fault.duration) == ("jump", pytest.approx(4.0), duration)
    assert number(fault, "yaw") == pytest.approx(90)
    assert "jumps by 90 deg" in fault.reason.text


@pytest.mark.parametrize("rate", [1, 2, 20])
def test_a_slow_ground_truth_hides_no_jump_of_the_belief(rate):
    plain = drives.drive()
    times = np.arange(0.0, drives.DURATION_S, 1 / rate)
    values = plain.belief.values.copy()
    values[plain.belief.times >= 4.0, 0] += 1.0
    belief = drives.signal(plain.belief.times, values)
    (fault,) = localizer_faults(replace(plain, belief=belief, poses=drives.signal(times, drives.poses(times))))
    assert (fault.kind, fault.begin) == ("jump", pytest.approx(4.0))


@pytest.mark.parametrize("displacement", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.5)])
def test_a_robot_that_is_moved_away_or_turned_is_no_jump_of_the_belief(displacement):
    plain = drives.drive()
    poses = plain.poses.values + np.where(plain.poses.times >= 4.01, 1.0, 0.0)[:, None] * displacement
    assert list(localizer_faults(replace(plain, poses=drives.signal(plain.poses.times, poses)))) == []


def test_a_localizer_that_stays_silent_is_off_until_the_end():
    plain = drives.drive()
    is_kept = plain.belief.times < 3.05
    silent = drives.signal(plain.belief.times[is_kept], plain.belief.values[is_kept])
    (fault,) = localizer_faults(replace(plain, belief=silent))
    assert (fault.kind, fault.begin, fault.duration) == ("off", pytest.approx(3.0), None)


@pytest.mark.parametrize("has_gap", [False, True])
def test_missing_corrections_are_found_also_after_a_gap_at_rest(has_gap):
    plain = drives.drive()
    ticks = np.arange(0.0, 12.0, 0.5)
    corrected = 0.01 * np.where(ticks < 9.75, np.minimum(ticks, 6.0), ticks)
    times = plain.belief.times[(plain.belief.times < 0.5) | (plain.belief.times > (2.5 if has_gap else 0.5))]
    drive = replace(
        plain,
        has_true_poses=False,
        odometry=drives.signal(plain.odometry.times, drives.poses(np.maximum(plain.odometry.times - 3.0, 0.0))),
        corrections=drives.signal(ticks, np.column_stack((corrected, corrected, corrected))),
        belief=drives.signal(times, drives.poses(np.maximum(times - 3.0, 0.0))),
    )
    (fault,) = localizer_faults(drive)
    assert (fault.kind, fault.begin, fault.duration) == ("off", pytest.approx(6.0), pytest.approx(3.5))
