"""What a picture shows."""

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


def scene_with_robots(scene: Scene, robots: Mapping[str, tuple[Trace, Case]]) -> Scene:
    """The scene with several robots, which are not things in it."""
    parts = {name: replace(scene, trace=trace, case=case, name=name) for name, (trace, case) in robots.items()}
    return replace(scene, robots={name: replace(part, robots=parts) for name, part in parts.items()})


_UNKNOWN_RADIUS_M = 0.2
Outlines = tuple[Array, ...]


def object_outlines(trace: Trace, things: Sequence[MovableObject]) -> dict[str, Outlines]:
    """The outlines, each (n, 2), of each object in its own frame: what was spawned, and else the world's things."""
    found = {thing.name: tuple(map(np.array, thing.outlines)) for thing in things if thing.outlines}
    found.update({event.name: outlines_of_event(event) for event in trace.of_kind(EventKind.OBJECT_SPAWNED)})
    for name in trace.objects:
        found.setdefault(name, (_circle(_UNKNOWN_RADIUS_M),))
    return found


def outlines_of_event(event: Event) -> Outlines:
    """The outlines that an object.spawned event describes: its parts, or else `shape` with `size` or `points`."""
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
            return (_circle(_UNKNOWN_RADIUS_M),)


def spawn_pose(event: Event) -> Pose2:
    """Where an object.spawned event puts the object."""
    x, y, yaw = (event.data.get(key, 0.0) for key in ("x", "y", "yaw"))
    assert isinstance(x, int | float) and isinstance(y, int | float) and isinstance(yaw, int | float)
    return Pose2(float(x), float(y), float(yaw))


def _floats(data: Mapping[str, object], key: str) -> list[float]:
    value = data.get(key)
    return [float(part) for part in value if isinstance(part, int | float)] if isinstance(value, list) else []


def _rectangle(length: float, width: float) -> Array:
    x, y = length / 2, width / 2
    return np.array([(-x, -y), (x, -y), (x, y), (-x, y)])


def _circle(radius: float) -> Array:
    angles = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    return radius * np.column_stack((np.cos(angles), np.sin(angles)))
