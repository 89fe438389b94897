"""Tests of robots whose lidar and IMU are mounted upside down."""

import math
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

import simscen
from simscen.core.geometry import Pose3

ROOT = Path(__file__).parents[2]
LIDAR_MOUNT = "mount: {x: 0, z: 0.18}"
IMU = "imu: {rate: 40 Hz}"


def inverted_turtlebot() -> str:
    """Return the file of a turtlebot whose lidar and IMU are mounted upside down."""
    robot = (ROOT / "simscen/data/robots/turtlebot.robot.yaml").read_text()
    assert LIDAR_MOUNT in robot
    assert IMU in robot
    robot = robot.replace(LIDAR_MOUNT, "mount: {x: 0, z: 0.18, roll: 180 deg, yaw: 90 deg}")
    return robot.replace(IMU, "imu: {rate: 40 Hz, mount: {x: 0.1, z: 0.1, roll: 180 deg, yaw: 30 deg}}")


@pytest.mark.parametrize("profile", ["reference", "advanced"])
def test_robot_with_inverted_sensors_reaches_its_goal(profile: str, tmp_path: Path) -> None:
    (tmp_path / "inverted.robot.yaml").write_text(inverted_turtlebot())
    (tmp_path / "house.world.yaml").write_text((ROOT / "worlds/house.world.yaml").read_text())
    scenario = tmp_path / "inverted.scenario.yaml"
    scenario.write_text(
        f"simscen: 1\nworld: house.world.yaml\nstack: {{profile: {profile}}}\n"
        "robot: {model: inverted.robot.yaml, pose: dock}\n"
        "goals: [{pose: sofa, timeout: 60 s}]\n"
        "pass:\n  - goals_reached: {}\n  - collisions: {max: 0}\n  - localization_error: {max: 0.15 m}\n"
    )
    run = simscen.simulate(scenario, seed=5)
    assert run.passed, run.result


def test_log_has_the_mounts_of_tilted_sensors(tmp_path: Path) -> None:
    """The decoder of mcap_ros2 reads both mounts on /tf_static, and the readings of the IMU in the IMU frame."""
    (tmp_path / "a.robot.yaml").write_text(inverted_turtlebot())
    scenario = tmp_path / "a.scenario.yaml"
    scenario.write_text(
        "simscen: 1\nworld: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}\n"
        "robot: {model: a.robot.yaml, pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 5, y: 3}}]\ntime_limit: 1 s\n"
        "pass:\n  - collisions: {max: 0}\n"
    )
    simscen.simulate(scenario, seed=1, log=tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        messages = [
            (schema.name, message)
            for schema, channel, _, message in make_reader(file, decoder_factories=[DecoderFactory()])
            .iter_decoded_messages(["/tf_static", "/imu"])
        ]  # fmt: skip
    links = {link.child_frame_id: link for _, found in messages for link in getattr(found, "transforms", ())}
    assert links["imu"].header.frame_id == "base_link"
    for name, yaw in (("lidar", 90.0), ("imu", 30.0)):
        q = links[name].transform.rotation
        expected = Pose3.from_rpy(0, 0, 0, math.pi, 0, math.radians(yaw)).quaternion
        assert (q.x, q.y, q.z, q.w) == pytest.approx(expected, abs=1e-9)
    readings = [found for name, found in messages if name == "sensor_msgs/msg/Imu"]
    assert {reading.header.frame_id for reading in readings} == {"imu"}
    assert np.mean([reading.linear_acceleration.z for reading in readings]) == pytest.approx(-9.81, abs=0.05)
