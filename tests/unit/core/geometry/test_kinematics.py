"""Tests of mecanum kinematics against single rollers and published equations."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry.kinematics import MecanumWheels, Twist

YOUBOT = MecanumWheels(radius=0.0475, half_track=0.15, half_base=0.235)
SPEED = st.floats(-3, 3)
PLACES = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Signs of x and y of the wheels, in their order."""


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
    """The roller on the ground lies at `angle` to the axle; along it the base moves just as the wheel's rim does."""
    wheels = MecanumWheels(0.05, 0.2, 0.3, 1 / math.tan(angle))
    for speed, (ahead, left) in zip(wheels.speeds(Twist(vx, vy, wz)), PLACES, strict=True):
        over_ground = (vx - wz * left * 0.2, vy + wz * ahead * 0.3)
        axis = (math.sin(angle), -ahead * left * math.cos(angle))
        slip = (over_ground[0] - 0.05 * speed) * axis[0] + over_ground[1] * axis[1]
        assert slip == pytest.approx(0, abs=1e-9)


@given(SPEED, SPEED, SPEED, st.floats(0.3, 1.3))
def test_encoder_increments_reproduce_the_motion(vx, vy, wz, angle):
    wheels = MecanumWheels(0.05, 0.2, 0.3, 1 / math.tan(angle))
    assert wheels.motion(wheels.speeds(Twist(vx, vy, wz))) == pytest.approx((vx, vy, wz), abs=1e-9)


def test_inconsistent_wheel_speeds_give_no_motion():
    """One direction of the four speeds is no motion at all: the pseudo-inverse leaves it out."""
    assert YOUBOT.motion((1.0, 1.0, -1.0, -1.0)) == pytest.approx((0, 0, 0), abs=1e-12)
