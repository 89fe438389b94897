"""`remove`: take an object out of the world."""

from simscen.actions.base import Action
from simscen.core.stage import Stage
from simscen.spec.base import Spec
from simscen.spec.references import ObjectName


class Remove(Spec, Action):
    """Take an object out of the world, at once.

    Example: `do: {remove: {name: pallet}}`
    """

    name: ObjectName
    """The object to remove."""

    def perform(self, stage: Stage) -> None:
        """Remove it."""
        stage.remove(self.name)
