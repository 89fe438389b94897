"""What a picture shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

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
    for their shapes. `robots` is what there is of each of several robots; one of these has a `name`.
    """

    trace: Trace
    case: Case
    map: OccupancyGrid
    result: RunResult
    places: Mapping[str, Pose2] = field(default_factory=dict)
    bodies: Sequence[Body] = ()
    robots: Mapping[str, "Scene"] = field(default_factory=dict)
    name: str = ""

    @property
    def each(self) -> Sequence["Scene"]:
        """What is shown of each robot."""
        return tuple(self.robots.values()) or (self,)

    def called(self, what: str) -> str:
        """What something of this robot is called on the picture."""
        return f"{self.name}: {what}" if self.name else what


def with_robots(scene: Scene, robots: Mapping[str, tuple[Trace, Case]]) -> Scene:
    """The scene with several robots, which are not things in it."""
    parts = {name: replace(scene, trace=trace, case=case, name=name) for name, (trace, case) in robots.items()}
    return replace(scene, robots=parts)
