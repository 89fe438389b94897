"""Tests of clearing the costmap: a reopened door is found, and a blocked hall is detected."""

import pytest

from simscen.advanced.stack import ClearingBackoff
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.model.localizers import GroundTruth
from simscen.model.recovery import Recovery
from simscen.model.stack import StackSpec
from simscen.testing.flatland import Drive, Flatland, drive

FAR_GOAL = Goal("far", Pose2(10.0, 3.0), timeout=150.0)
WALL = (6.0, 0.05, 6.2, 5.95)


def drive_toward_wall(seconds: float, *, entirely: bool = False) -> Drive:
    """Drive in a hall that a new wall blocks after 2 s; `entirely` clears the whole costmap each time, as in Nav2."""
    world = Flatland().room(12, 6)
    grid = world.grid((-0.5, -0.5, 12.5, 6.5))
    spec = StackSpec(localizer=GroundTruth(type="ground_truth"), recovery=Recovery(clear_entirely=entirely))
    d = drive(world, Pose2(3.0, 3.0), FAR_GOAL, grid=grid, spec=spec).run(2.0)
    world.boxes.append(WALL)
    return d.run(seconds)


@pytest.mark.slow
def test_wall_across_a_hall_fails_with_no_valid_path() -> None:
    d = drive_toward_wall(60)
    assert [event.data["error_name"] for event in d.events_of_kind("goal.failed")] == ["NO_VALID_PATH"]
    assert d.tick / 240 < 40
    assert d.min_clearance > 0.02


@pytest.mark.slow
def test_nav2_profile_clears_the_whole_costmap_each_time() -> None:
    assert not drive_toward_wall(45, entirely=True).events_of_kind("goal.failed")


def test_reopened_door_out_of_sight_is_tried_again() -> None:
    """The costmap is cleared a second time after about ten seconds."""
    mapped = Flatland().room(8, 8)
    mapped.boxes += [(3.9, 0.0, 4.0, 1.0), (3.9, 2.0, 4.0, 6.0), (3.9, 7.0, 4.0, 8.0)]  # two doors
    world = Flatland([*mapped.boxes, lower_door := (3.9, 1.0, 4.0, 2.0), (3.9, 6.0, 4.0, 7.0)])
    goal, grid = Goal("g", Pose2(6.0, 1.5), timeout=120.0), mapped.grid((-0.5, -0.5, 8.5, 8.5))
    d = drive(world, Pose2(2.0, 1.5), goal, grid=grid)
    while d.pose.y < 4.0:
        d.run(0.1)
    world.boxes.remove(lower_door)
    assert d.run(120).result == "SUCCEEDED"


def test_whole_costmap_is_cleared_with_growing_intervals() -> None:
    backoff = ClearingBackoff()
    assert [t for t in range(100) if backoff.clears_entirely(float(t), 5.0)] == [0, 10, 30, 70]
    backoff.reset()
    assert backoff.clears_entirely(100.0, 5.0)


@pytest.mark.parametrize(("remaining_m", "clears"), [(4.5, False), (3.9, True)])
def test_progress_of_a_meter_allows_clearing_at_once(remaining_m: float, clears: bool) -> None:
    backoff = ClearingBackoff()
    assert backoff.clears_entirely(0.0, 5.0)
    assert backoff.clears_entirely(1.0, remaining_m) == clears
    assert not backoff.clears_entirely(2.0, remaining_m)
