"""`kidnap`, `push`: things done to the robot itself."""

from typing import Annotated

from pydantic import Field

from simscen.actions.base import Action
from simscen.core.stage import Stage
from simscen.spec.base import Spec
from simscen.spec.places import PoseSpec
from simscen.spec.quantities import Impulse


class Kidnap(Spec, Action):
    """Set the robot down somewhere else; its stack is not told.

    Example: `do: {kidnap: {pose: {x: 2, y: 3, yaw: 90 deg}}}`
    """

    pose: PoseSpec
    """Where it finds itself, in the world frame."""

    def perform(self, stage: Stage) -> None:
        """Set it down, at rest."""
        stage.place_robot(self.pose.pose)


class Push(Spec, Action):
    """Push the robot: an impulse at its centre.

    Example: `do: {push: {impulse: [0, 5]}}`
    """

    impulse: Annotated[list[Impulse], Field(min_length=2, max_length=2)]
    """N s along x and y of the world frame."""

    def perform(self, stage: Stage) -> None:
        """Push once."""
        stage.push((self.impulse[0], self.impulse[1]))
