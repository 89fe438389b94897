"""Slippery floor, against Coulomb's closed forms."""

import math

import pytest

from simscen.core.environment.world_model import Patch, disc_outline
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist

TICKS, GRAVITY = 240, 9.81


def square(left, low, right, high):
    return ((left, low), (right, low), (right, high), (left, high))


EVERYWHERE = square(-50, -50, 50, 50)


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.2])
def test_four_braked_wheels_slide_for_v_squared_over_2_mu_g(simulate, friction):
    simulation = simulate("jackal", drive=(1.0, 0.0, 0.0))
    simulation.step(3 * TICKS)
    simulation.add_friction_patch("ice", Patch(EVERYWHERE, friction))
    begin, speed = simulation.truth().pose.x, simulation.truth().twist.vx
    rolled = simulation.encoders()[0]
    simulation.drive(STOP)
    simulation.step(5 * TICKS)
    slid = simulation.truth().pose.x - begin
    braking = speed**2 / (2 * 3.0)  # the firmware's own way to stop, which is all that odometry sees
    assert slid == pytest.approx(speed**2 / (2 * friction * GRAVITY), rel=0.03)
    assert (simulation.encoders()[0] - rolled) * 0.098 == pytest.approx(braking, rel=0.25)
    assert slid > 1.4 * braking


def test_spinning_wheels_drive_no_faster_than_mu_g_and_odometry_counts_what_they_spin(simulate):
    simulation = simulate("jackal")
    simulation.add_friction_patch("ice", Patch(EVERYWHERE, 0.05))
    simulation.drive(Twist(2.0, 0.0, 0.0))
    simulation.step(2 * TICKS)
    assert simulation.truth().pose.x == pytest.approx(0.05 * GRAVITY * 2**2 / 2, rel=0.05)
    assert simulation.encoders()[0] * 0.098 > 2.5 * simulation.truth().pose.x


def test_one_side_on_oil_turns_a_robot_that_brakes(simulate):
    simulation = simulate("jackal", drive=(1.5, 0.0, 0.0))
    simulation.step(2 * TICKS)
    simulation.add_friction_patch("oil", Patch(square(-50, 0, 50, 50), 0.05))
    simulation.drive(STOP)
    simulation.step(TICKS)
    assert simulation.truth().pose.yaw < -math.radians(5)  # towards the side that holds


def test_what_is_laid_later_lies_on_top_and_dries_up(simulate):
    simulation = simulate("turtlebot")
    simulation.add_friction_patch("wet", Patch(EVERYWHERE, 0.3))
    simulation.add_friction_patch("oil", Patch(disc_outline((0.0, 0.0), 1.0), 0.1, until=24))
    floor = simulation._scene.floor
    assert (floor.friction(0.5, 0.0), floor.friction(2.0, 0.0), floor.friction(99.0, 0.0)) == (0.1, 0.3, 1.0)
    simulation.step(25)
    assert floor.friction(0.5, 0.0) == 0.3
    simulation.add_friction_patch("wet", Patch(EVERYWHERE, 1.0))
    simulation.step(1)
    assert floor.friction(0.5, 0.0) == 1.0


@pytest.mark.parametrize("robot", ["turtlebot", "jackal", "car", "omni"])
def test_a_patch_elsewhere_changes_nothing_at_all(simulate, robot):
    poses = []
    for patches in ([], [Patch(square(20, 20, 21, 21), 0.1)]):
        simulation = simulate(robot, drive=(0.4, 0.0, 0.3), pose=Pose2(0.1, 0.2, 0.3))
        for patch in patches:
            simulation.add_friction_patch("oil", patch)
        simulation.step(TICKS)
        poses.append((simulation.truth(), simulation.encoders()))
    assert poses[0] == poses[1]
