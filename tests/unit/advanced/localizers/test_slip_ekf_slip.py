"""Tests of the slip EKF with locked, spinning, and slipping wheels."""

import math

import numpy as np
import pytest
from scipy import stats

from simscen.advanced.spec import SlipEkf
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.testing.synthetic_room import build_localizer, nees

RATE, PERIOD_TICKS = 40, 6


def replay_drive(
    spec: SlipEkf, twists: Array, wheels: Array, gyro: Array, start: Pose2 | None = None
) -> tuple[Belief, Array]:
    """Return the final belief of the EKF and the error of its pose.

    `twists` (n, 3) are the true velocities vx, vy, wz at 40 Hz, `wheels` (n, 3) the velocities from odometry, and
    `gyro` (n,) the yaw rates of the gyroscope.
    """
    localizer = build_localizer(spec, Estimate(start or Pose2(0, 0, 0), (0.0, 0.0, 0.0)), 1)
    true_pose = reported = Pose2(0, 0, 0)
    localizer.on_odometry(Odometry("odom", 0, reported, Twist()))
    for k in range(len(twists)):
        true_pose, reported = true_pose.compose(_displacement(twists[k])), reported.compose(_displacement(wheels[k]))
        localizer.on_imu(Imu("imu", PERIOD_TICKS * (k + 1), (0.0, 0.0, float(gyro[k])), (0.0, 0.0, 9.81)))
        localizer.on_odometry(Odometry("odom", PERIOD_TICKS * (k + 1), reported, Twist()))
    error = np.array(localizer.belief.pose) - np.array(true_pose)
    return localizer.belief, np.array([error[0], error[1], math.remainder(error[2], 2 * math.pi)])


def _displacement(twist: Array) -> Pose2:
    """Return the motion of one period at a constant twist."""
    vx, vy, wz = (twist / RATE).tolist()
    c, s = math.cos(wz / 2), math.sin(wz / 2)
    return Pose2(c * vx - s * vy, s * vx + c * vy, wz)


def circle(seconds: float = 4.0) -> Array:
    """Return the twists of a drive at 0.4 m/s and 1 rad/s."""
    return np.tile([0.4, 0.0, 1.0], (round(seconds * RATE), 1))


def test_locked_wheels_in_a_turn_are_detected() -> None:
    """The wheels stop for one second while the robot slides: the heading stays correct, and the covariance grows."""
    truth = circle()
    reported = truth.copy()
    reported[60:100] = 0.0
    spec = SlipEkf(type="slip_ekf", gyro_noise=0.005)
    belief, error = replay_drive(
        spec, truth, reported, truth[:, 2] + np.random.default_rng(1).normal(0, 0.005, len(truth))
    )
    assert abs(error[2]) < 0.02
    assert nees(belief, error) < stats.chi2.ppf(0.999, 3)
    assert math.hypot(*error[:2]) > 0.2  # no sensor measures the slide
    assert np.sqrt(np.trace(belief.covariance[:2, :2])) > 0.2  # the covariance must cover the slide


def test_spinning_wheels_do_not_turn_the_estimate() -> None:
    reported = circle()
    truth = np.zeros_like(reported)
    belief, error = replay_drive(
        SlipEkf(type="slip_ekf"), truth, reported, np.random.default_rng(2).normal(0, 0.005, len(truth))
    )
    assert abs(error[2]) < 0.02
    assert nees(belief, error) < stats.chi2.ppf(0.999, 3)


def test_locked_wheels_do_not_change_the_gyro_bias() -> None:
    """After one second of locked wheels, the heading error stays small."""
    truth = circle(8.0)
    reported = truth.copy()
    reported[100:140] = 0.0
    bias = 0.004
    belief, error = replay_drive(SlipEkf(type="slip_ekf"), truth, reported, truth[:, 2] + bias)
    assert abs(error[2]) < 0.04
    assert abs(error[2]) < 4 * math.sqrt(belief.covariance[2, 2])


def test_position_variance_stops_growing_after_slip() -> None:
    """The position variance grows while the wheels slip, and hardly afterward."""

    def position_std(seconds: float) -> float:
        truth = circle(seconds)
        reported = truth.copy()
        reported[60:100] = 0.0
        belief, _ = replay_drive(SlipEkf(type="slip_ekf"), truth, reported, truth[:, 2])
        return float(np.sqrt(np.trace(belief.covariance[:2, :2])))

    before, after, later = position_std(1.5), position_std(2.5), position_std(5.0)
    assert after > 10 * before
    assert later < 1.5 * after


def test_gyro_bias_variance_has_a_floor() -> None:
    """The variance must not vanish after ten minutes at rest, as the filter could not follow a drifting bias."""
    n = 600 * RATE // 10  # at 4 Hz, for a short run time
    localizer = build_localizer(SlipEkf(type="slip_ekf"), Estimate(Pose2(0, 0, 0), (0.0, 0.0, 0.0)), 1)
    for k in range(n):
        localizer.on_imu(Imu("imu", 60 * k, (0.0, 0.0, 0.003), (0.0, 0.0, 9.81)))
        localizer.on_odometry(Odometry("odom", 60 * k, Pose2(0, 0, 0), Twist()))
    assert abs(localizer.belief.pose.yaw) < 3 * math.sqrt(localizer.belief.covariance[2, 2])
    state, variance = localizer._filter.x, localizer._filter.P
    assert state[4] == pytest.approx(0.003, abs=1e-3)
    assert variance[4, 4] > 1e-9


CASES = [  # precise robot, imprecise odometry with a good gyroscope, fast robot with a poor gyroscope
    {"speed": 0.5, "translation": 0.01, "rotation": 0.01, "gyro": 0.002, "bias": 0.002},
    {"speed": 0.8, "translation": 0.05, "rotation": 0.1, "gyro": 0.002, "bias": 0.002},
    {"speed": 2.0, "translation": 0.02, "rotation": 0.03, "gyro": 0.02, "bias": 0.01},
]
DURATION_S = 5.0


def replay_random_drive(case: dict[str, float], slip: float, seed: int) -> tuple[Belief, Array]:
    """Replay a drive in bends with the specified noise and slips of about a second."""
    rng = np.random.default_rng((seed, round(1000 * slip)))
    n, dt = round(DURATION_S * RATE), 1 / RATE
    t = np.arange(n) * dt
    phase, frequency = rng.uniform(0, 6.3), rng.uniform(0.3, 1.0)
    truth = np.column_stack((np.full(n, case["speed"]), np.zeros(n), 1.2 * np.sin(frequency * t * 2 + phase)))
    distance, turn = np.abs(truth[:, 0]) * dt, np.abs(truth[:, 2]) * dt
    reported = truth.copy()
    reported[:, 0] += rng.normal(0, case["translation"] * np.sqrt(distance)) / dt
    reported[:, 2] += rng.normal(0, case["rotation"] * np.sqrt(distance + turn)) / dt
    share = rng.normal(0, slip)
    for k in range(n):
        truth[k, 0] *= 1 + share
        share = share * math.exp(-dt) + rng.normal(0, slip * math.sqrt(1 - math.exp(-2 * dt)))
    bias = rng.normal(0, case["bias"])
    spec = SlipEkf(
        type="slip_ekf", translation_noise=case["translation"], rotation_noise=case["rotation"],
        gyro_noise=case["gyro"],
        gyro_bias=case["bias"], gyro_bias_walk=0.0, wheel_slip=slip,
    )  # fmt: skip
    return replay_drive(spec, truth, reported, truth[:, 2] + bias + rng.normal(0, case["gyro"], n))


@pytest.mark.sample(2)
@pytest.mark.parametrize("slip", [0.0, 0.2])
@pytest.mark.parametrize("case", CASES, ids=["precise", "imprecise odometry", "fast"])
def test_covariance_is_consistent_with_and_without_slip(case: dict[str, float], slip: float, is_quick: bool) -> None:
    """The sum of NEES values has a chi-square distribution; a consistent filter fails 1 of 1000 such tests."""
    runs = 10 if is_quick else 25
    values = [nees(*replay_random_drive(case, slip, seed)) for seed in range(1000, 1000 + runs)]
    low, high = stats.chi2.ppf([0.0005, 0.9995], 3 * runs)
    assert low <= np.sum(values) <= high
