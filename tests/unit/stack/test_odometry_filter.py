"""Tests of the odometry filter: exact answers, an independent oracle, consistency on many seeds, and bad readings."""

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

RATE = 240
DRIVE = Omnidirectional(type="omnidirectional")
EXACT_WHEELS = sensors.WheelOdometry(translation_noise=0.0, rotation_noise=0.0, drift_noise=0.0)
EXACT_IMU = sensors.InertialUnit(gyro_noise=0.0, gyro_bias=0.0)


class View:
    """What the sensors see of the robot: the motion of its wheels and its angular velocity."""

    rolled = (0.0, 0.0, 0.0)
    angular = (0.0, 0.0, 0.0)

    def base_pose(self) -> Pose3:
        return Pose3()

    def base_velocity(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        return (0.0, 0.0, 0.0), self.angular

    def placements(self) -> int:
        return 0

    def encoders(self) -> tuple[float, ...]:
        return self.rolled


class Step(NamedTuple):
    """The true pose, the wheel odometry and the filtered odometry at a tick."""

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
    """Drive with random accelerations and halts. The sensors are those of the simulator. 0 Hz: no IMU.

    `slip`: reported over true turn of the wheels. `change`: what becomes of an IMU reading.
    """
    rng, view = np.random.default_rng((seed, 1)), View()
    setting = [
        SensorSetting(name, RATE // rate, 1 / rate, np.random.default_rng((seed, key)), view, None, DRIVE)  # type: ignore[arg-type]
        for key, (name, rate) in enumerate((("odom", odometry_rate), ("imu", imu_rate or 60)), start=2)
    ]
    odometer, gyro = WheelOdometrySensor(wheels or sensors.WheelOdometry(), setting[0]), None
    if imu_rate:
        gyro = ImuSensor(imu or sensors.InertialUnit(), setting[1])
    subject, pose, velocity, target, steps = OdometryFilter(spec or Spec(), RATE), Pose2(0, 0), np.zeros(2), None, []
    for tick in range(seconds * RATE + 1):
        if tick % (2 * RATE) == 0:
            target = np.array([rng.uniform(0, 0.5), rng.uniform(-1, 1)]) * (rng.random() < 0.8)
        if tick:
            last, limit = velocity, np.array([1.0, 3.2]) / RATE
            velocity = last + np.clip(target - last, -limit, limit)
            vx, wz = (velocity + last) / 2 / RATE
            pose = pose.compose(integrate_arc(Twist(vx, 0.0, wz)))
            view.rolled = (view.rolled[0] + vx, 0.0, view.rolled[2] + slip * wz)
            view.angular = (0.0, 0.0, velocity[1])
        if gyro is not None and tick % gyro.period == 0:
            reading = change(gyro.read(tick))
            if reading is not None:
                subject.on_imu(reading)
        if tick % odometer.period == 0:
            measured = odometer.read(tick)
            filtered = subject.fuse(measured)
            if filtered is not None:
                steps.append(Step(pose, measured, filtered))
    return steps


def error(step: Step, odometry: Odometry) -> Array:
    x, y, yaw = odometry.pose
    return np.array([x - step.truth.x, y - step.truth.y, math.remainder(yaw - step.truth.yaw, math.tau)])


def nees(step: Step, odometry: Odometry) -> float:
    wrong = error(step, odometry)
    return float(wrong @ np.linalg.solve(np.reshape(odometry.pose_covariance, (3, 3)), wrong))


def odometry(tick: int, pose: Pose2, variance: tuple[float, float, float] = (1e-3, 0.0, 1e-3)) -> Odometry:
    return Odometry("odom", tick, pose, Twist(), variance)


def imu(tick: int, rate: float, variance: float = 4e-6) -> Imu:
    return Imu("imu", tick, (0.0, 0.0, rate), (0.0, 0.0, 9.81), variance, 1e-4)


@pytest.mark.parametrize("imu_rate", [0, 40, 60, 240])
def test_pose_without_noise_equals_wheel_odometry(imu_rate: int) -> None:
    steps = drive(1, 20, EXACT_WHEELS, EXACT_IMU, imu_rate=imu_rate)
    assert max(np.abs(error(step, step.filtered)).max() for step in steps) < 3e-3
    assert max(np.abs(error(step, step.wheels)).max() for step in steps) < 3e-3


def test_filter_without_an_imu_hardly_changes_odometry() -> None:
    for step in drive(2, 20, imu_rate=0):
        assert step.filtered.pose == pytest.approx(step.wheels.pose, abs=5e-3)


def test_filtered_odometry_keeps_the_odom_frame_of_the_wheels() -> None:
    first = odometry(6, Pose2(1.0, 2.0, 3.0))
    assert OdometryFilter(Spec(), RATE).fuse(first) is first


@pytest.mark.slow
def test_filtered_heading_is_several_times_as_accurate_as_wheel_odometry() -> None:
    ends = [drive(seed, 20)[-1] for seed in range(7000, 7020)]
    fused, wheels = (np.std([error(end, getattr(end, name))[2] for end in ends]) for name in ("filtered", "wheels"))
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
        found = [nees(steps[len(steps) // share - 1], steps[len(steps) // share - 1].filtered) for steps in runs]
        assert low < np.mean(found) < high


def test_pose_and_covariance_equal_those_of_an_independent_filter() -> None:
    """Oracle: the information form of the update, and a covariance from finite differences of the whole chain.

    Every error of the drive, of the first bias, of each process noise and of each measurement, is changed by a little,
    and the linear filter with the known gains is run again.
    """
    rng, seconds = np.random.default_rng(5), 0.025
    spec = Spec(gyro_bias=0.01, gyro_bias_walk=0.002, frequency=40)
    subject, pose, steps = OdometryFilter(spec, RATE), Pose2(0, 0), []
    subject.on_imu(imu(0, 0.4))
    subject.fuse(odometry(0, pose))
    for k in range(1, 12):
        velocity, rate = Twist(0.5 + 0.1 * rng.normal(), 0.1 * rng.normal(), 0.4 + 0.02 * rng.normal()), 0.4
        pose = pose.compose(integrate_arc(Twist(*(seconds * value for value in velocity))))
        subject.on_imu(imu(6 * k, rate))
        filtered = subject.fuse(odometry(6 * k, pose, (1e-3, 2e-3, 1e-3)))
        steps.append((np.array(velocity), rate, filtered))
    matrix = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1.0]])
    process = np.diag([10.0, 10.0, 10.0, 0.002**2]) * seconds
    noise = np.diag([1e-3, 2e-3, 1e-3, 4e-6])
    state, covariance, place = np.zeros(4), np.diag([0, 0, 0, 1e-4]), np.zeros(3)
    columns = np.zeros((3, 0))  # error of the pose by each unit error so far
    errors = np.sqrt(covariance)  # error of the state by each unit error so far
    for number, (velocity, rate, filtered) in enumerate(steps):
        covariance = covariance + process
        errors = np.hstack((errors, np.sqrt(process)))
        information = np.linalg.inv(covariance) + matrix.T @ np.linalg.inv(noise) @ matrix
        posterior = np.linalg.inv(information)
        gain = posterior @ matrix.T @ np.linalg.inv(noise)
        state = state + gain @ (np.array([*velocity, rate]) - matrix @ state)
        covariance = posterior
        errors = np.hstack((errors - gain @ matrix @ errors, gain @ np.sqrt(noise)))
        columns = np.hstack((columns, np.zeros((3, errors.shape[1] - columns.shape[1]))))

        def moved(place: Array, velocity: Array) -> Array:
            heading = place[2] + velocity[2] * seconds / 2
            c, s = math.cos(heading), math.sin(heading)
            turned = np.array([[c, -s], [s, c]])
            return place + seconds * np.array([*(turned @ velocity[:2]), velocity[2]])

        tiny = 1e-6
        columns = np.column_stack([
            (moved(place + tiny * column, state[:3] + tiny * each[:3]) - moved(place, state[:3])) / tiny
            for column, each in zip(columns.T, errors.T, strict=True)
        ])  # fmt: skip
        place = moved(place, state[:3])
        assert filtered is not None
        assert filtered.pose == pytest.approx(tuple(place), abs=2e-5), number
        assert filtered.twist == pytest.approx(tuple(state[:3]), abs=2e-3)
        expected = columns @ columns.T
        assert np.reshape(filtered.pose_covariance, (3, 3)) == pytest.approx(expected, rel=1e-3, abs=1e-12)
        assert filtered.twist_variance == pytest.approx(np.diag(posterior)[:3], rel=1e-6)


def test_standing_still_reveals_the_bias_and_does_not_move_the_robot() -> None:
    subject = OdometryFilter(Spec(gyro_bias=0.01, frequency=40), RATE)
    poses = []
    for k in range(400):
        subject.on_imu(imu(6 * k, 0.004))
        filtered = subject.fuse(odometry(6 * k, Pose2(1.0, 0.0, 0.5), (0.0, 0.0, 0.0)))
        assert filtered is not None
        poses.append(filtered.pose)
    assert np.ptp(poses, axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    for k in range(400, 440):
        subject.on_imu(imu(6 * k, 0.504))
        filtered = subject.fuse(odometry(6 * k, Pose2(1.0, 0.0, 0.5 + 0.0001 * (k - 399)), (0.0, 0.0, 1.0)))
    assert filtered is not None
    assert filtered.twist.wz == pytest.approx(0.5, abs=2e-3)


def test_wheels_that_slip_in_turns_do_not_turn_the_pose() -> None:
    slipping = drive(3, 20, slip=1.3)
    assert abs(error(slipping[-1], slipping[-1].wheels)[2]) > 0.2
    assert abs(error(slipping[-1], slipping[-1].filtered)[2]) < 0.03


def other_end(spec: Spec, **options: Any) -> tuple[Pose2, tuple[float, ...]]:
    end = drive(4, 6, spec=spec, **options)[-1].filtered
    return end.pose, end.pose_covariance


@pytest.mark.parametrize("spec", [
    Spec(process_noise_covariance=[10.0, 10.0, 0.1]), Spec(odom0_twist_rejection_threshold=0.5),
    Spec(gyro_bias=0.0), Spec(gyro_bias_walk=0.01), Spec(frequency=10),
])  # fmt: skip
def test_each_parameter_counts(spec: Spec) -> None:
    assert other_end(spec) != other_end(Spec())


def test_filter_uses_only_the_wheels_after_the_gyroscope_stops() -> None:
    steps = drive(5, 10, change=lambda reading: reading if reading.tick < 4 * RATE else None)
    silent = [step for step in steps if step.wheels.tick > 5 * RATE]
    assert len(silent) > 90
    for before, after in pairwise(silent):
        by_wheels = before.wheels.pose.between(after.wheels.pose)
        assert before.filtered.pose.between(after.filtered.pose) == pytest.approx(by_wheels, abs=2e-4)


@pytest.mark.parametrize("rate", [math.nan, math.inf, -math.inf, 1e30])
def test_meaningless_yaw_rates_are_ignored(rate: float) -> None:
    def broken(reading: Imu) -> Imu:
        return imu(reading.tick, rate) if reading.tick % 16 == 0 else reading

    end = drive(6, 10, change=broken)[-1]
    assert abs(error(end, end.filtered)[2]) < 0.02


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30])
def test_meaningless_odometry_is_refused(value: float) -> None:
    subject = OdometryFilter(Spec(frequency=40), RATE)
    subject.fuse(odometry(0, Pose2(0, 0)))
    assert subject.fuse(odometry(6, Pose2(value, value, value))) is None
    filtered = subject.fuse(odometry(12, Pose2(0.02, 0.0)))
    assert filtered is not None
    assert filtered.pose == pytest.approx((0.02, 0.0, 0.0), abs=1e-3)


def test_old_odometry_is_refused() -> None:
    subject = OdometryFilter(Spec(frequency=40), RATE)
    subject.fuse(odometry(6, Pose2(0, 0)))
    assert subject.fuse(odometry(6, Pose2(1, 0))) is None
    assert subject.fuse(odometry(0, Pose2(1, 0))) is None


@pytest.mark.parametrize(("frequency", "ticks"), [(100, 6), (40, 6), (39, 12), (30, 12), (20, 12), (19, 18), (1, 240)])
def test_the_frequency_limits_the_rate_of_the_updates(frequency: float, ticks: int) -> None:
    updates = [step.wheels.tick for step in drive(7, 4, spec=Spec(frequency=frequency))]
    assert updates == list(range(0, 4 * RATE + 1, ticks))


def test_an_update_has_the_variance_of_all_readings_since_the_last_one() -> None:
    """Half of the motion is exact; the other half has a known variance."""
    subject = OdometryFilter(Spec(frequency=20, process_noise_covariance=[1e6, 1e6, 1e6]), RATE)
    subject.fuse(odometry(0, Pose2(0, 0)))
    assert subject.fuse(odometry(6, Pose2(0.01, 0), (4e-4, 0.0, 0.0))) is None
    filtered = subject.fuse(odometry(12, Pose2(0.02, 0), (0.0, 0.0, 0.0)))
    assert filtered is not None
    assert filtered.twist.vx == pytest.approx(0.4)
    assert filtered.twist_variance[0] == pytest.approx(4e-4 / 4, rel=1e-3)


def test_motion_is_complete_after_lost_odometry_messages() -> None:
    """The next reading covers the gap, with the error of all its increments."""
    all_of_it, some = OdometryFilter(Spec(frequency=40), RATE), OdometryFilter(Spec(frequency=40), RATE)
    for k in range(21):
        reading = odometry(6 * k, integrate_arc(Twist(0.01 * k, 0.0, 0.005 * k)))
        complete = all_of_it.fuse(reading)
        if k not in range(10, 20):
            partial = some.fuse(reading)
    assert complete is not None
    assert partial is not None
    assert partial.pose == pytest.approx(complete.pose, abs=1e-3)
    assert np.reshape(partial.pose_covariance, (3, 3))[0, 0] == pytest.approx(complete.pose_covariance[0], rel=0.1)


# In the stack


def decisions(spec: StackSpec, has_imu: bool = True, turn: float = 0.2, has_spare: bool = False) -> list[Any]:
    """Half a second of a robot that stands, while its wheels report a turn and its gyroscope does not.

    `has_spare`: a second odometry sensor reports a motion, and a second gyroscope reports a turn.
    """
    surroundings = Surroundings(round_robot(), None, RATE, has_imu=has_imu)
    stack = build_stack(spec, surroundings, Streams(1), Clock(RATE))
    stack.start(Estimate(Pose2(0.0, 0.0)), (Goal("away", Pose2(9.0, 0.0)),))
    made = []
    for tick in range(0, RATE // 2, 6):
        yaw = turn * tick / RATE
        wheels = odometry(tick, Pose2(0.0, 0.0, yaw), (0.0, 0.0, 1e-2))
        spare = Odometry("spare", tick, Pose2(0.01 * tick, -2.0, 1.0), Twist(2.4))
        spares = [replace(imu(tick, 1.5), sensor="spare imu"), spare] if has_spare else []
        made.append(stack.decide(tick, (imu(tick, 0.0), wheels, *spares)))
    return made


def test_the_stack_localizes_by_the_filtered_odometry_and_publishes_it() -> None:
    made = decisions(StackSpec())
    filtered = [odometry for decision in made for odometry in decision.odometry]
    assert [odometry.tick for odometry in filtered] == list(range(0, filtered[-1].tick + 1, 12))
    assert abs(filtered[-1].pose.yaw) < 0.002
    beliefs = [decision.belief for decision in made if decision.belief is not None]
    assert abs(beliefs[-1].pose.yaw) < 0.002


@pytest.mark.parametrize(("spec", "has_imu"), [
    (StackSpec(), False),
    (StackSpec.model_validate({"odometry": {"type": "wheel"}}), True),
    (StackSpec.model_validate({"localizer": {"type": "ekf"}}), True),
])  # fmt: skip
def test_odometry_is_not_filtered_without_an_imu_or_by_other_fusing_localizers(spec: StackSpec, has_imu: bool) -> None:
    made = decisions(spec, has_imu)
    assert not any(decision.odometry for decision in made)
    if spec.localizer.type != "ekf":
        assert [each.belief for each in made if each.belief is not None][-1].pose.yaw > 0.05


@pytest.mark.parametrize(("localizer", "has_imu"), [("amcl", True), ("amcl", False), ("ekf", True), ("slip_ekf", True)])
def test_a_second_odometry_sensor_and_a_second_gyroscope_do_not_move_the_robot(localizer: str, has_imu: bool) -> None:
    spec = StackSpec.model_validate({"localizer": {"type": localizer}})
    one, two = decisions(spec, has_imu), decisions(spec, has_imu, has_spare=True)
    assert [decision.command for decision in one] == [decision.command for decision in two]
    poses = [[each.belief.pose for each in made if each.belief is not None] for made in (one, two)]
    assert poses[0] == poses[1]


def test_gyroscope_is_used_from_its_second_reading_on() -> None:
    """Its variance depends on the time between two readings."""
    gyroscope = GyroscopeIntegral(tick_rate=100)
    gyroscope.add(imu(0, 0.5))
    assert [gyroscope.turned_until(tick) for tick in (0, 2, 4)] == [None, None, None]
    gyroscope.add(imu(5, 0.5))
    turned = gyroscope.turned_until(6)
    assert turned is not None
    assert turned[0] == pytest.approx(0.5 * 0.02)
    assert turned[1] > 0.0
