"""Actions on objects: `spawn`, `remove`, `move`, `teleport`, and `stop`."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from simscen.actions.base import Action
from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.shapes import Body
from simscen.core.messages.navigation import Path
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.motions import Motion
from simscen.spec.named_places import PlaceOrPose
from simscen.spec.objects import Shaped
from simscen.spec.places import Name
from simscen.spec.quantities import Angle, Length, Mass, NonNegativeLength, PositiveDuration
from simscen.spec.references import MovableName


class Spawn(Shaped, Action):
    """Put an object into the world: at a pose, relative to the robot, or on the plan it is following.

    With `mass` the robot can push it; without, only the scenario moves it.

    Example: `do: {spawn: {name: pallet, box: [1.2, 0.8, 0.3], on_plan: 1.5 m}}`
    """

    name: Name
    """What it is called from now on."""
    pose: PlaceOrPose | None = None
    """In the world frame: a pose, or a place by name."""
    ahead: Annotated[list[Length], Field(min_length=2, max_length=2)] | None = None
    """In the robot's frame: [meters ahead, meters to the left]."""
    on_plan: NonNegativeLength | None = None
    """On the robot's plan, so far ahead along it, turned across it; at its end where the plan is shorter. Where the
    robot has no plan, ahead of it by as much, which does not count as having happened."""
    yaw: Angle = 0.0
    """Turn relative to the robot's heading or the plan's direction."""
    mass: Mass = 0.0
    """In kg; 0 = immovable for the robot."""

    @model_validator(mode="after")
    def _one_place(self) -> Spawn:
        if sum(place is not None for place in (self.pose, self.ahead, self.on_plan)) != 1:
            raise ValueError("expected exactly one of: pose, ahead, on_plan")
        return self

    @property
    def of_a_robot(self) -> bool:
        """At a pose of the world it is the same for all."""
        return self.pose is None

    def perform(self, stage: Stage) -> Effect:
        """Spawn it; without a plan to put it on, it is put ahead of the robot instead."""
        planned = self.on_plan is None or _has_plan(stage)
        pose = self._place(stage)
        stage.spawn(Body(self.name, (self.solid(self.name),), Pose3.planar(pose), self.mass))
        what = f"spawned {self.name} at ({pose.x:.2f}, {pose.y:.2f})"
        return Effect(planned, what if planned else f"{what} as the robot had no plan to put it on")

    def _place(self, stage: Stage) -> Pose2:
        if self.pose is not None:
            return self.pose.pose
        if self.ahead is not None:
            return stage.robot.compose(Pose2(self.ahead[0], self.ahead[1], self.yaw))
        assert self.on_plan is not None
        if stage.plan is None or not _has_plan(stage):
            return stage.robot.compose(Pose2(self.on_plan, 0.0, self.yaw))
        return along(stage.plan, stage.robot, self.on_plan).compose(Pose2(0.0, 0.0, self.yaw))


def _has_plan(stage: Stage) -> bool:
    return stage.plan is not None and len(stage.plan.points) > 1


def along(plan: Path, robot: Pose2, ahead: float) -> Pose2:
    """The pose on `plan` that is `ahead` meters further along it than its point nearest to the robot."""
    points = plan.points[:, :2]
    steps = np.hypot(*np.diff(points, axis=0).T)
    travelled = np.concatenate(([0.0], np.cumsum(steps)))
    nearest = int(np.argmin(np.hypot(points[:, 0] - robot.x, points[:, 1] - robot.y)))
    target = min(travelled[nearest] + ahead, travelled[-1])
    segment = min(int(np.searchsorted(travelled, target, side="right")) - 1, len(steps) - 1)
    direction = points[segment + 1] - points[segment]
    fraction = (target - travelled[segment]) / steps[segment] if steps[segment] else 0.0
    x, y = points[segment] + fraction * direction
    return Pose2(float(x), float(y), float(np.arctan2(direction[1], direction[0])))


class Remove(Spec, Action):
    """Take an object out of the world, at once.

    Example: `do: {remove: {name: pallet}}`
    """

    name: MovableName
    """The object to remove."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Remove it; nothing comes of it when it is not there."""
        if stage.object(self.name) is None:
            return Effect(False, f"there is nothing called {self.name}")
        stage.remove(self.name)
        return Effect(True, f"removed {self.name}")


class Move(Motion, Action):
    """Let an object drive through waypoints at a speed, or be where it is said when, along timed keyframes.

    It does not stop for the robot, and nothing can push it from then on. Imitates a cart, a forklift or a person on
    a fixed course, and worlds of moving obstacles like those of DynaBARN (Nair et al., 2022), which are given by
    where each obstacle is when.

    Example: `do: {move: {name: cart, keyframes: [[0, 4, 1, 0], [3, 4, 5, 90 deg], [6, 4, 1, 0]], repeat: loop}}`
    """

    name: MovableName
    """The object to move."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Set it going; nothing comes of it when it is not there, or stands at its only waypoint."""
        here = stage.object(self.name)
        if here is None:
            return Effect(False, f"there is nothing called {self.name}")
        path = self.path(here)
        if len(path.poses) == 1 and self.keyframes is None:
            return Effect(False, f"{self.name} stands at its waypoint already")
        stage.move(self.name, path)
        return Effect(True, f"moved {self.name}")


SAME = 1e-3
"""Meters and radians within which a thing is where it shall be."""


class Teleport(Spec, Action):
    """Set an object down somewhere else, at once and at rest; for the robot there is `kidnap`.

    Imitates what changes while the robot does not look: the pallet of this morning stands an aisle further, and the
    costmap still shows it where it was. What a script moved stands still from then on.

    Example: `do: {teleport: {name: pallet, pose: {x: 4, y: 2, yaw: 90 deg}}}`
    """

    name: MovableName
    """The object to set down."""
    pose: PlaceOrPose
    """Where it stands from now on, in the world frame: a pose, or a place by name."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Set it down; nothing comes of it when it is not there, or stands there already."""
        here, there = stage.object(self.name), self.pose.pose
        if here is None:
            return Effect(False, f"there is nothing called {self.name}")
        moves = stage.motion(self.name) is not None
        if here.distance(there) < SAME and abs(wrap(here.yaw - there.yaw)) < SAME and not moves:
            return Effect(False, f"{self.name} stood there already")
        stage.place(self.name, there)
        return Effect(
            True, f"set {self.name} down {here.distance(there):.2f} m away, at ({there.x:.2f}, {there.y:.2f})"
        )


class Stop(Spec, Action):
    """Stop an object where it is, a person, or a door half-way; with `for` a script goes on as if nothing had been.

    Imitates a person who stops in front of the robot to look at it, a cart that waits, a door that jams.

    Example: `do: {stop: {name: cart, for: 3 s}}`
    """

    name: MovableName
    """The object to stop."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """How long it stands; default: until something else moves it."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Stop it; nothing comes of it when it is not there, or no script moves it now."""
        here, motion = stage.object(self.name), stage.motion(self.name)
        if here is None:
            return Effect(False, f"there is nothing called {self.name}")
        if motion is None:
            return Effect(False, f"{self.name} was not moving")
        path, since = motion
        if self.for_ is None:
            stage.place(self.name, here)
            return Effect(True, f"stopped {self.name}")
        waits = self.for_ + max(0.0, path.start - since)
        stage.move(self.name, replace(path, phase=path.elapsed(since), start=waits))
        return Effect(True, f"stopped {self.name} for {self.for_:g} s")
