"""Every localizer keeps the promises of simscen.stack.protocols.Localizer."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "stack" / "localizers"))
from simscen.core.belief import Belief, Estimate
from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.sensing import Imu, Odometry
from simscen.model.stack import Amcl, Ekf, GroundTruth, OdometryOnly
from simscen.model.stack import Localizer as Spec
from simscen.testing.room import BEAMS, Drive, Noise, drive, errors, localizer, record, run, scan

SPECS: dict[str, Spec] = {
    "amcl": Amcl(),
    "amcl omni": Amcl(robot_model="omni", update_min_d=0.0, update_min_a=0.0),
    "amcl prob": Amcl(laser_model_type="likelihood_field_prob", do_beamskip=True, selective_resampling=True),
    "amcl beam": Amcl(laser_model_type="beam", min_particles=100, max_particles=300, resample_interval=2),
    "amcl recovering": Amcl(recovery_alpha_slow=0.001, recovery_alpha_fast=0.1),
    "amcl cocksure": Amcl(laser_model_type="likelihood_field_prob", z_rand=0.0, sigma_hit=0.001, max_beams=2000),
    "ekf": Ekf(type="ekf"),
    "ekf noiseless": Ekf(type="ekf", translation_noise=0.0, rotation_noise=0.0, gyro_noise=0.0),
    "ground_truth": GroundTruth(type="ground_truth"),
    "odometry": OdometryOnly(type="odometry"),
}
SHORT = drive(6.0)
HERE = Estimate(Pose2(*SHORT.truth[0]), (0.1, 0.1, 0.05))
every = pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)


def sane(belief: Belief) -> bool:
    """Finite, symmetric, positive semidefinite, weights that add up to one."""
    covariance, weights = belief.covariance, belief.particles[:, 3]
    finite = np.isfinite([*belief.pose, *belief.map_from_odom]).all() and np.isfinite(covariance).all()
    semidefinite = np.linalg.eigvalsh(covariance).min() >= -1e-9 * np.trace(covariance)
    return bool(
        finite and np.isfinite(belief.particles).all() and np.allclose(covariance, covariance.T) and semidefinite
        and (not len(weights) or abs(weights.sum() - 1) < 1e-9)
    )  # fmt: skip


@every
@pytest.mark.parametrize("pose", [HERE.pose, None])
def test_the_same_calls_give_the_same_answers_bit_for_bit(spec: Spec, pose: Pose2 | None) -> None:
    first, again = (run(localizer(spec, Estimate(pose), 3), SHORT, 4, imu=True) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        assert one.pose == other.pose
        assert one.map_from_odom == other.map_from_odom
        assert np.array_equal(one.covariance, other.covariance)
        assert np.array_equal(one.particles, other.particles)


@every
def test_no_motion_and_perfect_readings_do_not_make_the_belief_wander_off(spec: Spec) -> None:
    still = record(np.tile(SHORT.truth[:1], (400, 1)))
    silent = Noise(lidar=0, translation=0, rotation=0, drift=0, gyro=0, gyro_bias=0)
    beliefs = run(localizer(spec, Estimate(HERE.pose, (0.02, 0.02, 0.01)), 1), still, 1, silent, imu=True)
    error = errors(beliefs, still.truth)
    assert np.abs(error[:, :2]).max() < 0.05
    assert np.abs(error[:, 2]).max() < 0.03
    assert beliefs[-1].pose == pytest.approx(beliefs[0].pose, abs=0.05)


@every
def test_a_belief_does_not_change_after_it_was_given(spec: Spec) -> None:
    subject = localizer(spec, HERE, 1)
    subject.on_odometry(Odometry("odom", 0, Pose2(0, 0, 0), Twist()))
    belief = subject.belief
    covariance, particles = belief.covariance.copy(), belief.particles.copy()
    for k in range(1, 20):
        subject.on_odometry(Odometry("odom", 24 * k, Pose2(0.3 * k, 0, 0.1 * k), Twist()))
        subject.on_scan(scan(SHORT.ranges[k], 24 * k))
    assert np.array_equal(belief.covariance, covariance)
    assert np.array_equal(belief.particles, particles)


@every
def test_a_scan_is_neither_changed_nor_kept_to_be_changed_later(spec: Spec) -> None:
    subject, ranges = localizer(spec, HERE, 1), SHORT.ranges[0].copy()
    subject.on_scan(scan(ranges, 24))
    assert np.array_equal(ranges, SHORT.ranges[0])
    ranges[:] = np.nan
    subject.on_odometry(Odometry("odom", 24, Pose2(0, 0, 0), Twist()))
    other = localizer(spec, HERE, 1)
    other.on_odometry(Odometry("odom", 24, Pose2(0, 0, 0), Twist()))
    other.on_scan(scan(SHORT.ranges[0], 24))
    assert subject.belief.pose == other.belief.pose


def lies(seed: int) -> np.ndarray:
    """Ranges that no lidar should give, of a different kind for each seed."""
    chance = np.random.default_rng(seed)
    kinds = [np.nan, np.inf, -np.inf, 0.0, -5.0, 1e300, 12.0, 0.05, 3.0]
    wild = chance.choice([np.nan, np.inf, -1.0, 1e9, 2.0, 0.3], BEAMS)
    return np.full(BEAMS, kinds[seed]) if seed < len(kinds) else chance.choice([wild, chance.uniform(0, 12, BEAMS)])


@every
@pytest.mark.parametrize("start", [HERE, Estimate(None)], ids=["told", "untold"])
def test_a_lidar_that_is_blind_or_lies_never_makes_the_belief_insane(spec: Spec, start: Estimate) -> None:
    subject = localizer(spec, start, 2)
    for k in range(30):
        subject.on_odometry(Odometry("odom", 24 * k, Pose2(0.3 * k, 0.01 * k, 0.3 * k), Twist()))
        subject.on_scan(scan(lies(k % 14), 24 * k))
        assert sane(subject.belief), f"after lie {k}"


@every
def test_odometry_and_gyroscope_that_lie_never_make_the_belief_insane(spec: Spec) -> None:
    subject, chance = localizer(spec, HERE, 2), np.random.default_rng(5)
    for k in range(40):
        x, y, yaw = chance.choice([0.0, np.nan, np.inf, -np.inf, 1e300, -9e5, 4.0, 1e-300], 3).tolist()
        subject.on_imu(Imu("imu", 24 * k, (0.0, 0.0, chance.choice([np.nan, np.inf, 99.0, -1e9])), (0.0, 0.0, 9.8)))
        subject.on_odometry(Odometry("odom", 24 * k, Pose2(x, y, yaw), Twist()))
        subject.on_scan(scan(SHORT.ranges[k % 20], 24 * k))
        assert sane(subject.belief), f"after lie {k}"


@every
def test_scans_of_any_size_range_and_place_are_taken(spec: Spec) -> None:
    subject = localizer(spec, HERE, 2)
    sizes = [0, 1, 2, 3, 59, 60, 61, 4096]
    for k, size in enumerate(sizes):
        subject.on_odometry(Odometry("odom", 24 * k, Pose2(0.3 * k, 0, 0), Twist()))
        limits = {"range_max": [12.0, 0.0, np.nan, 1e6][k % 4], "mount": Pose2(0.3, -2.0, 5.0)}
        subject.on_scan(scan(np.full(size, 2.0), 24 * k, **limits))
        assert sane(subject.belief)


@every
def test_a_reset_forgets_everything(spec: Spec) -> None:
    used = localizer(spec, Estimate(Pose2(3, 3, 3)), 1)
    run(used, Drive(SHORT.truth[:80], SHORT.steps[:80], SHORT.ranges[:20]), 1, imu=True)
    used.reset(HERE)
    assert used.belief.pose == HERE.pose
    assert np.allclose(used.belief.covariance, np.diag(np.square(HERE.std)))
    used.on_odometry(Odometry("odom", 0, Pose2(-8, 4, 2), Twist()))
    assert used.belief.pose == pytest.approx(HERE.pose)
