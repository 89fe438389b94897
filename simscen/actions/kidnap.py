"""`kidnap`: the robot stands somewhere else."""

from simscen.actions.base import Action
from simscen.core.geometry import wrap
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.named_places import PlaceOrPose

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
