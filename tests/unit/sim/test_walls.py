"""Tests of walls that are added to the engine when something comes near."""

import math
from itertools import product

import pybullet
import pytest
from playground import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, Cylinder, Solid
from simscen.sim.scene import walls

FOREST = [
    Solid(Cylinder(0.1, 1.0), Pose3(x, y, 0.5), f"post {x} {y}")
    for x, y in product(range(-60, 60, 3), range(-60, 60, 3))
    if abs(y) > 4
]
WORLD = [box("near wall", 2.0, 0, 0.2, 6.0), box("far wall", -9.0, 0, 1.0, 6.0), *FOREST]
CRATE = Body("crate", (box("crate", 0, 0, 1.0, 1.0, 0.2),), Pose3(-3.0), mass=5.0)


def into_a_wall(simulation):
    simulation.drive(Twist(0.5, 0.0, 0.0))


def pushed_into_a_wall_far_away(simulation):
    simulation.push_object("crate", (-50.0, 0.0))


def set_down_beside_a_post(simulation):
    simulation.robot.place(Pose2(30.0, 29.5, 1.5))
    simulation.drive(Twist(0.4, 0.0, 0.0))


@pytest.mark.sample(1)
@pytest.mark.parametrize("happens", [into_a_wall, pushed_into_a_wall_far_away, set_down_beside_a_post])
def test_a_large_world_is_that_in_which_all_walls_stand_from_the_start(simulate, monkeypatch, happens):
    """To the last bit until something touches a wall; from then on the engine solves contacts in another order."""
    courses = []
    for few in (10**9, 0):
        monkeypatch.setattr(walls, "SMALL_WORLD_FACES", few)
        simulation = simulate(solids=WORLD, bodies=[CRATE])
        happens(simulation)
        course = []
        for _ in range(160):
            simulation.step(6)
            course.append((simulation.truth().pose, simulation.object_pose("crate"), simulation.robot.collisions()))
        courses.append(course)
    at_once, near = courses
    touched = next((k for k, (_, crate, events) in enumerate(at_once) if events or crate.x < -7.8), None)
    assert touched is not None
    assert near[: touched - 1] == at_once[: touched - 1]
    assert [(event.tick, event.name) for event in near[touched][2]] == [
        (event.tick, event.name) for event in at_once[touched][2]
    ]
    assert near[-1][0].y == pytest.approx(at_once[-1][0].y, abs=0.01)
    assert near[-1][1].x == pytest.approx(at_once[-1][1].x, abs=0.01)


def test_walls_that_nothing_comes_near_are_not_put_up(simulate, monkeypatch):
    monkeypatch.setattr(walls, "SMALL_WORLD_FACES", 0)
    simulation = simulate(solids=WORLD, pose=Pose2(0.0, 4.0, math.pi))
    simulation.drive(Twist(0.5, 0.0, 0.0))
    for _ in range(320):
        simulation.step(6)
        simulation.truth()
    assert simulation.truth().pose.x == pytest.approx(-4.0, abs=0.2)
    assert pybullet.getNumBodies() < 12
