"""Tests of robot motion against closed forms."""

import math

import pybullet
import pytest
from simulation_helpers import box, measure_motion

from simscen.core.errors import RunError
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist

TICKS = 240


@pytest.mark.parametrize("robot", ["turtlebot", "amr", "jackal", "car", "omni"])
def test_a_robot_at_rest_stays_where_it_is(simulate, robot):
    simulation = simulate(robot)
    simulation.step(10 * TICKS)
    pose = simulation.truth().pose
    assert math.hypot(pose.x, pose.y) < 2e-4
    assert abs(pose.z) < 2e-4
    assert abs(pose.yaw) < 2e-3


@pytest.mark.parametrize("robot", ["turtlebot", "amr", "jackal", "car", "omni"])
def test_robot_drives_straight_at_the_commanded_speed(simulate, robot):
    simulation = simulate(robot, drive=(0.5, 0.0, 0.0))
    simulation.step(TICKS)
    start = simulation.truth().pose
    simulation.step(10 * TICKS)
    end = simulation.truth().pose
    assert end.x - start.x == pytest.approx(5.0, rel=2e-3)
    assert abs(end.y) < 5e-3
    assert abs(end.yaw) < 2e-3


@pytest.mark.parametrize("robot", ["turtlebot", "amr", "omni"])
def test_turn_in_place_has_the_commanded_rate_and_stays_in_place(simulate, robot):
    simulation = simulate(robot, drive=(0.0, 0.0, 1.0))
    simulation.step(TICKS)
    rotation, _ = measure_motion(simulation, round(2 * math.pi * TICKS / 6) * 6)
    assert rotation == pytest.approx(2 * math.pi, rel=2e-3)
    pose = simulation.truth().pose
    assert math.hypot(pose.x, pose.y) < 5e-3


@pytest.mark.parametrize(("robot", "speed", "turn"), [("turtlebot", 0.4, 0.5), ("amr", 0.8, 0.8), ("omni", 0.5, 0.5),
                                                      ("car", 0.8, 0.8)])  # fmt: skip
def test_a_circle_has_the_radius_of_speed_over_turn_rate(simulate, robot, speed, turn):
    simulation = simulate(robot, drive=(speed, 0.0, turn))
    simulation.step(2 * TICKS)
    rotation, length = measure_motion(simulation, 4 * TICKS)
    assert length / rotation == pytest.approx(speed / turn, rel=0.01)


def test_base_accelerates_and_brakes_at_its_limits(simulate):
    simulation = simulate("turtlebot", drive=(0.5, 0.0, 0.0))
    for tick in range(12, 96, 12):
        simulation.step(12)
        assert simulation.truth().twist.vx == pytest.approx(1.0 * tick / TICKS, abs=0.03)
    simulation.step(TICKS)
    simulation.drive(Twist(0.0, 0.0, 0.0))
    start = simulation.truth().pose.x
    simulation.step(TICKS)
    # v²/2a with 1.5 m/s², plus the distance of half a firmware period.
    assert simulation.truth().pose.x - start == pytest.approx(0.5**2 / 3.0, abs=0.008)
    assert abs(simulation.truth().twist.vx) < 1e-4


def test_commands_beyond_the_limits_are_clipped(simulate):
    simulation = simulate("turtlebot", drive=(9.0, 9.0, 0.0))
    simulation.step(2 * TICKS)
    assert simulation.truth().twist == pytest.approx((0.5, 0.0, 0.0), abs=2e-3)


def test_omnidirectional_base_drives_sideways_and_in_arcs(simulate):
    simulation = simulate("omni", drive=(0.3, 0.4, 0.0))
    simulation.step(2 * TICKS)
    assert simulation.truth().twist == pytest.approx((0.3, 0.4, 0.0), abs=1e-6)
    simulation.drive(Twist(0.3, 0.4, 1.0))
    simulation.step(TICKS)
    rotation, length = measure_motion(simulation, 3 * TICKS)
    assert length / rotation == pytest.approx(0.5, rel=2e-3)


def test_encoders_of_a_mecanum_base_count_two_wheels_in_diagonal_motion(simulate):
    """Closed form: two wheels turn at (vx + vy) / r, the other two not at all."""
    simulation = simulate("mecanum", drive=(0.3, 0.3, 0.0))
    simulation.step(2 * TICKS)
    before = simulation.encoders()
    simulation.step(TICKS)
    wheel_rotation = [b - a for a, b in zip(before, simulation.encoders(), strict=True)]
    assert wheel_rotation == pytest.approx([0.0, 0.6 / 0.0475, 0.6 / 0.0475, 0.0], abs=1e-4)
    assert simulation.truth().twist == pytest.approx((0.3, 0.3, 0.0), abs=1e-6)


def test_encoders_of_a_mecanum_base_count_all_wheels_in_a_turn(simulate):
    """Closed form: (lx + ly) wz / r, positive on the right."""
    simulation = simulate("mecanum", drive=(0.0, 0.0, 1.0))
    simulation.step(2 * TICKS)
    before = simulation.encoders()
    simulation.step(TICKS)
    wheel_rotation = [b - a for a, b in zip(before, simulation.encoders(), strict=True)]
    wheel = (0.235 + 0.15) / 0.0475
    assert wheel_rotation == pytest.approx([-wheel, wheel, -wheel, wheel], rel=1e-4)


def test_car_cannot_turn_in_place_or_tighter_than_its_steering_limit(simulate):
    simulation = simulate("car", drive=(0.0, 0.0, 1.0))
    simulation.step(2 * TICKS)
    assert abs(simulation.truth().pose.yaw) < 1e-3
    simulation.drive(Twist(0.5, 0.0, 1.8))
    simulation.step(2 * TICKS)
    rotation, length = measure_motion(simulation, 4 * TICKS)
    assert length / rotation == pytest.approx(0.45 / math.tan(0.51), rel=0.01)


def test_a_car_drives_a_three_point_turn(simulate):
    simulation = simulate("car")
    for speed, turn in ((0.5, 0.6), (-0.5, 0.6), (0.5, 0.6)):
        simulation.drive(Twist(speed, 0.0, turn))
        simulation.step(2 * TICKS)
    assert 0.5 * math.pi < simulation.truth().pose.yaw < 1.2 * math.pi


def test_skid_steered_robot_turns_less_than_its_wheels(simulate):
    """The ratio is 1 without slip, about 1.8 with the friction of the solver, and 1 + (a/b)² by Coulomb's law."""
    simulation = simulate("jackal", drive=(0.0, 0.0, 1.0))
    simulation.step(TICKS)
    left, right = simulation.encoders()
    rotation, _ = measure_motion(simulation, 4 * TICKS)
    after = simulation.encoders()
    wheel_rotation = (after[1] - right - after[0] + left) * 0.098 / 0.37559
    assert 1.2 < wheel_rotation / rotation < 1.9
    pose = simulation.truth().pose
    assert math.hypot(pose.x, pose.y) < 0.02


def test_a_jackal_brakes_from_full_speed_without_tipping(simulate):
    simulation = simulate("jackal", drive=(2.0, 0.0, 0.0))
    for command in ((2.0, 0.0, 0.0), (-2.0, 0.0, 0.0), (2.0, 0.0, 1.0), (0.0, 0.0, 0.0)):
        simulation.drive(Twist(*command))
        for _ in range(20):
            simulation.step(18)
            pose = simulation.truth().pose
            assert math.hypot(pose.qx, pose.qy) < 0.02


def test_placed_robot_is_at_rest_and_its_encoders_do_not_change(simulate):
    for robot in ("turtlebot", "omni"):
        simulation = simulate(robot, drive=(0.5, 0.0, 0.0))
        simulation.step(TICKS)
        before = simulation.encoders()
        simulation.drive(Twist(0.0, 0.0, 0.0))
        simulation.place_robot(Pose2(3.0, -2.0, 1.0))
        truth = simulation.truth()
        assert truth.pose.plane == pytest.approx(Pose2(3.0, -2.0, 1.0))
        assert truth.twist == pytest.approx((0.0, 0.0, 0.0))
        simulation.step(6)
        assert simulation.encoders() == pytest.approx(before, abs=0.02)


def test_push_moves_the_robot_in_its_direction(simulate):
    for robot in ("turtlebot", "jackal", "omni"):
        simulation = simulate(robot)
        simulation.push_robot((0.0, 30.0))
        simulation.step(30)
        pose = simulation.truth().pose
        assert pose.y > 0.01
        assert abs(pose.x) < 0.2 * pose.y


def test_a_push_in_free_flight_gives_the_robot_its_impulse(simulate):
    """Half a meter above the ground there is no friction: the change of momentum is the impulse."""
    simulation = simulate("turtlebot")
    position, orientation = pybullet.getBasePositionAndOrientation(
        simulation.robot.base.id, physicsClientId=simulation._scene.client
    )
    raised = (position[0], position[1], position[2] + 0.5)
    pybullet.resetBasePositionAndOrientation(
        simulation.robot.base.id, raised, orientation, physicsClientId=simulation._scene.client
    )
    simulation.push_robot((0.9, 0.0))
    simulation.step(1)
    assert simulation.robot.base_velocity()[0][0] == pytest.approx(0.9 / 1.8, rel=0.02)


def test_diverging_physics_raise_an_error_with_the_time(simulate):
    simulation = simulate("turtlebot", [box("wall", 0.5, 0, 0.1, 2)])
    simulation.step(120)
    pybullet.resetBaseVelocity(
        simulation.robot.base.id, (math.nan, 0, 0), (0, 0, 0), physicsClientId=simulation._scene.client
    )
    with pytest.raises(RunError, match=r"simulation diverged at t=0\.5"):
        for _ in range(10):
            simulation.step(6)
            simulation.truth()


@pytest.mark.parametrize("robot", ["turtlebot", "amr", "jackal", "car"])
def test_wheel_has_one_contact_point_with_the_ground_at_any_speed(simulate, robot):
    """By default, Bullet keeps up to three outdated points, which doubles the cost of a step."""
    simulation = simulate(robot, drive=(9.0, 0.0, 0.0))
    simulation.step(2 * TICKS)
    points = pybullet.getContactPoints(simulation.robot.base.id, physicsClientId=simulation._scene.client)
    touched = [point[3] for point in points if point[3] not in simulation.robot.base.hull_links]
    assert len(touched) == len(set(touched)) >= 2
