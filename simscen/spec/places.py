"""Points and poses as a user writes them."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, GetCoreSchemaHandler, PrivateAttr, StringConstraints
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import polygon_defect
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Length


def _no_path(name: str) -> str:
    """Refuse `../x` and `/x`, but not `1 m/s`: files could be named after it."""
    if name[0] in "/\\" or not {".", ".."}.isdisjoint(name.replace("\\", "/").split("/")):
        raise PydanticCustomError("path_name", "must not be a path")
    return name


Name = Annotated[
    str,
    StringConstraints(min_length=1, max_length=120, pattern=r"^[^\x00-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]*$"),
    AfterValidator(_no_path),
]
# The length stands apart from the pattern: a Unicode `\w` repeated 119 times takes 25 ms to compile, at every start.
NAMESPACE = r"^[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*$"
RobotName = Annotated[str, StringConstraints(max_length=40, pattern=NAMESPACE)]
"""What one of several robots is called, which is its namespace in ROS, too."""
PlaceName = Annotated[str, StringConstraints(max_length=120, pattern=r"^[A-Za-z_][\w .-]*$")]
Point = Annotated[list[Length], Field(min_length=2, max_length=2)]


def _without_flaw(ring: list[Point]) -> list[Point]:
    wrong = polygon_defect([(x, y) for x, y in ring])
    if wrong:
        raise ValueError(f"the polygon {wrong}")
    return ring


Ring = Annotated[list[Point], Field(min_length=3, max_length=200), AfterValidator(_without_flaw)]
"""The corners of one area, in order, either way round."""


class PoseSpec(Spec):
    """A position in meters and a heading in radians, in the map frame."""

    x: Length
    """Meters along the x axis."""
    y: Length
    """Meters along the y axis."""
    yaw: Angle = 0.0
    """The heading, anticlockwise from the x axis."""
    _place: str = PrivateAttr(default="")

    @property
    def place(self) -> str:
        """The place of the world whose pose it is; "" where the pose itself is written."""
        return self._place

    def at(self, place: str) -> "PoseSpec":
        """The same pose, as that of a place."""
        named = self.model_copy()
        named._place = place
        return named

    @property
    def pose(self) -> Pose2:
        """As plain data."""
        return Pose2(self.x, self.y, self.yaw)


# MERGED: Names that must exist elsewhere: a specification says what they name, the loader looks whether it is there.
Target = Literal["place", "region", "object", "movable", "mover", "door", "goal", "event", "happening", "mask"]


@dataclass(frozen=True)
class ReferenceTo:
    """Marks a text as the name of something.

    A `mask` is the file of a filter mask; where a criterion names one, it is among the masks of its Case.
    An `object` is anything that can be touched, a `movable` one that has a pose of its own, and a `mover` one of
    these or another robot; a `happening` is an event
    or a fault of the scenario.
    """

    to: Target


RegionName = Annotated[Name, ReferenceTo("region")]
ObjectName = Annotated[Name, ReferenceTo("object")]
MovableName = Annotated[Name, ReferenceTo("movable")]
MoverName = Annotated[Name, ReferenceTo("mover")]
DoorName = Annotated[Name, ReferenceTo("door")]
GoalName = Annotated[Name, ReferenceTo("goal")]
EventName = Annotated[Name, ReferenceTo("event")]
HappeningName = Annotated[Name, ReferenceTo("happening")]
MaskFile = Annotated[str, Field(min_length=1, max_length=4096), ReferenceTo("mask")]


# MERGED: Places of the world by name, wherever a pose or a point of it is meant.
# MERGED:
# MERGED: A field says so by its type, `PlaceOrPose` or `PlaceOrPoint`, and needs to do no more: when a scenario has been loaded,
# MERGED: the pose of the place stands there (`loading/places.py`), so that code only ever meets poses and points.
DESCRIPTION = "A place of the world, by name."


def _text_or_not(value: Any) -> str:
    return "text" if isinstance(value, str) else "written out"


@dataclass(frozen=True)
class PlaceAllowed(ReferenceTo):
    """Marks a pose in the world frame, in place of which the name of a place may be written.

    `besides` are words that mean something else there.
    """

    to: Target = "place"
    besides: tuple[str, ...] = ()

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        shown = Field(description=DESCRIPTION, examples=list(self.besides) or None)
        name = handler.generate_schema(Annotated[PlaceName, shown])
        return core_schema.tagged_union_schema({"text": name, "written out": handler(source)}, _text_or_not)

    def of(self, pose: PoseSpec) -> Any:
        """What stands there instead of the name of a place with this pose."""
        return pose


class PlaceAllowedForPoint(PlaceAllowed):
    """Marks a point [x, y] in the world frame, in place of which the name of a place may be written."""

    def of(self, pose: PoseSpec) -> Any:
        """Its position."""
        return [pose.x, pose.y]


@dataclass(frozen=True)
class PlaceShorthand:
    """Marks a mapping in place of which a place alone may be written: the value of its key `key`."""

    key: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        name, whole = handler.generate_schema(Annotated[PlaceName, Field(description=DESCRIPTION)]), handler(source)
        alone = core_schema.chain_schema([name, core_schema.no_info_plain_validator_function(self._as_mapping), whole])
        return core_schema.tagged_union_schema({"text": alone, "written out": whole}, _text_or_not)

    def _as_mapping(self, place: str) -> dict[str, str]:
        return {self.key: place}


PlaceOrPose = Annotated[PoseSpec, PlaceAllowed()]
"""A pose in the world frame, or a place of the world by name."""
PlaceOrPoint = Annotated[Point, PlaceAllowedForPoint()]
"""A point [x, y] in the world frame, or a place of the world by name."""
