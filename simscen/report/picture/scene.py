"""Scene: the data from which the picture of a run is drawn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.scenery import Scenery
from simscen.core.records.case import Case
from simscen.core.records.run_result import RunResult
from simscen.core.records.trace import Trace


@dataclass(frozen=True, eq=False)
class Scene:
    """Finished run to draw: the world and the data of one robot.

    With several robots, there is one scene for each robot, and a common scene. Each of these scenes contains the scenes
    of all robots in `robots`. The common scene has `trace` and `case` of the first robot.

    Attributes:
        trace: Recorded run of the robot.
        case: Goals, footprint, and other parts of the scenario that criteria need.
        map: Map of the world, which can differ from the robot's map.
        result: Result of the run with the verdicts.
        scenery: Objects, zones, ramps and places of the world.
        robots: With several robots, the scene of each robot by name.
        robot_name: Name of the robot; "" for a single robot and for the common scene.
    """

    trace: Trace
    case: Case
    map: OccupancyGrid
    result: RunResult
    scenery: Scenery = field(default_factory=Scenery)
    robots: Mapping[str, "Scene"] = field(default_factory=dict)
    robot_name: str = ""

    @property
    def per_robot(self) -> Sequence["Scene"]:
        """The scenes of all robots; only this one for a single robot."""
        return tuple(self.robots.values()) or (self,)

    @property
    def robot_index(self) -> int:
        """Index of the robot in the order of the names; 0 for a single robot."""
        return sorted(self.robots).index(self.robot_name) if self.robot_name in self.robots else 0

    def label(self, text: str) -> str:
        """Return a text, preceded by the name of the robot if there are several."""
        return f"{self.robot_name}: {text}" if self.robot_name else text


def scene_with_robots(scene: Scene, robots: Mapping[str, tuple[Trace, Case]]) -> Scene:
    """Return the common scene: `scene` with a scene for each robot. Without robots, return `scene`.

    `robots` has the trace and the case of each robot by name.
    """
    parts = {name: replace(scene, trace=trace, case=case, robot_name=name) for name, (trace, case) in robots.items()}
    return replace(scene, robots={name: replace(part, robots=parts) for name, part in parts.items()})
