"""Tests of the collision checks of controllers with predicted obstacles."""

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
HERE, SPEED = Pose2(1.0, 0.0), Twist(0.5)
FAR = Goal("far", Pose2(8.0, 0.0))
OPEN = CostmapView(np.zeros((160, 200), np.uint8), np.full((160, 200), 2.0, np.float32), 0.05, (-2.0, -4.0))
PATH = Path(np.column_stack((np.arange(0.0, 8.0, 0.05), np.zeros(160), np.zeros(160))))
GONE, COMES, STANDS = (1.6, 0.0, 0.0, 2.0), (1.6, -1.0, 0.0, 1.2), (1.6, 0.0, 0.0, 0.0)
"""x, y, vx, vy of a disc of 0.2 m: on the arc now, and off it before the robot of 0.5 m/s is there; not on it now, and
there when the robot is; and one that stands."""


def among(*discs: tuple[float, float, float, float], deviation: float = 0.0) -> CostmapView:
    """A costmap with these on it and nothing else, all of whose places are known to so many meters."""
    obstacles = [MovingObstacle(complex(x, y), complex(vx, vy), 0.2, deviation**2, 0.0, 0.0) for x, y, vx, vy in discs]
    return replace(OPEN, moving=MovingObstacles(obstacles, 0.0))


def met(disc: tuple[float, float, float, float], speed: float, seconds: float = 1.0) -> bool:
    """Whether a robot that goes straight on at this speed meets the disc."""
    x, y, vx, vy = disc
    times = np.arange(0.0, seconds + 1e-9, 0.01)
    return bool((np.hypot(x + vx * times - HERE.x - speed * times, y + vy * times) < 0.4).any())


def controllers() -> list[Controller]:
    return [
        Rpp(RegulatedPurePursuit(desired_linear_vel=0.5), setting(ROBOT)),
        MppiController(Mppi(type="mppi", vx_max=0.5, batch_size=400), setting(ROBOT)),
        DynamicWindowController(DynamicWindow(type="dwb", max_vel_x=0.5), setting(ROBOT)),
    ]


def driven(controller: Controller, view: CostmapView, times: int = 20) -> Twist:
    """What it wants after a few looks at the same place: MPPI takes some to make up its mind."""
    controller.set_path(PATH)
    for _ in range(times):
        command = controller.command(HERE, SPEED, view, FAR)
    return command


@pytest.mark.parametrize("number", range(3), ids=["regulated pure pursuit", "mppi", "dwb"])
def test_controller_stops_only_for_predicted_obstacles_that_will_be_in_its_path(number: int) -> None:
    free = driven(controllers()[number], OPEN)
    assert met(STANDS, 0.5) and met(COMES, 0.5) and not met(GONE, 0.5)
    gone, comes = (driven(controllers()[number], among(disc)) for disc in (GONE, COMES))
    assert gone.vx > 0.9 * free.vx and abs(gone.wz) < 0.2
    assert comes.vx < 0.8 * free.vx or abs(comes.wz) > 0.2


def test_pure_pursuit_uses_the_highest_speed_that_lets_the_obstacle_pass() -> None:
    expected = max(part for part in (1.0, 0.75, 0.5, 0.25, 0.0) if not met(COMES, part * 0.5))
    assert 0.0 < expected < 1.0
    assert driven(controllers()[0], among(COMES)).vx == pytest.approx(expected * 0.5)


def test_pure_pursuit_waits_for_a_stopped_moving_obstacle_without_failing() -> None:
    assert driven(controllers()[0], among((1.45, 0.0, 0.0, 0.05))) == STOP


def test_pure_pursuit_without_collision_detection_ignores_obstacles() -> None:
    blind = Rpp(RegulatedPurePursuit(desired_linear_vel=0.5, use_collision_detection=False), setting(ROBOT))
    assert driven(blind, among(COMES)).vx == pytest.approx(0.5)


def test_uncertain_obstacle_gets_more_clearance() -> None:
    beside = (1.4, 0.45, 0.0, 0.0)
    assert driven(controllers()[0], among(beside)).vx == pytest.approx(0.5)
    assert driven(controllers()[0], among(beside, deviation=0.3)).vx < 0.5


def test_mppi_compares_each_step_with_predictions_for_that_step() -> None:
    """One rollout stands, one goes at 0.5 m/s; where nothing else costs, this is the whole of it."""
    times = 0.1 * np.arange(1, 11, dtype=np.float32)
    x = np.column_stack((0.0 * times, 0.5 * times))
    none = np.zeros_like(x)
    limits = VelocityLimits((0.0,) * 3, (1.0,) * 3, (9.0,) * 3, (-9.0,) * 3, 0.0)
    plan = UpcomingPath(np.column_stack((HERE.x + 0.5 * times, none)).astype(np.float64), 0.05, 0.5)
    rolled = Rollouts(x, none, none, np.stack((np.diff(x, axis=0, prepend=0) / 0.1, none)))
    for disc in (GONE, COMES):
        seen = CriticData(rolled, plan, HERE, 0.0, among(disc), Footprint(ROBOT, 0.05), limits, 0.1, 0.25)
        px, py = disc[0] - HERE.x + disc[2] * times, disc[1] + disc[3] * times
        gap = np.hypot(x - px[:, None], py[:, None]) - 0.4
        soon = np.exp(-times / COLLISION_DECAY_S)[:, None]
        near = (np.clip(1.0 - gap / MOVING_CLEARANCE_M, 0.0, 2.0) ** 2 * soon).mean(axis=0)
        hit = ((gap < 0.03) * soon).max(axis=0)
        cost, stuck = critics.cost_critic(model.MppiCostCritic(), seen)
        assert cost == pytest.approx(3.81 / 254 * (300.0 * near + 1e6 * hit), rel=1e-4, abs=1e-4)
        assert bool(hit[1]) is (disc is COMES) and not hit[0]
        assert not stuck.any()  # who meets all has still somewhere to go


def test_predicted_collision_uses_the_rotated_hull() -> None:
    footprint = Footprint(box_robot(length=1.0, width=0.4), 0.05)
    moving = among((2.0, 0.0, -1.0, 0.0)).moving
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2]])
    gaps = footprint.gap(moving, poses, np.array([0.0, 1.0, 1.0]))
    true = np.array([1.3, 0.3, 0.6])
    assert (gaps < true).all()
    assert (gaps > true - 0.15).all()  # a row of discs reaches a little beyond the hull


@pytest.mark.parametrize("horizon", [0.0, 0.01, 0.04, 0.06])
def test_motion_shorter_than_the_prediction_step_is_checked_completely(horizon: float) -> None:
    """Of a carrot that is all but reached."""
    free = CollisionChecker(Footprint(ROBOT, 0.05), 0.1)
    assert free.slow_down_for_moving(SPEED, among(GONE), HERE, horizon) == SPEED
    ahead = among((HERE.x + 0.403, 0.0, 0.0, 0.0))
    expected = max(part for part in (1.0, 0.75, 0.5, 0.25, 0.0) if part * 0.5 * horizon <= 0.003)
    assert free.slow_down_for_moving(SPEED, ahead, HERE, horizon).vx == pytest.approx(expected * 0.5)
