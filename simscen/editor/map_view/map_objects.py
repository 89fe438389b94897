"""Objects on the map of the editor, and functions that read positions, outlines, and paths from the data of a file.

The data are dicts, lists, and scalars, and can be invalid. Values that cannot be read are ignored. `keys` are the path
to a value in the file.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from simscen.loading.yaml.tree import Key
from simscen.spec.quantities import si_number

Keys = tuple[Key, ...]
"""Path to a value in a YAML file: keys of mappings and indices of lists."""
Notation = Literal["pose", "point", "keyframe"]
"""Notation of a position in the file: mapping with x, y, and yaw; list [x, y]; or list [t, x, y, yaw]."""
Corners = list[tuple[float, float]]
"""Corners (x, y) of a polygon in m."""
CIRCLE_CORNER_COUNT = 24
"""Number of corners of the polygon that represents a circle."""


@dataclass(frozen=True)
class Handle:
    """Position on the map that can be dragged.

    Attributes:
        keys: Path to the position in the file.
        notation: Notation of the position.
        x: Position in m.
        y: Position in m.
        yaw: Heading in rad; None for a position without heading.
        place: Name of the place (named pose) that the file contains instead of numbers; "" for numbers.
    """

    keys: Keys
    notation: Notation
    x: float
    y: float
    yaw: float | None = None
    place: str = ""


@dataclass(frozen=True)
class MapObject:
    """Object on the map and in the list of objects. An object without handles and region is only in the list.

    Attributes:
        keys: Path to the value that defines the object.
        kind: Kind of the object, such as "robot" or "wall".
        label: Name of the object on the map.
        handles: Positions that can be dragged.
        parts: Outlines in the frame of the first handle.
        line: Line through the handles: "" for no line, "open", or "closed".
        radius: Radius in m of a circle around the first handle; None for no circle.
        radius_keys: Path to the radius if it can be changed; otherwise ().
        region: Name of the region that the object refers to; "" for none.
        center_object: Name of the moving object at the center of the circle; "" if the center is the first handle.
        moves_as_one: Whether dragging the object moves all handles.
        origin: Start (x, y) in m of the line, before the first handle; None if the line starts at the first handle.
        points_keys: Path to the list of the handles if handles can be added and removed; otherwise ().
        width: Width of the line in m.
    """

    keys: Keys
    kind: str
    label: str
    handles: tuple[Handle, ...] = ()
    parts: list[Corners] = field(default_factory=list)
    line: Literal["", "open", "closed"] = ""
    radius: float | None = None
    radius_keys: Keys = ()
    region: str = ""
    center_object: str = ""
    moves_as_one: bool = False
    origin: tuple[float, float] | None = None
    points_keys: Keys = ()
    width: float = 0.0


Places = Mapping[str, tuple[float, float, float]]
"""Poses (x, y, yaw) in m and rad of the places of a world, by name."""


def number(value: Any) -> float | None:
    """Return a finite number, or a quantity such as "2 cm" in SI units; None for other values."""
    result = si_number(value)
    if not isinstance(result, int | float) or isinstance(result, bool):
        return None
    try:
        return float(result) if math.isfinite(result) else None
    except OverflowError:  # an integer that is larger than any float
        return None


def items(value: Any) -> list[Any]:
    """Return `value` if it is a list, otherwise an empty list."""
    return value if isinstance(value, list) else []


def mapping(value: Any) -> dict[str, Any]:
    """Return `value` if it is a dict, otherwise an empty dict."""
    return value if isinstance(value, dict) else {}


def pose_handle(value: Any, keys: Keys, places: Places) -> tuple[Handle, ...]:
    """Return the handle for a pose or the name of a place, as a tuple; () for other values."""
    if isinstance(value, str):
        place = places.get(value)
        return (Handle(keys, "pose", *place, value),) if place else ()
    x, y, yaw = (number(mapping(value).get(key, default)) for key, default in (("x", None), ("y", None), ("yaw", 0.0)))
    return () if x is None or y is None else (Handle(keys, "pose", x, y, yaw or 0.0),)


def point_handles(value: Any, keys: Keys, places: Places) -> tuple[Handle, ...]:
    """Return the handles for a list of points [x, y] or names of places. Other items are ignored."""
    return tuple(
        handle for index, point in enumerate(items(value)) for handle in point_handle(point, (*keys, index), places)
    )


def point_handle(value: Any, keys: Keys, places: Places) -> tuple[Handle, ...]:
    """Return the handle for a point [x, y] or the name of a place, as a tuple; () for other values."""
    if isinstance(value, str):
        place = places.get(value)
        return (Handle(keys, "point", place[0], place[1], None, value),) if place else ()
    axes = [number(axis) for axis in items(value)]
    if len(axes) != 2 or axes[0] is None or axes[1] is None:
        return ()
    return (Handle(keys, "point", axes[0], axes[1]),)


def keyframe_handles(value: Any, keys: Keys) -> tuple[Handle, ...]:
    """Return the handles for a list of keyframes [t, x, y, yaw]. Other items are ignored."""
    handles = []
    for index, keyframe in enumerate(items(value)):
        numbers = [number(item) for item in items(keyframe)]
        if len(numbers) == 4 and numbers[1] is not None and numbers[2] is not None:
            handles.append(Handle((*keys, index), "keyframe", numbers[1], numbers[2], numbers[3] or 0.0))
    return tuple(handles)


def outline(data: Mapping[str, Any]) -> list[Corners]:
    """Return the outline of a `box`, `cylinder`, or `polygon` in the frame of the object; [] without these keys."""
    box = [number(side) for side in items(data.get("box"))]
    if len(box) == 3 and box[0] and box[1]:
        x, y = box[0] / 2, box[1] / 2
        return [[(-x, -y), (x, -y), (x, y), (-x, y)]]
    cylinder = [number(side) for side in items(data.get("cylinder"))]
    if cylinder and cylinder[0]:
        return [circle(cylinder[0])]
    corners = point_handles(data.get("polygon"), (), {})
    return [[(corner.x, corner.y) for corner in corners]] if len(corners) > 2 else []


def circle(radius: float) -> Corners:
    """Return a circle around the origin as a polygon. The radius is in m."""
    angles = [2 * math.pi * k / CIRCLE_CORNER_COUNT for k in range(CIRCLE_CORNER_COUNT)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


def motion_path(
    value: Any, keys: Keys, label: str, places: Places, origin: Handle | None = None
) -> Iterator[MapObject]:
    """Yield an object for the path of a motion through waypoints or keyframes; nothing for another value.

    `origin` is the start position of the moving object.
    """
    motion = mapping(value)
    start = None if origin is None else (origin.x, origin.y)
    if through := point_handles(motion.get("through"), (*keys, "through"), places):
        line: Literal["open", "closed"] = "closed" if motion.get("repeat") == "loop" and start is None else "open"
        yield MapObject(keys, "path", label, through, line=line, origin=start, points_keys=(*keys, "through"))
    elif keyframes := keyframe_handles(motion.get("keyframes"), (*keys, "keyframes")):
        times = [number(keyframe[0]) for keyframe in map(items, items(motion.get("keyframes"))) if keyframe]
        starts_at_keyframe = times[0] == 0
        yield MapObject(keys, "path", label, keyframes, line="open", origin=None if starts_at_keyframe else start)
