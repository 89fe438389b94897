"""Actions on doors: `open` and `close`."""

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
"""Number of straight segments that approximate the arc of a swinging door."""
TRAVEL_TOLERANCE = 1e-6
"""Remaining fraction of a door's full travel below which the door has reached its target."""


class OpenDoor(Spec, WorldAction):
    """Swing or slide a door of the world open, from its current position.

    Example: `do: {open: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Time from fully closed to fully open. A partial motion takes proportionally less time."""
    to: Annotated[Ratio, Field(gt=0, le=1)] = 1.0
    """Fraction of the full travel: 100 % is fully open, 30 % ajar."""

    def perform(self, stage: Stage) -> Effect:
        """Start the motion. Has no effect if the door is at the target or already moves to it."""
        closed, opened = stage.door(self.name)
        target = opened if self.to == 1 else _interpolate(closed, opened, self.to)
        state = "open" if self.to == 1 else f"{self.to:.0%} open"
        return _move_door(stage, self.name, target, self.duration, state)


class CloseDoor(Spec, WorldAction):
    """Close a door of the world from its current position. The door does not stop for the robot.

    Example: `do: {close: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Time from fully open to fully closed. A partial motion takes proportionally less time."""

    def perform(self, stage: Stage) -> Effect:
        """Start the motion. Has no effect if the door is closed or already closing."""
        return _move_door(stage, self.name, stage.door(self.name)[0], self.duration, "shut")


def _move_door(stage: Stage, name: str, target: Pose2, full_duration: float, state: str) -> Effect:
    """Start the motion of a door to `target` and return the effect.

    `full_duration` is the time in s for the full travel. `state` is the name of the target in messages, e.g. "open".
    """
    pose = stage.object(name)
    if pose is None:
        return Effect(False, f"{name} does not exist any more")
    closed, opened = stage.door(name)
    remaining = _travel_fraction(pose, target, closed, opened)
    if remaining < TRAVEL_TOLERANCE:
        return Effect(False, f"{name} was already {state}")
    motion, verb = stage.motion(name), "swings" if wrap(opened.yaw - closed.yaw) else "slides"
    if motion is not None and _travel_fraction(motion[0].poses[-1], target, closed, opened) < TRAVEL_TOLERANCE:
        return Effect(False, f"{name} already {verb} {state}")
    duration = full_duration if remaining > 1 - TRAVEL_TOLERANCE else full_duration * remaining
    stage.move(name, panel_path(pose, target, duration))
    return Effect(True, f"{name} {verb} {state}")


def panel_path(start: Pose2, target: Pose2, duration: float) -> MotionPath:
    """Return the path of a door panel from `start` to `target` in `duration` seconds."""
    segments = SWING_SEGMENTS if wrap(target.yaw - start.yaw) else 1
    fractions = [segment / segments for segment in range(segments + 1)]
    times = tuple(fraction * duration for fraction in fractions)
    return MotionPath(times, tuple(_interpolate(start, target, fraction) for fraction in fractions))


def _travel_fraction(start: Pose2, end: Pose2, closed: Pose2, opened: Pose2) -> float:
    """Return the travel of a door from `start` to `end` as a fraction of the travel from `closed` to `opened`."""
    turn, slide = abs(wrap(opened.yaw - closed.yaw)), opened.distance(closed)
    return abs(wrap(end.yaw - start.yaw)) / turn if turn else start.distance(end) / slide


def _interpolate(start: Pose2, end: Pose2, fraction: float) -> Pose2:
    """Return the pose after `fraction` (0 to 1) of a straight motion from `start` to `end`, by the shorter rotation."""
    x, y = start.x + fraction * (end.x - start.x), start.y + fraction * (end.y - start.y)
    return Pose2(x, y, wrap(start.yaw + fraction * wrap(end.yaw - start.yaw)))
