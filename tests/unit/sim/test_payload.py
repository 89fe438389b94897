"""Tests of payloads and weak motors against closed forms."""

import math

import pytest
from simulation_helpers import robot_spec

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP
from simscen.sim.body.climb_limits import compute_climb_limits
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.body.robot_body import add_payload, center_of_mass, is_stable, scale_motor_torque
from simscen.worlds.world_file import ramp_solid

TICKS, GRAVITY_M_S2 = 240, 9.81


def inertial_mass(body, payload):
    """Return the mass that the motors accelerate: robot, payload, and the inertia of wheels and rotors."""
    rotational_inertias = [wheel.inertia.tensor[1, 1] + wheel.rotor_inertia for wheel in body.wheels]
    return body.mass + payload + sum(i / w.radius**2 for i, w in zip(rotational_inertias, body.wheels, strict=True))


def motor_force(body):
    """Return the force of all wheels at the stall torque of their motors in N."""
    return sum(wheel.stall_torque / wheel.radius for wheel in body.wheels)


def test_braking_distance_of_an_overloaded_robot_is_v_squared_over_2_a(simulate):
    body = build_robot_body(robot_spec("turtlebot"))
    payload = 20.0
    deceleration = motor_force(body) / inertial_mass(body, payload)
    assert deceleration < 0.5 * body.limits.linear_deceleration
    simulation = simulate(add_payload(body, payload, (-0.02, 0.0, 0.1)), drive=(0.5, 0.0, 0.0))
    simulation.step(4 * TICKS)
    start = simulation.truth().pose.x
    simulation.drive(STOP)
    simulation.step(3 * TICKS)
    assert simulation.truth().pose.x - start == pytest.approx(0.5**2 / (2 * deceleration), rel=0.1)


def test_weak_motors_accelerate_by_force_over_inertia(simulate):
    body = scale_motor_torque(build_robot_body(robot_spec("turtlebot")), 0.05)
    simulation = simulate(body, drive=(0.5, 0.0, 0.0))
    simulation.step(TICKS)
    assert simulation.truth().twist.vx == pytest.approx(motor_force(body) / inertial_mass(body, 0.0), rel=0.1)


@pytest.mark.parametrize(("share", "climbs"), [(0.8, False), (1.3, True)])
def test_weak_motors_climb_slopes_up_to_their_force_over_the_weight(simulate, share, climbs):
    original, slope = build_robot_body(robot_spec("turtlebot")), math.radians(5)
    body = scale_motor_torque(original, share * math.sin(slope) * original.mass * GRAVITY_M_S2 / motor_force(original))
    assert (compute_climb_limits(body).slope > slope) == climbs
    simulation = simulate(body, [ramp_solid((0.5, 0), (4.5, 0), 2, 4 * math.tan(slope), "ramp")], pose=Pose2(2, 0, 0),
                          drive=(0.3, 0, 0))  # fmt: skip
    simulation.step(2 * TICKS)
    assert (simulation.base_pose().x > 2.0) == climbs


@pytest.mark.parametrize(("height", "tips"), [(0.4, False), (0.8, True)])
def test_robot_with_a_high_load_tips_over_backwards_on_a_steep_slope(simulate, height, tips):
    body, slope = add_payload(build_robot_body(robot_spec("jackal")), 50.0, (0.0, 0.0, height)), math.radians(15)
    assert (math.tan(slope) > 0.262 / 2 / center_of_mass(body)[2]) == tips
    simulation = simulate(body, [ramp_solid((0.5, 0), (3.5, 0), 2, 3 * math.tan(slope), "ramp")], pose=Pose2(2, 0, 0))
    simulation.step(2 * TICKS)
    pose = simulation.base_pose()
    upright = 1 - 2 * (pose.qx**2 + pose.qy**2)
    assert (upright < math.cos(1.5 * slope)) == tips


def test_robot_with_a_load_beside_its_wheels_is_unstable():
    body = build_robot_body(robot_spec("jackal"))
    assert is_stable(add_payload(body, 50.0, (0.0, 0.1, 0.3)))
    assert not is_stable(add_payload(body, 50.0, (0.0, 0.4, 0.3)))


def test_a_load_moves_the_center_of_mass_and_adds_its_inertia():
    body = build_robot_body(robot_spec("jackal"))
    loaded = add_payload(body, body.mass, (0.2, 0.0, 0.5))
    assert loaded.mass == pytest.approx(2 * body.mass)
    assert center_of_mass(loaded)[0] == pytest.approx(0.1 + center_of_mass(body)[0] / 2)
    assert loaded.chassis.tensor[1, 1] > body.chassis.tensor[1, 1]
