"""Tests of noise, bias, scale, and drift of all message types against their definitions."""

import math

import numpy as np
import pytest
from fault_effects import ManualClock, belief, image, imu, odometry, scan, start, unsuitable_key

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist


def test_camera_noise_has_the_given_strength_and_stays_in_range():
    output = start({"noise": {"std": "5 cm", "colour": "4 %"}}, "Image").reading(image(np.full((100, 100), 2.0)))
    assert output.depth.std() == pytest.approx(0.05, rel=0.05)
    assert output.rgb.std() == pytest.approx(0.04 * 255, rel=0.05)
    assert (output.rgb.dtype, output.depth.dtype) == (np.uint8, np.float32)
    assert np.isinf(start({"noise": {"std": 1.0}}, "Image").reading(image([[np.inf]])).depth).all()


def test_imu_noise_has_the_given_standard_deviation_on_each_axis():
    effect = start({"noise": {"gyro": "0.05 rad/s", "accelerometer": 0.3}}, "Imu")
    outputs = [effect.reading(imu()) for _ in range(4000)]
    rates, accelerations = (np.array([getattr(reading, name) for reading in outputs]) for name in
                        ("angular_velocity", "linear_acceleration"))  # fmt: skip
    assert rates.std(axis=0) == pytest.approx([0.05] * 3, rel=0.06)
    assert accelerations.std(axis=0) == pytest.approx([0.3] * 3, rel=0.06)
    assert rates.mean(axis=0) == pytest.approx([0, 0, 0.2], abs=0.004)


@pytest.mark.parametrize("steps", [4, 40])
def test_noise_of_odometry_after_a_meter_does_not_depend_on_its_rate(steps):
    ends = []
    for seed in range(300):
        effect = start({"noise": {"linear": "5 cm", "angular": "3 deg"}}, "Odometry", seed=seed)
        for k in range(steps + 1):
            end = effect.reading(odometry(Pose2(k / steps, 0.0), 24 * k)).pose
        ends.append(end.x)
    assert np.std(ends) == pytest.approx(0.05, rel=0.15)
    assert np.mean(ends) == pytest.approx(1.0, abs=0.01)


def test_stationary_odometry_has_no_noise():
    effect = start({"noise": {"linear": "5 cm", "angular": "3 deg"}}, "Odometry")
    assert {effect.reading(odometry(Pose2(1, 2), 6 * k)).pose for k in range(50)} == {Pose2(1, 2)}


def test_noisy_odometry_reports_the_velocity_of_its_reported_path():
    effect = start({"noise": {"linear": "5 cm", "angular": "3 deg"}}, "Odometry")
    before = effect.reading(odometry(Pose2(0, 0), 0, Twist(0.5)))
    after = effect.reading(odometry(Pose2(0.0125, 0), 6, Twist(0.5)))
    assert after.twist.vx == pytest.approx((after.pose.x - before.pose.x) * 40)


def test_belief_noise_is_independent_and_keeps_the_odometry():
    effect = start({"noise": {"linear": "10 cm", "angular": "2 deg"}}, "Belief")
    outputs = [effect.belief(belief(Pose2(3, 4, 0.5), Pose2(1, 0, 0.1))) for _ in range(3000)]
    poses = np.array([output.pose for output in outputs])
    assert poses.std(axis=0) == pytest.approx([0.1, 0.1, math.radians(2)], rel=0.06)
    assert outputs[7].map_from_odom.compose(Pose2(1, 0, 0.1)) == pytest.approx(outputs[7].pose)


def test_bias_is_added_to_finite_measurements_only():
    assert start({"bias": {"range": "-20 cm"}}, "Scan").reading(scan([1.0, np.inf, np.nan, 0.2])).ranges == (
        pytest.approx([0.8, np.inf, np.nan, -np.inf], nan_ok=True)
    )
    imu_reading = start({"bias": {"gyro": 0.1, "accelerometer": -0.5}}, "Imu").reading(imu())
    assert imu_reading.angular_velocity == pytest.approx((0, 0, 0.3))
    assert imu_reading.linear_acceleration == pytest.approx((-0.4, 0, 9.81))
    camera_image = start({"bias": {"range": 0.5, "brightness": "20 %"}}, "Image").reading(
        image([[1.0, np.inf]], gray=230)
    )
    assert camera_image.depth.tolist() == [[1.5, np.inf]]
    assert (camera_image.rgb == 255).all()


def test_range_scaled_beyond_the_maximum_is_no_hit():
    output = start({"scale": {"factor": 2}}, "Scan").reading(scan([1.0, 7.0, np.inf, np.nan])).ranges
    assert output == pytest.approx([2.0, np.inf, np.inf, np.nan], nan_ok=True)


def test_scaled_odometry_multiplies_distance_and_twist_by_the_factor():
    effect = start({"scale": {"factor": "110 %"}}, "Odometry")
    effect.reading(odometry())
    output = effect.reading(odometry(Pose2(1.0, 0.0, 0.0), 6, Twist(0.5, 0, 0.2)))
    assert output.pose == pytest.approx((1.1, 0, 0))
    assert output.twist == pytest.approx((0.55, 0, 0.22))


def test_drift_grows_with_the_time_since_its_start():
    now = ManualClock()
    now.tick = 480
    gyro, lidar = start({"drift": {"gyro": 0.01}}, "Imu", now), start({"drift": {"range": "5 cm/s"}}, "Scan", now)
    for seconds in (0, 1, 7.5):
        tick = 480 + round(240 * seconds)
        assert gyro.reading(imu(tick)).angular_velocity[2] == pytest.approx(0.2 + 0.01 * seconds)
        assert lidar.reading(scan([2.0], tick)).ranges == pytest.approx([2.0 + 0.05 * seconds])


@pytest.mark.parametrize("garbage", [math.nan, math.inf, 1e30])
def test_garbage_does_not_change_later_distorted_odometry(garbage):
    effect = start({"scale": {"factor": 2.0}}, "Odometry")
    assert effect.reading(odometry(Pose2(0, 0))).pose == Pose2(0, 0)
    garbage_reading = odometry(Pose2(garbage, garbage, garbage))
    assert effect.reading(garbage_reading) is garbage_reading
    assert effect.reading(odometry(Pose2(1, 0))).pose == Pose2(2, 0)


def test_odometry_drifts_at_standstill_and_keeps_the_drift_after_the_fault():
    effect = start({"drift": {"linear": "10 cm/s"}}, "Odometry")
    for tick in range(0, 481, 6):
        output = effect.reading(odometry(tick=tick))
    assert output.pose == pytest.approx((0.2, 0, 0))
    assert output.twist.vx == pytest.approx(0.1)
    remaining = effect.end()
    assert remaining.reading(odometry(tick=720)).pose == pytest.approx((0.2, 0, 0))


def test_belief_drifts_along_the_heading_at_the_start_of_the_fault():
    now = ManualClock()
    effect = start({"drift": {"linear": "10 cm/s", "angular": 0.0}}, "Belief", now)
    effect.belief(belief(Pose2(1, 1, math.pi / 2), Pose2(0, 0)))
    now.tick = 960
    output = effect.belief(belief(Pose2(1, 1, math.pi / 2), Pose2(0, 0)))
    assert output.pose == pytest.approx((1, 1.4, math.pi / 2))
    assert output.map_from_odom == pytest.approx(output.pose)


@pytest.mark.parametrize(
    ("fault", "kind", "key"),
    [
        ({"noise": {"std": 1, "gyro": 1}}, "Scan", "gyro"),
        ({"noise": {"std": 1}}, "Imu", "std"),
        ({"bias": {"range": 1}}, "Odometry", "range"),
        ({"bias": {"linear_scale": 1.1}}, "Scan", "linear_scale"),
        ({"drift": {"gyro": 1}}, "Belief", "gyro"),
        ({"extrinsic": {"x": 1}}, "Imu", "x"),
    ],
)
def test_key_of_another_sensor_type_is_refused(fault, kind, key):
    assert unsuitable_key(fault, kind)[0] == key
