"""Tests of walls that are added to the engine when a body comes near."""

import math
from itertools import product

import pybullet
import pytest
from simulation_helpers import box

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


def drive_into_a_wall(simulation):
    simulation.drive(Twist(0.5, 0.0, 0.0))


def push_crate_into_a_distant_wall(simulation):
    simulation.push_object("crate", (-50.0, 0.0))


def place_beside_a_post(simulation):
    simulation.place_robot(Pose2(30.0, 29.5, 1.5))
    simulation.drive(Twist(0.4, 0.0, 0.0))


@pytest.mark.sample(1)
@pytest.mark.parametrize("action", [drive_into_a_wall, push_crate_into_a_distant_wall, place_beside_a_post])
def test_run_with_walls_added_later_equals_one_with_all_walls_from_the_start(simulate, monkeypatch, action):
    """Equal to the last bit until a body touches a wall; then the engine solves contacts in another order."""
    runs = []
    for max_faces in (10**9, 0):
        monkeypatch.setattr(walls, "SMALL_WORLD_FACES", max_faces)
        simulation = simulate(solids=WORLD, bodies=[CRATE])
        action(simulation)
        samples = []
        for _ in range(160):
            simulation.step(6)
            samples.append((simulation.truth().pose, simulation.object_pose("crate"), simulation.robot.collisions()))
        runs.append(samples)
    all_walls, near_walls = runs
    touched = next((k for k, (_, crate, events) in enumerate(all_walls) if events or crate.x < -7.8), None)
    assert touched is not None
    assert near_walls[: touched - 1] == all_walls[: touched - 1]
    assert [(event.tick, event.name) for event in near_walls[touched][2]] == [
        (event.tick, event.name) for event in all_walls[touched][2]
    ]
    assert near_walls[-1][0].y == pytest.approx(all_walls[-1][0].y, abs=0.01)
    assert near_walls[-1][1].x == pytest.approx(all_walls[-1][1].x, abs=0.01)


def test_walls_without_bodies_near_them_are_not_added_to_the_engine(simulate, monkeypatch):
    monkeypatch.setattr(walls, "SMALL_WORLD_FACES", 0)
    simulation = simulate(solids=WORLD, pose=Pose2(0.0, 4.0, math.pi))
    simulation.drive(Twist(0.5, 0.0, 0.0))
    for _ in range(320):
        simulation.step(6)
        simulation.truth()
    assert simulation.truth().pose.x == pytest.approx(-4.0, abs=0.2)
    assert pybullet.getNumBodies() < 12
