"""Tests of the limits of the velocity smoother."""

from dataclasses import replace

import pytest

from simscen.core.geometry.kinematics import Twist
from simscen.model.velocity_commands import VelocitySmoother as SmootherSpec
from simscen.stack.commands import VelocitySmoother
from simscen.testing.flatland import round_robot


def test_smoother_limits_acceleration_and_brakes_at_full_deceleration() -> None:
    robot = round_robot(linear_acceleration=1.0, linear_deceleration=4.0)
    smoother = VelocitySmoother(SmootherSpec(), robot, 0.1)
    assert [round(smoother.smooth(Twist(0.25)).vx, 6) for _ in range(4)] == [0.1, 0.2, 0.25, 0.25]
    assert smoother.smooth(Twist(0.0)).vx == 0.0
    assert smoother.smooth(Twist(wz=1.0)).wz == pytest.approx(0.32)


def test_smoother_stops_before_it_reverses() -> None:
    smoother = VelocitySmoother(SmootherSpec(), round_robot(), 0.05)
    smoother.reset(Twist(0.05))
    assert smoother.smooth(Twist(-0.5)).vx == 0.0
    assert smoother.smooth(Twist(-0.5)).vx == pytest.approx(-0.125)


def test_smoother_respects_its_limits() -> None:
    spec = SmootherSpec(max_decel=2.0, max_velocity=0.3, max_angular_velocity=0.5)
    smoother = VelocitySmoother(spec, round_robot(linear_deceleration=4.0), 0.1)
    smoother.reset(Twist(0.5))
    assert [round(smoother.smooth(Twist(0.5, 0.0, 2.0)).vx, 6) for _ in range(3)] == [0.3, 0.3, 0.3]
    assert smoother.smooth(Twist(0.5, 0.0, 2.0)).wz == 0.5
    assert smoother.smooth(Twist()).vx == pytest.approx(0.1)


def test_slowed_car_keeps_its_curvature() -> None:
    robot = replace(round_robot(), turning_radius=0.5)
    smoother = VelocitySmoother(SmootherSpec(max_velocity=0.2), robot, 0.1)
    smoother.reset(Twist(0.2, 0.0, 0.1))
    assert smoother.smooth(Twist(0.4, 0.0, 0.2)) == Twist(0.2, 0.0, pytest.approx(0.1))


def test_a_disabled_smoother_changes_nothing() -> None:
    assert VelocitySmoother(SmootherSpec(enabled=False), round_robot(), 0.1).smooth(Twist(9.0)) == Twist(9.0)
