"""Tests of the odometry filter: accuracy, an independent reference filter, consistency, and invalid readings."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy import stats

from simscen.core.clock import Clock
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.core.random_streams import Streams
from simscen.model import sensors
from simscen.model.localizers import OdometryFilter as Spec
from simscen.model.robot import Omnidirectional
from simscen.model.stack import StackSpec
from simscen.sensors.imu import ImuSensor
from simscen.sensors.odometry import WheelOdometrySensor, integrate_arc
from simscen.sensors.sensor import SensorSetting
from simscen.stack.build import build_stack
from simscen.stack.localizers.odometry_filter import GyroscopeIntegral, OdometryFilter
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import round_robot

TICK_RATE_HZ = 240
DRIVE = Omnidirectional(type="omnidirectional")
EXACT_WHEELS = sensors.WheelOdometry(translation_noise=0.0, rotation_noise=0.0, drift_noise=0.0)
EXACT_IMU = sensors.InertialUnit(gyro_noise=0.0, gyro_bias=0.0)


class View:
    """SensorView of the robot with the encoder angles and the angular velocity that the test sets."""

    wheel_angles = (0.0, 0.0, 0.0)
    angular_velocity = (0.0, 0.0, 0.0)

    def base_pose(self) -> Pose3:
        return Pose3()

    def base_velocity(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        return (0.0, 0.0, 0.0), self.angular_velocity

    def placements(self) -> int:
        return 0

    def encoders(self) -> tuple[float, ...]:
        return self.wheel_angles


class Step(NamedTuple):
    """True pose, wheel odometry, and filtered odometry at a tick."""

    truth: Pose2
    wheels: Odometry
    filtered: Odometry


def drive(
    seed: int,
    seconds: int,
    wheels: sensors.WheelOdometry | None = None,
    imu: sensors.InertialUnit | None = None,
    spec: Spec | None = None,
    odometry_rate: int = 40,
    imu_rate: int = 60,
    slip: float = 1.0,
    change: Callable[[Imu], Imu | None] = lambda reading: reading,
) -> list[Step]:
    """Return the steps of a drive with random accelerations and stops, with the sensors of the simulator.

    With `imu_rate` 0, there is no IMU. `slip` is the ratio of the turn that the wheels report to the true turn, and
    `change` replaces or drops IMU readings.
    """
    rng, view = np.random.default_rng((seed, 1)), View()
    setting = [
        SensorSetting(name, TICK_RATE_HZ // rate, 1 / rate, np.random.default_rng((seed, key)), view, None, DRIVE)  # type: ignore[arg-type]
        for key, (name, rate) in enumerate((("odom", odometry_rate), ("imu", imu_rate or 60)), start=2)
    ]
    odometer, gyro = WheelOdometrySensor(wheels or sensors.WheelOdometry(), setting[0]), None
    if imu_rate:
        gyro = ImuSensor(imu or sensors.InertialUnit(), setting[1])
    odometry_filter, steps = OdometryFilter(spec or Spec(), TICK_RATE_HZ), []
    pose, velocity, target = Pose2(0, 0), np.zeros(2), None
    for tick in range(seconds * TICK_RATE_HZ + 1):
        if tick % (2 * TICK_RATE_HZ) == 0:
            target = np.array([rng.uniform(0, 0.5), rng.uniform(-1, 1)]) * (rng.random() < 0.8)
        if tick:
            last, limit = velocity, np.array([1.0, 3.2]) / TICK_RATE_HZ
            velocity = last + np.clip(target - last, -limit, limit)
            vx, wz = (velocity + last) / 2 / TICK_RATE_HZ
            pose = pose.compose(integrate_arc(Twist(vx, 0.0, wz)))
            view.wheel_angles = (view.wheel_angles[0] + vx, 0.0, view.wheel_angles[2] + slip * wz)
            view.angular_velocity = (0.0, 0.0, velocity[1])
        if gyro is not None and tick % gyro.period == 0:
            reading = change(gyro.read(tick))
            if reading is not None:
                odometry_filter.on_imu(reading)
        if tick % odometer.period == 0:
            measured = odometer.read(tick)
            filtered = odometry_filter.fuse(measured)
            if filtered is not None:
                steps.append(Step(pose, measured, filtered))
    return steps


def pose_error(step: Step, odometry: Odometry) -> Array:
    x, y, yaw = odometry.pose
    return np.array([x - step.truth.x, y - step.truth.y, math.remainder(yaw - step.truth.yaw, math.tau)])


def nees(step: Step, odometry: Odometry) -> float:
    error_vector = pose_error(step, odometry)
    return float(error_vector @ np.linalg.solve(np.reshape(odometry.pose_covariance, (3, 3)), error_vector))


def odometry(tick: int, pose: Pose2, variance: tuple[float, float, float] = (1e-3, 0.0, 1e-3)) -> Odometry:
    return Odometry("odom", tick, pose, Twist(), variance)


def imu(tick: int, rate: float, variance: float = 4e-6) -> Imu:
    return Imu("imu", tick, (0.0, 0.0, rate), (0.0, 0.0, 9.81), variance, 1e-4)


@pytest.mark.parametrize("imu_rate", [0, 40, 60, 240])
def test_pose_without_noise_equals_wheel_odometry(imu_rate: int) -> None:
    steps = drive(1, 20, EXACT_WHEELS, EXACT_IMU, imu_rate=imu_rate)
    assert max(np.abs(pose_error(step, step.filtered)).max() for step in steps) < 3e-3
    assert max(np.abs(pose_error(step, step.wheels)).max() for step in steps) < 3e-3


def test_filter_without_an_imu_hardly_changes_odometry() -> None:
    for step in drive(2, 20, imu_rate=0):
        assert step.filtered.pose == pytest.approx(step.wheels.pose, abs=5e-3)


def test_first_filtered_odometry_equals_the_wheel_odometry() -> None:
    first = odometry(6, Pose2(1.0, 2.0, 3.0))
    assert OdometryFilter(Spec(), TICK_RATE_HZ).fuse(first) is first


@pytest.mark.slow
def test_filtered_heading_is_three_times_as_accurate_as_wheel_odometry() -> None:
    ends = [drive(seed, 20)[-1] for seed in range(7000, 7020)]
    fused, wheels = (
        np.std([pose_error(end, getattr(end, name))[2] for end in ends]) for name in ("filtered", "wheels")
    )
    assert fused < wheels / 3


CASES: dict[str, dict[str, Any]] = {
    "as shipped": {},
    "without an IMU": {"imu_rate": 0},
    "both at 40 Hz": {"imu_rate": 40},
    "odometry at 20 Hz": {"odometry_rate": 20},
    "bad wheels": {"wheels": sensors.WheelOdometry(translation_noise=0.05, rotation_noise=0.1, drift_noise=0.05)},
    "each odometry reading": {"spec": Spec(frequency=40)},
    "updates at 5 Hz": {"spec": Spec(frequency=5)},
    "a bad gyroscope": {"imu": sensors.InertialUnit(gyro_noise=0.02, gyro_bias=0.01), "spec": Spec(gyro_bias=0.01)},
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("case", CASES)
def test_the_covariance_agrees_with_the_error(case: str, is_quick: bool) -> None:
    """The average NEES after 5 and after 20 s lies within the 99.9 % bounds for three degrees of freedom."""
    runs = [drive(seed, 20, **CASES[case]) for seed in range(8000, 8010 if is_quick else 8030)]
    low, high = stats.chi2.ppf([0.0005, 0.9995], 3 * len(runs)) / len(runs)
    for share in (4, 1):
        values = [nees(steps[len(steps) // share - 1], steps[len(steps) // share - 1].filtered) for steps in runs]
        assert low < np.mean(values) < high


def test_pose_and_covariance_equal_those_of_an_independent_filter() -> None:
    """The reference filter updates in information form, and computes the pose covariance by finite differences.

    Each error source (initial bias, process noise, measurement noise) adds one column to `errors`, the resulting error
    of the velocity, and to `columns`, the resulting error of the pose.
    """
    rng, seconds = np.random.default_rng(5), 0.025
    spec = Spec(gyro_bias=0.01, gyro_bias_walk=0.002, frequency=40)
    odometry_filter, pose, steps = OdometryFilter(spec, TICK_RATE_HZ), Pose2(0, 0), []
    odometry_filter.on_imu(imu(0, 0.4))
    odometry_filter.fuse(odometry(0, pose))
    for k in range(1, 12):
        velocity, rate = Twist(0.5 + 0.1 * rng.normal(), 0.1 * rng.normal(), 0.4 + 0.02 * rng.normal()), 0.4
        pose = pose.compose(integrate_arc(Twist(*(seconds * value for value in velocity))))
        odometry_filter.on_imu(imu(6 * k, rate))
        filtered = odometry_filter.fuse(odometry(6 * k, pose, (1e-3, 2e-3, 1e-3)))
        steps.append((np.array(velocity), rate, filtered))
    matrix = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1.0]])
    process = np.diag([10.0, 10.0, 10.0, 0.002**2]) * seconds
    noise = np.diag([1e-3, 2e-3, 1e-3, 4e-6])
    state, covariance, pose_vector = np.zeros(4), np.diag([0, 0, 0, 1e-4]), np.zeros(3)
    columns = np.zeros((3, 0))
    errors = np.sqrt(covariance)
    for index, (velocity, rate, filtered) in enumerate(steps):
        covariance = covariance + process
        errors = np.hstack((errors, np.sqrt(process)))
        information = np.linalg.inv(covariance) + matrix.T @ np.linalg.inv(noise) @ matrix
        posterior = np.linalg.inv(information)
        gain = posterior @ matrix.T @ np.linalg.inv(noise)
        state = state + gain @ (np.array([*velocity, rate]) - matrix @ state)
        covariance = posterior
        errors = np.hstack((errors - gain @ matrix @ errors, gain @ np.sqrt(noise)))
        columns = np.hstack((columns, np.zeros((3, errors.shape[1] - columns.shape[1]))))

        def propagate(pose_vector: Array, velocity: Array) -> Array:
            heading = pose_vector[2] + velocity[2] * seconds / 2
            c, s = math.cos(heading), math.sin(heading)
            rotation = np.array([[c, -s], [s, c]])
            return pose_vector + seconds * np.array([*(rotation @ velocity[:2]), velocity[2]])

        next_pose, epsilon = propagate(pose_vector, state[:3]), 1e-6
        columns = np.column_stack([
            (propagate(pose_vector + epsilon * column, state[:3] + epsilon * error[:3]) - next_pose) / epsilon
            for column, error in zip(columns.T, errors.T, strict=True)
        ])  # fmt: skip
        pose_vector = next_pose
        assert filtered is not None
        assert filtered.pose == pytest.approx(tuple(pose_vector), abs=2e-5), index
        assert filtered.twist == pytest.approx(tuple(state[:3]), abs=2e-3)
        expected = columns @ columns.T
        assert np.reshape(filtered.pose_covariance, (3, 3)) == pytest.approx(expected, rel=1e-3, abs=1e-12)
        assert filtered.twist_variance == pytest.approx(np.diag(posterior)[:3], rel=1e-6)


def test_gyroscope_bias_is_estimated_at_standstill_without_moving_the_pose() -> None:
    odometry_filter = OdometryFilter(Spec(gyro_bias=0.01, frequency=40), TICK_RATE_HZ)
    poses = []
    for k in range(400):
        odometry_filter.on_imu(imu(6 * k, 0.004))
        filtered = odometry_filter.fuse(odometry(6 * k, Pose2(1.0, 0.0, 0.5), (0.0, 0.0, 0.0)))
        assert filtered is not None
        poses.append(filtered.pose)
    assert np.ptp(poses, axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    for k in range(400, 440):
        odometry_filter.on_imu(imu(6 * k, 0.504))
        filtered = odometry_filter.fuse(odometry(6 * k, Pose2(1.0, 0.0, 0.5 + 0.0001 * (k - 399)), (0.0, 0.0, 1.0)))
    assert filtered is not None
    assert filtered.twist.wz == pytest.approx(0.5, abs=2e-3)


def test_wheels_that_slip_in_turns_do_not_turn_the_pose() -> None:
    slipping = drive(3, 20, slip=1.3)
    assert abs(pose_error(slipping[-1], slipping[-1].wheels)[2]) > 0.2
    assert abs(pose_error(slipping[-1], slipping[-1].filtered)[2]) < 0.03


def final_pose_and_covariance(spec: Spec, **options: Any) -> tuple[Pose2, tuple[float, ...]]:
    end = drive(4, 6, spec=spec, **options)[-1].filtered
    return end.pose, end.pose_covariance


@pytest.mark.parametrize("spec", [
    Spec(process_noise_covariance=[10.0, 10.0, 0.1]), Spec(odom0_twist_rejection_threshold=0.5),
    Spec(gyro_bias=0.0), Spec(gyro_bias_walk=0.01), Spec(frequency=10),
])  # fmt: skip
def test_each_parameter_changes_the_result(spec: Spec) -> None:
    assert final_pose_and_covariance(spec) != final_pose_and_covariance(Spec())


def test_filter_uses_only_the_wheels_after_the_gyroscope_stops() -> None:
    steps = drive(5, 10, change=lambda reading: reading if reading.tick < 4 * TICK_RATE_HZ else None)
    without_imu = [step for step in steps if step.wheels.tick > 5 * TICK_RATE_HZ]
    assert len(without_imu) > 90
    for before, after in pairwise(without_imu):
        wheel_motion = before.wheels.pose.between(after.wheels.pose)
        assert before.filtered.pose.between(after.filtered.pose) == pytest.approx(wheel_motion, abs=2e-4)


@pytest.mark.parametrize("rate", [math.nan, math.inf, -math.inf, 1e30])
def test_meaningless_yaw_rates_are_ignored(rate: float) -> None:
    def broken(reading: Imu) -> Imu:
        return imu(reading.tick, rate) if reading.tick % 16 == 0 else reading

    end = drive(6, 10, change=broken)[-1]
    assert abs(pose_error(end, end.filtered)[2]) < 0.02


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30])
def test_meaningless_odometry_is_refused(value: float) -> None:
    odometry_filter = OdometryFilter(Spec(frequency=40), TICK_RATE_HZ)
    odometry_filter.fuse(odometry(0, Pose2(0, 0)))
    assert odometry_filter.fuse(odometry(6, Pose2(value, value, value))) is None
    filtered = odometry_filter.fuse(odometry(12, Pose2(0.02, 0.0)))
    assert filtered is not None
    assert filtered.pose == pytest.approx((0.02, 0.0, 0.0), abs=1e-3)


def test_old_odometry_is_refused() -> None:
    odometry_filter = OdometryFilter(Spec(frequency=40), TICK_RATE_HZ)
    odometry_filter.fuse(odometry(6, Pose2(0, 0)))
    assert odometry_filter.fuse(odometry(6, Pose2(1, 0))) is None
    assert odometry_filter.fuse(odometry(0, Pose2(1, 0))) is None


@pytest.mark.parametrize(("frequency", "ticks"), [(100, 6), (40, 6), (39, 12), (30, 12), (20, 12), (19, 18), (1, 240)])
def test_the_frequency_limits_the_rate_of_the_updates(frequency: float, ticks: int) -> None:
    updates = [step.wheels.tick for step in drive(7, 4, spec=Spec(frequency=frequency))]
    assert updates == list(range(0, 4 * TICK_RATE_HZ + 1, ticks))


def test_update_has_the_variance_of_all_readings_since_the_last_update() -> None:
    """The second half of the motion is exact, and the first half has a known variance."""
    odometry_filter = OdometryFilter(Spec(frequency=20, process_noise_covariance=[1e6, 1e6, 1e6]), TICK_RATE_HZ)
    odometry_filter.fuse(odometry(0, Pose2(0, 0)))
    assert odometry_filter.fuse(odometry(6, Pose2(0.01, 0), (4e-4, 0.0, 0.0))) is None
    filtered = odometry_filter.fuse(odometry(12, Pose2(0.02, 0), (0.0, 0.0, 0.0)))
    assert filtered is not None
    assert filtered.twist.vx == pytest.approx(0.4)
    assert filtered.twist_variance[0] == pytest.approx(4e-4 / 4, rel=1e-3)


def test_motion_is_complete_after_lost_odometry_messages() -> None:
    """The next reading contains the motion and the error of all lost readings."""
    with_all_messages, with_lost_messages = (
        OdometryFilter(Spec(frequency=40), TICK_RATE_HZ),
        OdometryFilter(Spec(frequency=40), TICK_RATE_HZ),
    )
    for k in range(21):
        reading = odometry(6 * k, integrate_arc(Twist(0.01 * k, 0.0, 0.005 * k)))
        complete = with_all_messages.fuse(reading)
        if k not in range(10, 20):
            partial = with_lost_messages.fuse(reading)
    assert complete is not None
    assert partial is not None
    assert partial.pose == pytest.approx(complete.pose, abs=1e-3)
    assert np.reshape(partial.pose_covariance, (3, 3))[0, 0] == pytest.approx(complete.pose_covariance[0], rel=0.1)


# The filter in the stack


def decisions(spec: StackSpec, has_imu: bool = True, turn: float = 0.2, has_spare: bool = False) -> list[Any]:
    """Return the decisions of half a second at rest, in which the wheels report a turn and the gyroscope does not.

    With `has_spare`, a second odometry sensor reports motion, and a second gyroscope reports a turn.
    """
    surroundings = Surroundings(round_robot(), None, TICK_RATE_HZ, has_imu=has_imu)
    stack = build_stack(spec, surroundings, Streams(1), Clock(TICK_RATE_HZ))
    stack.start(Estimate(Pose2(0.0, 0.0)), (Goal("away", Pose2(9.0, 0.0)),))
    results = []
    for tick in range(0, TICK_RATE_HZ // 2, 6):
        yaw = turn * tick / TICK_RATE_HZ
        wheels = odometry(tick, Pose2(0.0, 0.0, yaw), (0.0, 0.0, 1e-2))
        spare = Odometry("spare", tick, Pose2(0.01 * tick, -2.0, 1.0), Twist(2.4))
        spares = [replace(imu(tick, 1.5), sensor="spare imu"), spare] if has_spare else []
        results.append(stack.decide(tick, (imu(tick, 0.0), wheels, *spares)))
    return results


def test_the_stack_localizes_by_the_filtered_odometry_and_publishes_it() -> None:
    results = decisions(StackSpec())
    filtered = [odometry for decision in results for odometry in decision.odometry]
    assert [odometry.tick for odometry in filtered] == list(range(0, filtered[-1].tick + 1, 12))
    assert abs(filtered[-1].pose.yaw) < 0.002
    beliefs = [decision.belief for decision in results if decision.belief is not None]
    assert abs(beliefs[-1].pose.yaw) < 0.002


@pytest.mark.parametrize(("spec", "has_imu"), [
    (StackSpec(), False),
    (StackSpec.model_validate({"odometry": {"type": "wheel"}}), True),
    (StackSpec.model_validate({"localizer": {"type": "ekf"}}), True),
])  # fmt: skip
def test_odometry_is_not_filtered_without_an_imu_or_for_localizers_that_fuse_it(spec: StackSpec, has_imu: bool) -> None:
    results = decisions(spec, has_imu)
    assert not any(decision.odometry for decision in results)
    if spec.localizer.type != "ekf":
        assert [decision.belief for decision in results if decision.belief is not None][-1].pose.yaw > 0.05


@pytest.mark.parametrize(("localizer", "has_imu"), [("amcl", True), ("amcl", False), ("ekf", True), ("slip_ekf", True)])
def test_a_second_odometry_sensor_and_a_second_gyroscope_do_not_move_the_robot(localizer: str, has_imu: bool) -> None:
    spec = StackSpec.model_validate({"localizer": {"type": localizer}})
    without_spare, with_spare = decisions(spec, has_imu), decisions(spec, has_imu, has_spare=True)
    assert [decision.command for decision in without_spare] == [decision.command for decision in with_spare]
    poses = [
        [decision.belief.pose for decision in results if decision.belief is not None]
        for results in (without_spare, with_spare)
    ]
    assert poses[0] == poses[1]


def test_gyroscope_is_used_from_its_second_reading_on() -> None:
    """The variance of the turn depends on the time between two readings."""
    gyroscope = GyroscopeIntegral(tick_rate=100)
    gyroscope.add(imu(0, 0.5))
    assert [gyroscope.turned_until(tick) for tick in (0, 2, 4)] == [None, None, None]
    gyroscope.add(imu(5, 0.5))
    turned = gyroscope.turned_until(6)
    assert turned is not None
    assert turned[0] == pytest.approx(0.5 * 0.02)
    assert turned[1] > 0.0
