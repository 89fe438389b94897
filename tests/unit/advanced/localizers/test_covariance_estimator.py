"""Tests of the covariance of a localizer with scan matching, estimated from the scatter of its corrections."""

from collections.abc import Iterator

import numpy as np
import pytest

from simscen.advanced.localizers.covariance_estimator import WINDOW_SIZE, CovarianceEstimator, ScanResiduals
from simscen.core.geometry import Array, Pose2

STEP = Pose2(0.25, 0.0, 0.05)
MATCH_COVARIANCE = np.diag(np.square((0.005, 0.004, 0.0017)))
"""Covariance in (m, m, rad)² of a step between two scans with enough features."""
ERROR = np.array([0.05, 0.02, 0.01])
"""Standard deviations in m, m, rad of pose errors."""
OVERCONFIDENT = np.diag(np.square((0.01, 0.01, 0.005)))
"""Covariance of particles that is smaller than the true errors."""
GOOD_FIT = ScanResiduals(0.98, 0.1)


def drive(seed: int, rho: float, error: Array, particles: Array, residuals: ScanResiduals = GOOD_FIT) -> list[float]:
    """Return the NEES by the covariance of the particles and by the estimate, in the middle and at the end of a drive.

    `rho` is the correlation of consecutive errors.
    """
    nees = []
    results = list(corrections(seed, rho, error, particles, residuals))
    for pose_error, estimate in results[WINDOW_SIZE - 1 :: WINDOW_SIZE]:
        nees += [float(pose_error @ np.linalg.solve(covariance, pose_error)) for covariance in (particles, estimate)]
    return nees


def corrections(
    seed: int, rho: float, error: Array, particles: Array, residuals: ScanResiduals = GOOD_FIT
) -> Iterator[tuple[Array, Array]]:
    """Yield the pose error (3,) and the estimated covariance (3, 3) of each correction of a drive."""
    rng, estimator = np.random.default_rng(seed), CovarianceEstimator()
    truth, robot_frame_error = Pose2(3.0, -2.0, 1.0), error * rng.standard_normal(3)
    start = truth
    for _ in range(2 * WINDOW_SIZE):
        truth = truth.compose(STEP)
        robot_frame_error = rho * robot_frame_error + np.sqrt(1 - rho**2) * error * rng.standard_normal(3)
        c, s = np.cos(truth.yaw), np.sin(truth.yaw)
        world_frame_error = np.array(((c, -s, 0), (s, c, 0), (0, 0, 1))) @ robot_frame_error
        x, y, yaw = (np.array(truth) + world_frame_error).tolist()
        estimator.propagate_poses(start.between(truth), MATCH_COVARIANCE)
        yield world_frame_error, estimator.estimate(Pose2(x, y, yaw), particles, residuals)


@pytest.mark.parametrize("rho", [0.85, 0.94])
def test_estimated_covariance_matches_the_error_despite_overconfident_particles(rho: float) -> None:
    """The expected NEES is 3. Pose errors of AMCL at a distance of 25 cm have a correlation of 0.94."""
    particles_only, inflated = (
        np.array([drive(seed, rho, ERROR, OVERCONFIDENT) for seed in range(20)]).reshape(-1, 2).mean(axis=0)
    )
    assert 1.0 < inflated < 4.5
    assert particles_only > 15


def test_common_errors_of_all_poses_are_detected_by_beam_residuals() -> None:
    """The scale of beam residuals is learned while poses scatter, and applies when all poses have the same error."""

    def estimated_std(residuals: ScanResiduals) -> float:
        rng, estimator, base, covariance = (
            np.random.default_rng(1),
            CovarianceEstimator(),
            Pose2(0.0, 0.0, 0.0),
            OVERCONFIDENT,
        )
        for k in range(2 * WINDOW_SIZE):
            base, is_learning = base.compose(Pose2(0.25, 0.0, 0.0)), k < WINDOW_SIZE
            x = base.x + (0.05 * float(rng.standard_normal()) if is_learning else 0.1)
            estimator.propagate_poses(base, MATCH_COVARIANCE)
            covariance = estimator.estimate(Pose2(x, 0.0, 0.0), OVERCONFIDENT, GOOD_FIT if is_learning else residuals)
        return float(np.sqrt(covariance[0, 0]))

    assert estimated_std(ScanResiduals(0.98, 1.0)) > 2.0 * estimated_std(GOOD_FIT)


def test_fewer_explained_beams_have_less_weight() -> None:
    (_, most), (_, half) = (
        list(corrections(1, 0.9, ERROR, OVERCONFIDENT, ScanResiduals(fit, 0.3 * fit)))[-1] for fit in (1.0, 0.5)
    )
    assert np.sqrt(np.diag(half)) == pytest.approx(2 * np.sqrt(np.diag(most)))


def test_pose_scatter_overrides_wide_particles() -> None:
    *_, (_, covariance) = corrections(1, 0.7, ERROR / 10, OVERCONFIDENT * 25)
    assert 0 < np.trace(covariance) < np.trace(OVERCONFIDENT * 25) / 2


def test_drift_of_matched_scans_is_not_a_pose_error() -> None:
    """In a corridor without features, only the wheels measure the distance, and the map corrects it."""
    featureless, stds = np.diag(np.square((0.05, 0.004, 0.0017))), []
    for match_covariance in (MATCH_COVARIANCE, featureless):
        rng, estimator, base, covariance = (
            np.random.default_rng(2),
            CovarianceEstimator(),
            Pose2(0.0, 0.0, 0.0),
            OVERCONFIDENT,
        )
        for k in range(2 * WINDOW_SIZE):
            base = base.compose(Pose2(0.25 + 0.05 * float(rng.standard_normal()), 0.0, 0.0))
            estimator.propagate_poses(base, match_covariance)
            covariance = estimator.estimate(Pose2(0.25 * k, 0.0, 0.0), OVERCONFIDENT, GOOD_FIT)
        stds.append(float(np.sqrt(covariance[0, 0])))
    assert stds[1] < stds[0] / 3


def test_first_correction_has_a_covariance() -> None:
    estimator = CovarianceEstimator()
    estimator.propagate_poses(Pose2(0.0, 0.0, 0.0), None)
    covariance = estimator.estimate(Pose2(1.0, 2.0, 3.0), OVERCONFIDENT, None)
    assert (np.linalg.eigvalsh(covariance) > 0).all()


@pytest.mark.parametrize("turn", [0.0, 1.3, -3.1])
def test_covariance_does_not_depend_on_the_scan_frame(turn: float) -> None:
    poses = [Pose2(0.3 * k, 0.1 * np.sin(k), 0.2 * k) for k in range(12)]
    frame, covariances = Pose2(5.0, -3.0, turn), []
    match_covariance = np.array(((4e-4, 1e-5, 0.0), (1e-5, 5e-5, 2e-6), (0.0, 2e-6, 9e-6)))
    for from_frame in (Pose2(0.0, 0.0, 0.0), frame):
        estimator, covariance = CovarianceEstimator(), OVERCONFIDENT
        for k, pose in enumerate(poses):
            estimator.propagate_poses(from_frame.compose(Pose2(0.29 * k, 0.0, 0.2 * k)), match_covariance)
            covariance = estimator.estimate(pose, OVERCONFIDENT, GOOD_FIT)
        covariances.append(covariance)
    assert np.allclose(*covariances)


def test_covariance_grows_with_the_observed_odometry_error() -> None:
    slipping_robot, gripping_robot, turn = CovarianceEstimator(), CovarianceEstimator(), Pose2(0.0, 0.0, 0.3)
    for _ in range(200):
        slipping_robot.learn_odometry_error(Pose2(0.2, 0.0, 0.0), Pose2(0.25, 0.0, 0.02))
        gripping_robot.learn_odometry_error(Pose2(0.25, 0.0, 0.0), Pose2(0.25, 0.0, 0.0))
    step = Pose2(0.25, 0.0, 0.0)
    wrong, right = (estimator.propagate(np.zeros((3, 3)), 0.4, step) for estimator in (slipping_robot, gripping_robot))
    assert np.sqrt(np.diag(wrong)) == pytest.approx((0.035, 0.035, 0.02), rel=0.1)
    assert (np.sqrt(np.diag(right)) < (0.008, 0.008, 0.008)).all()
    with_heading_error = gripping_robot.propagate(np.diag([0.0, 0.0, 0.01]), 0.0, step)
    assert with_heading_error[1, 1] == pytest.approx(0.01 * 0.25**2 + right[1, 1], rel=0.01)
    assert (np.diag(slipping_robot.propagate(np.zeros((3, 3)), 0.0, turn)) > 0).all()
