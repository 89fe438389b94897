"""`remove`: take an object out of the world."""

from simscen.actions.base import Action
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.references import MovableName


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
