"""`kidnap`, `push`: things done to the robot itself."""

import math
from typing import Annotated

from pydantic import Field

from simscen.actions.base import Action
from simscen.core.geometry import wrap
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.orplace import PlaceOrPose
from simscen.spec.quantities import Impulse

SAME = 1e-3
"""Metres and radians within which the robot is where a kidnapper wants it."""


class Kidnap(Spec, Action):
    """Set the robot down somewhere else; its stack is not told.

    Example: `do: {kidnap: {pose: {x: 2, y: 3, yaw: 90 deg}}}`
    """

    pose: PlaceOrPose
    """Where it finds itself, in the world frame: a pose, or a place by name."""

    def perform(self, stage: Stage) -> Effect:
        """Set it down, at rest; nothing comes of it when it stands there."""
        here, there = stage.robot, self.pose.pose
        if here.distance(there) < SAME and abs(wrap(here.yaw - there.yaw)) < SAME:
            return Effect(False, "the robot stood there already")
        stage.place_robot(there)
        return Effect(True, f"set the robot down {here.distance(there):.2f} m away, at ({there.x:.2f}, {there.y:.2f})")


class Push(Spec, Action):
    """Push the robot: an impulse at its centre.

    Example: `do: {push: {impulse: [0, 5]}}`
    """

    impulse: Annotated[list[Impulse], Field(min_length=2, max_length=2)]
    """N s along x and y of the world frame."""

    def perform(self, stage: Stage) -> Effect:
        """Push once; nothing comes of an impulse of zero."""
        x, y = self.impulse
        if not math.hypot(x, y):
            return Effect(False, "an impulse of zero moves nothing")
        stage.push((x, y))
        return Effect(True, f"pushed the robot with {math.hypot(x, y):.1f} N s")
