"""`teleport`: an object stands somewhere else."""

from simscen.actions.base import Action
from simscen.core.geometry import wrap
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.named_places import PlaceOrPose
from simscen.spec.references import MovableName

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
