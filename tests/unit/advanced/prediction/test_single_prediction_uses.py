"""Tests that the prediction prevents a collision if only the collision monitor or only the controller uses it."""

from typing import Any

import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.model.stack import StackSpec
from simscen.stack.frames import Frames
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, drive, round_robot

CONTROLLERS: dict[str, dict[str, Any]] = {
    "regulated_pure_pursuit": {},
    "dwb": {"vx_samples": 8, "vtheta_samples": 9},
    "mppi": {"batch_size": 300},
}


def min_clearance(user: str, controller: str = "regulated_pure_pursuit") -> float:
    """Return the minimum clearance if `user` (controller, monitor or none) is the only user of the prediction."""
    world, grid = Flatland().room(7, 8), Flatland().room(7, 8).grid((-0.5, -0.5, 7.5, 8.5))
    parts = {"localizer": {"type": "ground_truth"}, "controller": {"type": controller, **CONTROLLERS[controller]}}
    spec = StackSpec.model_validate({"profile": "advanced", **parts})
    goal = Goal("beyond", Pose2(6.0, 4.0))
    d = drive(world, Pose2(1.0, 4.0), goal, robot=round_robot(), grid=grid, spec=spec)
    stack = d.stack.inner
    stack._prediction.steer = lambda tick, command, *seen: command
    original = stack._on_costmaps_updated

    def update(tick: int, frames: Frames) -> None:
        original(tick, frames)
        if user != "monitor":
            stack._monitor.set_moving_obstacles(NO_MOVING_OBSTACLES)
        if user != "controller":
            stack._costmaps.local_costmap.moving = NO_MOVING_OBSTACLES

    stack._on_costmaps_updated = update
    world.discs.append((4.5, 0.5, 0.3))
    clearance = 9.0
    while d.tick < 10.5 * TICK_RATE_HZ:
        world.discs[-1] = (4.5, min(max(4.0 - 0.8 * (6.5 - d.tick / TICK_RATE_HZ), 0.5), 7.5), 0.3)
        d.step()
        clearance = min(clearance, world.clearance(d.robot, d.pose))
    return clearance


def test_robot_without_prediction_collides() -> None:
    assert min_clearance("none") < 0.0


def test_collision_monitor_with_prediction_prevents_the_collision() -> None:
    assert min_clearance("monitor") > 0.0


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_each_controller_with_prediction_prevents_the_collision(controller: str) -> None:
    assert min_clearance("controller", controller) > 0.0
