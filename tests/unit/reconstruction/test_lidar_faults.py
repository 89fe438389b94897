"""Tests of the faults of a lidar that are found in a recorded drive."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2
from simscen.reconstruction.drive.recorded_drive import no_values
from simscen.reconstruction.estimators import run_estimators
from simscen.reconstruction.faults.false_returns import glass_fault
from simscen.reconstruction.faults.lidar_calibration import mount_error, range_error_faults
from simscen.reconstruction.faults.lidar_readings import sector_limits_text
from simscen.reconstruction.objects.clusters import usable_scans
from simscen.reconstruction.scenario.robot_file import RobotProperties
from simscen.reconstruction.static_world import StaticWorld


def number(fault, key):
    """Return the number of a value of the fault without its unit."""
    return float(str(fault.values[key]).split()[0])


def all_faults(measured):
    """Return all faults of the lidar that the estimators find in these scans."""
    drive = replace(drives.drive(measured), odometry=no_values(6), commands=no_values(3), turn_rates=no_values(1))
    robot = RobotProperties(lidar_noise=drives.NOISE_M, is_known=True)
    return [fault for fault in run_estimators(drive, drives.room(), robot).faults if fault.target == "lidar"]


def test_a_good_lidar_has_no_fault():
    assert all_faults(drives.scans()) == []


def test_a_lidar_without_returns_has_no_mount_error():
    measured = drives.scans()
    blind = drives.with_ranges(measured, np.full_like(measured.ranges, np.inf))
    assert mount_error(drives.compared_scans(blind), drives.room()) == Pose2(0.0, 0.0, 0.0)


def test_invalid_scans_are_garbage_with_their_probability():
    measured = drives.scans()
    ranges = measured.ranges.copy()
    ranges[::5] = np.nan
    (fault,) = all_faults(drives.with_ranges(measured, ranges))
    assert (fault.kind, fault.values["value"], number(fault, "probability")) == ("garbage", "nan", 20)


def test_blind_directions_are_a_sector():
    measured = drives.scans()
    ranges = measured.ranges.copy()
    ranges[:, 40:81] = np.nan
    (fault,) = all_faults(drives.with_ranges(measured, ranges))
    assert fault.kind == "sector"
    ends = [number(fault, "from"), number(fault, "to")]
    assert ends == pytest.approx(np.degrees(drives.ANGLES[[40, 80]]), abs=1.0)


def test_a_blind_sector_of_a_fine_lidar_has_two_ends():
    angles = np.radians(np.linspace(-29.4, 29.4, 377))
    begin, end = sector_limits_text(angles, 0, 2)
    assert float(begin) < float(end)
    assert [float(begin), float(end)] == pytest.approx(np.degrees(angles[[0, 2]]), abs=0.06)


def test_beams_lost_for_a_while_are_a_beam_dropout_in_that_time():
    measured = drives.scans()
    ranges = measured.ranges.copy()
    is_lost = np.random.default_rng(2).random(ranges.shape) < 0.4
    is_lost[(measured.times < 3.0) | (measured.times > 7.0)] = False
    ranges[is_lost] = np.nan
    (fault,) = all_faults(drives.with_ranges(measured, ranges))
    assert (fault.kind, fault.begin) == ("beam_dropout", pytest.approx(3.0, abs=0.15))
    assert fault.duration == pytest.approx(4.0, abs=0.3)
    assert number(fault, "probability") == pytest.approx(40, abs=3)


def test_far_objects_that_are_not_seen_are_a_range_limit():
    measured = drives.scans()
    (fault,) = all_faults(drives.with_ranges(measured, np.where(measured.ranges > 3.0, np.inf, measured.ranges)))
    assert (fault.kind, number(fault, "max")) == ("range_limit", pytest.approx(3.0, abs=0.05))


def test_single_beams_that_end_early_are_dust():
    measured, rng = drives.scans(), np.random.default_rng(5)
    dust_ranges = rng.exponential(30.0, measured.ranges.shape)
    (fault,) = all_faults(drives.with_ranges(measured, np.minimum(dust_ranges, measured.ranges)))
    assert (fault.kind, number(fault, "mean_free_path")) == ("dust", pytest.approx(30, rel=0.35))


def test_returns_that_move_with_the_lidar_are_a_ghost_fault():
    measured = drives.scans()
    ranges = measured.ranges.copy()
    noise = np.random.default_rng(4).normal(0, drives.NOISE_M, (len(ranges), 9))
    ranges[:, 176:185] = 1.0 + noise
    (fault,) = all_faults(drives.with_ranges(measured, ranges))
    assert (fault.kind, number(fault, "range")) == ("ghost", pytest.approx(1.0, abs=0.03))
    assert number(fault, "direction") == pytest.approx(0.0, abs=1.0)


def test_more_noise_than_the_lidar_normally_has_is_a_noise_fault():
    measured = drives.scans()
    ranges = measured.ranges + np.random.default_rng(6).normal(0, 0.05, measured.ranges.shape)
    (fault,) = all_faults(drives.with_ranges(measured, ranges))
    assert (fault.kind, number(fault, "std")) == ("noise", pytest.approx(5.0, rel=0.15))


def test_a_turned_lidar_is_a_wrong_mount():
    (fault,) = all_faults(drives.scans(offset=Pose2(0.0, 0.05, np.radians(3))))
    assert (fault.kind, number(fault, "yaw")) == ("extrinsic", pytest.approx(3.0, abs=0.3))
    assert number(fault, "y") == pytest.approx(5.0, abs=1.0)


@pytest.mark.parametrize(("change", "kind", "key", "value"), [
    (lambda ranges, times: ranges + 0.08, "bias", "range", 8.0),
    (lambda ranges, times: ranges * 1.05, "scale", "factor", 105.0),
    (lambda ranges, times: ranges + 0.02 * times[:, None], "drift", "range", 2.0),
])  # fmt: skip
def test_systematic_range_errors_are_distinguished(change, kind, key, value):
    measured = drives.scans()
    changed = drives.with_ranges(measured, change(measured.ranges, measured.times))
    (fault,) = range_error_faults(drives.compared_scans(changed))
    assert (fault.kind, number(fault, key)) == (kind, pytest.approx(value, rel=0.1))


def test_beams_that_pass_through_a_named_obstacle_are_glass():
    measured = drives.scans()
    solids_without_shelf = [solid for solid in drives.ROOM if solid.name != "shelf"]
    world = StaticWorld(World("room", tuple(solids_without_shelf)), drives.HEIGHT)
    ranges_through_shelf = world.ranges_from(drives.poses(measured.times), drives.ANGLES, 12.0)
    compared = drives.compared_scans(drives.with_ranges(measured, ranges_through_shelf))
    fault = glass_fault(compared, drives.room(), usable_scans(compared))
    assert fault is not None
    assert (fault.kind, fault.values["of"], number(fault, "probability")) == (
        "glass",
        ["shelf"],
        pytest.approx(100, abs=10),
    )


def test_faults_name_the_sensors_of_the_robot_file():
    measured = drives.scans()
    drive = drives.drive(drives.with_ranges(measured, np.where(measured.ranges > 3.0, np.inf, measured.ranges)))
    robot = RobotProperties(sensors={"lidar": "front laser"}, is_known=True)
    (fault,) = run_estimators(drive, drives.room(), robot).faults
    assert (fault.target, fault.kind) == ("front laser", "range_limit")


def test_a_fault_of_a_sensor_that_the_robot_lacks_is_only_mentioned():
    drive = drives.drive(drives.scans())
    rates = drives.signal(drive.turn_rates.times, drive.turn_rates.values + 0.05)
    parts = run_estimators(replace(drive, turn_rates=rates), drives.room(), RobotProperties(sensors={"lidar": "lidar"}))
    assert parts.faults == []
    assert any("imu.bias" in unknown for unknown in parts.unknowns)


def test_range_errors_are_not_estimated_with_a_map_built_from_the_same_scans():
    drive = drives.drive(drives.with_ranges(measured := drives.scans(), measured.ranges + 0.05))
    kinds = [fault.kind for fault in run_estimators(drive, drives.room()).faults]
    assert kinds == ["bias"]
    built = run_estimators(drive, drives.room(), is_map_built=True)
    assert [fault.kind for fault in built.faults] == []
    assert any("--map" in unknown for unknown in built.unknowns)
