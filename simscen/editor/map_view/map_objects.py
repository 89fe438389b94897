"""Objects on the map of the editor, and functions that read them from the data of a world.

The data are dicts, lists, and scalars. They need not be valid; values that cannot be read are ignored. `keys` are the
path to a value in the file.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from simscen.core.errors import Problem
from simscen.loading.yaml.source_nodes import SourceNode, source_at
from simscen.loading.yaml.tree import Key
from simscen.spec.quantities import si_number

Keys = tuple[Key, ...]
"""Path to a value in a YAML file: keys of mappings and indices of lists."""
Notation = Literal["pose", "point", "keyframe"]
"""Notation of a position in the file: mapping with x, y, and yaw; list [x, y]; or list [t, x, y, yaw]."""
Corners = list[tuple[float, float]]
"""Corners (x, y) of a polygon in m."""
CIRCLE_CORNERS = 24
PERSON_RADIUS_M = 0.25
"""Radius of a pedestrian without the key `radius`."""
MAX_OBJECTS = 3000
"""Maximum number of objects on a map."""


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
    """Object on the map and in the list of objects. Without handles and region, it is only in the list.

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
        follows: Name of the moving object at the center of the circle; "" if the center is the first handle.
        moves_as_one: Whether dragging the object moves all its handles.
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
    follows: str = ""
    moves_as_one: bool = False
    origin: tuple[float, float] | None = None
    points_keys: Keys = ()
    width: float = 0.0


Places = Mapping[str, tuple[float, float, float]]
"""Poses (x, y, yaw) in m and rad of the places of a world, by name."""


def number(value: Any) -> float | None:
    """Return a finite number, or a quantity such as "2 cm" in SI units; None for other values."""
    found = si_number(value)
    usable = isinstance(found, int | float) and not isinstance(found, bool) and math.isfinite(found)
    return float(found) if usable else None


def items(value: Any) -> list[Any]:
    """Return `value` if it is a list, otherwise an empty list."""
    return value if isinstance(value, list) else []


def mapping(value: Any) -> dict[str, Any]:
    """Return `value` if it is a dict, otherwise an empty dict."""
    return value if isinstance(value, dict) else {}


def pose_handle(value: Any, keys: Keys, places: Places) -> tuple[Handle, ...]:
    """Return the handle for a pose or the name of a place, as a tuple; () for other values."""
    if isinstance(value, str):
        found = places.get(value)
        return (Handle(keys, "pose", *found, value),) if found else ()
    x, y, yaw = (number(mapping(value).get(key, default)) for key, default in (("x", None), ("y", None), ("yaw", 0.0)))
    return () if x is None or y is None else (Handle(keys, "pose", x, y, yaw or 0.0),)


def point_handles(value: Any, keys: Keys, places: Places) -> tuple[Handle, ...]:
    """Return the handles for a list of points [x, y] or names of places. Other items are ignored."""
    return tuple(
        handle for index, one in enumerate(items(value)) for handle in point_handle(one, (*keys, index), places)
    )


def point_handle(value: Any, keys: Keys, places: Places) -> tuple[Handle, ...]:
    """Return the handle for a point [x, y] or the name of a place, as a tuple; () for other values."""
    if isinstance(value, str):
        found = places.get(value)
        return (Handle(keys, "point", found[0], found[1], None, value),) if found else ()
    axes = [number(axis) for axis in items(value)]
    if len(axes) != 2 or axes[0] is None or axes[1] is None:
        return ()
    return (Handle(keys, "point", axes[0], axes[1]),)


def keyframe_handles(value: Any, keys: Keys) -> tuple[Handle, ...]:
    """Return the handles for a list of keyframes [t, x, y, yaw]. Other items are ignored."""
    found = []
    for index, one in enumerate(items(value)):
        axes = [number(axis) for axis in items(one)]
        if len(axes) == 4 and axes[1] is not None and axes[2] is not None:
            found.append(Handle((*keys, index), "keyframe", axes[1], axes[2], axes[3] or 0.0))
    return tuple(found)


def outline(thing: Mapping[str, Any]) -> list[Corners]:
    """Return the outline of a `box`, `cylinder`, or `polygon` in the frame of the object; [] without these keys."""
    box = [number(side) for side in items(thing.get("box"))]
    if len(box) == 3 and box[0] and box[1]:
        x, y = box[0] / 2, box[1] / 2
        return [[(-x, -y), (x, -y), (x, y), (-x, y)]]
    cylinder = [number(side) for side in items(thing.get("cylinder"))]
    if cylinder and cylinder[0]:
        return [circle(cylinder[0])]
    corners = point_handles(thing.get("polygon"), (), {})
    return [[(corner.x, corner.y) for corner in corners]] if len(corners) > 2 else []


def circle(radius: float) -> Corners:
    """Return a circle around the origin as a polygon. The radius is in m."""
    turns = [2 * math.pi * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS)]
    return [(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns]


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
        begins_there = number(items(items(motion.get("keyframes"))[0])[0]) == 0
        yield MapObject(keys, "path", label, keyframes, line="open", origin=None if begins_there else start)


def object_at_problem(problem: Problem, objects: Sequence[MapObject], source: SourceNode | None, text: str) -> str:
    """Return the ID of the object to which a problem in the text belongs; "" if there is none.

    If several objects contain the problem, the one with the shortest YAML is chosen. A problem at a key belongs to the
    value in the same line. `source` is the syntax tree of `text`.
    """
    if not problem.line or source is None:
        return ""
    lines = text.split("\n")
    line_start = sum(len(line) + 1 for line in lines[: problem.line - 1])
    index, line_end = line_start + max(problem.col - 1, 0), line_start + len(lines[problem.line - 1])
    nodes = [(node, one) for one in objects if one.keys and (node := source_at(source, one.keys)) is not None]
    around = [(node.end - node.start, one) for node, one in nodes if node.start <= index <= node.end]
    behind = [(node.end - node.start, one) for node, one in nodes if index < node.start <= line_end]
    found = around or behind
    return "/".join(map(str, min(found, key=lambda each: each[0])[1].keys)) if found else ""


def world_places(world: Any) -> dict[str, tuple[float, float, float]]:
    """Return the places in the data of a world, by name."""
    found = {}
    for name, pose in mapping(mapping(world).get("places")).items():
        for handle in pose_handle(pose, (), {}):
            found[name] = (handle.x, handle.y, handle.yaw or 0.0)
    return found


def world_objects(world: Any, keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield the objects of a world. `world` is its data, at `keys` of the file."""
    data = mapping(world)
    yield from _regions(data, keys)
    yield from _walls_ramps_doors(data, keys, places)
    for key, kind in (("obstacles", "obstacle"), ("objects", "object")):
        for index, thing in enumerate(items(data.get(key))):
            yield from _object(mapping(thing), (*keys, key, index), kind, places)
    for name, pose in mapping(data.get("places")).items():
        own = (*keys, "places", name)
        yield MapObject(own, "place", name, pose_handle(pose, own, {}))


def _regions(data: dict[str, Any], keys: Keys) -> Iterator[MapObject]:
    """Yield the regions, as closed lines."""
    for name, ring in mapping(data.get("regions")).items():
        own = (*keys, "regions", name)
        corners = point_handles(ring, own, {})
        yield MapObject(own, "region", name, corners, line="closed", moves_as_one=True, points_keys=own)


def _walls_ramps_doors(data: dict[str, Any], keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield the walls, ramps, and doors, which are lines with a width."""
    for index, wall in enumerate(map(mapping, items(data.get("walls")))):
        own = (*keys, "walls", index)
        corners = point_handles(wall.get("points"), (*own, "points"), places)
        label, width = str(wall.get("name", f"wall_{index + 1}")), number(wall.get("thickness", 0.1)) or 0.1
        points = (*own, "points")
        yield MapObject(own, "wall", label, corners, line="open", moves_as_one=True, points_keys=points, width=width)
    for index, ramp in enumerate(map(mapping, items(data.get("ramps")))):
        own = (*keys, "ramps", index)
        ends = tuple(handle for end in ("start", "end") for handle in point_handle(ramp.get(end), (*own, end), places))
        width = number(ramp.get("width")) or 0.5
        yield MapObject(own, "ramp", str(ramp.get("name", "ramp")), ends, line="open", moves_as_one=True, width=width)
    for index, door in enumerate(map(mapping, items(data.get("doors")))):
        own = (*keys, "doors", index)
        posts, width = (
            point_handles(door.get("points"), (*own, "points"), places),
            number(door.get("thickness")) or 0.05,
        )
        yield MapObject(own, "door", str(door.get("name", "door")), posts, line="open", moves_as_one=True, width=width)


def _object(thing: dict[str, Any], keys: Keys, kind: str, places: Places) -> Iterator[MapObject]:
    """Yield an obstacle or movable object, and its path if it moves."""
    handle = pose_handle(thing.get("pose"), (*keys, "pose"), places)
    label = str(thing.get("name", kind))
    yield MapObject(keys, kind, label, handle, outline(thing))
    yield from motion_path(
        thing.get("move"), (*keys, "move"), f"path of {label}", places, handle[0] if handle else None
    )
