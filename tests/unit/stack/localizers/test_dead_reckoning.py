"""Tests of dead reckoning, the localizer of type `odometry`."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry
from simscen.model.localizers import OdometryOnly
from simscen.testing.synthetic_room import Noise, build_localizer, drive, pose_errors, run_localizer

SPEC = OdometryOnly(type="odometry")
NOISELESS = Noise(translation=0, rotation=0, drift=0)


def test_odometry_localizer_without_noise_is_exact() -> None:
    log = drive(30.0)
    beliefs = run_localizer(build_localizer(SPEC, Estimate(Pose2(*log.truth[0])), 1), log, 1, NOISELESS)
    assert np.abs(pose_errors(beliefs, log.truth)).max() < 1e-9
    assert len({belief.map_from_odom for belief in beliefs}) == 1


def test_error_stays_within_the_covariance() -> None:
    """The localizer assumes the default noise of the EKF, which is twice that of the simulated wheels."""
    log = drive(30.0)
    for seed in range(5):
        beliefs = run_localizer(build_localizer(SPEC, Estimate(Pose2(*log.truth[0]), (0.01, 0.01, 0.01)), 1), log, seed)
        assert (np.abs(pose_errors(beliefs, log.truth)[-1]) < 3 * np.sqrt(np.diag(beliefs[-1].covariance))).all()


def test_the_first_odometry_is_the_reference_and_not_a_step() -> None:
    localizer = build_localizer(SPEC, Estimate(Pose2(1, 2, 0)), 1)
    localizer.on_odometry(Odometry("odom", 0, Pose2(5, 5, 1), Twist()))
    assert localizer.belief.pose == pytest.approx((1, 2, 0))
    assert localizer.belief.map_from_odom.compose(Pose2(5, 5, 1)) == pytest.approx((1, 2, 0))


def test_unknown_start_is_the_origin_with_a_large_covariance() -> None:
    belief = build_localizer(SPEC, Estimate(None), 1).belief
    assert belief.pose == Pose2(0, 0, 0)
    assert np.sqrt(np.diag(belief.covariance)) == pytest.approx((100, 100, np.pi / np.sqrt(3)))
