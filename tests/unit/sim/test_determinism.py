"""Tests of the determinism of the simulation."""

import subprocess
import sys
from pathlib import Path

import pytest

RUN = """
import sys
sys.path.insert(0, {folder!r})
from playground import box, shipped
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.single_robot import SingleRobotSimulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate

solids = [box(f"box{{k}}", (k * 7 % 11) - 5, (k * 5 % 9) - 4, 0.3, 0.4) for k in range(60)]
solids = [solid for solid in solids if abs(solid.pose.x) + abs(solid.pose.y) > 1.0]
bodies = [
    Body("crate", (box("crate", 0, 0, 0.3, 0.3, 0.3),), Pose3(0.7, 0.1), mass=2.0),
    Body("cart", (box("cart", 0, 0, 0.5, 0.5),), Pose3(2, 2), path=MotionPath((0.0, 3.0), (Pose2(2, 2), Pose2(-2, 1)))),
]
if {turned}:
    bodies.reverse()
body = build_robot_body(shipped({robot!r}))
simulation = SingleRobotSimulation(merge_solids(solids), bodies, body, Pose2(0.1, 0.2, 0.3), triangulate)
for k in range(60):
    simulation.drive(Twist(0.5, 0.0, 0.4 - 0.02 * k))
    simulation.step(24)
    truth = simulation.truth()
    print(truth.pose, truth.twist, truth.clearance, sorted(truth.objects.items()), simulation.encoders())
print(simulation.robot.collisions())
"""


def fresh(robot, turned=False):
    code = RUN.format(folder=str(Path(__file__).parent), robot=robot, turned=turned)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


def test_two_runs_in_one_process_and_one_in_a_fresh_one_are_equal(capsys):
    code = RUN.format(folder=str(Path(__file__).parent), robot="turtlebot", turned=False)
    outputs = []
    for _ in range(2):
        exec(code, {})
        outputs.append(capsys.readouterr().out)
    assert "collision.started" in outputs[0]
    assert outputs[0] == outputs[1] == fresh("turtlebot")


@pytest.mark.sample(1)
@pytest.mark.parametrize("robot", ["jackal", "car", "omni"])
def test_two_fresh_processes_are_equal(robot):
    assert fresh(robot) == fresh(robot)


def test_the_order_in_which_bodies_are_given_changes_nothing():
    assert fresh("amr") == fresh("amr", turned=True)
