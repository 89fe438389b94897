"""Tests of how the sensors of a robot are built from its file: order, periods, refused values, and noise."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from puppet import Puppet, SquareRoom
from pydantic import ValidationError

from simscen.core.clock import Clock
from simscen.core.errors import RunError
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.robot import Ackermann, RobotSpec
from simscen.sensors.factory import PluginSensor, build_sensors
from simscen.sensors.sensor import SensorSetting

SENSORS = {
    "zed": {"camera": {"rate": 5.0, "width": 16, "height": 8}},
    "back": {"lidar": {"rate": 10.0, "beams": 8}},
    "front": {"lidar": {"rate": 20.0, "beams": 8}},
    "odom": {"odometry": {}},
    "imu": {"imu": {}},
    "bumper": {"bumper": {}},
}


def robot(sensors):
    return RobotSpec.model_validate({
        "simscen": 1, "name": "r", "mass": 1.0, "body": [{"cylinder": [0.2, 0.1]}],
        "drive": {"type": "differential", "wheel_radius": 0.03, "wheel_separation": 0.3},
        "limits": {"linear": 1.0, "angular": 1.0, "linear_acceleration": 1.0, "angular_acceleration": 1.0},
        "sensors": sensors,
    })  # fmt: skip


def build(sensors=SENSORS, seed=1, view=None):
    return build_sensors(robot(sensors), Clock(240), Streams(seed), view or Puppet(), SquareRoom(3.0))


def test_sensors_are_sorted_by_name():
    reversed_file = dict(reversed(SENSORS.items()))
    assert [sensor.name for sensor in build()] == ["back", "bumper", "front", "imu", "odom", "zed"]
    assert [sensor.name for sensor in build(reversed_file)] == [sensor.name for sensor in build()]


def test_periods_are_whole_ticks():
    assert {sensor.name: sensor.period for sensor in build()} == {
        "back": 24, "bumper": 6, "front": 12, "imu": 4, "odom": 6, "zed": 48}  # fmt: skip


def test_rate_that_does_not_divide_the_clock_is_refused_and_the_nearest_valid_rate_named():
    with pytest.raises(ValueError, match="7 Hz does not divide 240 Hz; the nearest that does is"):
        build({"lidar": {"lidar": {"rate": 7.0}}})


@pytest.mark.parametrize("sensor", [{"lidar": {"field_of_view": 7.0}}, {"camera": {"field_of_view": math.pi}}])
def test_too_wide_field_of_view_is_refused(sensor):
    with pytest.raises(ValidationError, match="field_of_view"):
        robot({"wide": sensor})


def test_maximum_steering_angle_of_90_degrees_is_refused():
    size = {"wheel_radius": 0.1, "wheel_separation": 0.3, "wheel_base": 0.3}
    with pytest.raises(ValidationError, match="max_steering"):
        Ackermann(type="ackermann", max_steering=math.pi / 2, **size)


def test_each_sensor_type_returns_its_reading_type():
    kinds = {type(sensor.read(0)) for sensor in build()}
    assert kinds == {Scan, Odometry, Imu, Bump, Image}


def test_additional_sensor_does_not_change_the_others():
    alone = build({"front": SENSORS["front"]})[0].read(0)
    with_others = next(sensor for sensor in build() if sensor.name == "front").read(0)
    assert np.array_equal(alone.ranges, with_others.ranges)


def test_noise_of_two_lidars_differs():
    back, *_, front = (s.read(0) for s in build() if s.name in {"back", "front"})
    assert not np.array_equal(back.ranges, front.ranges)


def test_bumper_reports_contacts_of_the_hull():
    view = Puppet()
    (bumper,) = build({"bumper": {"bumper": {}}}, view=view)
    assert not bumper.read(0).pressed
    view.pressed = True
    assert bumper.read(6).pressed


@pytest.mark.parametrize("increment", [0, 0.0])
def test_scan_of_a_plug_in_with_zero_angle_increment_is_refused(increment):
    def sensor(_spec, _setting):
        return SimpleNamespace(read=lambda tick: Scan("beam", tick, np.ones(1), 0.0, increment, 0.1, 10.0))

    spec = SimpleNamespace(reading_type="Scan", component="package:Beam", implementation=lambda: sensor)
    setting = SensorSetting("beam", 24, 0.1, np.random.default_rng(1), Puppet(), None, None)
    with pytest.raises(RunError, match="returned a reading whose `angle_increment` is 0"):
        PluginSensor("beam", spec, setting).read(24)
