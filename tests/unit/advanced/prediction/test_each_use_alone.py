"""Tests that each use of the prediction alone prevents a collision."""

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


def least(heed: str, controller: str = "regulated_pure_pursuit") -> float:
    """The least clearance of a robot whose avoidance is off, where only the controller or the monitor is told."""
    world, grid = Flatland().room(7, 8), Flatland().room(7, 8).grid((-0.5, -0.5, 7.5, 8.5))
    own = {"type": controller, **CONTROLLERS[controller]}
    spec = StackSpec.model_validate({"profile": "advanced", "localizer": {"type": "ground_truth"}, "controller": own})
    goal = Goal("beyond", Pose2(6.0, 4.0))
    driven = drive(world, Pose2(1.0, 4.0), goal, robot=round_robot(), grid=grid, spec=spec)
    stack = driven.stack.inner
    stack._prediction.steer = lambda tick, command, *seen: command
    original = stack._on_costmaps_updated

    def update(tick: int, frames: Frames) -> None:
        original(tick, frames)
        if heed != "monitor":
            stack._monitor.set_moving_obstacles(NO_MOVING_OBSTACLES)
        if heed != "controller":
            stack._costmaps.local_costmap.moving = NO_MOVING_OBSTACLES

    stack._on_costmaps_updated = update
    world.discs.append((4.5, 0.5, 0.3))
    nearest = 9.0
    while driven.tick < 10.5 * TICK_RATE_HZ:
        world.discs[-1] = (4.5, min(max(4.0 - 0.8 * (6.5 - driven.tick / TICK_RATE_HZ), 0.5), 7.5), 0.3)
        driven.step()
        nearest = min(nearest, world.clearance(driven.robot, driven.pose))
    return nearest


def test_without_any_use_of_prediction_the_robot_collides() -> None:
    assert least("nobody") < 0.0


def test_the_collision_monitor_alone_brakes_for_it() -> None:
    assert least("monitor") > 0.0


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_each_controller_alone_avoids_the_crossing_obstacle(controller: str) -> None:
    assert least("controller", controller) > 0.0
