"""Names that must exist elsewhere: a specification says what they name, the loader looks whether it is there."""

from dataclasses import dataclass
from typing import Annotated, Literal

from simscen.spec.places import Name

Target = Literal["place", "region", "object", "movable", "door", "goal", "event", "happening"]


@dataclass(frozen=True)
class Refers:
    """Marks a text as the name of something.

    An `object` is anything that can be touched, a `movable` one that has a pose of its own; a `happening` is an event
    or a fault of the scenario.
    """

    to: Target


RegionName = Annotated[Name, Refers("region")]
ObjectName = Annotated[Name, Refers("object")]
MovableName = Annotated[Name, Refers("movable")]
DoorName = Annotated[Name, Refers("door")]
GoalName = Annotated[Name, Refers("goal")]
EventName = Annotated[Name, Refers("event")]
HappeningName = Annotated[Name, Refers("happening")]
