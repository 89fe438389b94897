"""Points and poses as a user writes them."""

from typing import Annotated

from pydantic import AfterValidator, Field, PrivateAttr, StringConstraints
from pydantic_core import PydanticCustomError

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
