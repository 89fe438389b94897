"""Functions that read the objects on the map from the data of a world: regions, walls, obstacles, and places.

The data are dicts, lists, and scalars. They need not be valid. `keys` are the path to a value in the file.
"""

from collections.abc import Iterator
from typing import Any

from simscen.editor.map_view.map_objects import (
    Keys,
    MapObject,
    Places,
    items,
    mapping,
    motion_path,
    number,
    outline,
    point_handle,
    point_handles,
    pose_handle,
)


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
    for name, ring in mapping(data.get("regions")).items():
        own = (*keys, "regions", name)
        corners = point_handles(ring, own, {})
        yield MapObject(own, "region", name, corners, line="closed", moves_as_one=True, points_keys=own)
    yield from _walls_ramps_doors(data, keys, places)
    for key, kind in (("obstacles", "obstacle"), ("objects", "object")):
        for index, thing in enumerate(items(data.get(key))):
            yield from _object(mapping(thing), (*keys, key, index), kind, places)
    for name, pose in mapping(data.get("places")).items():
        own = (*keys, "places", name)
        yield MapObject(own, "place", name, pose_handle(pose, own, {}))


def _walls_ramps_doors(data: dict[str, Any], keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield the walls, ramps, and doors, which are lines with a width."""
    for index, wall in enumerate(map(mapping, items(data.get("walls")))):
        own = (*keys, "walls", index)
        points = (*own, "points")
        corners = point_handles(wall.get("points"), points, places)
        label, width = str(wall.get("name", f"wall_{index + 1}")), number(wall.get("thickness")) or 0.1
        yield MapObject(own, "wall", label, corners, line="open", moves_as_one=True, points_keys=points, width=width)
    for index, ramp in enumerate(map(mapping, items(data.get("ramps")))):
        own = (*keys, "ramps", index)
        ends = tuple(handle for end in ("start", "end") for handle in point_handle(ramp.get(end), (*own, end), places))
        width = number(ramp.get("width")) or 0.5
        yield MapObject(own, "ramp", str(ramp.get("name", "ramp")), ends, line="open", moves_as_one=True, width=width)
    for index, door in enumerate(map(mapping, items(data.get("doors")))):
        own = (*keys, "doors", index)
        posts = point_handles(door.get("points"), (*own, "points"), places)
        width = number(door.get("thickness")) or 0.05
        yield MapObject(own, "door", str(door.get("name", "door")), posts, line="open", moves_as_one=True, width=width)


def _object(thing: dict[str, Any], keys: Keys, kind: str, places: Places) -> Iterator[MapObject]:
    """Yield an obstacle or movable object, and its path if it moves."""
    handle = pose_handle(thing.get("pose"), (*keys, "pose"), places)
    label = str(thing.get("name", kind))
    yield MapObject(keys, kind, label, handle, outline(thing))
    start = handle[0] if handle else None
    yield from motion_path(thing.get("move"), (*keys, "move"), f"path of {label}", places, start)
