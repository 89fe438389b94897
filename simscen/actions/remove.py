"""`remove`: take an object out of the world."""

from simscen.actions.base import Action
from simscen.core.stage import Stage
from simscen.spec.base import Spec
from simscen.spec.references import MovableName


class Remove(Spec, Action):
    """Take an object out of the world, at once.

    Example: `do: {remove: {name: pallet}}`
    """

    name: MovableName
    """The object to remove."""

    def perform(self, stage: Stage) -> None:
        """Remove it."""
        stage.remove(self.name)
