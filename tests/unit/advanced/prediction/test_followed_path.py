"""Tests of the predicted trajectory of a robot that follows a path."""

import math

import numpy as np
import pytest

from simscen.advanced.prediction.followed_path import FollowedPath
from simscen.advanced.prediction.rollouts import HORIZON_S, Rollouts
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.testing.flatland import box_robot

PATH = FollowedPath(np.column_stack((np.arange(0.0, 8.01, 0.05), np.zeros(161))))
"""Straight path along x, 8 m long."""
START_X_M = 2.0


def rollout(yaw: float, vx: float) -> Rollouts:
    """Return the trajectory of a robot on the path that keeps its velocity."""
    pose, twist = Pose2(START_X_M, 0.0, yaw), Twist(vx)
    return PATH.rollouts(pose, twist, twist, (1.0,), box_robot(), with_headings=True)


@pytest.mark.parametrize(("yaw", "vx"), [(0.0, 0.5), (math.pi, -0.5), (3.0, -0.5)], ids=["forward", "back", "oblique"])
def test_robot_drives_forward_or_backward_toward_the_end_of_the_path(yaw: float, vx: float) -> None:
    result = rollout(yaw, vx)
    assert result.x[0, -1] == pytest.approx(START_X_M + 0.5 * HORIZON_S)
    assert np.abs(np.cos(result.yaw[0]) - np.sign(vx)).max() < 1e-9
    twist = Twist(vx)
    position, _, deviation = PATH.position_over_time(Pose2(START_X_M, 0.0, yaw), twist, twist, box_robot())
    assert deviation == 0.0
    assert position(HORIZON_S).real == pytest.approx(START_X_M + 0.5 * HORIZON_S)


def test_robot_that_backs_up_against_the_path_keeps_its_heading() -> None:
    result = rollout(0.0, -0.5)
    assert result.x.max() <= START_X_M
    assert np.abs(result.yaw).max() < 1e-9
