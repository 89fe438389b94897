"""What a picture shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.scenery import Scenery
from simscen.core.records.case import Case
from simscen.core.records.run_result import RunResult
from simscen.core.records.trace import Trace


@dataclass(frozen=True, eq=False)
class Scene:
    """A finished run: everything here is in its log.

    `map` is the world as it is (not necessarily the map the robot was given), `scenery` what else there was to see.
    `robots` is what there is of each of several robots; one of these has a `name`.
    """

    trace: Trace
    case: Case
    map: OccupancyGrid
    result: RunResult
    scenery: Scenery = field(default_factory=Scenery)
    robots: Mapping[str, "Scene"] = field(default_factory=dict)
    name: str = ""

    @property
    def each(self) -> Sequence["Scene"]:
        """What is shown of each robot."""
        return tuple(self.robots.values()) or (self,)

    @property
    def number(self) -> int:
        """Which of several robots it is of, by name; 0 for the only one."""
        return sorted(self.robots).index(self.name) if self.name in self.robots else 0

    def called(self, what: str) -> str:
        """What something of this robot is called on the picture."""
        return f"{self.name}: {what}" if self.name else what


def with_robots(scene: Scene, robots: Mapping[str, tuple[Trace, Case]]) -> Scene:
    """The scene with several robots, which are not things in it."""
    parts = {name: replace(scene, trace=trace, case=case, name=name) for name, (trace, case) in robots.items()}
    return replace(scene, robots={name: replace(part, robots=parts) for name, part in parts.items()})
