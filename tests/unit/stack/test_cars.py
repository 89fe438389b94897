"""Tests of the stack with a base that cannot turn in place."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Path
from simscen.model.velocity_commands import VelocitySmoother as SmootherSpec
from simscen.stack.commands import VelocitySmoother
from simscen.stack.costmap.layered_costmap import CostmapView
from simscen.stack.followed_plan import FollowedPlan
from simscen.stack.kinematics import cusps
from simscen.stack.protocols import RobotModel
from simscen.testing.flatland import box_robot

CAR = RobotModel(box_robot(0.6, 0.4).footprint, None, 1.0, 1.0, 0.0, 1.5, 2.0, 2.0, 3.0, turning_radius=0.6)
FREE_COSTMAP = CostmapView(np.zeros((80, 80), np.uint8), np.full((80, 80), 2.0, np.float32), 0.05, (-2.0, -2.0), 1)


def line(start: float, end: float, yaw: float) -> np.ndarray:
    """Return poses (21, 3) along x with a constant heading."""
    x = np.linspace(start, end, 21)
    return np.column_stack((x, np.zeros(21), np.full(21, yaw)))


def test_cusps_are_poses_between_forward_and_backward_motion() -> None:
    assert cusps(np.vstack((line(0, 1, 0.0), line(1, 0, 0.0)[1:], line(0, 1, 0.0)[1:]))).tolist() == [20, 40]
    assert cusps(line(1, 0, np.pi)).size == 0
    assert cusps(np.zeros((1, 3))).size == 0


def test_plan_is_missed_beside_it_or_at_its_end() -> None:
    plan = FollowedPlan(Path(line(0, 1, 0.0)), 0.2, FREE_COSTMAP)
    for pose, is_missed in ((Pose2(0.2, 0.1), False), (Pose2(0.4, 0.3), True), (Pose2(0.9, 0.0), False)):
        plan.locate(pose)
        assert plan.is_missed(pose) is is_missed
    plan.locate(Pose2(1.0, 0.0))
    assert plan.is_missed(Pose2(1.0, 0.0))


def test_smoother_keeps_the_curvature_of_a_car_while_it_accelerates() -> None:
    smoother = VelocitySmoother(SmootherSpec(), CAR, 0.05)
    for _ in range(5):
        command = smoother.smooth(Twist(0.8, 0.0, 0.4))
        assert command.wz / command.vx == pytest.approx(0.5)
    assert command.vx < 0.8
