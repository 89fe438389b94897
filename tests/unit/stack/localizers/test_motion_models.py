"""Tests of the motion models against the formulas of nav2_amcl."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.stack.localizers.motion_models import DifferentialMotionModel, MotionModel, OmniMotionModel

START = Pose2(1.5, -0.7, 2.1)
SAMPLES = 200_000


def moved_poses(model: MotionModel, delta: Pose2, count: int = SAMPLES) -> np.ndarray:
    return model.sample(np.tile(START, (count, 1)), delta, np.random.default_rng(7))


@pytest.mark.parametrize("model", [DifferentialMotionModel((0, 0, 0, 0)), OmniMotionModel((0, 0, 0, 0, 0))])
@pytest.mark.parametrize("delta", [Pose2(0.3, 0.1, 0.4), Pose2(-0.2, 0.0, 0.1), Pose2(0, 0, -1.2), Pose2(0, 0, 0)])
def test_particles_without_noise_move_as_odometry(model: MotionModel, delta: Pose2) -> None:
    assert np.allclose(moved_poses(model, delta, 3), START.compose(delta), atol=1e-12)


@pytest.mark.parametrize(("forward", "second_turn"), [(0.3, 0.4), (-0.3, 0.4), (0.3, -2.0)])
def test_differential_noise_has_the_variances_of_nav2(forward: float, second_turn: float) -> None:
    a1, a2, a3, a4 = 0.004, 0.003, 0.002, 0.001
    poses = moved_poses(DifferentialMotionModel((a1, a2, a3, a4)), Pose2(forward, 0.0, second_turn))
    local = np.array([START.between(Pose2(*pose)) for pose in poses[:20_000]])
    turn = min(abs(second_turn), math.pi - abs(second_turn)) if forward > 0 else abs(second_turn)
    drive_variance = a3 * forward**2 + a4 * turn**2
    assert np.var(np.hypot(local[:, 0], local[:, 1])) == pytest.approx(drive_variance, rel=0.05)
    bearing = np.arctan2(local[:, 1] * np.sign(forward), local[:, 0] * np.sign(forward))
    assert np.var(bearing) == pytest.approx(a2 * forward**2, rel=0.05)
    heading_variance = a2 * forward**2 + a1 * turn**2 + a2 * forward**2
    assert np.var(local[:, 2]) == pytest.approx(heading_variance, rel=0.05)


def test_noise_is_equal_backward_and_forward() -> None:
    model = DifferentialMotionModel((0.01, 0.01, 0.01, 0.01))
    forward, backward = moved_poses(model, Pose2(0.4, 0, 0.2)), moved_poses(model, Pose2(-0.4, 0, 0.2))
    assert np.allclose(forward.std(axis=0), backward.std(axis=0), rtol=0.02)


def test_translation_below_a_centimeter_causes_no_rotation_noise() -> None:
    """Otherwise, small translations in odometry while the robot turns in place would count as two large turns."""
    poses = moved_poses(DifferentialMotionModel((0.01, 0, 0, 0)), Pose2(0.0, 0.009, 0.0))
    assert poses[:, 2].std() < 1e-12


def test_omni_noise_has_the_variances_of_nav2() -> None:
    a1, a2, a3, a4, a5 = 0.004, 0.003, 0.002, 0.001, 0.006
    delta = Pose2(0.3, 0.4, 0.2)
    poses = moved_poses(OmniMotionModel((a1, a2, a3, a4, a5)), delta)
    bearing = START.yaw + math.atan2(delta.y, delta.x)
    drive, strafe = (
        np.array([[np.cos(bearing), np.sin(bearing)], [-np.sin(bearing), np.cos(bearing)]])
        @ (poses[:, :2] - START[:2]).T
    )
    assert drive.mean() == pytest.approx(0.5, abs=1e-3)
    assert np.var(drive) == pytest.approx(a3 * 0.25 + a4 * 0.04, rel=0.02)
    assert np.var(strafe) == pytest.approx(a4 * 0.04 + a5 * 0.25, rel=0.02)
    assert np.var(poses[:, 2]) == pytest.approx(a1 * 0.04 + a2 * 0.25, rel=0.02)


@pytest.mark.parametrize(
    "model", [DifferentialMotionModel((2e-4, 3e-4, 4e-4, 1e-4)), OmniMotionModel((2e-4, 3e-4, 4e-4, 1e-4, 5e-4))]
)
@pytest.mark.parametrize("delta", [Pose2(0.3, 0.1, 0.4), Pose2(-0.4, 0.05, -0.3), Pose2(0, 0, 0.9)])
def test_propagated_covariance_equals_that_of_moved_particles(model: MotionModel, delta: Pose2) -> None:
    rng = np.random.default_rng(3)
    covariance = np.array([[4e-4, 1e-4, -5e-5], [1e-4, 3e-4, 2e-5], [-5e-5, 2e-5, 1e-4]])
    poses = model.sample(rng.multivariate_normal(START, covariance, SAMPLES), delta, rng)
    propagated = model.propagate(covariance, START.yaw, delta)
    scale = np.sqrt(np.outer(np.diag(propagated), np.diag(propagated)))
    assert np.allclose(np.cov(poses.T) / scale, propagated / scale, atol=0.015)


def test_headings_remain_wrapped() -> None:
    poses = moved_poses(DifferentialMotionModel((0.2, 0.2, 0.2, 0.2)), Pose2(0, 0, 3.0))
    assert np.abs(poses[:, 2]).max() <= math.pi
