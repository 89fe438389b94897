"""Tests of the pose prior, the distribution of poses that the robot can have reached by odometry and scan matching."""

import numpy as np
import pytest

from simscen.advanced.localizers.matched_motion import MatchedMotion, sample_motion
from simscen.advanced.localizers.pose_prior import (
    CERTAIN_STD,
    MAX_MATCHED_STEP_STD_M,
    ODOMETRY_DRIFT,
    ObservedMotion,
    PosePrior,
)
from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.particles import pose_errors

START = Pose2(1.0, 2.0, np.pi / 2)
PRIOR = PosePrior.at(np.array([5.0, 5.0, 0.0]), START)
BASE = START.compose(Pose2(2.0, 1.0, 0.3))
"""Base pose by scan matching after a drive from START."""
STEP = MatchedMotion(Pose2(0.25, 0.0, 0.1), np.array([[4e-5, 1e-5, 0.0], [1e-5, 3e-5, 1e-5], [0.0, 1e-5, 2e-5]]))


def disagreeing_motion(scan_motion: Pose2, disagreement: Pose2) -> ObservedMotion:
    """Return a motion by scan matching that differs by `disagreement` from the motion by odometry."""
    return ObservedMotion(scan_motion.compose(disagreement.inverse()), MatchedMotion(scan_motion, np.zeros((3, 3))))


def cost_of_error(prior: PosePrior, base: Pose2, error: Array) -> float:
    return float(prior.negative_log_likelihood((prior.expected(base) + error)[None], base)[0])


def test_expected_pose_follows_matched_scans() -> None:
    assert PRIOR.expected(BASE) == pytest.approx([7.0, 6.0, 0.3])
    assert cost_of_error(PRIOR, BASE, np.zeros(3)) == pytest.approx(0.0)


@pytest.mark.parametrize("error", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.1), (0.2, -0.1, 0.05)])
def test_step_errors_accumulate_as_in_simulation(error: tuple[float, ...]) -> None:
    rng, base = np.random.default_rng(1), START
    prior = PosePrior.at(np.array([5.0, 5.0, 0.7]), START, (1e-6, 1e-6, 1e-6))
    poses = np.tile(np.array(prior.pose), (20_000, 1))
    for _ in range(20):
        poses, last_base, base = sample_motion(poses, STEP, rng), base, base.compose(STEP.delta)
        prior = prior.propagate(last_base, base, 0.3, ObservedMotion(step=STEP))
    errors = pose_errors(prior.expected(base), poses)
    delta, covariance = np.array(error), errors.T @ errors / len(poses)
    assert cost_of_error(prior, base, delta) == pytest.approx(0.5 * delta @ np.linalg.inv(covariance) @ delta, rel=0.05)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("motion", "drift"),
    [
        (ObservedMotion(), (10 * ODOMETRY_DRIFT[0], 10 * ODOMETRY_DRIFT[0], 10 * ODOMETRY_DRIFT[1])),
        (
            disagreeing_motion(STEP.delta, Pose2(0.3, -0.4, 0.2)),
            (0.5, 0.5, 0.2),
        ),
        (
            ObservedMotion(step=MatchedMotion(STEP.delta, np.diag([(4 * MAX_MATCHED_STEP_STD_M) ** 2, 0.0, 0.0]))),
            (3 * MAX_MATCHED_STEP_STD_M, 3 * MAX_MATCHED_STEP_STD_M, 0.0),
        ),
    ],
    ids=["no scans", "scans and odometry disagree", "endless corridor"],
)
def test_step_errors_are_correlated_without_scan_matches(
    axis: int, motion: ObservedMotion, drift: tuple[float, float, float]
) -> None:
    """Systematic errors double with the distance, random errors grow by √2, and errors of a step are added."""
    prior = PRIOR.propagate(START, START, 10.0, motion).propagate(START, START, 10.0, motion)
    variance = 0.0 if motion.step is None else 2 * motion.step.covariance[axis, axis]
    error = np.eye(3)[axis] * 2 * np.sqrt((CERTAIN_STD[axis] + 2 * drift[axis]) ** 2 + variance)
    assert cost_of_error(prior, START, error) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("scan_motion", "disagreement", "expected"),
    [(0.25, 0.0, False), (0.16, -0.09, False), (0.05, -0.2, True), (0.5, 0.25, True), (0.0, -0.08, False)],
    ids=["agreement", "wheel slip", "people walk along", "people approach", "almost no motion"],
)
def test_scan_difference_beyond_slip_indicates_moving_surroundings(
    scan_motion: float, disagreement: float, expected: bool
) -> None:
    motion = disagreeing_motion(Pose2(scan_motion, 0.0, 0.0), Pose2(disagreement, 0.0, 0.0))
    assert motion.is_scene_moving is expected


def test_odometry_without_scans_is_accepted() -> None:
    assert not ObservedMotion(odometry=Pose2(1.0, 0.0, 0.0)).is_scene_moving
