"""Tests of objects that are pushed, stopped, and teleported."""

import math

import pybullet
import pytest
from playground import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.core.records.events import EventKind

CRATE = (box("crate", 0, 0, 0.4, 0.4, 0.4),)


def crate(x=3.0, mass=5.0):
    return Body("crate", CRATE, Pose3(x), mass=mass)


def slowing(simulation):
    """The deceleration in m/s² that friction gives it while it slides."""
    places = []
    for _ in range(3):
        places.append(simulation.object_pose("crate").x)
        simulation.step(12)
    return (2 * places[1] - places[0] - places[2]) * 20.0**2


def test_a_force_accelerates_by_newton_and_friction_and_no_longer_than_it_lasts(simulate):
    simulation = simulate(bodies=[crate()])
    simulation.push_object("crate", (10.0, 0.0))
    simulation.step(6)
    friction = slowing(simulation)
    assert 1.0 < friction < 10.0
    simulation.step(480)
    begin = simulation.object_pose("crate").x
    force, lasts = 60.0, 0.5
    simulation.push_object("crate", (force * lasts, 0.0), lasts)
    simulation.step(120)
    speed = (force / 5.0 - friction) * lasts
    assert simulation.object_pose("crate").x - begin == pytest.approx(speed * lasts / 2, rel=0.05)
    simulation.step(720)
    way = speed * lasts / 2 + speed**2 / (2 * friction)
    assert simulation.object_pose("crate").x - begin == pytest.approx(way, rel=0.05)


def test_long_resting_object_can_be_pushed(simulate):
    simulation = simulate(bodies=[crate()])
    simulation.step(240 * 6)
    before = simulation.object_pose("crate").x
    simulation.push_object("crate", (10.0, 0.0))
    simulation.step(240)
    assert simulation.object_pose("crate").x > before + 0.2


def test_a_pushed_crate_that_hits_the_robot_is_felt(simulate):
    simulation = simulate(bodies=[crate(1.0)])
    simulation.push_object("crate", (-25.0, 0.0))
    simulation.step(240)
    assert [event.name for event in simulation.robot.collisions()][:1] == ["crate"]


def test_push_of_an_unmovable_or_removed_object_fails(simulate):
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


def test_motion_tells_the_path_until_it_is_over(simulate):
    path = MotionPath((0.0, 1.0), (Pose2(3, 0), Pose2(3, 1)))
    simulation = simulate(bodies=[crate(mass=0.0)])
    assert simulation.motion("crate") is None
    simulation.move("crate", path)
    simulation.step(60)
    assert simulation.motion("crate") == (path, 0.25)
    simulation.step(180)
    assert simulation.motion("crate") is None


def test_a_force_on_the_robot_adds_up_to_its_impulse_evenly_and_ends(simulate):
    """Half a meter above the ground there is no friction: the change of momentum is force times time."""
    simulation = simulate("turtlebot")
    number, client = simulation.robot.base.id, simulation._scene.client
    place, turn = pybullet.getBasePositionAndOrientation(number, physicsClientId=client)
    pybullet.resetBasePositionAndOrientation(number, (*place[:2], place[2] + 0.5), turn, physicsClientId=client)
    simulation.robot.push_for((0.9, 0.0), 0.1)
    speeds = []
    for _ in range(3):
        simulation.step(12)
        speeds.append(simulation.robot.base_velocity()[0][0])
    assert speeds == pytest.approx([0.25, 0.5, 0.5], rel=0.03)


def test_a_robot_that_is_placed_elsewhere_touches_only_what_is_there(simulate):
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
