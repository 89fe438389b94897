"""World with two rooms and a door between them, and drives of the navigator in it."""

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


def rooms(*boxes: tuple[float, float, float, float]) -> Flatland:
    """Return two rooms with a door of one meter between them, and with boxes (min x, min y, max x, max y) in m."""
    world = Flatland().room(10, 6)
    world.boxes += [(4.9, 0.0, 5.0, 2.5), (4.9, 3.5, 5.0, 6.0), *boxes]
    return world


def start(world: Flatland, *goals: Goal, grid: Flatland | None = None, **options: object) -> Drive:
    """Return a drive from START to the goals, by default to FAR, with the map of `grid` or else of the world."""
    return drive(world, START, *(goals or (FAR,)), grid=(grid or world).grid(BOUNDS), **options)


def codes(drive: Drive, kind: str = "goal.failed") -> list[object]:
    """Return the names of the error codes of all events of a kind."""
    return [event.data["error_name"] for event in drive.events_of_kind(kind)]


def reasons(drive: Drive) -> list[object]:
    """Return the reasons of all plans."""
    return [event.data["reason"] for event in drive.events_of_kind("plan.made")]
