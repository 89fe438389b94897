"""Tests of the ground-truth localizer."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry
from simscen.stack.localizers.ground_truth import TRUTH, GroundTruthLocalizer


def estimate(localizer: GroundTruthLocalizer, sensor: str, tick: int, pose: Pose2) -> Pose2:
    """Return the pose of the localizer after an odometry reading of a sensor."""
    localizer.on_odometry(Odometry(sensor, tick, pose, Twist()))
    return localizer.belief.pose


def test_first_ground_truth_reading_replaces_the_initial_estimate() -> None:
    localizer = GroundTruthLocalizer(Estimate(Pose2(9, 9, 9)))
    assert estimate(localizer, TRUTH, 0, Pose2(1, 2, 0.5)) == pytest.approx((1, 2, 0.5))
    assert np.linalg.cond(localizer.belief.covariance) == 1


@pytest.mark.parametrize("truth_first", [True, False])
def test_ground_truth_applies_in_any_order_of_readings(truth_first: bool) -> None:
    localizer, truth, odometry = GroundTruthLocalizer(Estimate(Pose2(0, 0, 0))), Pose2(1, 2, 0.5), Pose2(0.7, 0, 0.1)
    for tick in (0, 6, 12):
        truth, odometry = truth.compose(Pose2(0.1, 0, 0.02)), odometry.compose(Pose2(0.3, 0, 0.5))
        readings = [(TRUTH, truth), ("odom", odometry)]
        for sensor, pose in readings if truth_first else readings[::-1]:
            estimate(localizer, sensor, tick, pose)
        assert localizer.belief.pose == pytest.approx(truth)
        assert localizer.belief.map_from_odom.compose(odometry) == pytest.approx(truth)


def test_pose_follows_odometry_between_ground_truth_readings() -> None:
    localizer = GroundTruthLocalizer(Estimate(Pose2(0, 0, 0)))
    estimate(localizer, "odom", 0, Pose2(5, 5, 0))
    estimate(localizer, TRUTH, 0, Pose2(1, 2, np.pi / 2))
    assert estimate(localizer, "odom", 6, Pose2(5.5, 5, 0)) == pytest.approx((1, 2.5, np.pi / 2))


def test_localizer_without_ground_truth_readings_is_dead_reckoning() -> None:
    localizer = GroundTruthLocalizer(Estimate(Pose2(1, 1, 0)))
    assert estimate(localizer, "odom", 0, Pose2(5, 5, 0)) == pytest.approx((1, 1, 0))
    assert estimate(localizer, "odom", 6, Pose2(5.5, 5, 0)) == pytest.approx((1.5, 1, 0))
