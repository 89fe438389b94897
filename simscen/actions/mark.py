"""`mark`: a name for this moment."""

from typing import Annotated

from pydantic import Field

from simscen.actions.base import Action
from simscen.core.records.events import Event, EventKind
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.places import Name


class Mark(Spec, Action):
    """Write a name for this moment into the log; nothing else changes.

    The trigger `event`, and criteria with `after`, know it by that name, and pictures show where the robot was. Stands
    for what a test engineer would call out while watching: "now it sees the door". Several events may set the same one.

    Example: `do: {mark: {name: in the aisle}}`
    """

    name: Name
    """What this moment is called."""
    note: Annotated[str, Field(max_length=1000)] = ""
    """More about it, for people who read the log."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Write it down."""
        stage.tell(Event(0, EventKind.MARK, self.name, {"note": self.note} if self.note else {}))
        return Effect(True, f"marked {self.name}")
