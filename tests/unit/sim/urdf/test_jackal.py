"""Tests of driving and slip of Clearpath's Jackal, built from its published URDF."""

import math
from pathlib import Path

import pytest

from simscen.core.geometry import wrap
from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import RobotSpec
from simscen.sim.body.from_spec import build_robot_body
from tests.single_robot import SingleRobotSimulation

JACKAL = Path(__file__).parents[5] / "shared/data/jackal_urdf"


@pytest.fixture
def jackal():
    if not JACKAL.is_dir():
        pytest.skip("shared/data/jackal_urdf is missing: see CONTRIBUTING.md")
    drive = {"type": "skid_steer", "wheel_radius": 0.098, "wheel_separation": 0.37559, "wheel_base": 0.262,
             "turning_scale": 1.6}  # fmt: skip
    limits = {"linear": 2.0, "angular": 4.0, "linear_acceleration": 3.0, "angular_acceleration": 8.0}
    spec = RobotSpec.model_validate(
        {"simscen": 1, "name": "jackal", "urdf": "jackal.urdf", "drive": drive, "limits": limits, "sensors": {}}
    )
    body = build_robot_body(spec, JACKAL / "jackal.robot.yaml", [JACKAL])
    simulation = SingleRobotSimulation(body)
    yield simulation
    simulation.close()


def drive_until(simulation, is_done, command, seconds):
    """Send `command(pose)` at 20 Hz until `is_done(pose)` for the true pose; fail after `seconds`."""
    for _ in range(round(seconds * 20)):
        if is_done(simulation.truth().pose.plane):
            simulation.drive(Twist())
            simulation.step(120)
            return
        simulation.drive(command(simulation.truth().pose.plane))
        simulation.step(12)
    pytest.fail(f"not done after {seconds} s: {simulation.truth().pose.plane}")


def test_the_jackal_drives_a_square_of_two_meters(jackal):
    """A controller with feedback from the true pose drives four sides and turns four times in place."""
    corners, odometer = [], jackal.encoders()
    for side in range(4):
        start, heading = jackal.truth().pose.plane, side * math.pi / 2
        drive_until(
            jackal,
            lambda pose, start=start: start.distance(pose) >= 2.0 - 0.04,
            lambda pose, heading=heading: Twist(0.5, 0.0, 2 * wrap(heading - pose.yaw)),
            seconds=10,
        )
        corners.append(jackal.truth().pose.plane)
        heading += math.pi / 2
        drive_until(
            jackal,
            lambda pose, heading=heading: wrap(heading - pose.yaw) <= 0.01,
            lambda pose, heading=heading: Twist(0.0, 0.0, min(1.0, 2 * wrap(heading - pose.yaw) + 0.1)),
            seconds=10,
        )
    for corner, (x, y) in zip(corners, ((2, 0), (2, 2), (0, 2), (0, 0)), strict=True):
        assert math.hypot(corner.x - x, corner.y - y) < 0.15
    assert wrap(jackal.truth().pose.yaw) == pytest.approx(0.0, abs=0.05)
    left, right = (now - before for now, before in zip(jackal.encoders(), odometer, strict=True))
    wheel_rotation = (right - left) * 0.098 / 0.37559
    assert wheel_rotation > 1.15 * 2 * math.pi, "the wheels turn farther than the robot"


def test_the_jackal_turns_in_place_and_its_wheels_slip(jackal):
    jackal.drive(Twist(0.0, 0.0, 1.0))
    jackal.step(240)
    start, encoders = jackal.truth().pose, jackal.encoders()
    jackal.step(480)
    end, after = jackal.truth().pose, jackal.encoders()
    rotation = math.remainder(end.yaw - start.yaw, 2 * math.pi)
    wheel_rotation = (after[1] - encoders[1] - after[0] + encoders[0]) * 0.098 / 0.37559
    assert math.hypot(end.x - start.x, end.y - start.y) < 0.1
    assert 1.2 < wheel_rotation / rotation < 2.0
