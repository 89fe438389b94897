"""Tests of how controllers react to the predicted positions of moving obstacles."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Path
from simscen.model import mppi as model
from simscen.model.controllers import DynamicWindow, RegulatedPurePursuit
from simscen.model.mppi import Mppi
from simscen.stack.controllers.collision_checker import CollisionChecker
from simscen.stack.controllers.dwb.controller import DynamicWindowController
from simscen.stack.controllers.mppi import critics
from simscen.stack.controllers.mppi.controller import MppiController
from simscen.stack.controllers.mppi.critic_data import COLLISION_DECAY_S, MOVING_CLEARANCE_M, CriticData
from simscen.stack.controllers.mppi.rollouts import Rollouts
from simscen.stack.controllers.path_handler import UpcomingPath
from simscen.stack.controllers.regulated_pure_pursuit import RegulatedPurePursuit as Rpp
from simscen.stack.footprint import Footprint
from simscen.stack.kinematics import VelocityLimits
from simscen.stack.moving_obstacles import MovingObstacle, MovingObstacles
from simscen.stack.protocols import Controller, CostmapView
from simscen.testing.flatland import box_robot, round_robot, setting

ROBOT = round_robot(radius=0.2, speed=1.0)
POSE, TWIST = Pose2(1.0, 0.0), Twist(0.5)
FAR = Goal("far", Pose2(8.0, 0.0))
FREE_COSTMAP = CostmapView(np.zeros((160, 200), np.uint8), np.full((160, 200), 2.0, np.float32), 0.05, (-2.0, -4.0))
PATH = Path(np.column_stack((np.arange(0.0, 8.0, 0.05), np.zeros(160), np.zeros(160))))
LEAVING, ENTERING, STANDING = (1.6, 0.0, 0.0, 2.0), (1.6, -1.0, 0.0, 1.2), (1.6, 0.0, 0.0, 0.0)
"""x, y, vx, vy of discs with a radius of 0.2 m. At 0.5 m/s, the robot hits ENTERING and STANDING. LEAVING is on the
path at first, but leaves it before the robot arrives."""


def view_of(*discs: tuple[float, float, float, float], deviation: float = 0.0) -> CostmapView:
    """Return an empty costmap with moving discs; `deviation` is the standard deviation of their positions in m."""
    obstacles = [MovingObstacle(complex(x, y), complex(vx, vy), 0.2, deviation**2, 0.0, 0.0) for x, y, vx, vy in discs]
    return replace(FREE_COSTMAP, moving=MovingObstacles(obstacles, 0.0))


def is_hit(disc: tuple[float, float, float, float], speed: float, seconds: float = 1.0) -> bool:
    """Return whether a robot that drives straight at this speed hits the disc."""
    x, y, vx, vy = disc
    times = np.arange(0.0, seconds + 1e-9, 0.01)
    return bool((np.hypot(x + vx * times - POSE.x - speed * times, y + vy * times) < 0.4).any())


def controllers() -> list[Controller]:
    return [
        Rpp(RegulatedPurePursuit(desired_linear_vel=0.5), setting(ROBOT)),
        MppiController(Mppi(type="mppi", vx_max=0.5, batch_size=400), setting(ROBOT)),
        DynamicWindowController(DynamicWindow(type="dwb", max_vel_x=0.5), setting(ROBOT)),
    ]


def final_command(controller: Controller, view: CostmapView, calls: int = 20) -> Twist:
    """Return the command of the last of several calls at the same pose, as MPPI needs some calls to converge."""
    controller.set_path(PATH)
    for _ in range(calls):
        command = controller.command(POSE, TWIST, view, FAR)
    return command


@pytest.mark.parametrize("index", range(3), ids=["regulated pure pursuit", "mppi", "dwb"])
def test_controller_reacts_only_to_obstacles_that_will_be_in_its_path(index: int) -> None:
    free = final_command(controllers()[index], FREE_COSTMAP)
    assert is_hit(STANDING, 0.5) and is_hit(ENTERING, 0.5) and not is_hit(LEAVING, 0.5)
    for_leaving, for_entering = (final_command(controllers()[index], view_of(disc)) for disc in (LEAVING, ENTERING))
    assert for_leaving.vx > 0.9 * free.vx and abs(for_leaving.wz) < 0.2
    assert for_entering.vx < 0.8 * free.vx or abs(for_entering.wz) > 0.2


def test_pure_pursuit_uses_the_highest_speed_that_lets_the_obstacle_pass() -> None:
    expected = max(ratio for ratio in (1.0, 0.75, 0.5, 0.25, 0.0) if not is_hit(ENTERING, ratio * 0.5))
    assert 0.0 < expected < 1.0
    assert final_command(controllers()[0], view_of(ENTERING)).vx == pytest.approx(expected * 0.5)


def test_pure_pursuit_waits_for_a_stopped_moving_obstacle_without_failing() -> None:
    assert final_command(controllers()[0], view_of((1.45, 0.0, 0.0, 0.05))) == STOP


def test_pure_pursuit_without_collision_detection_ignores_obstacles() -> None:
    controller = Rpp(RegulatedPurePursuit(desired_linear_vel=0.5, use_collision_detection=False), setting(ROBOT))
    assert final_command(controller, view_of(ENTERING)).vx == pytest.approx(0.5)


def test_uncertain_obstacle_gets_more_clearance() -> None:
    disc = (1.4, 0.45, 0.0, 0.0)
    assert final_command(controllers()[0], view_of(disc)).vx == pytest.approx(0.5)
    assert final_command(controllers()[0], view_of(disc, deviation=0.3)).vx < 0.5


def test_mppi_compares_each_step_with_predictions_for_that_step() -> None:
    """One rollout stands, and one drives at 0.5 m/s. Moving obstacles are the only source of costs."""
    times = 0.1 * np.arange(1, 11, dtype=np.float32)
    x = np.column_stack((0.0 * times, 0.5 * times))
    zeros = np.zeros_like(x)
    limits = VelocityLimits((0.0,) * 3, (1.0,) * 3, (9.0,) * 3, (-9.0,) * 3, 0.0)
    plan = UpcomingPath(np.column_stack((POSE.x + 0.5 * times, zeros)).astype(np.float64), 0.05, 0.5)
    rollouts = Rollouts(x, zeros, zeros, np.stack((np.diff(x, axis=0, prepend=0) / 0.1, zeros)))
    for disc in (LEAVING, ENTERING):
        data = CriticData(rollouts, plan, POSE, 0.0, view_of(disc), Footprint(ROBOT, 0.05), limits, 0.1, 0.25)
        px, py = disc[0] - POSE.x + disc[2] * times, disc[1] + disc[3] * times
        gap = np.hypot(x - px[:, None], py[:, None]) - 0.4
        decay = np.exp(-times / COLLISION_DECAY_S)[:, None]
        proximity = (np.clip(1.0 - gap / MOVING_CLEARANCE_M, 0.0, 2.0) ** 2 * decay).mean(axis=0)
        hit = ((gap < 0.03) * decay).max(axis=0)
        cost, is_colliding = critics.cost_critic(model.MppiCostCritic(), data)
        assert cost == pytest.approx(3.81 / 254 * (300.0 * proximity + 1e6 * hit), rel=1e-4, abs=1e-4)
        assert bool(hit[1]) is (disc is ENTERING) and not hit[0]
        assert not is_colliding.any()  # predicted collisions do not make a rollout invalid


def test_predicted_collision_uses_the_rotated_hull() -> None:
    footprint = Footprint(box_robot(length=1.0, width=0.4), 0.05)
    moving = view_of((2.0, 0.0, -1.0, 0.0)).moving
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2]])
    gaps = footprint.gap(moving, poses, np.array([0.0, 1.0, 1.0]))
    true_gaps = np.array([1.3, 0.3, 0.6])
    assert (gaps < true_gaps).all()
    assert (gaps > true_gaps - 0.15).all()  # the discs that approximate the hull are slightly larger


@pytest.mark.parametrize("horizon", [0.0, 0.01, 0.04, 0.06])
def test_motion_shorter_than_the_prediction_step_is_checked_completely(horizon: float) -> None:
    """The motion to a close carrot is that short."""
    checker = CollisionChecker(Footprint(ROBOT, 0.05), 0.1)
    assert checker.slow_down_for_moving(TWIST, view_of(LEAVING), POSE, horizon) == TWIST
    view = view_of((POSE.x + 0.403, 0.0, 0.0, 0.0))
    expected = max(ratio for ratio in (1.0, 0.75, 0.5, 0.25, 0.0) if ratio * 0.5 * horizon <= 0.003)
    assert checker.slow_down_for_moving(TWIST, view, POSE, horizon).vx == pytest.approx(expected * 0.5)
