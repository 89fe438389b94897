"""Tests of scan matching: measured motion, fallback to odometry, and detection of kidnapping."""

import numpy as np
import pytest

from simscen.advanced.localizers.matched_motion import MatchedMotion, sample_motion
from simscen.advanced.localizers.scan_matcher import ScanMatcher
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.testing.synthetic_room import BEAMS, cast, scan

ANGLES = -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
START, STEP, ELSEWHERE = Pose2(-2.5, -1.8, 0.6), Pose2(0.3, 0.02, 0.15), Pose2(3.9, -0.2, 2.4)


def scan_from(pose: Pose2, boxes: np.ndarray | None = None) -> Scan:
    arguments = (np.array([pose]), ANGLES) if boxes is None else (np.array([pose]), ANGLES, boxes)
    return scan(cast(*arguments)[0])


def match(guess: Pose2, before: Scan, after: Scan) -> MatchedMotion | None:
    """Return the motion between two scans; `guess` is the motion by odometry."""
    matcher = ScanMatcher()
    matcher.step(before, Pose2(0, 0, 0))
    return matcher.step(after, guess)


@pytest.mark.parametrize("guess", [STEP, Pose2(0.4, 0.0, 0.2), Pose2(0.2, 0.0, 0.05)])
def test_scan_matching_measures_a_step_within_2_cm_despite_slip(guess: Pose2) -> None:
    step = match(guess, scan_from(START), scan_from(START.compose(STEP)))
    assert step is not None
    error = STEP.between(step.delta)
    assert np.hypot(error.x, error.y) < 0.02
    assert abs(error.yaw) < 0.006


def test_odometry_determines_motion_along_an_endless_corridor() -> None:
    walls = np.array([(-100.0, 1.0, 100.0, 1.1), (-100.0, -1.1, 100.0, -1.0)])
    step = match(Pose2(0.3, 0.1, 0.0), scan_from(Pose2(0, 0, 0), walls), scan_from(Pose2(0.25, 0, 0), walls))
    assert step is not None
    assert step.delta.x == pytest.approx(0.3, abs=0.01)
    assert step.delta.y == pytest.approx(0.0, abs=0.01)
    assert step.covariance[0, 0] > 10 * step.covariance[1, 1]


@pytest.mark.parametrize("odometry_m", [0.25, 0.21, 0.3])
def test_person_ahead_in_a_corridor_does_not_bias_the_match(odometry_m: float) -> None:
    """Regression: the person had more beams than the wall at the end of the corridor, and the match was 0.03 m."""
    corridor = (-100.0, 1.0, 9.0, 1.1), (-100.0, -1.1, 9.0, -1.0), (9.0, -1.1, 9.1, 1.1)
    before, after = (np.array([*corridor, (2.0 + shift, -0.2, 2.3 + shift, 0.2)]) for shift in (0.0, 0.25))
    step = match(Pose2(odometry_m, 0, 0), scan_from(Pose2(0, 0, 0), before), scan_from(Pose2(0.25, 0, 0), after))
    assert step is not None
    assert tuple(step.delta) == pytest.approx((odometry_m, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize("ranges", [np.full(BEAMS, np.inf), np.full(BEAMS, np.nan), np.full(40, 2.0), np.empty(0)])
def test_scans_without_surfaces_give_no_match(ranges: np.ndarray) -> None:
    assert match(STEP, scan(ranges), scan(ranges)) is None
    assert match(STEP, scan_from(START), scan(ranges)) is None


@pytest.mark.parametrize(
    ("pose", "expected"),
    [(START.compose(STEP), False), (START.compose(Pose2(0.3, 0.02, 0.4)), False), (ELSEWHERE, True)],
    ids=["as in odometry", "wheel slip", "kidnapped"],
)
def test_kidnapped_robot_sees_no_known_surfaces(pose: Pose2, expected: bool) -> None:
    matcher = ScanMatcher()
    matcher.step(scan_from(START), Pose2(0, 0, 0))
    assert matcher.was_carried is None
    matcher.step(scan_from(pose), STEP)
    assert matcher.was_carried is expected
    matcher.step(scan_from(pose.compose(STEP)), STEP)
    assert matcher.was_carried is False


@pytest.mark.parametrize("ranges", [np.full(BEAMS, np.inf), np.full(40, 2.0)], ids=["no returns", "40 beams"])
def test_empty_scan_does_not_indicate_a_kidnapping(ranges: np.ndarray) -> None:
    matcher = ScanMatcher()
    matcher.step(scan(ranges), Pose2(0, 0, 0))
    matcher.step(scan(ranges), STEP)
    assert matcher.was_carried is None


def test_particles_follow_a_step_with_its_covariance() -> None:
    step = MatchedMotion(STEP, np.diag([0.01, 0.0004, 0.0001]))
    poses = sample_motion(np.tile((1.0, 2.0, np.pi / 2), (20_000, 1)), step, np.random.default_rng(1))
    assert poses.mean(axis=0) == pytest.approx((1 - 0.02, 2.3, np.pi / 2 + 0.15), abs=0.003)
    assert poses.std(axis=0) == pytest.approx((0.02, 0.1, 0.01), rel=0.03)


def test_particle_spread_equals_the_covariance_of_the_step() -> None:
    """The random numbers of the three particles are unit vectors, so their errors give the covariance."""

    class UnitNormals(np.random.Generator):
        def standard_normal(self, size: object = None, *_: object, **__: object) -> Array:  # type: ignore[override]
            return np.eye(3)

    rng = np.random.default_rng(4)
    for _ in range(20):
        root = rng.normal(size=(3, 3)) * 0.05
        covariance, delta = root @ root.T + np.diag((1e-6, 1e-6, 1e-6)), Pose2(0.3, 0.1, -0.2)
        after = sample_motion(np.zeros((3, 3)), MatchedMotion(delta, covariance), UnitNormals(np.random.PCG64(1)))
        error = (after - np.array(delta)).T
        assert error @ error.T == pytest.approx(covariance, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(
    ("guess", "expected"), [(STEP, True), (Pose2(1.0, 0.0, 0.15), None), (Pose2(0.3, 0.02, 1.0), None)]
)
def test_little_overlap_after_a_long_step_is_not_a_kidnapping(guess: Pose2, expected: bool | None) -> None:
    """Scans that are far apart share few surfaces. Odometry measures a long step, but not a kidnapping."""
    matcher = ScanMatcher()
    matcher.step(scan_from(START), Pose2(0, 0, 0))
    matcher.step(scan_from(ELSEWHERE), guess)
    assert matcher.was_carried is expected
