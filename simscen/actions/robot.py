"""Actions on a robot and its goals: `kidnap`, `push`, `new_goal`, and `cancel_goal`."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from simscen.actions.base import Action
from simscen.core.geometry import wrap
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.named_places import PlaceOrPose
from simscen.spec.places import Name
from simscen.spec.quantities import Force, Impulse, PositiveAngle, PositiveDuration, PositiveLength
from simscen.spec.references import MovableName

POSE_TOLERANCE = 1e-3
"""Meters and radians within which the robot is where a kidnapper wants it."""


class Kidnap(Spec, Action):
    """Set the robot down somewhere else, at rest; its stack is not told. For objects there is `teleport`.

    Imitates somebody who carries the robot away, and a localizer that has to find out by itself.

    Example: `do: {kidnap: {pose: {x: 2, y: 3, yaw: 90 deg}}}`
    """

    pose: PlaceOrPose
    """Where it finds itself, in the world frame: a pose, or a place by name."""

    def perform(self, stage: Stage) -> Effect:
        """Set it down, at rest; nothing comes of it when it stands there."""
        here, there = stage.robot, self.pose.pose
        if here.distance(there) < POSE_TOLERANCE and abs(wrap(here.yaw - there.yaw)) < POSE_TOLERANCE:
            return Effect(False, "the robot stood there already")
        stage.place_robot(there)
        return Effect(True, f"set the robot down {here.distance(there):.2f} m away, at ({there.x:.2f}, {there.y:.2f})")


class Push(Spec, Action):
    """Push the robot, or an object that has a mass, at its center: an impulse at once, or a force for a while.

    Imitates somebody who bumps into the robot (`impulse`), and somebody who leans on it, a slope or a gust of wind
    (`force`). A force of F newtons for t seconds gives a mass that nothing holds an impulse of F t.

    Example: `do: {push: {force: [0, 20], for: 1.5 s}}`
    """

    name: MovableName | None = None
    """An object that has a mass; default: the robot."""
    impulse: Annotated[list[Impulse], Field(min_length=2, max_length=2)] | None = None
    """N s along x and y of the world frame, within one tick of the physics."""
    force: Annotated[list[Force], Field(min_length=2, max_length=2)] | None = None
    """Instead: N along x and y of the world frame, for as long as `for` says."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """How long the force lasts."""

    @model_validator(mode="after")
    def _how(self) -> Push:
        if (self.impulse is None) == (self.force is None):
            raise ValueError("expected either impulse or force")
        if (self.force is None) != (self.for_ is None):
            raise ValueError("a force needs `for`: how long it lasts" if self.force else "an impulse lasts no time")
        return self

    @property
    def of_a_robot(self) -> bool:
        """It is, unless it is an object that is pushed."""
        return self.name is None

    def perform(self, stage: Stage) -> Effect:
        """Push; nothing comes of a push of zero, or of one on what is not there or has no mass."""
        what, lasts = self.name or "the robot", self.for_ or 0.0
        x, y = self.impulse or self.force or (0.0, 0.0)
        if not math.hypot(x, y):
            return Effect(False, "a push of zero moves nothing")
        if self.name is not None:
            if stage.object(self.name) is None:
                return Effect(False, f"there is nothing called {self.name}")
            if not stage.mass(self.name):
                return Effect(False, f"{self.name} has no mass, or a script moves it: no push does")
        stage.push((x * lasts, y * lasts) if lasts else (x, y), self.name, lasts)
        said = f"{math.hypot(x, y):.1f} N for {lasts:g} s" if lasts else f"{math.hypot(x, y):.1f} N s"
        return Effect(True, f"pushed {what} with {said}")


class NewGoal(Spec, Action):
    """Send another goal; it preempts the one the robot is driving to, and the goals after it follow.

    Criteria judge it like any other goal of the scenario, and the one it preempts as preempted. Every goal that events
    send has a name of its own; sent twice, it has to be reached twice.

    Example: `do: {new_goal: {name: detour, pose: {x: 1, y: 4}}}`
    """

    name: Name
    """What the goal is called."""
    pose: PlaceOrPose
    """In the map frame: a pose, or a place by name."""
    timeout: PositiveDuration | None = None
    """Simulated time it may take."""
    xy_tolerance: PositiveLength | None = None
    """How far off the position may be; default: that of the stack's goal checker."""
    yaw_tolerance: PositiveAngle | None = None
    """How far off the heading may be; default: that of the stack's goal checker."""

    def perform(self, stage: Stage) -> Effect:
        """Send it."""
        stage.send_goal(self.name)
        return Effect(True, f"sent goal {self.name}")


class CancelGoal(Spec, Action):
    """Cancel the goal the robot is driving to, as an action client would; the robot must stop.

    Example: `do: {cancel_goal: {}}`
    """

    def perform(self, stage: Stage) -> Effect:
        """Cancel it; nothing comes of it when the robot drives to no goal."""
        goal = stage.goal
        if goal is None:
            return Effect(False, "the robot was driving to no goal")
        stage.cancel_goal()
        return Effect(True, f"canceled goal {goal.name}")
