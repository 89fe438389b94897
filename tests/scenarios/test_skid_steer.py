"""Test of a skid-steer robot with the geometry of Clearpath's Husky."""

from pathlib import Path

import pytest

import simscen

ROBOT = """\
simscen: 1
name: husky
body:
  - {box: [0.99, 0.57, 0.25], z: 0.13}
mass: 50
footprint: [[0.5, 0.34], [-0.5, 0.34], [-0.5, -0.34], [0.5, -0.34]]
drive:
  {type: skid_steer, wheel_radius: 0.1651, wheel_separation: 0.5708, wheel_base: 0.512, wheel_width: 0.114,
   turning_scale: SCALE}
limits: {linear: 1.0, angular: 2.0, linear_acceleration: 3.0, angular_acceleration: 6.0}
sensors:
  lidar: {lidar: {beams: 720, field_of_view: 270 deg, min_range: 0.1, max_range: 30, mount: {x: 0.3, z: 0.45}}}
  odom: {odometry: {rate: 40 Hz}}
"""
IMU = "  imu: {imu: {rate: 40 Hz}}\n"
SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls:
    - {name: hall, points: [[0, 0], [16, 0], [16, 10], [0, 10], [0, 0]]}
    - {name: partition, points: [[8, 0], [8, 6]]}
  obstacles: [{name: crate, box: [1, 1, 1], pose: {x: 4, y: 5}}]
robot: {model: husky.robot.yaml, pose: {x: 2, y: 2}}
stack: {profile: PROFILE}
goals:
  - {pose: {x: 13, y: 2, yaw: -90 deg}, timeout: 90 s}
  - {pose: {x: 3, y: 8, yaw: 180 deg}, timeout: 90 s}
pass:
  - goals_reached: {}
  - localization_error: {max: 0.3 m}
  - collisions: {max: 0}
"""


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["reference", "advanced"])
@pytest.mark.parametrize("scale", [1.0, 1.875])
@pytest.mark.parametrize("imu", [IMU, ""], ids=["imu", "wheels only"])
def test_a_husky_reaches_its_goals(imu: str, scale: float, profile: str, tmp_path: Path) -> None:
    (tmp_path / "husky.robot.yaml").write_text(ROBOT.replace("SCALE", str(scale)) + imu)
    scenario = tmp_path / "husky.scenario.yaml"
    scenario.write_text(SCENARIO.replace("PROFILE", profile))
    runs = [simscen.simulate(scenario, seed=seed) for seed in range(1, 6)]
    assert sum(run.passed for run in runs) >= 4, [run.result for run in runs if not run.passed]
