"""Contract tests of all drives."""

import random
from pathlib import Path

import pytest
import yaml

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.robot import Holonomic, RobotSpec
from simscen.sim.body.from_spec import build_robot_body
from tests.single_robot import SingleRobotSimulation

ROBOTS = Path(__file__).parents[2] / "simscen/data/robots"
NAMES = sorted(path.name.removesuffix(".robot.yaml") for path in ROBOTS.glob("*.robot.yaml"))
RAMP_PERIOD_TICKS = 4


@pytest.fixture(params=NAMES)
def robot(request):
    """Return the specification of each shipped robot, and its simulation."""
    spec = RobotSpec.model_validate(yaml.safe_load((ROBOTS / f"{request.param}.robot.yaml").read_text()))
    simulation = SingleRobotSimulation(build_robot_body(spec))
    yield spec, simulation
    simulation.close()


def test_every_drive_type_has_a_shipped_robot():
    drives = {yaml.safe_load((ROBOTS / f"{name}.robot.yaml").read_text())["drive"]["type"] for name in NAMES}
    assert drives == {"differential", "skid_steer", "ackermann", "omnidirectional", "mecanum"}


def test_drive_respects_speed_and_acceleration_limits(robot):
    spec, simulation = robot
    limits, rng = spec.limits, random.Random(5)
    lateral = limits.lateral or limits.linear if isinstance(spec.drive, Holonomic) else 0.0
    max_acceleration = max(limits.linear_acceleration, limits.linear_deceleration or 0.0)
    before = STOP
    for _ in range(40):
        simulation.drive(Twist(*(rng.uniform(-9, 9) for _ in range(3))))
        simulation.step(24)
        now = simulation.truth().twist
        # A base with wheels that slip sideways turns a little further than commanded.
        assert -(limits.reverse or limits.linear) * 1.05 <= now.vx <= limits.linear * 1.05
        assert abs(now.wz) <= limits.angular * 1.3
        if isinstance(spec.drive, Holonomic):
            assert abs(now.vy) <= lateral * 1.01
        if spec.drive.type == "differential":
            assert abs(now.vx - before.vx) <= max_acceleration * (24 + RAMP_PERIOD_TICKS) / 240 * 1.1
        before = now


def test_base_follows_a_constant_command(robot):
    _, simulation = robot
    simulation.drive(Twist(0.4, 0.0, 0.3))
    simulation.step(720)
    twist = simulation.truth().twist
    assert twist.vx == pytest.approx(0.4, rel=0.03)
    assert twist.wz == pytest.approx(0.3, rel=0.25)  # skid steering is only as good as its turning scale


def test_encoders_do_not_detect_a_kidnapping(robot):
    _, simulation = robot
    simulation.drive(Twist(0.3, 0.0, 0.0))
    simulation.step(240)
    simulation.drive(STOP)
    simulation.step(240)
    before = simulation.encoders()
    simulation.place_robot(Pose2(5.0, 5.0, 2.0))
    simulation.step(60)
    assert simulation.encoders() == pytest.approx(before, abs=0.01)


def test_equal_commands_give_equal_motion(robot):
    spec, first = robot
    second = SingleRobotSimulation(build_robot_body(spec))
    for simulation in (first, second):
        for k in range(20):
            simulation.drive(Twist(0.4, 0.1, 0.1 * k - 1.0))
            simulation.step(18)
    assert first.truth() == second.truth()
    assert first.encoders() == second.encoders()
    second.close()
