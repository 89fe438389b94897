"""Events and faults as a scenario lists them: something happens when a trigger fires."""

from typing import Annotated, Any, ClassVar

from pydantic import Discriminator, Field, Tag

from simscen.actions.action import AnyAction
from simscen.faults.fault import AnyFault
from simscen.spec.base import Spec
from simscen.spec.places import Name
from simscen.spec.quantities import PositiveDuration
from simscen.triggers.trigger import Trigger


def _one_or_several(value: Any) -> str:
    return "several" if isinstance(value, list) else "one"


Actions = Annotated[
    Annotated[AnyAction, Tag("one")]
    | Annotated[Annotated[list[AnyAction], Field(min_length=1, max_length=50)], Tag("several")],
    Discriminator(_one_or_several),
]


class EventEntry(Spec):
    """Something that happens in the world: `do` it `when` the trigger fires."""

    name: Name | None = None
    """What reports and other triggers call it; default: event-1, event-2, …"""
    when: Trigger
    do: Actions
    """One action, or several in order."""
    required: bool = True
    """Whether the run fails when this never happened: its trigger never fired, an action of it changed nothing, or
    its `probability` was not drawn. `false` where it may stay away."""

    @property
    def actions(self) -> list[AnyAction]:
        """What to do, in order."""
        return self.do if isinstance(self.do, list) else [self.do]


class FaultEntry(AnyFault):
    """Something that goes wrong with a sensor or the wheels."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"sensor", "when", "for_", "name", "required"})

    sensor: Name
    """The instance it affects, by its name in the robot's `sensors`."""
    name: Name | None = None
    """What reports and criteria call it; default: `<sensor>.<fault>`, e.g. `lidar.off`."""
    when: Trigger | None = None
    """When it begins; default: at the start."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """How long it lasts; default: to the end."""
    required: bool = True
    """Whether the run fails when this never happened: its trigger never fired, its `probability` was not drawn, or it
    was over before it changed a message or a command. `false` where it may stay away."""

    @property
    def label(self) -> str:
        """Its name in events and criteria."""
        return self.name or f"{self.sensor}.{self.kind}"
