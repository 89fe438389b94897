"""`open`, `close`: doors of the world."""

from __future__ import annotations

import numpy as np

from simscen.actions.base import Action
from simscen.core.geometry import Pose2, wrap
from simscen.core.shapes import MotionPath
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveDuration
from simscen.spec.references import DoorName

STEPS = 16
"""A swing is cut into so many straight moves; the panel's edge then strays from its arc by less than 0.2 %."""
SHUT = 1e-6
"""Radians from where it should be, within which a door needs no swing."""


class OpenDoor(Spec, Action):
    """Swing a door of the world open.

    Example: `do: {open: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Of the swing."""

    def perform(self, stage: Stage) -> Effect:
        """Start the swing; nothing comes of it when the door is open."""
        return _swing(stage, self.name, stage.door(self.name)[1], self.duration, "open")


class CloseDoor(Spec, Action):
    """Swing a door of the world shut; it does not stop for the robot.

    Example: `do: {close: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Of the swing."""

    def perform(self, stage: Stage) -> Effect:
        """Start the swing; nothing comes of it when the door is shut."""
        return _swing(stage, self.name, stage.door(self.name)[0], self.duration, "shut")


def _swing(stage: Stage, name: str, target: Pose2, duration: float, state: str) -> Effect:
    here = stage.object(name)
    if here is None:
        return Effect(False, f"{name} is not there any more")
    turn = wrap(target.yaw - here.yaw)
    if abs(turn) < SHUT:
        return Effect(False, f"{name} was {state} already")
    parts = np.linspace(0.0, 1.0, STEPS + 1)
    poses = tuple(Pose2(here.x, here.y, wrap(here.yaw + float(part) * turn)) for part in parts)
    stage.move(name, MotionPath(tuple(float(part) * duration for part in parts), poses))
    return Effect(True, f"{name} swings {state}")
