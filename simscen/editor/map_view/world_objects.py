"""Functions that read the objects on the map from the data of a world: regions, walls, obstacles, and places.

The data are dicts, lists, and scalars, and can be invalid. `keys` are the path to a value in the file.
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
    """Return the poses (x, y, yaw) in m and rad of the places in the data of a world, by name."""
    places = {}
    for name, pose in mapping(mapping(world).get("places")).items():
        for handle in pose_handle(pose, (), {}):
            places[name] = (handle.x, handle.y, handle.yaw or 0.0)
    return places


def world_objects(world: Any, keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield the objects of a world. `world` is the data of the world, at `keys` in the file."""
    data = mapping(world)
    for name, polygon in mapping(data.get("regions")).items():
        region_keys = (*keys, "regions", name)
        corners = point_handles(polygon, region_keys, {})
        yield MapObject(region_keys, "region", name, corners, line="closed", moves_as_one=True, points_keys=region_keys)
    yield from _walls_ramps_doors(data, keys, places)
    for key, kind in (("obstacles", "obstacle"), ("objects", "object")):
        for index, entry in enumerate(items(data.get(key))):
            yield from _object(mapping(entry), (*keys, key, index), kind, places)
    for name, pose in mapping(data.get("places")).items():
        place_keys = (*keys, "places", name)
        yield MapObject(place_keys, "place", name, pose_handle(pose, place_keys, {}))


def _walls_ramps_doors(data: dict[str, Any], keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield the walls, ramps, and doors, which are lines with a width."""
    for index, wall in enumerate(map(mapping, items(data.get("walls")))):
        wall_keys = (*keys, "walls", index)
        points_keys = (*wall_keys, "points")
        corners = point_handles(wall.get("points"), points_keys, places)
        label, width = str(wall.get("name", f"wall_{index + 1}")), number(wall.get("thickness")) or 0.1
        yield MapObject(
            wall_keys, "wall", label, corners, line="open", moves_as_one=True, points_keys=points_keys, width=width
        )
    for index, ramp in enumerate(map(mapping, items(data.get("ramps")))):
        ramp_keys = (*keys, "ramps", index)
        ends = tuple(
            handle for end in ("start", "end") for handle in point_handle(ramp.get(end), (*ramp_keys, end), places)
        )
        label, width = str(ramp.get("name", "ramp")), number(ramp.get("width")) or 0.5
        yield MapObject(ramp_keys, "ramp", label, ends, line="open", moves_as_one=True, width=width)
    for index, door in enumerate(map(mapping, items(data.get("doors")))):
        door_keys = (*keys, "doors", index)
        posts = point_handles(door.get("points"), (*door_keys, "points"), places)
        label, width = str(door.get("name", "door")), number(door.get("thickness")) or 0.05
        yield MapObject(door_keys, "door", label, posts, line="open", moves_as_one=True, width=width)


def _object(data: dict[str, Any], keys: Keys, kind: str, places: Places) -> Iterator[MapObject]:
    """Yield an obstacle or movable object, and the path of a moving object."""
    handle = pose_handle(data.get("pose"), (*keys, "pose"), places)
    label = str(data.get("name", kind))
    yield MapObject(keys, kind, label, handle, outline(data))
    start = handle[0] if handle else None
    yield from motion_path(data.get("move"), (*keys, "move"), f"path of {label}", places, start)
