"""Scene: the data from which the picture of a run is drawn. Also computes the outlines of objects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.scenery import MovableObject, Scenery
from simscen.core.geometry import Array, Pose2
from simscen.core.records.case import Case
from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import RunResult
from simscen.core.records.trace import Trace


@dataclass(frozen=True, eq=False)
class Scene:
    """Finished run to draw: the world and the data of one robot.

    With several robots, there is a scene for each robot and a common scene. All of them contain the scenes of all
    robots in `robots`. `trace` and `case` of the common scene are those of the first robot.

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


_DEFAULT_RADIUS_M = 0.2
"""Radius of an object whose shape is unknown."""
Outlines = tuple[Array, ...]
"""Polygons (n, 2) in m in the frame of an object, one for each part of the object."""


def object_outlines(trace: Trace, world_objects: Sequence[MovableObject]) -> dict[str, Outlines]:
    """Return the outlines of `world_objects` and of all spawned objects by name; a circle for an unknown shape."""
    outlines = {thing.name: tuple(map(np.array, thing.outlines)) for thing in world_objects if thing.outlines}
    outlines.update({event.name: outlines_of_event(event) for event in trace.of_kind(EventKind.OBJECT_SPAWNED)})
    for name in trace.objects:
        outlines.setdefault(name, (_circle(_DEFAULT_RADIUS_M),))
    return outlines


def outlines_of_event(event: Event) -> Outlines:
    """Return the outlines in an object.spawned event: from `parts`, or from `shape` with `size` or `points`."""
    size, points = _floats(event.data, "size"), event.data.get("points")
    parts = event.data.get("parts")
    if isinstance(parts, list) and parts:
        return tuple(np.array(part, dtype=np.float64) for part in parts)
    match event.data.get("shape"):
        case "box" if len(size) >= 2:
            return (_rectangle(size[0], size[1]),)
        case "cylinder" if size:
            return (_circle(size[0]),)
        case "polygon" if isinstance(points, list) and len(points) > 2:
            return (np.array(points, dtype=np.float64),)
        case _:
            return (_circle(_DEFAULT_RADIUS_M),)


def spawn_pose(event: Event) -> Pose2:
    """Return the pose of the object in an object.spawned event."""
    x, y, yaw = (event.data.get(key, 0.0) for key in ("x", "y", "yaw"))
    assert isinstance(x, int | float) and isinstance(y, int | float) and isinstance(yaw, int | float)
    return Pose2(float(x), float(y), float(yaw))


def _floats(data: Mapping[str, object], key: str) -> list[float]:
    """Return the numbers in a list of event data; [] without a list."""
    value = data.get(key)
    return [float(part) for part in value if isinstance(part, int | float)] if isinstance(value, list) else []


def _rectangle(length: float, width: float) -> Array:
    x, y = length / 2, width / 2
    return np.array([(-x, -y), (x, -y), (x, y), (-x, y)])


def _circle(radius: float) -> Array:
    angles = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    return radius * np.column_stack((np.cos(angles), np.sin(angles)))
