"""Tests of the ground-truth localizer."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry
from simscen.stack.localizers.ground_truth import TRUTH, GroundTruthLocalizer


def estimate(subject: GroundTruthLocalizer, sensor: str, tick: int, pose: Pose2) -> Pose2:
    subject.on_odometry(Odometry(sensor, tick, pose, Twist()))
    return subject.belief.pose


def test_ground_truth_replaces_any_estimate_at_once() -> None:
    subject = GroundTruthLocalizer(Estimate(Pose2(9, 9, 9)))
    assert estimate(subject, TRUTH, 0, Pose2(1, 2, 0.5)) == pytest.approx((1, 2, 0.5))
    assert np.linalg.cond(subject.belief.covariance) == 1


@pytest.mark.parametrize("truth_first", [True, False])
def test_ground_truth_applies_in_any_order_of_readings(truth_first: bool) -> None:
    subject, true, drifted = GroundTruthLocalizer(Estimate(Pose2(0, 0, 0))), Pose2(1, 2, 0.5), Pose2(0.7, 0, 0.1)
    for tick in (0, 6, 12):
        true, drifted = true.compose(Pose2(0.1, 0, 0.02)), drifted.compose(Pose2(0.3, 0, 0.5))
        readings = [(TRUTH, true), ("odom", drifted)]
        for sensor, pose in readings if truth_first else readings[::-1]:
            estimate(subject, sensor, tick, pose)
        assert subject.belief.pose == pytest.approx(true)
        assert subject.belief.map_from_odom.compose(drifted) == pytest.approx(true)


def test_pose_follows_odometry_between_ground_truth_readings() -> None:
    subject = GroundTruthLocalizer(Estimate(Pose2(0, 0, 0)))
    estimate(subject, "odom", 0, Pose2(5, 5, 0))
    estimate(subject, TRUTH, 0, Pose2(1, 2, np.pi / 2))
    assert estimate(subject, "odom", 6, Pose2(5.5, 5, 0)) == pytest.approx((1, 2.5, np.pi / 2))


def test_without_ground_truth_it_is_dead_reckoning() -> None:
    subject = GroundTruthLocalizer(Estimate(Pose2(1, 1, 0)))
    assert estimate(subject, "odom", 0, Pose2(5, 5, 0)) == pytest.approx((1, 1, 0))
    assert estimate(subject, "odom", 6, Pose2(5.5, 5, 0)) == pytest.approx((1.5, 1, 0))
