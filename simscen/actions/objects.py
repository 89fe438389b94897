"""Actions on objects: `spawn`, `remove`, `move`, `teleport`, and `stop`."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from simscen.actions.base import Action, WorldAction, is_same_pose
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body
from simscen.core.messages.navigation import Path
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.motions import Motion
from simscen.spec.places import MovableName, Name, PlaceOrPose
from simscen.spec.quantities import Angle, Length, Mass, NonNegativeLength, PositiveDuration
from simscen.spec.shapes import ShapedObject


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
    """Rotation relative to the heading of the robot (`ahead`) or the direction of the plan (`on_plan`); not valid with
    `pose`."""
    mass: Mass = 0.0
    """Mass in kg; 0 = cannot be pushed."""

    @model_validator(mode="after")
    def _check_place(self) -> Spawn:
        if sum(place is not None for place in (self.pose, self.ahead, self.on_plan)) != 1:
            raise ValueError("expected exactly one of: pose, ahead, on_plan")
        if self.pose is not None and self.yaw:
            raise ValueError("`yaw` has no effect with `pose`; write the heading in the pose")
        return self

    @property
    def is_robot_specific(self) -> bool:
        return self.pose is None

    def perform(self, stage: Stage) -> Effect:
        """Add the object. The effect counts as failed if `on_plan` is set and the robot has no plan."""
        plan, remark = stage.plan, ""
        if self.pose is not None:
            pose = self.pose.pose
        elif self.ahead is not None:
            pose = stage.robot.compose(Pose2(self.ahead[0], self.ahead[1], self.yaw))
        elif plan is not None and len(plan.points) > 1:
            pose = pose_on_plan(plan, stage.robot, self.on_plan or 0.0).compose(Pose2(0.0, 0.0, self.yaw))
        else:
            pose = stage.robot.compose(Pose2(self.on_plan or 0.0, 0.0, self.yaw))
            remark = ", straight ahead because the robot had no plan"
        stage.spawn(Body(self.name, (self.solid(self.name),), Pose3.planar(pose), self.mass))
        return Effect(not remark, f"spawned {self.name} at ({pose.x:.2f}, {pose.y:.2f}){remark}")


def pose_on_plan(plan: Path, robot: Pose2, distance: float) -> Pose2:
    """Return the pose on `plan` that is `distance` m beyond the point of the plan nearest to the robot.

    The heading is the direction of the plan. If the plan ends before, the pose is at the end of the plan.
    """
    points = plan.points[:, :2]
    steps = np.hypot(*np.diff(points, axis=0).T)
    if not steps.all():  # repeated points have no direction
        points, steps = points[np.append(True, steps > 0)], steps[steps > 0]
    if not len(steps):
        return Pose2(*plan.points[0].tolist())
    lengths = np.concatenate(([0.0], np.cumsum(steps)))
    directions = np.diff(points, axis=0) / steps[:, None]
    offsets = np.array([robot.x, robot.y]) - points[:-1]
    along = np.clip((offsets * directions).sum(axis=1), 0.0, steps)
    nearest = int(np.argmin(np.hypot(*(offsets - along[:, None] * directions).T)))
    target = min(lengths[nearest] + along[nearest] + distance, lengths[-1])
    segment = min(int(np.searchsorted(lengths, target, side="right")) - 1, len(steps) - 1)
    x, y = points[segment] + (target - lengths[segment]) * directions[segment]
    return Pose2(float(x), float(y), float(np.arctan2(directions[segment, 1], directions[segment, 0])))


class Remove(Spec, WorldAction):
    """Remove an object from the world.

    Example: `do: {remove: {name: pallet}}`
    """

    name: MovableName
    """The object to remove."""

    def perform(self, stage: Stage) -> Effect:
        """Remove the object. Has no effect if the object does not exist."""
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
        """Start the motion. Has no effect if the object does not exist, or is at rest and already at all waypoints."""
        pose = stage.object(self.name)
        if pose is None:
            return Effect(False, f"there is nothing called {self.name}")
        path = self.path(pose)
        if stage.motion(self.name) is None and all(is_same_pose(pose, waypoint) for waypoint in path.poses):
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
        """Move the object. Has no effect if the object does not exist, or is at rest and already at the new pose."""
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

    Use this action for a person who stops in front of the robot, a cart that waits, or a door that jams. A pedestrian
    can only be stopped for good, without `for`.

    Example: `do: {stop: {name: cart, for: 3 s}}`
    """

    name: MovableName
    """The object to stop."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """Duration of the stop; default: until another action moves the object."""

    def perform(self, stage: Stage) -> Effect:
        """Stop the object. Has no effect if it does not exist, if no script moves it, or if it already stops longer."""
        pose, motion = stage.object(self.name), stage.motion(self.name)
        if pose is None:
            return Effect(False, f"there is nothing called {self.name}")
        if motion is None:
            return Effect(False, f"{self.name} was not moving")
        path, elapsed = motion
        if self.for_ is None:
            stage.place(self.name, pose)
            return Effect(True, f"stopped {self.name}")
        if self.for_ <= path.start - elapsed:
            return Effect(False, f"{self.name} was not moving")
        stage.move(self.name, replace(path, phase=path.elapsed(elapsed), start=self.for_))
        return Effect(True, f"stopped {self.name} for {self.for_:g} s")
