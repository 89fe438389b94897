"""Simulations that are closed when a test is over."""

import sys
from pathlib import Path

import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.single_robot import SingleRobotSimulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate

sys.path.insert(0, str(Path(__file__).parent))

from playground import shipped


@pytest.fixture
def simulate():
    """Makes simulations and closes them."""
    made = []

    def make(robot="turtlebot", solids=(), bodies=(), pose=Pose2(0.0, 0.0, 0.0), drive=None, **physics):
        body = build_robot_body(shipped(robot)) if isinstance(robot, str) else robot
        made.append(SingleRobotSimulation(merge_solids(solids), bodies, body, pose, triangulate, **physics))
        if drive:
            made[-1].drive(Twist(*drive))
        return made[-1]

    yield make
    for simulation in made:
        simulation.close()
