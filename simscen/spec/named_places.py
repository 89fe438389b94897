"""Places of the world by name, wherever a pose or a point of it is meant.

A field says so by its type, `PlaceOrPose` or `PlaceOrPoint`, and needs to do no more: when a scenario has been loaded,
the pose of the place stands there (`loading/places.py`), so that code only ever meets poses and points.
"""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from simscen.spec.places import PlaceName, Point, PoseSpec
from simscen.spec.references import Refers, Target

DESCRIPTION = "A place of the world, by name."


def _text_or_not(value: Any) -> str:
    return "text" if isinstance(value, str) else "written out"


@dataclass(frozen=True)
class OrPlace(Refers):
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


class PointOrPlace(OrPlace):
    """Marks a point [x, y] in the world frame, in place of which the name of a place may be written."""

    def of(self, pose: PoseSpec) -> Any:
        """Its position."""
        return [pose.x, pose.y]


@dataclass(frozen=True)
class PlaceAlone:
    """Marks a mapping in place of which a place alone may be written: the value of its key `key`."""

    key: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        name, whole = handler.generate_schema(Annotated[PlaceName, Field(description=DESCRIPTION)]), handler(source)
        alone = core_schema.chain_schema([name, core_schema.no_info_plain_validator_function(self._as_mapping), whole])
        return core_schema.tagged_union_schema({"text": alone, "written out": whole}, _text_or_not)

    def _as_mapping(self, place: str) -> dict[str, str]:
        return {self.key: place}


PlaceOrPose = Annotated[PoseSpec, OrPlace()]
"""A pose in the world frame, or a place of the world by name."""
PlaceOrPoint = Annotated[Point, PointOrPlace()]
"""A point [x, y] in the world frame, or a place of the world by name."""
