"""The things of a world on the map: walls, obstacles, objects, ramps, doors, places, and regions."""

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
    """Return the places of a world by name."""
    found = {}
    for name, pose in mapping(mapping(world).get("places")).items():
        for handle in pose_handle(pose, (), {}):
            found[name] = (handle.x, handle.y, handle.yaw or 0.0)
    return found


def world_objects(world: Any, keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield the things of a world whose data is at `keys`."""
    data = mapping(world)
    yield from _regions(data, keys)
    yield from _lines(data, keys, places)
    for key, kind in (("obstacles", "obstacle"), ("objects", "object")):
        for index, thing in enumerate(items(data.get(key))):
            yield from _object(mapping(thing), (*keys, key, index), kind, places)
    for name, pose in mapping(data.get("places")).items():
        own = (*keys, "places", name)
        yield MapObject(own, "place", name, pose_handle(pose, own, {}))


def _regions(data: dict[str, Any], keys: Keys) -> Iterator[MapObject]:
    for name, ring in mapping(data.get("regions")).items():
        own = (*keys, "regions", name)
        corners = point_handles(ring, own, {})
        yield MapObject(own, "region", name, corners, line="closed", whole=True, points_keys=own)


def _lines(data: dict[str, Any], keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield walls, ramps, and doors."""
    for index, wall in enumerate(map(mapping, items(data.get("walls")))):
        own = (*keys, "walls", index)
        corners = point_handles(wall.get("points"), (*own, "points"), places)
        label, width = str(wall.get("name", f"wall_{index + 1}")), number(wall.get("thickness", 0.1)) or 0.1
        points = (*own, "points")
        yield MapObject(own, "wall", label, corners, line="open", whole=True, points_keys=points, width=width)
    for index, ramp in enumerate(map(mapping, items(data.get("ramps")))):
        own = (*keys, "ramps", index)
        ends = tuple(handle for end in ("start", "end") for handle in point_handle(ramp.get(end), (*own, end), places))
        width = number(ramp.get("width")) or 0.5
        yield MapObject(own, "ramp", str(ramp.get("name", "ramp")), ends, line="open", whole=True, width=width)
    for index, door in enumerate(map(mapping, items(data.get("doors")))):
        own = (*keys, "doors", index)
        posts, width = (
            point_handles(door.get("points"), (*own, "points"), places),
            number(door.get("thickness")) or 0.05,
        )
        yield MapObject(own, "door", str(door.get("name", "door")), posts, line="open", whole=True, width=width)


def _object(thing: dict[str, Any], keys: Keys, kind: str, places: Places) -> Iterator[MapObject]:
    handle = pose_handle(thing.get("pose"), (*keys, "pose"), places)
    label = str(thing.get("name", kind))
    yield MapObject(keys, kind, label, handle, outline(thing))
    yield from motion_path(
        thing.get("move"), (*keys, "move"), f"path of {label}", places, handle[0] if handle else None
    )
