"""Specifications of worlds (`*.world.yaml`) and of the YAML files of ROS maps."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field, ValidationInfo, field_validator, model_validator

from simscen.spec.base import LanguageVersion, Spec
from simscen.spec.motions import Motion
from simscen.spec.places import FilePath, Name, PlaceName, PlaceOrPoint, PlaceOrPose, PoseSpec, Ring
from simscen.spec.quantities import Duration, Friction, Length, Mass, PositiveLength, Probability
from simscen.spec.shapes import ShapedObject


class Wall(Spec):
    """Wall along a polyline."""

    name: Name = "wall"
    """Name in collision reports. Default: wall_1, wall_2, …"""
    points: Annotated[list[PlaceOrPoint], Field(min_length=2, max_length=10_000)]
    """Corners of the center line as [x, y] or names of places. Repeat the first corner at the end to close the wall."""
    thickness: PositiveLength = 0.1
    """Thickness across the center line."""
    height: PositiveLength = 1.0
    """Height above the ground."""

    def label(self, number: int) -> str:
        """Return the name, or e.g. `wall_3` for wall number 3 without a name."""
        return self.name if "name" in self.model_fields_set else f"wall_{number}"


class WorldObject(ShapedObject):
    """Object in the world."""

    name: Name
    """Name in collision reports."""
    pose: PlaceOrPose
    """Pose, or name of a place."""


class Obstacle(WorldObject):
    """Object that never moves. Robots drive over the object if it is low enough."""

    friction: Friction = 1.0
    """Friction coefficient of the surface for wheels on a sill, step, or platform."""


class Ramp(Spec):
    """Wedge that rises from the ground."""

    name: Name
    """Name in collision reports."""
    start: PlaceOrPoint
    """Center [x, y] of the lower edge, where the wedge begins to rise."""
    end: PlaceOrPoint
    """Center [x, y] of the upper edge, where the wedge ends with a vertical face."""
    width: PositiveLength
    """Width across the direction of the slope."""
    height: PositiveLength
    """Height of the upper edge above the ground."""
    friction: Friction = 1.0
    """Friction coefficient of the surface."""


class Travel(Motion):
    """Motion through waypoints at a speed, or along timed keyframes."""

    start: Duration = 0.0
    """Time at which the motion starts."""


class Movable(WorldObject):
    """Object that can move. The robot can push an object with a mass. An object with `move` moves by itself."""

    mass: Mass = 0.0
    """Mass in kg; 0: the robot cannot push the object."""
    move: Travel | None = None
    """Motion of the object. Keyframes may start at a pose other than `pose`."""


class Door(Spec):
    """Door that a scenario can open and close: a panel that swings about its hinge, or slides."""

    name: Name
    """Name for the actions `open` and `close`."""
    points: Annotated[list[PlaceOrPoint], Field(min_length=2, max_length=2)]
    """The two door posts as [x, y] or names of places. A door swings about the first post, or slides past it."""
    motion: Literal["swing", "slide"] = "swing"
    """`swing`: the panel turns by 90° counterclockwise about the hinge. `slide`: the panel moves along its own line,
    past the first post."""
    travel: PositiveLength | None = None
    """Distance that a sliding door moves; default: its width."""
    closed: bool = False
    """Whether the door is closed at the start."""
    thickness: PositiveLength = 0.05
    """Thickness of the panel."""
    height: PositiveLength = 1.0
    """Height of the panel."""

    @model_validator(mode="after")
    def _check_travel(self) -> "Door":
        if self.travel is not None and self.motion == "swing":
            raise ValueError("`travel` is only valid for a sliding door (`motion: slide`)")
        return self


class WorldSpec(Spec):
    """World: walls, obstacles, movable objects, and named places and regions, in meters in the map frame."""

    simscen: LanguageVersion
    """Version of the scenario language; optional for a world within a scenario file."""
    name: Name | None = None
    """Name of the world; default: the name of the file."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """Description for people."""
    map: FilePath | None = None
    """ROS map (yaml) whose occupied cells become walls with the height `map_height`."""
    map_height: PositiveLength = 1.0
    """Height of the walls made from `map`."""
    sdf: FilePath | None = None
    """Gazebo world to which the walls, obstacles, objects, ramps, and doors are added."""
    walls: Annotated[list[Wall], Field(max_length=2000)] = []
    """Walls along polylines."""
    obstacles: Annotated[list[Obstacle], Field(max_length=10_000)] = []
    """Objects that never move."""
    objects: Annotated[list[Movable], Field(max_length=200)] = []
    """Objects that can move, be pushed, or be moved by a scenario."""
    ramps: Annotated[list[Ramp], Field(max_length=200)] = []
    """Slopes, sills, and steps that wheels can climb."""
    doors: Annotated[list[Door], Field(max_length=200)] = []
    """Doors that a scenario can open and close."""
    places: dict[PlaceName, PoseSpec] = {}
    """Named poses for goals and starts."""
    regions: dict[PlaceName, Ring] = {}
    """Named areas: polygons given by their corners, without self-intersections."""
    friction: dict[PlaceName, Friction] = {}
    """Friction coefficient of the floor by region: 1 is dry concrete, 0.3 a wet floor, 0.1 oil or ice."""

    @model_validator(mode="after")
    def _check_names(self) -> "WorldSpec":
        names = [*(entry.name for entry in self.objects), *(door.name for door in self.doors)]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ValueError(f"several objects have the name `{repeated[0]}`")
        return self


class RosMapSpec(Spec):
    """ROS map: an image and the meaning of its gray values, as in nav2_map_server. Other keys are ignored."""

    model_config = ConfigDict(extra="ignore")

    image: FilePath
    """Image file (pgm, png, bmp), relative to this file."""
    resolution: PositiveLength
    """Size of a pixel in meters."""
    origin: Annotated[list[Length], Field(min_length=3, max_length=3)]
    """Pose of the lower left corner of the lower left pixel: x, y, yaw."""
    negate: Literal[0, 1] | bool = 0
    """Whether black is free and white is occupied."""
    occupied_thresh: Probability = 0.65
    """Minimum darkness of occupied pixels, from 0 (white) to 1 (black)."""
    free_thresh: Annotated[Probability, Field(validate_default=True)] = 0.25
    """Maximum darkness of free pixels."""
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    """`trinary`: gray values between the thresholds are unknown. `scale`: they are occupancies between 0 and 100 %.
    `raw`: gray values are the values of the cells, and the thresholds have no effect."""

    @field_validator("free_thresh")
    @classmethod
    def _check_thresholds(cls, free: float, info: ValidationInfo) -> float:
        """Raise ValueError if a gray value could be both free and occupied."""
        occupied = info.data.get("occupied_thresh", 1.0)
        if free >= occupied:
            raise ValueError(f"free_thresh {free:g} must be less than occupied_thresh {occupied:g}")
        return free
