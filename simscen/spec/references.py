"""Names that must exist elsewhere: a specification says what they name, the loader looks whether it is there."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from simscen.spec.places import Name

Target = Literal["place", "region", "object", "movable", "mover", "door", "goal", "event", "happening", "mask"]


@dataclass(frozen=True)
class Refers:
    """Marks a text as the name of something.

    A `mask` is the file of a filter mask; where a criterion names one, it is among the masks of its Case.
    An `object` is anything that can be touched, a `movable` one that has a pose of its own, and a `mover` one of
    these or another robot; a `happening` is an event
    or a fault of the scenario.
    """

    to: Target


RegionName = Annotated[Name, Refers("region")]
ObjectName = Annotated[Name, Refers("object")]
MovableName = Annotated[Name, Refers("movable")]
MoverName = Annotated[Name, Refers("mover")]
DoorName = Annotated[Name, Refers("door")]
GoalName = Annotated[Name, Refers("goal")]
EventName = Annotated[Name, Refers("event")]
HappeningName = Annotated[Name, Refers("happening")]
MaskFile = Annotated[str, Field(min_length=1, max_length=4096), Refers("mask")]
