"""Generator of office floors for the localization benchmark. Walls, glass, and furniture are axis-aligned boxes."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Box, Solid, TriangleMesh
from simscen.core.random_streams import Streams
from simscen.worlds.geometry.triangulation import merge_solids

HEIGHT_M = 1.0
"""Height of all boxes. The lidar is at half this height, so the value does not affect scans."""


def box_array(rows: Iterable[Sequence[float]]) -> Array:
    """Return boxes as an array (n, 4). A row has the smallest x, smallest y, largest x, and largest y of a box in m."""
    return np.array(list(rows), dtype=np.float64).reshape(-1, 4)


def wall_boxes(
    start: tuple[float, float], end: tuple[float, float], thickness: float, openings: Sequence[tuple[float, float]] = ()
) -> Array:
    """Return the boxes (n, 4) of a wall along x or y with the center line from `start` to `end`. All lengths are in m.

    `start` is the end with the smaller coordinate. `openings` are gaps in the wall: sorted intervals (begin, end) of
    the distance from `start`.
    """
    along = 0 if start[1] == end[1] else 1
    edges = [start[along], *(start[along] + edge for opening in openings for edge in opening), end[along]]
    across = start[1 - along] - thickness / 2, start[1 - along] + thickness / 2
    pieces = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 0.01]
    if along == 0:
        return box_array((a, across[0], b, across[1]) for a, b in pieces)
    return box_array((across[0], a, across[1], b) for a, b in pieces)


def extruded_mesh(*parts: Array) -> TriangleMesh:
    """Return one mesh of all boxes, extruded from the floor to HEIGHT_M. Each of `parts` is an array (n, 4)."""
    rows = np.concatenate(parts).tolist()
    return merge_solids(
        Solid(Box((r - x, t - y, HEIGHT_M)), Pose3((x + r) / 2, (y + t) / 2, HEIGHT_M / 2)) for x, y, r, t in rows
    )


def box_distances(rows: Array, point: Sequence[float]) -> Array:
    """Return the distance (n,) in m from the point (x, y) to each box (n, 4); 0 inside a box."""
    x, y = point
    distances: Array = np.hypot(
        np.maximum(0, np.maximum(rows[:, 0] - x, x - rows[:, 2])),
        np.maximum(0, np.maximum(rows[:, 1] - y, y - rows[:, 3])),
    )
    return distances


FLOOR_LENGTH_RANGE_M, FLOOR_DEPTH_RANGE_M, CORRIDOR_WIDTH_RANGE_M = (41.0, 48.0), (17.0, 24.0), (1.8, 2.6)
ROOM_WIDTH_RANGE_M, DOOR_WIDTH_RANGE_M, WALL_THICKNESS_RANGE_M = (3.2, 8.5), (0.95, 1.3), (0.12, 0.2)
"""Ranges of the random dimensions of a building."""
GLASS_WALL_FRACTION = 0.15
"""Fraction of the rooms that have a glass wall to the corridor."""
CONNECTING_DOOR_FRACTION = 0.3
"""Fraction of the walls between neighboring rooms that have a door."""
DOOR_CLEARANCE_M = 0.8
"""Minimum distance of random furniture to the centers of doors."""
MOVED_FRACTION, REMOVED_FRACTION, ADDED_FRACTION = 0.25, 0.1, 0.15
"""Fractions of the furniture that `rearranged_furniture` moves, removes, and adds."""


@dataclass(frozen=True, eq=False)
class Building:
    """An office floor. All lengths are in m.

    size:      length along x and depth along y
    middle:    x of the border between the left and the right half. The corridor crosses the border. In a few
               buildings, a gap behind the back wall of a room also leads from one half to the other
    walls:     boxes (n, 4), as in box_array
    glass:     boxes (n, 4) of the glass walls
    furniture: boxes (n, 4)
    rooms:     centers (n, 2) of the rooms
    doors:     centers (n, 2) of the doors
    """

    size: tuple[float, float]
    middle: float
    walls: Array
    glass: Array
    furniture: Array
    rooms: Array
    doors: Array


def generate_building(number: int, right_half_version: int = 0) -> Building:
    """Return the building with this number. The result depends on the arguments only.

    `right_half_version` selects the rooms and the furniture of the right half: 0 for the original ones, and any other
    number for a right half that was rebuilt.
    """
    streams = Streams(number)
    rng = streams.generator("floor")
    length, depth = rng.uniform(*FLOOR_LENGTH_RANGE_M), rng.uniform(*FLOOR_DEPTH_RANGE_M)
    width = rng.uniform(*CORRIDOR_WIDTH_RANGE_M)
    low = rng.uniform(0.35, 0.6) * (depth - width)
    middle = rng.uniform(0.45, 0.55) * length
    thickness = rng.uniform(*WALL_THICKNESS_RANGE_M)
    halves = [
        _generate_half(streams.generator(name), ends, (0.0, low, low + width, depth), thickness)
        for name, ends in (
            ("left", (0.0, middle)),
            (f"right {right_half_version}" if right_half_version else "right", (middle, length)),
        )
    ]
    corners = ((0, 0), (length, 0), (length, depth), (0, depth))
    outer_walls = [wall_boxes(corners[a], corners[b], 0.3) for a, b in ((0, 1), (3, 2), (0, 3), (1, 2))]
    walls, glass, furniture, rooms, doors = (np.concatenate(part) for part in zip(*halves, strict=True))
    return Building((length, depth), middle, np.concatenate((*outer_walls, walls)), glass, furniture, rooms, doors)


def _generate_half(
    rng: np.random.Generator, ends: tuple[float, float], wall_ys: tuple[float, ...], thickness: float
) -> tuple[Array, Array, Array, Array, Array]:
    """Return walls, glass, furniture, rooms, and doors, as in Building, of one half of a floor.

    `ends` are the smallest and largest x of the half. `wall_ys` are the y of the lower outer wall, the two corridor
    walls, and the upper outer wall.
    """
    walls, glass, furniture, rooms, doors = ([np.empty((0, k))] for k in (4, 4, 4, 2, 2))
    for outer, inner in ((wall_ys[0], wall_ys[1]), (wall_ys[3], wall_ys[2])):
        for a, b in pairwise(_room_bounds(rng, *ends)):
            back = outer + np.sign(inner - outer) * (rng.uniform(0.5, 1.5) if rng.random() < 0.4 else 0.0)
            if back != outer:
                walls.append(wall_boxes((a, back), (b, back), thickness))
            opening = _random_door(rng, b - a)
            front = wall_boxes((a, inner), (b, inner), thickness, [opening])
            (glass if rng.random() < GLASS_WALL_FRACTION else walls).append(front)
            low, high = sorted((back, inner))
            door = np.array([[a + sum(opening) / 2, inner]])
            if b < ends[1] and rng.random() < CONNECTING_DOOR_FRACTION:
                gap = _random_door(rng, high - low)
                walls.append(wall_boxes((b, low), (b, high), thickness, [gap]))
                door = np.concatenate((door, [[b, low + sum(gap) / 2]]))
            else:
                walls.append(wall_boxes((b, low), (b, high), thickness))
            doors.append(door)
            rooms.append(np.array([[(a + b) / 2, (low + high) / 2]]))
            furniture.append(box_array(_room_furniture(rng, (a, low, b, high), np.concatenate(doors))))
    furniture.append(box_array(_corridor_furniture(rng, ends, wall_ys[1:3], np.concatenate(doors))))
    return tuple(np.concatenate(part) for part in (walls, glass, furniture, rooms, doors))  # type: ignore[return-value]


def _room_bounds(rng: np.random.Generator, begin: float, end: float) -> list[float]:
    """Return the x of the walls between rooms of random width from x = `begin` to `end`, including both ends."""
    bounds = [begin]
    while end - bounds[-1] > ROOM_WIDTH_RANGE_M[1]:
        bounds.append(min(bounds[-1] + rng.uniform(*ROOM_WIDTH_RANGE_M), end - ROOM_WIDTH_RANGE_M[0]))
    return [*bounds, end]


def _random_door(rng: np.random.Generator, length: float) -> tuple[float, float]:
    """Return begin and end of a random door in a wall of this length, in m from the start of the wall."""
    width = rng.uniform(*DOOR_WIDTH_RANGE_M)
    begin = rng.uniform(0.3, length - width - 0.3)
    return begin, begin + width


def _room_furniture(
    rng: np.random.Generator, room: tuple[float, float, float, float], doors: Array
) -> Iterator[tuple[float, float, float, float]]:
    """Yield random boxes of furniture, most along the walls. `room` is a box (left, bottom, right, top)."""
    left, low, right, high = room
    for _ in range(int((right - left) * (high - low) / rng.uniform(4, 9))):
        a, b = rng.uniform((0.5, 0.3), (1.8, 0.8))
        if rng.random() < 0.5:
            a, b = b, a
        x, y = rng.uniform((left, low), (right - a, high - b))
        if rng.random() < 0.7:
            x, y = ((left, y), (right - a, y), (x, low), (x, high - b))[rng.integers(4)]
        if _is_clear_of_doors(doors, (x, y, x + a, y + b)):
            yield x, y, x + a, y + b


def _corridor_furniture(
    rng: np.random.Generator, ends: tuple[float, float], wall_ys: tuple[float, ...], doors: Array
) -> Iterator[tuple[float, float, float, float]]:
    """Yield random boxes of furniture along both walls of the corridor."""
    for _ in range(int(rng.integers(2, 6))):
        a, b = rng.uniform((0.5, 0.25), (1.6, 0.45))
        x = rng.uniform(ends[0], ends[1] - a)
        y = wall_ys[0] if rng.random() < 0.5 else wall_ys[1] - b
        if _is_clear_of_doors(doors, (x, y, x + a, y + b)):
            yield x, y, x + a, y + b


def _is_clear_of_doors(doors: Array, box: tuple[float, float, float, float]) -> bool:
    """Return whether a box is more than DOOR_CLEARANCE_M away from the centers `doors` (n, 2)."""
    return all(box_distances(box_array([box]), door)[0] > DOOR_CLEARANCE_M for door in doors.tolist())


def rearranged_furniture(floor: Building, rng: np.random.Generator) -> Array:
    """Return the furniture (n, 4) of a floor after random pieces are moved, removed, and added."""
    draws = rng.random(len(floor.furniture))
    furniture = floor.furniture[draws > REMOVED_FRACTION].copy()
    moved = draws[draws > REMOVED_FRACTION] < REMOVED_FRACTION + MOVED_FRACTION
    shift = rng.normal(0, 0.6, (int(moved.sum()), 2))
    furniture[moved] += np.hstack((shift, shift))
    added = []
    for _ in range(int(ADDED_FRACTION * len(floor.furniture))):
        x, y = floor.rooms[rng.integers(len(floor.rooms))] + rng.normal(0, 1.2, 2)
        a, b = rng.uniform(0.3, 0.9, 2)
        if _is_clear_of_doors(floor.doors, (x, y, x + a, y + b)):
            added.append((x, y, x + a, y + b))
    return np.concatenate((furniture, box_array(added)))
