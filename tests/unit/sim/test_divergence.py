"""Tests of divergence: a body falls through the floor, flies off, or has no finite pose."""

import math

import pybullet
import pytest
from simulation_helpers import box

from simscen.core.errors import RunError
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body

BOX = (box("box", 0, 0, 0.5, 0.5, 0.5),)


def move_in_engine(simulation, name, position):
    """Set the position of an object, or of the robot (""), in the engine."""
    number = simulation._scene.actors._actors[name].id if name else simulation.robot.base.id
    pybullet.resetBasePositionAndOrientation(number, position, (0, 0, 0, 1), physicsClientId=simulation._scene.client)


@pytest.mark.parametrize("name", ["box", ""])
@pytest.mark.parametrize(
    ("position", "message"),
    [
        ((2.0, 0.0, -0.5), "is below the floor"),
        ((2e5, 0.0, 0.3), "has left the world"),
        ((math.nan, 0.0, 0.3), "is not finite"),
    ],
)
def test_body_outside_the_world_is_a_divergence(simulate, name, position, message):
    simulation = simulate(bodies=[Body("box", BOX, Pose3(2.0), 3.0)])
    simulation.step(18)
    simulation.truth()
    simulation.step(6)
    move_in_engine(simulation, name, position)
    with pytest.raises(RunError, match=r"simulation diverged at t=0\.100 s") as error:
        simulation.truth()
    assert error.value.kind == "diverged"
    assert message in str(error.value)
    assert ('"box"' if name else "the robot") in str(error.value)


def test_too_heavy_object_is_an_error(simulate):
    simulation = simulate(bodies=[Body("anvil", BOX, Pose3(2.0), 1e12)])
    with pytest.raises(RunError, match='"anvil" is below the floor'):
        for _ in range(40):
            simulation.step(6)
            simulation.truth()


def test_falling_flat_and_overturned_objects_are_no_divergence(simulate):
    plate = (box("plate", 0, 0, 0.4, 0.4, 0.01),)
    falling = Body("falling", BOX, Pose3(3.0, 0.0, 1.0), 5.0)
    tall = Body("tall", (box("tall", 0, 0, 0.1, 0.1, 1.2),), Pose3(0.5), 1.0)
    simulation = simulate("amr", bodies=[Body("plate", plate, Pose3(-2.0), 1.0), falling, tall], drive=(0.5, 0.0, 0.0))
    for _ in range(80):
        simulation.step(12)
        simulation.truth()
    assert simulation.object_pose("falling").z == pytest.approx(0.0, abs=2e-3)
