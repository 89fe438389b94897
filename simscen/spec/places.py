"""Field types for names, points, poses, polygons, and filter masks, and for names that refer to other entries.

Some pose and point fields also accept the name of a place (a named pose of a world). The loader replaces the name by
the pose or point of the place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Field, GetCoreSchemaHandler, PrivateAttr, StringConstraints
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import polygon_defect, without_repeated_corners
from simscen.spec.base import Spec, text_or_mapping
from simscen.spec.quantities import Angle, Length

if TYPE_CHECKING:
    from simscen.core.environment.costmap_filters import SpeedLimits
    from simscen.core.environment.occupancy_grid import OccupancyGrid


def _reject_path(name: str) -> str:
    """Return the name. Raises PydanticCustomError for a path such as `../x` or `/x`; `1 m/s` is valid."""
    if name[0] in "/\\" or not {".", ".."}.isdisjoint(name.replace("\\", "/").split("/")):
        raise PydanticCustomError("path_name", "must not be a path")
    return name


Name = Annotated[
    str,
    StringConstraints(min_length=1, max_length=120, pattern=r"^[^\x00-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]*$"),
    AfterValidator(_reject_path),
]
"""Name: 1 to 120 characters, no control characters, and not a path."""
ROS_NAMESPACE_PATTERN = r"^[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*$"
"""Pattern of names that are also valid as ROS namespaces."""
RobotName = Annotated[str, StringConstraints(max_length=40, pattern=ROS_NAMESPACE_PATTERN)]
"""Name of one of several robots, which is also its ROS namespace."""
# The maximum length is not part of the pattern: compiling `\w{0,119}` for Unicode takes 25 ms at every start.
PlaceName = Annotated[str, StringConstraints(max_length=120, pattern=r"^[A-Za-z_][\w .-]*$")]
"""Name of a place, a region, or a tag."""
Point = Annotated[list[Length], Field(min_length=2, max_length=2)]
"""Point [x, y] in m."""


def _check_polygon(ring: list[Point]) -> list[Point]:
    """Return the polygon without repeated corners. Raises ValueError if it is invalid."""
    corners = [(x, y) for x, y in ring]
    defect = polygon_defect(corners)
    if defect:
        raise ValueError(f"the polygon {defect}")
    return [[x, y] for x, y in without_repeated_corners(corners)]


Ring = Annotated[list[Point], Field(min_length=3, max_length=200), AfterValidator(_check_polygon)]
"""Corners of a polygon in order, clockwise or counterclockwise."""


class PoseSpec(Spec):
    """A position in meters and a heading in radians."""

    x: Length
    """Meters along the x axis."""
    y: Length
    """Meters along the y axis."""
    yaw: Angle = 0.0
    """Heading, counterclockwise from the x axis."""
    _place: str = PrivateAttr(default="")

    @property
    def place(self) -> str:
        """Name of the place from which the pose comes; "" for a pose that is written out in the file."""
        return self._place

    def with_place(self, place: str) -> PoseSpec:
        """Return a copy of the pose that comes from this place."""
        copy = self.model_copy()
        copy._place = place
        return copy

    @property
    def pose(self) -> Pose2:
        """The pose as a tuple (x, y, yaw)."""
        return Pose2(self.x, self.y, self.yaw)


ReferenceKind = Literal[
    "place", "region", "object", "movable", "mover", "door", "goal", "event", "disturbance", "mask", "verdict"
]
"""Kind of entry to which a name refers. ReferenceTo explains the kinds."""


@dataclass(frozen=True)
class ReferenceTo:
    """Annotation of a string that must be the name of an existing entry of the kind `target`.

    Kinds in the world: `place`, `region`, `door`; `object`, any solid object, including walls and robots; `movable`, an
    object or door that can move; `mover`, a movable or a robot. Kinds in the scenario: `goal`; `event`, an event or a
    mark; `disturbance`, an event, a fault, or a mark; `verdict`, a criterion, an event, or a fault. `mask`: the file of
    a filter mask.
    """

    target: ReferenceKind


RegionName = Annotated[Name, ReferenceTo("region")]
ObjectName = Annotated[Name, ReferenceTo("object")]
MovableName = Annotated[Name, ReferenceTo("movable")]
MoverName = Annotated[Name, ReferenceTo("mover")]
DoorName = Annotated[Name, ReferenceTo("door")]
GoalName = Annotated[Name, ReferenceTo("goal")]
EventName = Annotated[Name, ReferenceTo("event")]
DisturbanceName = Annotated[Name, ReferenceTo("disturbance")]
FilePath = Annotated[str, Field(min_length=1, max_length=4096)]
MaskFile = Annotated[FilePath, ReferenceTo("mask")]


PLACE_NAME_DESCRIPTION = "Name of a place in the world."


@dataclass(frozen=True)
class PlaceAllowed(ReferenceTo):
    """Annotation of a pose in the world frame that can also be given as the name of a place.

    `keywords` are other valid texts, such as "unknown", which do not name a place.
    """

    target: ReferenceKind = "place"
    keywords: tuple[str, ...] = ()

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        field = Field(description=PLACE_NAME_DESCRIPTION, examples=list(self.keywords) or None)
        name = handler.generate_schema(Annotated[PlaceName, field])
        return core_schema.tagged_union_schema({"a text": name, "a mapping": handler(source)}, text_or_mapping)

    def value_at(self, pose: PoseSpec) -> Any:
        """Return the value of the field for a place with this pose: the pose itself."""
        return pose


class PlaceAllowedForPoint(PlaceAllowed):
    """Annotation of a point [x, y] in the world frame that can also be given as the name of a place."""

    def value_at(self, pose: PoseSpec) -> Any:
        """Return the value of the field for a place with this pose: [x, y]."""
        return [pose.x, pose.y]


@dataclass(frozen=True)
class PlaceShorthand:
    """Annotation of a mapping `{key: place}` that can also be given as the name of the place alone."""

    key: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        name = handler.generate_schema(Annotated[PlaceName, Field(description=PLACE_NAME_DESCRIPTION)])
        mapping = handler(source)
        convert = core_schema.no_info_plain_validator_function(lambda place: {self.key: place})
        shorthand = core_schema.chain_schema([name, convert, mapping])
        return core_schema.tagged_union_schema({"a text": shorthand, "a mapping": mapping}, text_or_mapping)


PlaceOrPose = Annotated[PoseSpec, PlaceAllowed()]
"""A pose in the world frame, or the name of a place in the world."""
PlaceOrPoint = Annotated[Point, PlaceAllowedForPoint()]
"""A point [x, y] in the world frame, or the name of a place in the world."""


class SpeedMask(Spec):
    """Filter mask of speed limits, as for nav2_costmap_2d's SpeedFilter and its CostmapFilterInfo.

    The limit of a cell is `base + multiplier · value` with a value of 0 … 100 as map_server reads the mask (`mode:
    scale` keeps shades of gray). Cells with value 0, unknown cells, and limits of 0 or less have no effect.
    """

    file: MaskFile
    """Map YAML file of the mask, relative to this file. Its resolution and origin may differ from those of the map."""
    type: Literal["percent", "absolute"] = "percent"
    """Unit of the limits: percent of the controller's full speed (CostmapFilterInfo type 1), or m/s (type 2)."""
    base: Annotated[float, Field(ge=-1000, le=1000)] = 0.0
    """Limit at value 0 (base of CostmapFilterInfo): percent or m/s."""
    multiplier: Annotated[float, Field(ge=-1000, le=1000)] = 1.0
    """Increase of the limit per unit of value (multiplier of CostmapFilterInfo): percent or m/s."""

    def speed_limits(self, grid: OccupancyGrid) -> SpeedLimits:
        """Return the speed limits of all cells; `grid` has the values of the mask."""
        from simscen.core.environment.costmap_filters import SpeedLimits

        return SpeedLimits(grid, self.type == "percent", self.base, self.multiplier)
