"""Outlines of the objects on the picture of a run, from the world and from the events that spawned them."""

from collections.abc import Mapping, Sequence

import numpy as np

from simscen.core.environment.scenery import MovableObject
from simscen.core.geometry import Array, Pose2
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace

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
    """Return the pose of the object in an object.spawned event. Missing values are 0."""
    values = (event.data.get(key) for key in ("x", "y", "yaw"))
    return Pose2(*(float(value) if isinstance(value, int | float) else 0.0 for value in values))


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
