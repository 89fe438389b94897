"""Tests of third-party worlds and robots with `simscen run --world-path`."""

import subprocess
import sys
from pathlib import Path

import pytest

DATA = Path(__file__).parents[3] / "shared" / "data"

RUNS = {
    "a Nav2 demo with the map that came with it": (
        ["nav2_tb3_sandbox", "nav2_tb3_sandbox/models"],
        """\
simscen: 1
world: worlds/tb3_sandbox.sdf.xacro
map: tb3_sandbox.yaml
robot: {pose: {x: -2.0, y: -0.5}}
goals: [{pose: {x: 0.5, y: -0.6}, timeout: 60 s}]
pass: [{goals_reached: {}}, {collisions: {max: 0}}, {localization_error: {max: 0.3}}]
""",
    ),
    "a warehouse of meshes on a floor of its own": (
        ["aws_small_warehouse", "aws_small_warehouse/models"],
        """\
simscen: 1
world: worlds/no_roof_small_warehouse.world
robot: {model: amr, pose: {x: 0, y: -8, yaw: 90 deg}}
goals: [{pose: {x: 1.0, y: 2.0, yaw: 90 deg}, timeout: 60 s}]
pass: [{goals_reached: {}}, {collisions: {max: 0}}]
""",
    ),
    "a bare URDF among the cylinders of BARN, without a map": (
        ["barn_sample", "jackal_urdf"],
        """\
simscen: 1
world: world_1.world
map: none
robot: {model: jackal.urdf, pose: {x: -2.25, y: 3, yaw: 90 deg}}
goals: [{pose: {x: -2.25, y: 13}, xy_tolerance: 1 m, yaw_tolerance: 3.14, timeout: 100 s}]
pass: [{goals_reached: {}}, {collisions: {max: 0}}]
""",
    ),
    "a square of 2 m and a turn in place with a bare URDF": (
        ["jackal_urdf"],
        """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [5, 0], [5, 4], [0, 4], [0, 0]]}]}
robot: {model: jackal.urdf, pose: {x: 1, y: 1}}
goals:
  - {pose: {x: 3, y: 1, yaw: 90 deg}, timeout: 30 s}
  - {pose: {x: 3, y: 3, yaw: 180 deg}, timeout: 30 s}
  - {pose: {x: 1, y: 3, yaw: -90 deg}, timeout: 30 s}
  - {pose: {x: 1, y: 1, yaw: 0}, timeout: 30 s}
  - {pose: {x: 1, y: 1, yaw: 180 deg}, timeout: 30 s}
pass: [{goals_reached: {}}, {collisions: {max: 0}}]
""",
    ),
}


@pytest.mark.sample(2)
@pytest.mark.skipif(not DATA.is_dir(), reason="the worlds of others are not here: see CONTRIBUTING.md")
@pytest.mark.parametrize("what", RUNS)
def test_a_robot_reaches_its_goal_in(what: str, tmp_path: Path) -> None:
    folders, text = RUNS[what]
    (tmp_path / "a.scenario.yaml").write_text(text)
    allowed = [argument for folder in folders for argument in ("--world-path", str(DATA / folder))]
    command = [sys.executable, "-m", "simscen.cli.main", "run", "a.scenario.yaml", *allowed]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
