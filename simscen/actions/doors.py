"""`open`, `close`: doors of the world."""

from __future__ import annotations

import numpy as np

from simscen.actions.base import Action
from simscen.core.geometry import Pose2, wrap
from simscen.core.shapes import MotionPath
from simscen.core.stage import Stage
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveDuration
from simscen.spec.references import DoorName

STEPS = 16
"""A swing is cut into so many straight moves; the panel's edge then strays from its arc by less than 0.2 %."""


class OpenDoor(Spec, Action):
    """Swing a door of the world open.

    Example: `do: {open: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Of the swing."""

    def perform(self, stage: Stage) -> None:
        """Start the swing."""
        _swing(stage, self.name, stage.door(self.name)[1], self.duration)


class CloseDoor(Spec, Action):
    """Swing a door of the world shut; it does not stop for the robot.

    Example: `do: {close: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """Of the swing."""

    def perform(self, stage: Stage) -> None:
        """Start the swing."""
        _swing(stage, self.name, stage.door(self.name)[0], self.duration)


def _swing(stage: Stage, name: str, target: Pose2, duration: float) -> None:
    here = stage.object(name)
    assert here is not None, f"a door of the world is always there: {name}"
    parts = np.linspace(0.0, 1.0, STEPS + 1)
    turn = wrap(target.yaw - here.yaw)
    poses = tuple(Pose2(here.x, here.y, wrap(here.yaw + float(part) * turn)) for part in parts)
    stage.move(name, MotionPath(tuple(float(part) * duration for part in parts), poses))
