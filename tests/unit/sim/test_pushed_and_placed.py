"""Tests of objects that are pushed, stopped, and teleported."""

import math

import pybullet
import pytest
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.core.records.events import EventKind

CRATE = (box("crate", 0, 0, 0.4, 0.4, 0.4),)


def crate(x=3.0, mass=5.0):
    return Body("crate", CRATE, Pose3(x), mass=mass)


def sliding_deceleration(simulation):
    """Return the deceleration of the sliding crate in m/s²."""
    places = []
    for _ in range(3):
        places.append(simulation.object_pose("crate").x)
        simulation.step(12)
    return (2 * places[1] - places[0] - places[2]) * 20.0**2


def test_pushed_crate_accelerates_by_force_minus_friction_for_the_duration(simulate):
    simulation = simulate(bodies=[crate()])
    simulation.push_object("crate", (10.0, 0.0))
    simulation.step(6)
    friction = sliding_deceleration(simulation)
    assert 1.0 < friction < 10.0
    simulation.step(480)
    start = simulation.object_pose("crate").x
    force, duration = 60.0, 0.5
    simulation.push_object("crate", (force * duration, 0.0), duration)
    simulation.step(120)
    speed = (force / 5.0 - friction) * duration
    assert simulation.object_pose("crate").x - start == pytest.approx(speed * duration / 2, rel=0.05)
    simulation.step(720)
    distance = speed * duration / 2 + speed**2 / (2 * friction)
    assert simulation.object_pose("crate").x - start == pytest.approx(distance, rel=0.05)


def test_long_resting_object_can_be_pushed(simulate):
    simulation = simulate(bodies=[crate()])
    simulation.step(240 * 6)
    before = simulation.object_pose("crate").x
    simulation.push_object("crate", (10.0, 0.0))
    simulation.step(240)
    assert simulation.object_pose("crate").x > before + 0.2


def test_pushed_crate_that_hits_the_robot_is_a_collision(simulate):
    simulation = simulate(bodies=[crate(1.0)])
    simulation.push_object("crate", (-25.0, 0.0))
    simulation.step(240)
    assert [event.name for event in simulation.robot.collisions()][:1] == ["crate"]


def test_push_of_an_immovable_or_removed_object_has_no_effect(simulate):
    simulation = simulate(bodies=[crate(mass=0.0)])
    assert simulation.mass("crate") == 0.0
    simulation.push_object("crate", (10.0, 0.0))
    simulation.push_object("crate", (10.0, 0.0), 1.0)
    simulation.step(24)
    assert simulation.object_pose("crate") == Pose3(3.0)
    simulation.remove("crate")
    simulation.step(24)


def test_teleported_object_keeps_its_mass(simulate):
    simulation = simulate(bodies=[crate()])
    simulation.push_object("crate", (10.0, 0.0))
    simulation.step(10)
    simulation.place("crate", Pose2(1.5, 1.5, math.pi / 4))
    simulation.step(240)
    assert simulation.object_pose("crate").plane == pytest.approx(Pose2(1.5, 1.5, math.pi / 4), abs=1e-4)
    assert simulation.mass("crate") == 5.0


def test_motion_returns_the_path_until_its_end(simulate):
    path = MotionPath((0.0, 1.0), (Pose2(3, 0), Pose2(3, 1)))
    simulation = simulate(bodies=[crate(mass=0.0)])
    assert simulation.motion("crate") is None
    simulation.move("crate", path)
    simulation.step(60)
    assert simulation.motion("crate") == (path, 0.25)
    simulation.step(180)
    assert simulation.motion("crate") is None


def test_force_on_the_robot_adds_its_impulse_evenly_over_its_duration(simulate):
    """Half a meter above the ground there is no friction: the change of momentum is force times time."""
    simulation = simulate("turtlebot")
    number, client = simulation.robot.base.id, simulation._scene.client
    position, orientation = pybullet.getBasePositionAndOrientation(number, physicsClientId=client)
    pybullet.resetBasePositionAndOrientation(
        number, (*position[:2], position[2] + 0.5), orientation, physicsClientId=client
    )
    simulation.push_robot((0.9, 0.0), 0.1)
    speeds = []
    for _ in range(3):
        simulation.step(12)
        speeds.append(simulation.robot.base_velocity()[0][0])
    assert speeds == pytest.approx([0.25, 0.5, 0.5], rel=0.03)


def test_placed_robot_touches_only_objects_at_its_new_pose(simulate):
    simulation = simulate(bodies=[crate(0.5, mass=0.0)])
    simulation.drive(Twist(0.5, 0.0, 0.0))
    simulation.step(240)
    assert simulation.robot.touching()
    simulation.place_robot(Pose2(-3.0, 0.0))
    assert not simulation.robot.touching()
    assert simulation.truth().clearance > 1.0
    assert [event.kind for event in simulation.robot.collisions()] == [
        EventKind.COLLISION_STARTED,
        EventKind.COLLISION_ENDED,
    ]
    simulation.place_robot(Pose2(0.5, 0.0))
    assert simulation.robot.touching()
    assert simulation.truth().clearance <= 0.0
