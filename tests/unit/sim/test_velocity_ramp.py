"""Tests of the velocity ramp, which limits the acceleration of commands."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.robot import Limits
from simscen.sim.robots.velocity_ramp import VelocityRamp

LIMITS = Limits(
    linear=1.0, reverse=0.5, angular=2.0, linear_acceleration=1.0, linear_deceleration=2.0, angular_acceleration=4.0
)
PERIOD_S = 0.1
speeds = st.floats(-3, 3)


@given(st.lists(st.builds(Twist, speeds, speeds, speeds), min_size=1, max_size=40))
def test_velocity_and_acceleration_never_exceed_the_limits(commands):
    ramp, before = VelocityRamp(LIMITS, PERIOD_S, is_holonomic=False), STOP
    for command in commands:
        ramp.command(command)
        ramp.advance()
        now = ramp.velocity
        assert -0.5 <= now.vx <= 1.0 and now.vy == 0 and abs(now.wz) <= 2.0
        is_slower = abs(now.vx) <= abs(before.vx)
        assert abs(now.vx - before.vx) <= (2.0 if is_slower else 1.0) * PERIOD_S + 1e-12
        assert abs(now.wz - before.wz) <= 4.0 * PERIOD_S + 1e-12
        before = now


def test_velocity_ramp_reaches_the_command_and_then_stops():
    ramp = VelocityRamp(LIMITS, PERIOD_S, is_holonomic=False)
    ramp.command(Twist(0.25, 0.0, 0.0))
    assert [ramp.advance() for _ in range(4)] == [True, True, True, False]
    assert ramp.velocity == Twist(0.25, 0.0, 0.0)


def test_reversing_brakes_to_a_stop_first():
    ramp = VelocityRamp(LIMITS, PERIOD_S, is_holonomic=False)
    ramp.command(Twist(0.1, 0.0, 0.0))
    ramp.advance()
    ramp.command(Twist(-0.5, 0.0, 0.0))
    ramp.advance()
    assert ramp.velocity.vx == 0.0
    ramp.advance()
    assert ramp.velocity.vx == pytest.approx(-0.1)


def test_holonomic_base_drives_sideways_within_the_limits():
    ramp = VelocityRamp(LIMITS, PERIOD_S, is_holonomic=True)
    ramp.command(Twist(0.0, 5.0, 0.0))
    for _ in range(20):
        ramp.advance()
    assert ramp.velocity == Twist(0.0, 1.0, 0.0)
