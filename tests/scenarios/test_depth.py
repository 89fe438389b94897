"""Test of obstacles below and above the scan plane, with and without a depth camera."""

from pathlib import Path

import pytest

from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROBOT = """\
simscen: 1
name: waiter
description: A TurtleBot with a tray on a mast.
mass: 1.8 kg
radius: 0.22 m
body:
  - {cylinder: [0.22, 0.09], z: 0.03}
  - {cylinder: [0.06, 0.50], z: 0.12}
drive: {type: differential, wheel_radius: 0.033, wheel_separation: 0.287, wheel_width: 0.018}
limits: {linear: 0.5 m/s, angular: 2, linear_acceleration: 1, linear_deceleration: 1.5, angular_acceleration: 3.2}
sensors:
  lidar: {lidar: {mount: {z: 0.18}}}
  odom: {odometry: {}}
"""
CAMERA = "  depth: {camera: {mount: {x: 0.05, z: 0.4}, width: 64, height: 64, field_of_view: 1.2, max_range: 5}}\n"
SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer wall, points: [[0, 0], [7, 0], [7, 4], [0, 4], [0, 0]]}]
  obstacles: [{name: obstacle, %s}]
robot: {model: waiter.robot.yaml, pose: {x: 1, y: 2}}
stack: {localizer: {type: ground_truth}}
goals: [{pose: {x: 6, y: 2}, timeout: 30 s}]
time_limit: 30 s
pass:
  - goals_reached: {}
  - collisions: {max: 0}
"""
LOW_BOX = "box: [0.3, 0.5, 0.12], pose: {x: 3.5, y: 2}"
TABLE_TOP = "box: [0.4, 0.6, 0.05], z: 0.5, pose: {x: 3.5, y: 2}"


def criterion_statuses(tmp_path: Path, obstacle: str, has_camera: bool) -> dict[str, str]:
    """Simulate a drive past an obstacle; return the status of each criterion."""
    (tmp_path / "waiter.robot.yaml").write_text(ROBOT + has_camera * CAMERA)
    file = tmp_path / "own.scenario.yaml"
    file.write_text(SCENARIO % obstacle)
    return {v.criterion: v.status.value for v in simulate(prepare(load_scenario(file, tmp_path))).result.verdicts}


@pytest.mark.sample(1)
@pytest.mark.parametrize("obstacle", [LOW_BOX, TABLE_TOP], ids=["low box", "table top"])
def test_depth_camera_prevents_a_collision_that_the_lidar_misses(tmp_path: Path, obstacle: str) -> None:
    assert criterion_statuses(tmp_path, obstacle, has_camera=False)["collisions"] == "fail"
    assert criterion_statuses(tmp_path, obstacle, has_camera=True) == {"goals_reached": "pass", "collisions": "pass"}
