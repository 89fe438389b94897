"""Tests of the compensation of wheel slip that turns or delays the robot."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.advanced.spec import SlipEkf
from simscen.advanced.turn_slip import MAX_TURN_SLIP_RAD_PER_M, TurnSlipObserver
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.sensor_data import Imu, Odometry, Readings
from simscen.core.records.trace import Decision
from simscen.model.stack import StackSpec
from simscen.testing.flatland import Drive, Flatland, drive

GROUND_CURVATURE = 0.3
"""Additional curvature to the left in 1/m, caused by the ground."""
ROOM = Flatland().room(14, 2.6)


class SlippingDrive:
    """Stack wrapper in which the ground turns the robot to the left, and odometry reports the wheel motion."""

    def __init__(self, drive: Drive, wheel_slip: float = 0.0) -> None:
        self.drive, self.stack, self._wheel_slip = drive, drive.stack, wheel_slip
        self._before, self._odometry = drive.pose, drive.pose

    def decide(self, tick: int, readings: Readings) -> Decision:
        step = self._before.between(self.drive.pose)
        self._before = self.drive.pose
        self._odometry = self._odometry.compose(
            Pose2(step.x * (1 + self._wheel_slip), step.y, step.yaw - GROUND_CURVATURE * step.x)
        )
        imu = Imu("imu", tick, (0.0, 0.0, self.drive.twist.wz), (0.0, 0.0, 9.81))
        modified_readings = tuple(
            replace(reading, pose=self._odometry) if isinstance(reading, Odometry) else reading for reading in readings
        )
        decision = self.stack.decide(tick, (imu, *modified_readings))
        vx, vy, wz = decision.command
        return replace(decision, command=Twist(vx, vy, wz + GROUND_CURVATURE * vx))


def drive_with_slip(**smoother_options: bool) -> Drive:
    """Drive straight through a room for 11 m."""
    spec = StackSpec(
        profile="advanced", localizer=SlipEkf(type="slip_ekf", rotation_noise=0.5), velocity_smoother=smoother_options
    )
    d = drive(ROOM, Pose2(1.0, 1.3), Goal("g", Pose2(12.0, 1.3)), spec=spec, odometry=("odom",))
    d.stack = SlippingDrive(d)
    return d.run(15.0)


def test_local_costmap_uses_the_filtered_heading() -> None:
    d = drive_with_slip()
    view = d.stack.stack.inner._costmaps.local_costmap.view
    cells = np.argwhere(view.costs == 254)
    lethal_points = (cells[:, ::-1] + 0.5) * view.resolution + view.origin
    assert len(lethal_points) > 20
    assert np.abs(ROOM.distance(lethal_points)).max() < 0.15


def test_uneven_slip_is_compensated() -> None:
    assert max_lateral_error(drive_with_slip()) < 0.06
    assert max_lateral_error(drive_with_slip(counter_turn_slip=False)) > 0.1


def max_lateral_error(d: Drive) -> float:
    """Return the largest lateral error in m."""
    return max(abs(pose.y - 1.3) for pose in d.track if 4.0 < pose.x < 11.0)


@pytest.mark.parametrize("match_scans, error", [(False, 0.7), (True, 0.1)])
def test_scan_matching_corrects_the_distance_of_slipping_wheels(match_scans: bool, error: float) -> None:
    """Odometry overestimates the distance of 8 m by 10 %."""
    spec = StackSpec(
        profile="advanced", localizer=SlipEkf(type="slip_ekf", rotation_noise=0.5, match_scans=match_scans)
    )
    world = Flatland().room(14, 6)
    world.discs += [(2.0 + 2.0 * k, 1.5 if k % 2 else 4.5, 0.2) for k in range(6)]
    d = drive(world, Pose2(1.0, 3.0), Goal("g", Pose2(12.9, 3.0)), spec=spec, odometry=("odom",))
    d.stack = SlippingDrive(d, wheel_slip=0.1)
    while d.pose.x < 9.0:
        d.step()
    estimate = d.stack.stack.inner._localizer.belief.pose
    assert abs(estimate.distance(d.pose) - error) < 0.15


def test_slip_compensation_is_limited_for_broken_sensors() -> None:
    slip, wheels, fused = TurnSlipObserver(), Pose2(0.0, 0.0, 0.0), Pose2(5.0, 5.0, 2.0)
    assert slip.compensate(Twist(1.0, 0.0, 0.2)) == Twist(1.0, 0.0, 0.2)
    for _ in range(200):
        wheels, fused = wheels.compose(Pose2(0.02, 0.0, 0.01)), fused.compose(Pose2(0.02, 0.0, 0.014))
        slip.update(wheels, fused)
    assert math.isclose(slip.compensate(Twist(1.0, 0.0, 0.5)).wz, 0.3, abs_tol=1e-3)
    assert math.isclose(slip.compensate(Twist(-1.0, 0.0, 0.5)).wz, 0.7, abs_tol=1e-3)
    assert slip.compensate(Twist(0.0, 0.0, 0.5)) == Twist(0.0, 0.0, 0.5)
    for _ in range(200):
        wheels, fused = wheels.compose(Pose2(0.02, 0.0, 0.0)), fused.compose(Pose2(0.02, 0.0, 1.0))
        slip.update(wheels, fused)
    assert slip.compensate(Twist(1.0, 0.0, 0.0)).wz == -MAX_TURN_SLIP_RAD_PER_M
