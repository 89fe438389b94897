"""What a picture shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from simscen.core.case import Case
from simscen.core.geometry import Pose2
from simscen.core.grid import OccupancyGrid
from simscen.core.result import RunResult
from simscen.core.shapes import Body
from simscen.core.trace import Trace


@dataclass(frozen=True, eq=False)
class Scene:
    """A finished run: everything here is in its log, but for `places` and `bodies`, which belong to the world.

    `map` is the world as it is (not necessarily the map the robot was given). `bodies` are the world's moving things,
    for their shapes.
    """

    trace: Trace
    case: Case
    map: OccupancyGrid
    result: RunResult
    places: Mapping[str, Pose2] = field(default_factory=dict)
    bodies: Sequence[Body] = ()
