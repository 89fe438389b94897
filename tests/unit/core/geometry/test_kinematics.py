"""Tests of mecanum kinematics against single rollers and published equations."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry.kinematics import MecanumWheels, Twist

YOUBOT = MecanumWheels(radius=0.0475, half_track=0.15, half_base=0.235)
SPEED = st.floats(-3, 3)
WHEEL_SIGNS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Signs of the x and y coordinates of the wheels, in the order of MecanumWheels."""


@pytest.mark.parametrize(
    ("motion", "signs"),
    [
        (Twist(1, 0, 0), (1, 1, 1, 1)),
        (Twist(0, 1, 0), (-1, 1, 1, -1)),
        (Twist(0, 0, 1), (-1, 1, -1, 1)),
        (Twist(1, 1, 0), (0, 1, 1, 0)),
    ],
    ids=["ahead", "to the left", "turning left", "diagonally"],
)
def test_mecanum_wheels_have_the_usual_directions(motion, signs):
    assert tuple(round(math.copysign(1, w)) if abs(w) > 1e-9 else 0 for w in YOUBOT.speeds(motion)) == signs


def test_mecanum_kinematics_match_the_published_equations():
    """omega = 1/r (vx -+ vy -+ (lx + ly) wz), Taheri et al., for rollers at 45 degrees."""
    vx, vy, wz, r, k = 0.5, -0.3, 0.8, 0.0475, 0.15 + 0.235
    assert YOUBOT.speeds(Twist(vx, vy, wz)) == pytest.approx(
        [(vx - vy - k * wz) / r, (vx + vy + k * wz) / r, (vx + vy - k * wz) / r, (vx - vy + k * wz) / r]
    )


@given(SPEED, SPEED, SPEED, st.floats(0.3, 1.3))
def test_no_roller_slips_along_its_axis(vx, vy, wz, angle):
    """The roller on the ground has the angle `angle` to the axle. Along its axis, base and rim have the same speed."""
    wheels = MecanumWheels(0.05, 0.2, 0.3, 1 / math.tan(angle))
    for speed, (sign_x, sign_y) in zip(wheels.speeds(Twist(vx, vy, wz)), WHEEL_SIGNS, strict=True):
        ground_velocity = (vx - wz * sign_y * 0.2, vy + wz * sign_x * 0.3)
        axis = (math.sin(angle), -sign_x * sign_y * math.cos(angle))
        slip = (ground_velocity[0] - 0.05 * speed) * axis[0] + ground_velocity[1] * axis[1]
        assert slip == pytest.approx(0, abs=1e-9)


@given(SPEED, SPEED, SPEED, st.floats(0.3, 1.3))
def test_encoder_increments_reproduce_the_motion(vx, vy, wz, angle):
    wheels = MecanumWheels(0.05, 0.2, 0.3, 1 / math.tan(angle))
    assert wheels.motion(wheels.speeds(Twist(vx, vy, wz))) == pytest.approx((vx, vy, wz), abs=1e-9)


def test_inconsistent_wheel_speeds_give_no_motion():
    """Three motions have four wheel speeds. The pseudo-inverse ignores the combination that is no motion."""
    assert YOUBOT.motion((1.0, 1.0, -1.0, -1.0)) == pytest.approx((0, 0, 0), abs=1e-12)
