"""Two rooms with a door between them, in which tests let the navigator drive."""

import math

from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.model.localizers import GroundTruth
from simscen.model.stack import StackSpec
from simscen.testing.flatland import Drive, Flatland, drive

TRUTH = GroundTruth(type="ground_truth")
ADVANCED = StackSpec(profile="advanced", localizer=TRUTH)
BOUNDS = (-0.5, -0.5, 10.5, 6.5)
START, FAR = Pose2(1.0, 1.0), Goal("far", Pose2(9.0, 1.0, math.pi / 2), timeout=90.0)
DOOR = (4.9, 2.5, 5.0, 3.5)


def rooms(*more: tuple[float, float, float, float]) -> Flatland:
    """Two rooms and a door of one meter between them."""
    world = Flatland().room(10, 6)
    world.boxes += [(4.9, 0.0, 5.0, 2.5), (4.9, 3.5, 5.0, 6.0), *more]
    return world


def start(world: Flatland, *goals: Goal, grid: Flatland | None = None, **options: object) -> Drive:
    return drive(world, START, *(goals or (FAR,)), grid=(grid or world).grid(BOUNDS), **options)


def codes(drive: Drive, kind: str = "goal.failed") -> list[object]:
    return [event.data["error_name"] for event in drive.events_of_kind(kind)]


def reasons(drive: Drive) -> list[object]:
    return [event.data["reason"] for event in drive.events_of_kind("plan.made")]
