"""`mark`: records a name for the current time in the log."""

from typing import Annotated

from pydantic import Field

from simscen.actions.base import WorldAction
from simscen.core.records.events import Event, EventKind
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.places import Name


class Mark(Spec, WorldAction):
    """Record a name for the current time in the log; nothing else changes.

    The trigger `event` and criteria with `after` can refer to the name. Pictures of the run show where the robot was at
    this time. Several events can set the same mark.

    Example: `do: {mark: {name: in the aisle}}`
    """

    name: Name
    """Name of the mark."""
    note: Annotated[str, Field(max_length=1000)] = ""
    """A remark for people who read the log."""

    def perform(self, stage: Stage) -> Effect:
        stage.record_world_event(Event(0, EventKind.MARK, self.name, {"note": self.note} if self.note else {}))
        return Effect(True, f"marked {self.name}")
