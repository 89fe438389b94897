"""A robot whose scans err together is as unsure as its poses scatter about the way that it saw itself go."""

import numpy as np
import pytest

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.scatter import COUNTED, Scatter

STEP = Pose2(0.25, 0.0, 0.05)
ERROR = np.array([0.05, 0.02, 0.01])
"""m, m, rad: standard deviations of errors that last for some corrections."""
TOO_SURE = np.diag(np.square((0.01, 0.01, 0.005)))


def told(seed: int, lasting: float, error: Array, particles: Array) -> tuple[Array, Array]:
    """The last error (3,) and covariance (3, 3) of a drive; `lasting` is the correlation of one error with the next."""
    chance, scatter = np.random.default_rng(seed), Scatter()
    truth, off, covariance = Pose2(3.0, -2.0, 1.0), error * chance.standard_normal(3), particles
    start = truth
    for _ in range(3 * COUNTED):
        truth = truth.compose(STEP)
        off = lasting * off + np.sqrt(1 - lasting**2) * error * chance.standard_normal(3)
        x, y, yaw = (np.array(truth) + off).tolist()
        covariance = scatter.widened(Pose2(x, y, yaw), particles, start.between(truth))
    return off, covariance


@pytest.mark.parametrize("lasting", [0.6, 0.9, 0.97])
def test_the_squared_error_is_about_what_it_is_said_to_be_although_the_particles_are_far_too_sure(
    lasting: float,
) -> None:
    """3 is right; opinions that err each on their own differ by twice what one is off by."""
    drives = [told(seed, lasting, ERROR, TOO_SURE) for seed in range(100)]
    nees = np.array([error @ np.linalg.solve(covariance, error) for error, covariance in drives])
    assert 0.8 < nees.mean() < 4.5
    assert np.mean([error @ np.linalg.solve(TOO_SURE, error) for error, _ in drives]) > 15


def test_particles_that_are_less_sure_than_the_poses_scatter_are_believed_less() -> None:
    _, covariance = told(1, 0.7, ERROR / 10, TOO_SURE * 25)
    assert 0 < np.trace(covariance) < np.trace(TOO_SURE * 25) / 2


def test_the_first_correction_has_a_covariance_too() -> None:
    covariance = Scatter().widened(Pose2(1.0, 2.0, 3.0), TOO_SURE, Pose2(0.0, 0.0, 0.0))
    assert (np.linalg.eigvalsh(covariance) > 0).all()


@pytest.mark.parametrize("turn", [0.0, 1.3, -3.1])
def test_it_is_the_same_wherever_the_frame_of_the_scans_lies(turn: float) -> None:
    poses = [Pose2(0.3 * k, 0.1 * np.sin(k), 0.2 * k) for k in range(12)]
    frame, found = Pose2(5.0, -3.0, turn), []
    for from_frame in (Pose2(0.0, 0.0, 0.0), frame):
        scatter = Scatter()
        found.append([scatter.widened(pose, TOO_SURE, from_frame.compose(Pose2(0.29 * k, 0.0, 0.2 * k)))
                      for k, pose in enumerate(poses)][-1])  # fmt: skip
    assert np.allclose(*found)


def test_between_corrections_it_grows_as_odometry_was_seen_to_err() -> None:
    slipping, holding, turn = Scatter(), Scatter(), Pose2(0.0, 0.0, 0.3)
    for _ in range(200):
        slipping.compare(Pose2(0.2, 0.0, 0.0), Pose2(0.25, 0.0, 0.02))
        holding.compare(Pose2(0.25, 0.0, 0.0), Pose2(0.25, 0.0, 0.0))
    step = Pose2(0.25, 0.0, 0.0)
    wrong, right = (scatter.carry(np.zeros((3, 3)), 0.4, step) for scatter in (slipping, holding))
    assert np.sqrt(np.diag(wrong)) == pytest.approx((0.035, 0.035, 0.02), rel=0.1)
    assert (np.sqrt(np.diag(right)) < (0.008, 0.008, 0.008)).all()
    swung = holding.carry(np.diag([0.0, 0.0, 0.01]), 0.0, step)
    assert swung[1, 1] == pytest.approx(0.01 * 0.25**2 + right[1, 1], rel=0.01)
    assert (np.diag(slipping.carry(np.zeros((3, 3)), 0.0, turn)) > 0).all()
