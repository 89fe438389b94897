"""A robot whose lidar and IMU are mounted upside down drives like one with upright sensors."""

from pathlib import Path

import pytest

import simscen

ROOT = Path(__file__).parents[2]
LIDAR_MOUNT = "mount: {x: 0, z: 0.18}"
IMU = "imu: {rate: 40 Hz}"


@pytest.mark.parametrize("profile", ["reference", "advanced"])
def test_robot_with_inverted_sensors_reaches_its_goal(profile: str, tmp_path: Path) -> None:
    robot = (ROOT / "simscen/data/robots/turtlebot.robot.yaml").read_text()
    assert LIDAR_MOUNT in robot
    assert IMU in robot
    robot = robot.replace(LIDAR_MOUNT, "mount: {x: 0, z: 0.18, roll: 180 deg, yaw: 90 deg}")
    robot = robot.replace(IMU, "imu: {rate: 40 Hz, mount: {x: 0.1, z: 0.1, roll: 180 deg, yaw: 30 deg}}")
    (tmp_path / "inverted.robot.yaml").write_text(robot)
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
