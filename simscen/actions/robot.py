"""Actions on a robot and its goals: `kidnap`, `push`, `new_goal`, and `cancel_goal`."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from simscen.actions.base import Action, is_same_pose
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.places import MovableName, Name, PlaceOrPose
from simscen.spec.quantities import Force, Impulse, PositiveAngle, PositiveDuration, PositiveLength


class Kidnap(Spec, Action):
    """Move the robot to another pose, at rest, without informing its stack. For objects, use `teleport`.

    Use this action for a robot that somebody carries away, and to test relocalization.

    Example: `do: {kidnap: {pose: {x: 2, y: 3, yaw: 90 deg}}}`
    """

    pose: PlaceOrPose
    """New pose in the world frame, or a place by name."""

    def perform(self, stage: Stage) -> Effect:
        """Move the robot. Has no effect if the robot is already at the new pose."""
        current, target = stage.robot, self.pose.pose
        if is_same_pose(current, target):
            return Effect(False, "the robot was already there")
        stage.place_robot(target)
        distance = current.distance(target)
        return Effect(True, f"moved the robot by {distance:.2f} m to ({target.x:.2f}, {target.y:.2f})")


class Push(Spec, Action):
    """Push the robot, or an object with a mass, at its center: with an impulse, or with a force for a duration.

    Use an `impulse` for a person who bumps into the robot. Use a `force` for a person who leans on the robot, for a
    slope, or for a gust of wind.

    Example: `do: {push: {force: [0, 20], for: 1.5 s}}`
    """

    name: MovableName | None = None
    """An object with a mass; default: the robot."""
    impulse: Annotated[list[Impulse], Field(min_length=2, max_length=2)] | None = None
    """Impulse in N s along x and y of the world frame, within one physics tick."""
    force: Annotated[list[Force], Field(min_length=2, max_length=2)] | None = None
    """Alternatively: force in N along x and y of the world frame, for the duration `for`."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """Duration of the force."""

    @model_validator(mode="after")
    def _check_kind(self) -> Push:
        if (self.impulse is None) == (self.force is None):
            raise ValueError("expected either impulse or force")
        if (self.force is None) != (self.for_ is None):
            raise ValueError("a force needs a duration `for`" if self.force else "an impulse has no duration `for`")
        return self

    @property
    def is_robot_specific(self) -> bool:
        return self.name is None

    def perform(self, stage: Stage) -> Effect:
        """Push the robot or object. Has no effect if the push is zero, or if the object is missing or not pushable."""
        target, duration = self.name or "the robot", self.for_ or 0.0
        x, y = self.impulse or self.force or (0.0, 0.0)
        if not math.hypot(x, y):
            return Effect(False, "a push of zero has no effect")
        if self.name is not None:
            if stage.object(self.name) is None:
                return Effect(False, f"there is nothing called {self.name}")
            if not stage.mass(self.name):
                return Effect(False, f"{self.name} has no mass or is moved by a script, so it cannot be pushed")
        stage.push((x * duration, y * duration) if duration else (x, y), self.name, duration)
        strength = f"{math.hypot(x, y):.1f} N for {duration:g} s" if duration else f"{math.hypot(x, y):.1f} N s"
        return Effect(True, f"pushed {target} with {strength}")


class NewGoal(Spec, Action):
    """Send another goal, which preempts the current one. The remaining goals follow after the new one.

    Criteria judge the new goal like any other goal of the scenario. They ignore the preempted goal. If the event
    happens twice, the robot must reach the new goal twice.

    Example: `do: {new_goal: {name: detour, pose: {x: 1, y: 4}}}`
    """

    name: Name
    """Name of the goal. It must differ from the names of all other goals."""
    pose: PlaceOrPose
    """Pose in the map frame, or a place by name."""
    timeout: PositiveDuration | None = None
    """Maximum simulated time to reach the goal; default: no limit."""
    xy_tolerance: PositiveLength | None = None
    """Maximum distance from the position; default: the tolerance of the stack's goal checker."""
    yaw_tolerance: PositiveAngle | None = None
    """Maximum heading error; default: the tolerance of the stack's goal checker."""

    def perform(self, stage: Stage) -> Effect:
        stage.send_goal(self.name)
        return Effect(True, f"sent goal {self.name}")


class CancelGoal(Spec, Action):
    """Cancel the current goal and all later goals, as an action client would; the robot must stop.

    Example: `do: {cancel_goal: {}}`
    """

    def perform(self, stage: Stage) -> Effect:
        """Cancel the goals; has no effect if there is no current goal."""
        goal = stage.goal
        if goal is None:
            return Effect(False, "the robot had no goal")
        stage.cancel_goal()
        return Effect(True, f"canceled goal {goal.name}")
