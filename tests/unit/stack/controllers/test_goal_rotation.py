"""Tests of turning in place to a heading."""

from collections import deque

import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.stack.controllers.goal_rotation import GoalRotation
from simscen.testing.flatland import round_robot

PERIOD = 0.05


def turned(angle: float, seconds: float, late: int) -> tuple[list[float], list[float]]:
    """Return the remaining angles and the turn rates of a base that executes commands after a number of periods."""
    pose = GoalRotation(round_robot(), 1.9, 3.2, PERIOD, 0.45)
    under_way, rate = deque([0.0] * late), 0.0
    left, rates = [angle], [0.0]
    for _ in range(round(seconds / PERIOD)):
        under_way.append(pose.turn(left[-1], Twist(0.0, 0.0, rate)).wz)
        rate = under_way.popleft()
        left.append(left[-1] - rate * PERIOD)
        rates.append(rate)
    return left, rates


@pytest.mark.parametrize(("angle", "late"), [(2.0, 0), (-0.3, 0), (0.004, 0), (-0.3, 1), (0.004, 1)])
def test_base_stops_at_its_target_heading(angle: float, late: int) -> None:
    left, rates = turned(angle, 4.0, late)
    assert max(map(abs, rates[-20:])) < 0.01
    assert abs(left[-1]) < 0.01


def test_braking_does_not_start_earlier_than_needed() -> None:
    left, _ = turned(2.0, 4.0, 0)
    assert next(step for step, angle in enumerate(left) if angle < 0.125) * PERIOD < 1.75


def test_goal_is_approached_again_after_leaving_it() -> None:
    pose, goal = GoalRotation(round_robot(), 1.9, 3.2, PERIOD, 0.45), Goal("g", Pose2(0.0, 0.0), xy_tolerance=0.2)
    assert pose.is_position_reached(Pose2(0.05, 0.0), Twist(), goal, 0.05)
    assert pose.is_position_reached(Pose2(0.15, 0.0), Twist(0.2), goal, 0.5)
    assert not pose.is_position_reached(Pose2(0.25, 0.0), Twist(0.2), goal, 0.5)
    assert not pose.is_position_reached(Pose2(0.15, 0.0), Twist(0.2), goal, 0.5)


@pytest.mark.parametrize("ratio", [0.2, 0.45, 1.0])
def test_the_position_is_reached_at_the_ratio_of_the_tolerance(ratio: float) -> None:
    goal = Goal("g", Pose2(0.0, 0.0), xy_tolerance=0.2)
    for distance, expected in ((ratio * 0.2 + 0.005, False), (ratio * 0.2 - 0.005, True)):
        rotation = GoalRotation(round_robot(), 1.9, 3.2, PERIOD, ratio)
        assert rotation.is_position_reached(Pose2(-distance, 0.0), Twist(0.2), goal, distance) is expected
