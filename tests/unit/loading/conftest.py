"""A small valid world, robot and scenario to vary."""

from collections.abc import Callable
from pathlib import Path

import pytest

Write = Callable[[str, str], Path]

WORLD = """\
simscen: 1
walls:
  - {points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}
objects:
  - {name: cart, box: [0.5, 0.5, 1], pose: {x: 3, y: 2}}
places: {start: {x: 1, y: 1}, desk: {x: 5, y: 3}}
regions: {hall: [[0, 0], [2, 0], [2, 4]]}
"""
ROBOT = """\
simscen: 1
name: cube
body: [{box: [0.3, 0.3, 0.3]}]
mass: 5 kg
drive: {type: differential, wheel_radius: 5 cm, wheel_separation: 0.25}
limits: {linear: 0.5, angular: 1, linear_acceleration: 1, angular_acceleration: 2}
sensors:
  front: {lidar: {rate: 10 Hz}}
  odom: {odometry: {}}
"""
SCENARIO = """\
simscen: 1
world: room.world.yaml
robot: {model: cube.robot.yaml, pose: start}
goals: [{pose: desk}]
pass: [{goals_reached: {}}]
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a file below a fresh folder, which already holds the world and the robot."""

    def write_file(name: str, text: str) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    write_file("room.world.yaml", WORLD)
    write_file("cube.robot.yaml", ROBOT)
    return write_file


@pytest.fixture
def scenario() -> str:
    """The text of a valid scenario in that folder."""
    return SCENARIO
