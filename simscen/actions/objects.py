"""Actions on objects and doors: `spawn`, `remove`, `move`, `teleport`, `stop`, `open`, and `close`."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from simscen.actions.base import Action, WorldAction, is_same_pose
from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.core.messages.navigation import Path
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.moving_objects import Motion, ShapedObject
from simscen.spec.places import DoorName, MovableName, Name, PlaceOrPose
from simscen.spec.quantities import Angle, Length, Mass, NonNegativeLength, PositiveDuration, Ratio

SWING_SEGMENTS = 16
"""Number of straight segments that approximate the arc of a swinging door."""
TRAVEL_TOLERANCE = 1e-6
"""Remaining fraction of a door's full travel below which the door counts as at its target."""


class Spawn(ShapedObject, Action):
    """Add an object to the world: at a pose, relative to the robot, or on the robot's plan.

    The robot can push an object that has a `mass`. Only the scenario moves other objects.

    Example: `do: {spawn: {name: pallet, box: [1.2, 0.8, 0.3], on_plan: 1.5 m}}`
    """

    name: Name
    """Name of the new object."""
    pose: PlaceOrPose | None = None
    """Pose in the world frame, or a place by name."""
    ahead: Annotated[list[Length], Field(min_length=2, max_length=2)] | None = None
    """Position in the robot's frame: [meters forward, meters to the left]."""
    on_plan: NonNegativeLength | None = None
    """Distance ahead of the robot along its plan, at most to the end of the plan. Without a plan, the object is placed
    at this distance straight ahead, and the event counts as failed."""
    yaw: Angle = 0.0
    """Rotation relative to the heading of the robot (`ahead`) or the direction of the plan (`on_plan`)."""
    mass: Mass = 0.0
    """Mass in kg; 0 = cannot be pushed."""

    @model_validator(mode="after")
    def _check_place(self) -> Spawn:
        if sum(place is not None for place in (self.pose, self.ahead, self.on_plan)) != 1:
            raise ValueError("expected exactly one of: pose, ahead, on_plan")
        return self

    @property
    def is_robot_specific(self) -> bool:
        """Whether the pose depends on the robot."""
        return self.pose is None

    def perform(self, stage: Stage) -> Effect:
        """Add the object. The effect counts as failed if `on_plan` is set and the robot has no plan."""
        is_as_requested = self.on_plan is None or _has_plan(stage)
        pose = self._spawn_pose(stage)
        stage.spawn(Body(self.name, (self.solid(self.name),), Pose3.planar(pose), self.mass))
        what = f"spawned {self.name} at ({pose.x:.2f}, {pose.y:.2f})"
        return Effect(is_as_requested, what if is_as_requested else f"{what}, because the robot had no plan")

    def _spawn_pose(self, stage: Stage) -> Pose2:
        if self.pose is not None:
            return self.pose.pose
        if self.ahead is not None:
            return stage.robot.compose(Pose2(self.ahead[0], self.ahead[1], self.yaw))
        assert self.on_plan is not None
        if stage.plan is None or not _has_plan(stage):
            return stage.robot.compose(Pose2(self.on_plan, 0.0, self.yaw))
        return pose_on_plan(stage.plan, stage.robot, self.on_plan).compose(Pose2(0.0, 0.0, self.yaw))


def _has_plan(stage: Stage) -> bool:
    return stage.plan is not None and len(stage.plan.points) > 1


def pose_on_plan(plan: Path, robot: Pose2, distance: float) -> Pose2:
    """Return the pose that is `distance` m ahead along `plan`, counted from the plan's point nearest to the robot.

    The heading is the direction of the plan. If the plan is shorter, the pose is at its end.
    """
    points = plan.points[:, :2]
    steps = np.hypot(*np.diff(points, axis=0).T)
    lengths = np.concatenate(([0.0], np.cumsum(steps)))
    nearest = int(np.argmin(np.hypot(points[:, 0] - robot.x, points[:, 1] - robot.y)))
    target = min(lengths[nearest] + distance, lengths[-1])
    segment = min(int(np.searchsorted(lengths, target, side="right")) - 1, len(steps) - 1)
    direction = points[segment + 1] - points[segment]
    fraction = (target - lengths[segment]) / steps[segment] if steps[segment] else 0.0
    x, y = points[segment] + fraction * direction
    return Pose2(float(x), float(y), float(np.arctan2(direction[1], direction[0])))


class Remove(Spec, WorldAction):
    """Remove an object from the world.

    Example: `do: {remove: {name: pallet}}`
    """

    name: MovableName
    """The object to remove."""

    def perform(self, stage: Stage) -> Effect:
        """Remove the object; has no effect if it does not exist."""
        if stage.object(self.name) is None:
            return Effect(False, f"there is nothing called {self.name}")
        stage.remove(self.name)
        return Effect(True, f"removed {self.name}")


class Move(Motion, WorldAction):
    """Move an object through waypoints at a speed, or along timed keyframes.

    The object does not stop for the robot, and nothing can push it from then on. Use this action for a cart or a person
    on a fixed course. Use `keyframes` for recorded motions, such as the obstacles of DynaBARN (Nair et al., 2022).

    Example: `do: {move: {name: cart, keyframes: [[0, 4, 1, 0], [3, 4, 5, 90 deg], [6, 4, 1, 0]], repeat: loop}}`
    """

    name: MovableName
    """The object to move."""

    def perform(self, stage: Stage) -> Effect:
        """Start the motion. Has no effect if the object does not exist or is already at its only waypoint."""
        pose = stage.object(self.name)
        if pose is None:
            return Effect(False, f"there is nothing called {self.name}")
        path = self.path(pose)
        if len(path.poses) == 1 and self.keyframes is None:
            return Effect(False, f"{self.name} is already at its waypoint")
        stage.move(self.name, path)
        return Effect(True, f"moved {self.name}")


class Teleport(Spec, WorldAction):
    """Move an object to another pose, at once and at rest. For the robot, use `kidnap`.

    The object's scripted motion ends. Use this action for changes that the robot does not see, for example a pallet
    that the costmap still shows at its old position.

    Example: `do: {teleport: {name: pallet, pose: {x: 4, y: 2, yaw: 90 deg}}}`
    """

    name: MovableName
    """The object to move."""
    pose: PlaceOrPose
    """New pose in the world frame, or a place by name."""

    def perform(self, stage: Stage) -> Effect:
        """Move the object. Has no effect if it does not exist, or if it is already there and no script moves it."""
        current, target = stage.object(self.name), self.pose.pose
        if current is None:
            return Effect(False, f"there is nothing called {self.name}")
        if is_same_pose(current, target) and stage.motion(self.name) is None:
            return Effect(False, f"{self.name} was already there")
        stage.place(self.name, target)
        distance = current.distance(target)
        return Effect(True, f"moved {self.name} by {distance:.2f} m to ({target.x:.2f}, {target.y:.2f})")


class Stop(Spec, WorldAction):
    """Stop a moving object, pedestrian, or door. With `for`, an object or door continues its motion after this time.

    Use it for a person who stops in front of the robot, a cart that waits, or a door that jams. A pedestrian can only
    be stopped for good, without `for`.

    Example: `do: {stop: {name: cart, for: 3 s}}`
    """

    name: MovableName
    """The object to stop."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """Duration of the stop; default: until another action moves the object."""

    def perform(self, stage: Stage) -> Effect:
        """Stop the object; has no effect if it does not exist or no script moves it."""
        pose, motion = stage.object(self.name), stage.motion(self.name)
        if pose is None:
            return Effect(False, f"there is nothing called {self.name}")
        if motion is None:
            return Effect(False, f"{self.name} was not moving")
        path, elapsed = motion
        if self.for_ is None:
            stage.place(self.name, pose)
            return Effect(True, f"stopped {self.name}")
        delay = self.for_ + max(0.0, path.start - elapsed)
        stage.move(self.name, replace(path, phase=path.elapsed(elapsed), start=delay))
        return Effect(True, f"stopped {self.name} for {self.for_:g} s")


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
    """Return the pose at `fraction` (0 to 1) of the straight way from `start` to `end`, with the shorter rotation."""
    x, y = start.x + fraction * (end.x - start.x), start.y + fraction * (end.y - start.y)
    return Pose2(x, y, wrap(start.yaw + fraction * wrap(end.yaw - start.yaw)))
