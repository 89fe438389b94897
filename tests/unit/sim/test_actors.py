"""Tests of movable objects: scripted paths, pushes, spawning, and removal."""

import math

import pytest
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, Cylinder, Extrusion, MotionPath, Solid

CRATE = (box("crate", 0, 0, 0.4, 0.4, 0.4),)


def test_scripted_body_follows_its_path(simulate):
    path = MotionPath((0.0, 2.0), (Pose2(3, 0, 0), Pose2(3, 2, math.pi / 2)), start=1.0)
    simulation = simulate(bodies=[Body("cart", CRATE, Pose3(3.0), path=path)])
    simulation.step(480)
    assert simulation.robot.objects()["cart"].plane == pytest.approx(Pose2(3, 1, math.pi / 4))
    simulation.step(480)
    assert simulation.truth().objects["cart"].plane == pytest.approx(Pose2(3, 2, math.pi / 2))


def test_move_starts_the_path_at_the_current_time(simulate):
    simulation = simulate(bodies=[Body("cart", CRATE, Pose3(3.0))])
    simulation.step(240)
    simulation.move("cart", MotionPath((0.0, 1.0), (Pose2(3, 0), Pose2(3, 1))))
    simulation.step(120)
    assert simulation.object_pose("cart").plane == pytest.approx(Pose2(3, 0.5))


def test_pushable_body_can_be_moved_along_a_path(simulate):
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(3.0), mass=5.0)])
    simulation.move("crate", MotionPath((0.0, 1.0), (Pose2(3, 0), Pose2(4, 0))))
    simulation.step(240)
    assert simulation.object_pose("crate").plane == pytest.approx(Pose2(4, 0))


def test_spawned_bodies_exist_until_they_are_removed(simulate):
    simulation = simulate()
    simulation.spawn(Body("crate", CRATE, Pose3(1.0, 2.0)))
    assert simulation.object_pose("crate") == Pose3(1.0, 2.0)
    assert list(simulation.robot.bodies_and_poses()) == ["crate"]
    simulation.remove("crate")
    simulation.remove("no such thing")
    assert simulation.object_pose("crate") is None
    assert simulation.truth().objects == {}


def test_spawned_body_replaces_one_with_the_same_name(simulate):
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(1.0, 2.0))])
    simulation.spawn(Body("crate", CRATE, Pose3(-2.0)))
    assert dict(simulation.robot.objects()) == {"crate": Pose3(-2.0)}


def test_a_cart_pushes_a_crate_along(simulate):
    path = MotionPath((0.0, 4.0), (Pose2(2, 0), Pose2(4, 0)))
    crate = Body("crate", CRATE, Pose3(3.0), mass=10.0)
    simulation = simulate(bodies=[Body("cart", CRATE, Pose3(2.0), path=path), crate])
    simulation.step(960)
    assert simulation.object_pose("crate").x == pytest.approx(4.4, abs=0.01)


def test_friction_stops_a_pushed_crate(simulate):
    """The distance is v²/2µg; µ is the product of the friction of the crate, 0.6, and of the ground, 1.0."""
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(2.0), mass=10.0)])
    simulation.push_object("crate", (10.0, 0.0))
    simulation.step(480)
    assert simulation.object_pose("crate").x - 2.0 == pytest.approx(1 / (2 * 0.6 * 9.81), rel=0.15)


@pytest.mark.parametrize("mass", [0.0, 5.0])
def test_bodies_of_any_shape_stay_where_they_were_placed(simulate, mass):
    corner = Solid(Extrusion(((0, 0), (0.4, 0), (0.4, 0.2), (0.2, 0.2), (0.2, 0.4), (0, 0.4)), 0.5))
    drum = Solid(Cylinder(0.2, 0.5), Pose3(z=0.25))
    bodies = [Body("corner", (corner,), Pose3(2, 0), mass), Body("drum", (drum,), Pose3(-2, 0), mass),
              Body("both", (corner, drum), Pose3(0, 3), mass)]  # fmt: skip
    simulation = simulate(bodies=bodies)
    simulation.step(240)
    for body in bodies:
        pose = simulation.object_pose(body.name)
        assert pose.position == pytest.approx(body.pose.position, abs=2e-3)
        assert pose.yaw == pytest.approx(0.0, abs=5e-3)
