"""Polygons and poses in the data of events. Data can be invalid, because plug-in stacks can report any data."""

import math

from simscen.core.geometry import Polygon, Pose2
from simscen.core.records.events import Event, Value


def polygon_from_data(value: Value) -> Polygon:
    """Return the corners in m of a polygon in the data of an event; () if the value is not a polygon."""
    corners = tuple((_number(corner[0]), _number(corner[1])) for corner in _lists(value) if len(corner) == 2)
    is_polygon = isinstance(value, list) and len(corners) == len(value) > 2
    return corners if is_polygon and all(math.isfinite(x) and math.isfinite(y) for x, y in corners) else ()


def spawned_outlines(event: Event) -> tuple[Polygon, ...]:
    """Return the valid outlines in an object.spawned event, one for each part, in the frame of the object."""
    return tuple(polygon for part in _lists(event.data.get("parts")) if (polygon := polygon_from_data(part)))


def spawn_pose(event: Event) -> Pose2:
    """Return the pose of the object in an object.spawned event. Missing and invalid values are 0."""
    values = (_number(event.data.get(key)) for key in ("x", "y", "yaw"))
    return Pose2(*(value if math.isfinite(value) else 0.0 for value in values))


def _lists(value: Value) -> list[list[Value]]:
    """Return the lists in a list; [] for any other value."""
    return [item for item in value if isinstance(item, list)] if isinstance(value, list) else []


def _number(value: Value) -> float:
    """Return a number as float; nan for any other value, and for an integer that is too large for a float."""
    try:
        return float(value) if isinstance(value, int | float) else math.nan
    except OverflowError:
        return math.nan
