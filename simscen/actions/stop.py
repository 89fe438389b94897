"""`stop`: what a script moves stands still, for good or for a while."""

from dataclasses import replace

from pydantic import Field

from simscen.actions.base import Action
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveDuration
from simscen.spec.references import MovableName


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
