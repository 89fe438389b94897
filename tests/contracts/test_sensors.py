"""Contract tests of the sensors of all shipped robots, with simulated physics."""

import copy
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import yaml

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Box, Solid
from simscen.core.messages.sensor_data import Bump, Image, Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.robot import RobotSpec
from simscen.sensors.factory import build_sensors
from simscen.sim.body.from_spec import build_robot_body
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.raycasting.ray_scene import RayScene
from tests.single_robot import SingleRobotSimulation

ROBOTS = Path(__file__).parents[2] / "simscen/data/robots"
CAMERA = {"camera": {"rate": 5.0, "width": 32, "height": 24, "mount": {"z": 0.4}}}
WALLS = [Solid(Box(size), Pose3(x, y, 0.5), "wall") for x, y, size in (
    (4.05, 0, (0.1, 8, 1)), (-4.05, 0, (0.1, 8, 1)), (0, 4.05, (8, 0.1, 1)), (0, -4.05, (8, 0.1, 1)))]  # fmt: skip
ROOM = merge_solids(WALLS)


def load(name):
    tree = yaml.safe_load((ROBOTS / f"{name}.robot.yaml").read_text())
    tree["sensors"]["camera"] = CAMERA
    return RobotSpec.model_validate(tree)


def without_noise(spec):
    """Return the specification of the robot with noise-free sensors."""
    noise_free = {
        "lidar": {"noise": 0.0},
        "odometry": {"translation_noise": 0.0, "rotation_noise": 0.0, "drift_noise": 0.0},
        "imu": {"gyro_noise": 0.0, "gyro_bias": 0.0, "accelerometer_noise": 0.0},
    }
    sensors = {
        name: sensor.model_copy(update={sensor.kind: sensor.chosen.model_copy(update=noise_free.get(sensor.kind, {}))})
        for name, sensor in spec.sensors.items()
    }
    return spec.model_copy(update={"sensors": sensors})


class Rig:
    """A robot in a room with its sensors."""

    def __init__(self, spec, seed=1, pose=Pose2(0.5, -0.3, 0.4)):
        self.simulation = SingleRobotSimulation(build_robot_body(spec), pose, WALLS)
        self.sensors = build_sensors(spec, Clock(240), Streams(seed), self.simulation.robot, RayScene(ROOM))

    def drive(self, twist, ticks):
        """Drive for some ticks; return the readings of all sensors."""
        readings = []
        self.simulation.drive(twist)
        for _ in range(ticks // 2):
            self.simulation.step(2)
            tick = self.simulation.tick
            readings += [sensor.read(tick) for sensor in self.sensors if tick % sensor.period == 0]
        return readings


@pytest.fixture
def rig():
    """Return a function that creates rigs, and close them after the test."""
    rigs = []

    def make(*args, **options):
        rigs.append(Rig(*args, **options))
        return rigs[-1]

    yield make
    for robot_rig in rigs:
        robot_rig.simulation.close()


def equal(a, b):
    """Return whether two readings are equal."""
    return type(a) is type(b) and all(
        np.array_equal(x, y, equal_nan=True) if isinstance(x, np.ndarray) else x == y
        for x, y in ((getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    )


@pytest.mark.parametrize("name", ["turtlebot", "omni"])
def test_equal_world_and_generator_give_equal_readings(rig, name):
    first, second = (rig(load(name)).drive(Twist(0.3, 0.0, 0.2), 96) for _ in range(2))
    assert len(first) == len(second) > 20
    assert all(equal(a, b) for a, b in zip(first, second, strict=True))


def test_readings_at_rest_differ_only_with_noise(rig):
    for spec, has_noise in ((load("turtlebot"), True), (without_noise(load("turtlebot")), False)):
        scene = rig(spec)
        scene.simulation.step(240)
        for sensor in scene.sensors:
            sensor.read(240)
            first, second = sensor.read(240), sensor.read(240)
            if isinstance(first, Odometry | Bump | Image):
                assert equal(first, second)  # encoders at rest count nothing; pictures have no noise
            else:
                assert equal(first, second) is not has_noise


def test_readings_do_not_change_later(rig):
    scene = rig(load("turtlebot"))
    readings = scene.drive(Twist(0.3, 0.0, 0.2), 48)
    copies = copy.deepcopy(readings)
    scene.drive(Twist(0.3, 0.0, -0.2), 48)
    assert all(equal(a, b) for a, b in zip(readings, copies, strict=True))


@pytest.mark.parametrize("name", ["turtlebot", "amr", "car", "omni"])
def test_odometry_without_noise_is_the_truth_on_a_straight_drive(rig, name):
    scene = rig(without_noise(load(name)), pose=Pose2(-2.0, 0.0, 0.0))
    reading = [r for r in scene.drive(Twist(0.4, 0.0, 0.0), 1440) if isinstance(r, Odometry)][-1]
    truth = Pose2(-2.0, 0.0, 0.0).between(scene.simulation.truth().pose.plane)
    assert reading.pose == pytest.approx(truth, abs=2e-3)
    assert reading.twist == pytest.approx(scene.simulation.truth().twist, abs=2e-3)


@pytest.mark.parametrize("name", ["turtlebot", "amr", "omni", "car"])
def test_odometry_without_noise_is_nearly_the_truth_around_curves(rig, name):
    scene = rig(without_noise(load(name)), pose=Pose2(0.0, -1.5, 0.0))
    reading = [r for r in scene.drive(Twist(0.4, 0.0, 0.4), 1440) if isinstance(r, Odometry)][-1]
    truth = Pose2(0.0, -1.5, 0.0).between(scene.simulation.truth().pose.plane)
    assert reading.pose == pytest.approx(truth, abs=0.03)


def test_a_lidar_in_a_room_measures_its_walls_while_driving(rig):
    scene = rig(without_noise(load("turtlebot")))
    scene.drive(Twist(0.3, 0.0, 0.5), 240)
    pose = scene.simulation.truth().pose.plane
    (lidar,) = (sensor for sensor in scene.sensors if sensor.name == "lidar")
    scan = lidar.read(240)
    assert isinstance(scan, Scan)
    hits = np.abs(pose.apply(scan.points()))
    assert len(hits) == 360
    # Errors: half a step of the range, and the height error of a robot that leans by 20 µrad.
    assert np.abs(hits.max(axis=1) - 4.0).max() < 0.0015


def test_bumper_detects_contact_with_a_wall(rig):
    scene = rig(load("turtlebot"), pose=Pose2(3.5, 0.0, 0.0))
    pressed = [reading.pressed for reading in scene.drive(Twist(0.5, 0.0, 0.0), 480) if isinstance(reading, Bump)]
    assert pressed[0] is False
    assert pressed[-1] is True
