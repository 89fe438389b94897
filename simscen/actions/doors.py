"""`open`, `close`: doors of the world, which swing or slide."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from simscen.actions.base import Action
from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.shapes import MotionPath
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveDuration, Ratio
from simscen.spec.references import DoorName

STEPS = 16
"""A swing is cut into so many straight moves; the panel's edge then strays from its arc by less than 0.2 %."""
SHUT = 1e-6
"""Share of its travel within which a door is where it should be."""


class OpenDoor(Spec, Action):
    """Open a door of the world: it swings or slides, from wherever it is now.

    Example: `do: {open: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """From shut to wide open; a door that is on its way takes its share."""
    to: Annotated[Ratio, Field(gt=0, le=1)] = 1.0
    """How far: 100 % is wide open, 30 % ajar."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Set it going; nothing comes of it when the door is open so far, or on its way there."""
        closed, opened = stage.door(self.name)
        target = opened if self.to == 1 else _between(closed, opened, self.to)
        state = "open" if self.to == 1 else f"{self.to:.0%} open"
        return _travel(stage, self.name, target, self.duration, state)


class CloseDoor(Spec, Action):
    """Shut a door of the world, from wherever it is now; it does not stop for the robot.

    Example: `do: {close: {name: door meeting room}}`
    """

    name: DoorName
    """A door of the world."""
    duration: PositiveDuration = 1.5
    """From wide open to shut; a door that is on its way takes its share."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Set it going; nothing comes of it when the door is shut, or on its way there."""
        return _travel(stage, self.name, stage.door(self.name)[0], self.duration, "shut")


def _travel(stage: Stage, name: str, target: Pose2, duration: float, state: str) -> Effect:
    here = stage.object(name)
    if here is None:
        return Effect(False, f"{name} is not there any more")
    closed, opened = stage.door(name)
    left = _share(here, target, closed, opened)
    if left < SHUT:
        return Effect(False, f"{name} was {state} already")
    motion, verb = stage.motion(name), "swings" if wrap(opened.yaw - closed.yaw) else "slides"
    if motion is not None and _share(motion[0].poses[-1], target, closed, opened) < SHUT:
        return Effect(False, f"{name} {verb} {state} already")
    lasts = duration if left > 1 - SHUT else duration * left
    stage.move(name, panel_path(here, target, lasts))
    return Effect(True, f"{name} {verb} {state}")


def panel_path(here: Pose2, target: Pose2, seconds: float) -> MotionPath:
    """Return the path of a door's panel from one pose to another."""
    steps = STEPS if wrap(target.yaw - here.yaw) else 1
    parts = [step / steps for step in range(steps + 1)]
    return MotionPath(tuple(part * seconds for part in parts), tuple(_between(here, target, part) for part in parts))


def _share(here: Pose2, there: Pose2, closed: Pose2, opened: Pose2) -> float:
    """How much of a door's whole travel lies between two poses of its panel."""
    turn, slide = abs(wrap(opened.yaw - closed.yaw)), opened.distance(closed)
    return abs(wrap(there.yaw - here.yaw)) / turn if turn else here.distance(there) / slide


def _between(here: Pose2, there: Pose2, part: float) -> Pose2:
    x, y = here.x + part * (there.x - here.x), here.y + part * (there.y - here.y)
    return Pose2(x, y, wrap(here.yaw + part * wrap(there.yaw - here.yaw)))
