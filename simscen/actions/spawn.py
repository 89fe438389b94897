"""`spawn`: put an object into the world."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from simscen.actions.base import Action
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body
from simscen.core.messages.navigation import Path
from simscen.core.stage import Effect, Stage
from simscen.spec.named_places import PlaceOrPose
from simscen.spec.objects import Shaped
from simscen.spec.places import Name
from simscen.spec.quantities import Angle, Length, Mass, NonNegativeLength


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
