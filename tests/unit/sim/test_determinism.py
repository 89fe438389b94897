"""Tests of the determinism of the simulation."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDERS = [str(Path(__file__).parents[k]) for k in (0, 3)]
"""Folders of the modules that the simulated code imports."""
RUN = """
import sys
sys.path[:0] = {folders}
from simulation_helpers import box, robot_spec
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.sim.body.from_spec import build_robot_body
from tests.single_robot import SingleRobotSimulation

solids = [box(f"box{{k}}", (k * 7 % 11) - 5, (k * 5 % 9) - 4, 0.3, 0.4) for k in range(60)]
solids = [solid for solid in solids if abs(solid.pose.x) + abs(solid.pose.y) > 1.0]
bodies = [
    Body("crate", (box("crate", 0, 0, 0.3, 0.3, 0.3),), Pose3(0.7, 0.1), mass=2.0),
    Body("cart", (box("cart", 0, 0, 0.5, 0.5),), Pose3(2, 2), path=MotionPath((0.0, 3.0), (Pose2(2, 2), Pose2(-2, 1)))),
]
if {reverse}:
    bodies.reverse()
body = build_robot_body(robot_spec({robot!r}))
simulation = SingleRobotSimulation(body, Pose2(0.1, 0.2, 0.3), solids, bodies)
for k in range(60):
    simulation.drive(Twist(0.5, 0.0, 0.4 - 0.02 * k))
    simulation.step(24)
    truth = simulation.truth()
    print(truth.pose, truth.twist, truth.clearance, sorted(truth.objects.items()), simulation.encoders())
print(simulation.robot.collisions())
"""


def run_in_new_process(robot):
    code = RUN.format(folders=FOLDERS, robot=robot, reverse=False)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


@pytest.fixture
def run_here(capsys):
    def run(robot, reverse=False):
        exec(RUN.format(folders=FOLDERS, robot=robot, reverse=reverse), {})
        return capsys.readouterr().out

    return run


def test_runs_in_the_same_and_in_a_new_process_are_equal(run_here):
    outputs = [run_here("turtlebot") for _ in range(2)]
    assert "collision.started" in outputs[0]
    assert outputs[0] == outputs[1] == run_in_new_process("turtlebot")


@pytest.mark.sample(1)
@pytest.mark.parametrize("robot", ["jackal", "car", "omni"])
def test_runs_in_two_new_processes_are_equal(robot):
    assert run_in_new_process(robot) == run_in_new_process(robot)


def test_order_of_bodies_does_not_change_the_run(run_here):
    assert run_here("amr") == run_here("amr", reverse=True)
