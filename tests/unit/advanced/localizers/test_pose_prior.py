"""Tests of the pose prior, which bounds the drift of the robot."""

import numpy as np
import pytest

from simscen.advanced.localizers.pose_prior import (
    CERTAIN_STD,
    KNOWN_STEP_STD_M,
    ODOMETRY_DRIFT,
    ObservedMotion,
    PosePrior,
)
from simscen.advanced.localizers.scan_matcher import Step, sample_step
from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.particles import pose_errors

THEN = Pose2(1.0, 2.0, np.pi / 2)
SURE = PosePrior.at(np.array([5.0, 5.0, 0.0]), THEN)
NOW = THEN.compose(Pose2(2.0, 1.0, 0.3))
STEP = Step(Pose2(0.25, 0.0, 0.1), np.array([[4e-5, 1e-5, 0.0], [1e-5, 3e-5, 1e-5], [0.0, 1e-5, 2e-5]]))


def far(sure: PosePrior, base: Pose2, off: Array) -> float:
    return float(sure.negative_log_likelihood((sure.expected(base) + off)[None], base)[0])


def test_expected_pose_follows_matched_scans() -> None:
    assert SURE.expected(NOW) == pytest.approx([7.0, 6.0, 0.3])
    assert far(SURE, NOW, np.zeros(3)) == pytest.approx(0.0)


@pytest.mark.parametrize("off", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.1), (0.2, -0.1, 0.05)])
def test_step_errors_accumulate_as_in_simulation(off: tuple[float, ...]) -> None:
    rng, base, sure = (
        np.random.default_rng(1),
        THEN,
        PosePrior.at(np.array([5.0, 5.0, 0.7]), THEN, (1e-6, 1e-6, 1e-6)),
    )
    robots = np.tile(np.array(sure.pose), (20_000, 1))
    for _ in range(20):
        robots, before, base = sample_step(robots, STEP, rng), base, base.compose(STEP.delta)
        sure = sure.after(before, base, 0.3, ObservedMotion(step=STEP))
    off_by = pose_errors(sure.expected(base), robots)
    aside, spread = np.array(off), off_by.T @ off_by / len(robots)
    assert far(sure, base, aside) == pytest.approx(0.5 * aside @ np.linalg.inv(spread) @ aside, rel=0.05)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("way", "drift"),
    [
        (ObservedMotion(), (10 * ODOMETRY_DRIFT[0], 10 * ODOMETRY_DRIFT[0], 10 * ODOMETRY_DRIFT[1])),
        (ObservedMotion(disagreement=Pose2(0.3, -0.4, 0.2), step=Step(STEP.delta, np.zeros((3, 3)))), (0.5, 0.5, 0.2)),
        (
            ObservedMotion(step=Step(STEP.delta, np.diag([(4 * KNOWN_STEP_STD_M) ** 2, 0.0, 0.0]))),
            (3 * KNOWN_STEP_STD_M, 3 * KNOWN_STEP_STD_M, 0.0),
        ),
    ],
    ids=["unseen", "torn", "a corridor without an end"],
)
def test_step_errors_are_correlated_without_scan_matches(
    axis: int, way: ObservedMotion, drift: tuple[float, float, float]
) -> None:
    """Systematic errors double with the distance, random errors grow by √2, and errors of a step are added."""
    sure = SURE.after(THEN, THEN, 10.0, way).after(THEN, THEN, 10.0, way)
    rng = 0.0 if way.step is None else 2 * way.step.covariance[axis, axis]
    off = np.eye(3)[axis] * 2 * np.sqrt((CERTAIN_STD[axis] + 2 * drift[axis]) ** 2 + rng)
    assert far(sure, THEN, off) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("seen", "torn", "led"),
    [(0.25, 0.0, False), (0.16, -0.09, False), (0.05, -0.2, True), (0.5, 0.25, True), (0.0, -0.08, False)],
    ids=["agreed", "wheels slip", "people walk along", "people come towards it", "hardly sample_step"],
)
def test_scan_difference_beyond_slip_indicates_moving_surroundings(seen: float, torn: float, led: bool) -> None:
    assert (
        ObservedMotion(
            disagreement=Pose2(torn, 0.0, 0.0), step=Step(Pose2(seen, 0.0, 0.0), np.zeros((3, 3)))
        ).is_scene_moving
        is led
    )


def test_odometry_without_scans_is_accepted() -> None:
    assert not ObservedMotion(disagreement=Pose2(1.0, 0.0, 0.0)).is_scene_moving
