"""Tests of sideways motion with each controller."""

from typing import Any

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.model.stack import StackSpec
from simscen.testing.flatland import Drive, Flatland, drive, round_robot

BESIDE = Goal("beside", Pose2(3.3, 4.2, 0.0))
DWB = {"type": "dwb", "vx_samples": 8, "vtheta_samples": 9}
MPPI = {"type": "mppi", "batch_size": 400}


def drive_sideways(max_lateral: float, **controller: Any) -> Drive:
    """Return the drive of a base along x to a goal on its left with the same heading."""
    world, robot = Flatland().room(7, 7), round_robot(max_lateral=max_lateral)
    spec = StackSpec.model_validate({"localizer": {"type": "ground_truth"}, "controller": controller})
    grid = world.grid((-0.5, -0.5, 7.5, 7.5))
    return drive(world, Pose2(3.0, 3.0), BESIDE, robot=robot, grid=grid, spec=spec).run(30)


def max_lateral_speed(d: Drive) -> float:
    return float(np.abs([command.vy for command in d.commands]).max())


@pytest.mark.parametrize("controller", [DWB, MPPI], ids=["dwb", "mppi"])
def test_strafing_speed_of_an_omnidirectional_base_is_limited(controller: dict[str, Any]) -> None:
    d = drive_sideways(0.3, **controller)
    assert d.result == "SUCCEEDED"
    assert 0.2 < max_lateral_speed(d) <= 0.3 + 1e-6


def test_omnidirectional_base_hardly_turns_with_mppi() -> None:
    d = drive_sideways(0.5, **MPPI)
    assert max(abs(pose.yaw) for pose in d.track) < 0.8


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "controller", [{**DWB, "max_vel_y": 0.0}, {**MPPI, "motion_model": "DiffDrive"}, {**MPPI, "vy_max": 0.0}],
    ids=["dwb", "mppi as a diff drive", "mppi without vy"],
)  # fmt: skip
def test_strafing_can_be_disabled(controller: dict[str, Any]) -> None:
    d = drive_sideways(0.5, **controller)
    assert d.result == "SUCCEEDED"
    assert max_lateral_speed(d) == 0.0


def test_regulated_pure_pursuit_never_strafes_as_in_nav2() -> None:
    d = drive_sideways(0.5)
    assert d.result == "SUCCEEDED"
    assert max_lateral_speed(d) == 0.0


@pytest.mark.sample(1)
@pytest.mark.parametrize("controller", [DWB, MPPI], ids=["dwb", "mppi"])
def test_a_base_that_cannot_strafe_never_does(controller: dict[str, Any]) -> None:
    assert max_lateral_speed(drive_sideways(0.0, **controller)) == 0.0
