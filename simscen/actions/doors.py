"""`open` and `close`: swing and slide the doors of the world."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from simscen.actions.base import WorldAction
from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.shapes import MotionPath
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.places import DoorName
from simscen.spec.quantities import PositiveDuration, Ratio

SWING_SEGMENTS = 16
"""Straight segments of a swing. The edge of the panel then deviates from its arc by less than 0.2 %."""
TRAVEL_TOLERANCE = 1e-6
"""Share of its travel within which a door has reached its target."""


class OpenDoor(Spec, WorldAction):
    """Open a door of the world from its current position; it swings or slides.

    Example: `do: {open: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Time from fully closed to fully open; proportionally less for a shorter travel."""
    to: Annotated[Ratio, Field(gt=0, le=1)] = 1.0
    """Share of its travel: 100 % is fully open, 30 % ajar."""

    def perform(self, stage: Stage) -> Effect:
        """Start the motion; has no effect if the door is already there or on its way there."""
        closed, opened = stage.door(self.name)
        target = opened if self.to == 1 else _interpolate(closed, opened, self.to)
        state = "open" if self.to == 1 else f"{self.to:.0%} open"
        return _move_door(stage, self.name, target, self.duration, state)


class CloseDoor(Spec, WorldAction):
    """Close a door of the world from its current position; it does not stop for the robot.

    Example: `do: {close: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Time from fully open to fully closed; proportionally less for a shorter travel."""

    def perform(self, stage: Stage) -> Effect:
        """Start the motion; has no effect if the door is already closed or on its way there."""
        return _move_door(stage, self.name, stage.door(self.name)[0], self.duration, "shut")


def _move_door(stage: Stage, name: str, target: Pose2, full_duration: float, state: str) -> Effect:
    pose = stage.object(name)
    if pose is None:
        return Effect(False, f"{name} does not exist any more")
    closed, opened = stage.door(name)
    remaining = _travel_share(pose, target, closed, opened)
    if remaining < TRAVEL_TOLERANCE:
        return Effect(False, f"{name} was already {state}")
    motion, verb = stage.motion(name), "swings" if wrap(opened.yaw - closed.yaw) else "slides"
    if motion is not None and _travel_share(motion[0].poses[-1], target, closed, opened) < TRAVEL_TOLERANCE:
        return Effect(False, f"{name} already {verb} {state}")
    duration = full_duration if remaining > 1 - TRAVEL_TOLERANCE else full_duration * remaining
    stage.move(name, panel_path(pose, target, duration))
    return Effect(True, f"{name} {verb} {state}")


def panel_path(start: Pose2, target: Pose2, duration: float) -> MotionPath:
    """Return the path of a door panel from one pose to another within `duration` seconds."""
    segments = SWING_SEGMENTS if wrap(target.yaw - start.yaw) else 1
    shares = [segment / segments for segment in range(segments + 1)]
    times = tuple(share * duration for share in shares)
    return MotionPath(times, tuple(_interpolate(start, target, share) for share in shares))


def _travel_share(start: Pose2, end: Pose2, closed: Pose2, opened: Pose2) -> float:
    """Return the distance between two poses of the panel as a share of the whole travel of the door."""
    turn, slide = abs(wrap(opened.yaw - closed.yaw)), opened.distance(closed)
    return abs(wrap(end.yaw - start.yaw)) / turn if turn else start.distance(end) / slide


def _interpolate(start: Pose2, end: Pose2, share: float) -> Pose2:
    x, y = start.x + share * (end.x - start.x), start.y + share * (end.y - start.y)
    return Pose2(x, y, wrap(start.yaw + share * wrap(end.yaw - start.yaw)))
