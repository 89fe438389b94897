"""Tests of slippery floors against Coulomb's closed forms."""

import math
from dataclasses import replace

import pytest
from simulation_helpers import box, robot_spec

from simscen.core.environment.world_model import FloorPatch, disc_outline
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.sim.body.from_spec import build_robot_body

TICKS, GRAVITY_M_S2 = 240, 9.81


def square(left, low, right, high):
    return ((left, low), (right, low), (right, high), (left, high))


WHOLE_FLOOR = square(-50, -50, 50, 50)


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.2])
def test_four_braked_wheels_slide_for_v_squared_over_2_mu_g(simulate, friction):
    simulation = simulate("jackal", drive=(1.0, 0.0, 0.0))
    simulation.step(3 * TICKS)
    simulation.add_friction_patch("ice", FloorPatch(WHOLE_FLOOR, friction))
    start, speed = simulation.truth().pose.x, simulation.truth().twist.vx
    encoder_start = simulation.encoders()[0]
    simulation.drive(STOP)
    simulation.step(5 * TICKS)
    sliding_distance = simulation.truth().pose.x - start
    braking_distance = speed**2 / (2 * 3.0)  # the braking distance of the firmware, which odometry measures
    assert sliding_distance == pytest.approx(speed**2 / (2 * friction * GRAVITY_M_S2), rel=0.03)
    assert (simulation.encoders()[0] - encoder_start) * 0.098 == pytest.approx(braking_distance, rel=0.25)
    assert sliding_distance > 1.4 * braking_distance


def test_spinning_wheels_accelerate_by_mu_g_and_odometry_counts_the_spin(simulate):
    simulation = simulate("jackal")
    simulation.add_friction_patch("ice", FloorPatch(WHOLE_FLOOR, 0.05))
    simulation.drive(Twist(2.0, 0.0, 0.0))
    simulation.step(2 * TICKS)
    assert simulation.truth().pose.x == pytest.approx(0.05 * GRAVITY_M_S2 * 2**2 / 2, rel=0.05)
    assert simulation.encoders()[0] * 0.098 > 2.5 * simulation.truth().pose.x


def test_braking_with_one_side_on_oil_turns_the_robot(simulate):
    simulation = simulate("jackal", drive=(1.5, 0.0, 0.0))
    simulation.step(2 * TICKS)
    simulation.add_friction_patch("oil", FloorPatch(square(-50, 0, 50, 50), 0.05))
    simulation.drive(STOP)
    simulation.step(TICKS)
    assert simulation.truth().pose.yaw < -math.radians(5)  # towards the side with grip


def test_newer_friction_patch_covers_older_ones_and_ends(simulate):
    simulation = simulate("turtlebot")
    simulation.add_friction_patch("wet", FloorPatch(WHOLE_FLOOR, 0.3))
    simulation.add_friction_patch("oil", FloorPatch(disc_outline((0.0, 0.0), 1.0), 0.1, until=24))
    floor = simulation._scene.floor
    assert (floor.friction(0.5, 0.0), floor.friction(2.0, 0.0), floor.friction(99.0, 0.0)) == (0.1, 0.3, 1.0)
    simulation.step(25)
    assert floor.friction(0.5, 0.0) == 0.3
    simulation.add_friction_patch("wet", FloorPatch(WHOLE_FLOOR, 1.0))
    simulation.step(1)
    assert floor.friction(0.5, 0.0) == 1.0


@pytest.mark.parametrize("robot", ["turtlebot", "jackal", "car", "omni"])
def test_distant_friction_patch_does_not_change_the_motion(simulate, robot):
    poses = []
    for patches in ([], [FloorPatch(square(20, 20, 21, 21), 0.1)]):
        simulation = simulate(robot, drive=(0.4, 0.0, 0.3), pose=Pose2(0.1, 0.2, 0.3))
        for patch in patches:
            simulation.add_friction_patch("oil", patch)
        simulation.step(TICKS)
        poses.append((simulation.truth(), simulation.encoders()))
    assert poses[0] == poses[1]


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_hull_slides_along_wall_by_coulombs_law(simulate, share):
    """A robot on ice is pressed against a wall, and pushed along it with `share` times the greatest friction force."""
    body = build_robot_body(robot_spec("jackal"))
    reach = max(x for x, _ in body.footprint)
    wall = box("wall", 1.0, 0.0, 1.0, 20.0)
    simulation = simulate(body, solids=[wall], pose=Pose2(0.5 - reach - 0.001, 0.0, 0.0))
    simulation.add_friction_patch("ice", FloorPatch(WHOLE_FLOOR, 0.0))
    normal_force = 0.5 * body.mass * GRAVITY_M_S2
    lateral_force = share * body.hull_friction * normal_force

    def press(ticks):
        for _ in range(ticks):
            simulation.push_robot((normal_force / TICKS, lateral_force / TICKS))
            simulation.step(1)

    press(TICKS // 4)
    before = simulation.truth().twist.vy
    press(TICKS)
    speed_gain = simulation.truth().twist.vy - before
    assert speed_gain == pytest.approx(
        max(0.0, lateral_force - body.hull_friction * normal_force) / body.mass, abs=0.03
    )


@pytest.mark.parametrize("friction", [0.5, 1.5])
def test_motors_of_planar_base_overcome_friction_of_hull_below_one(simulate, friction):
    """The motors press the base against the wall and push it along the wall with equal force."""
    body = replace(build_robot_body(robot_spec("omni")), hull_friction=friction)
    reach = max(x for x, _ in body.footprint)
    simulation = simulate(body, [box("wall", 1.0, 0.0, 1.0, 20.0)], pose=Pose2(0.499 - reach, 0.0, 0.0))
    simulation.drive(Twist(0.3, 0.2, 0.0))
    simulation.step(2 * TICKS)
    assert simulation.truth().twist.vy == pytest.approx(0.2 if friction < 1 else 0.0, abs=0.01)


def test_planar_base_at_rest_on_ice_is_pushed_away(simulate):
    simulation = simulate("omni")
    simulation.step(TICKS)
    simulation.add_friction_patch("ice", FloorPatch(WHOLE_FLOOR, 0.0))
    simulation.step(1)
    simulation.push_robot((20.0, 0.0))
    simulation.step(TICKS)
    assert simulation.truth().twist.vx == pytest.approx(20.0 / simulation.robot.body.mass, rel=0.01)


def test_casters_glide_without_friction(simulate):
    """A robot with its wheels on ice keeps its speed, although its hull has friction."""
    simulation = simulate("turtlebot", drive=(0.4, 0.0, 0.0))
    simulation.step(2 * TICKS)
    simulation.add_friction_patch("ice", FloorPatch(WHOLE_FLOOR, 0.0))
    simulation.drive(STOP)
    simulation.step(2 * TICKS)
    assert simulation.truth().twist.vx == pytest.approx(0.4, abs=0.005)
