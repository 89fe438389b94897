"""Fixture that creates simulations and closes them after the test."""

import sys
from pathlib import Path

import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.sim.body.from_spec import build_robot_body
from tests.single_robot import SingleRobotSimulation

sys.path.insert(0, str(Path(__file__).parent))

from simulation_helpers import robot_spec


@pytest.fixture
def simulate():
    """Return a function that creates simulations, and close them after the test."""
    simulations = []

    def make(robot="turtlebot", solids=(), bodies=(), pose=Pose2(0.0, 0.0, 0.0), drive=None, **physics):
        body = build_robot_body(robot_spec(robot)) if isinstance(robot, str) else robot
        simulations.append(SingleRobotSimulation(body, pose, solids, bodies, **physics))
        if drive:
            simulations[-1].drive(Twist(*drive))
        return simulations[-1]

    yield make
    for simulation in simulations:
        simulation.close()
