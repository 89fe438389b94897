"""A world as a user writes it (`*.world.yaml`)."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from simscen.spec.base import LanguageVersion, Spec
from simscen.spec.moving_objects import Motion, Shaped
from simscen.spec.places import Name, PlaceName, PlaceOrPoint, PlaceOrPose, PoseSpec, Ring
from simscen.spec.quantities import Duration, Friction, Mass, PositiveLength


class Wall(Spec):
    """A wall along a polyline."""

    name: Name = "wall"
    """What a collision with it is reported as; default: wall_1, wall_2, …"""
    points: Annotated[list[PlaceOrPoint], Field(min_length=2, max_length=10_000)]
    """Corners, [x, y] or places by name, of its center line; repeat the first one at the end to close it."""
    thickness: PositiveLength = 0.1
    """Across the center line."""
    height: PositiveLength = 1.0
    """From the ground."""

    def called(self, number: int) -> str:
        """Its name, or `wall_3` for the third wall of a world."""
        return self.name if "name" in self.model_fields_set else f"wall_{number}"


class Thing(Shaped):
    """Something that is in the world."""

    name: Name
    """What a collision with it is reported as."""
    pose: PlaceOrPose
    """Where it stands: a pose, or a place by name."""


class Obstacle(Thing):
    """Something that stands in the world and never moves; what is low enough is driven over."""

    friction: Friction = 1.0
    """Of its surface, where wheels get onto it: a sill, a step, a platform."""


class Ramp(Spec):
    """A wedge that rises from the ground: how steep it is follows from its length and height."""

    name: Name
    """What a collision with it is reported as."""
    start: PlaceOrPoint
    """The middle [x, y] of its foot, where it begins to rise."""
    end: PlaceOrPoint
    """The middle [x, y] of its upper edge, where it ends upright."""
    width: PositiveLength
    """Across the way up."""
    height: PositiveLength
    """Of its upper edge, above the ground."""
    friction: Friction = 1.0
    """Of its surface."""


class Travel(Motion):
    """Motion through waypoints at a speed, or along timed keyframes."""

    start: Duration = 0.0
    """When it begins."""


class Movable(Thing):
    """Something that can move: pushed by the robot if it has a mass, or by itself along waypoints."""

    mass: Mass = 0.0
    """In kg; 0 = the robot cannot push it."""
    move: Travel | None = None
    """How it moves by itself, whatever its pose where keyframes begin elsewhere."""


class Door(Spec):
    """A door: a panel in a doorway that a scenario can open and close. It swings about its hinge, or slides."""

    name: Name
    """What `open` and `close` call it."""
    points: Annotated[list[PlaceOrPoint], Field(min_length=2, max_length=2)]
    """The two door posts, [x, y] or places by name; the hinge is at the first, past which a sliding door goes."""
    motion: Literal["swing", "slide"] = "swing"
    """`swing`: by 90° anticlockwise about the hinge. `slide`: along its own line, as into a pocket of the wall."""
    travel: PositiveLength | None = None
    """How far it slides; default: as far as it is wide."""
    closed: bool = False
    """Whether it is closed at the start."""
    thickness: PositiveLength = 0.05
    """Of the panel."""
    height: PositiveLength = 1.0
    """Of the panel."""

    @model_validator(mode="after")
    def _travel_slides(self) -> "Door":
        if self.travel is not None and self.motion == "swing":
            raise ValueError("travel is for a door that slides: `motion: slide`")
        return self


class WorldSpec(Spec):
    """Walls, obstacles, things that move, named places and regions. Meters, in the map frame."""

    simscen: LanguageVersion
    """Version of this language."""
    name: Name | None = None
    """Default: the file's name."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """For people."""
    map: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    """A ROS map (yaml) whose occupied cells become walls `map_height` tall."""
    map_height: PositiveLength = 1.0
    """Height of the walls made from `map`."""
    sdf: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    """A Gazebo world to add things to."""
    walls: Annotated[list[Wall], Field(max_length=2000)] = []
    """Walls along polylines."""
    obstacles: Annotated[list[Obstacle], Field(max_length=10_000)] = []
    """What stands and never moves."""
    objects: Annotated[list[Movable], Field(max_length=200)] = []
    """What can move, be pushed, or be moved by a scenario."""
    ramps: Annotated[list[Ramp], Field(max_length=200)] = []
    """What wheels climb: slopes, sills and steps."""
    doors: Annotated[list[Door], Field(max_length=200)] = []
    """What a scenario can open and close."""
    places: dict[PlaceName, PoseSpec] = {}
    """Named poses for goals and starts."""
    regions: dict[PlaceName, Ring] = {}
    """Named areas: polygons over their corners, which may not cross themselves."""
    friction: dict[PlaceName, Friction] = {}
    """How slippery the floor is in which region: 1 is dry concrete, 0.3 a wet floor, 0.1 oil or ice."""

    @model_validator(mode="after")
    def _names_differ(self) -> "WorldSpec":
        names = [*(thing.name for thing in self.objects), *(door.name for door in self.doors)]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"two objects are called `{twice[0]}`")
        return self
