"""What things look like from above."""

from collections.abc import Mapping, Sequence

import numpy as np

from simscen.core.environment.scenery import MovableObject
from simscen.core.geometry import Array, Pose2
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace

_UNKNOWN_RADIUS = 0.2
Outlines = tuple[Array, ...]


def outlines(trace: Trace, things: Sequence[MovableObject]) -> dict[str, Outlines]:
    """The outlines, each (n, 2), of each object in its own frame: what was spawned, and else the world's things."""
    found = {thing.name: tuple(map(np.array, thing.outlines)) for thing in things if thing.outlines}
    found.update({event.name: of_event(event) for event in trace.of_kind(EventKind.OBJECT_SPAWNED)})
    for name in trace.objects:
        found.setdefault(name, (_circle(_UNKNOWN_RADIUS),))
    return found


def of_event(event: Event) -> Outlines:
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
            return (_circle(_UNKNOWN_RADIUS),)


def pose_of(event: Event) -> Pose2:
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
