"""Tests of turning in place to the heading of the goal, and of when the position of the goal is reached."""

from collections import deque

import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.stack.controllers.goal_rotation import GoalRotation
from simscen.testing.flatland import round_robot

PERIOD_S = 0.05


def simulate_turn(angle: float, seconds: float, delay: int) -> tuple[list[float], list[float]]:
    """Return the remaining angle and the turn rate of each period; the base executes commands `delay` periods late."""
    rotation = GoalRotation(round_robot(), 1.9, 3.2, PERIOD_S, 0.45)
    pending, rate = deque([0.0] * delay), 0.0
    angles, rates = [angle], [0.0]
    for _ in range(round(seconds / PERIOD_S)):
        pending.append(rotation.turn(angles[-1], Twist(0.0, 0.0, rate)).wz)
        rate = pending.popleft()
        angles.append(angles[-1] - rate * PERIOD_S)
        rates.append(rate)
    return angles, rates


@pytest.mark.parametrize(("angle", "delay"), [(2.0, 0), (-0.3, 0), (0.004, 0), (-0.3, 1), (0.004, 1)])
def test_base_stops_at_its_target_heading(angle: float, delay: int) -> None:
    angles, rates = simulate_turn(angle, 4.0, delay)
    assert max(map(abs, rates[-20:])) < 0.01
    assert abs(angles[-1]) < 0.01


def test_braking_does_not_start_earlier_than_needed() -> None:
    angles, _ = simulate_turn(2.0, 4.0, 0)
    assert next(step for step, angle in enumerate(angles) if angle < 0.125) * PERIOD_S < 1.75


def test_goal_is_approached_again_after_leaving_it() -> None:
    rotation, goal = GoalRotation(round_robot(), 1.9, 3.2, PERIOD_S, 0.45), Goal("g", Pose2(0.0, 0.0), xy_tolerance=0.2)
    assert rotation.is_position_reached(Pose2(0.05, 0.0), Twist(), goal, 0.05)
    assert rotation.is_position_reached(Pose2(0.15, 0.0), Twist(0.2), goal, 0.5)
    assert not rotation.is_position_reached(Pose2(0.25, 0.0), Twist(0.2), goal, 0.5)
    assert not rotation.is_position_reached(Pose2(0.15, 0.0), Twist(0.2), goal, 0.5)


@pytest.mark.parametrize("ratio", [0.2, 0.45, 1.0])
def test_the_position_is_reached_at_the_ratio_of_the_tolerance(ratio: float) -> None:
    goal = Goal("g", Pose2(0.0, 0.0), xy_tolerance=0.2)
    for distance, expected in ((ratio * 0.2 + 0.005, False), (ratio * 0.2 - 0.005, True)):
        rotation = GoalRotation(round_robot(), 1.9, 3.2, PERIOD_S, ratio)
        assert rotation.is_position_reached(Pose2(-distance, 0.0), Twist(0.2), goal, distance) is expected
