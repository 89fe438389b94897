"""Walls with openings and other boxes, seen from above."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Box, Solid, TriangleMesh
from simscen.core.random_streams import Streams
from simscen.worlds.geometry.triangulation import fuse

HEIGHT = 1.0
"""Of everything, in m: the lidar looks along the floor."""


def boxes(rows: Iterable[Sequence[float]]) -> Array:
    """An array (n, 4) of left, bottom, right, top in m."""
    return np.array(list(rows), dtype=np.float64).reshape(-1, 4)


def wall(
    start: tuple[float, float], end: tuple[float, float], thickness: float, openings: Sequence[tuple[float, float]] = ()
) -> Array:
    """Boxes (n, 4) of a wall along x or y; `openings` are (from, to) in m along it, in order."""
    along = 0 if start[1] == end[1] else 1
    edges = [start[along], *(start[along] + edge for opening in openings for edge in opening), end[along]]
    across = start[1 - along] - thickness / 2, start[1 - along] + thickness / 2
    pieces = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 0.01]
    if along == 0:
        return boxes((a, across[0], b, across[1]) for a, b in pieces)
    return boxes((across[0], a, across[1], b) for a, b in pieces)


def mesh_of(*parts: Array) -> TriangleMesh:
    """What stands on all these boxes (n, 4)."""
    rows = np.concatenate(parts).tolist()
    return fuse(Solid(Box((r - x, t - y, HEIGHT)), Pose3((x + r) / 2, (y + t) / 2, HEIGHT / 2)) for x, y, r, t in rows)


def distance_to(rows: Array, point: Sequence[float]) -> Array:
    """How far a point is from each of the boxes (n, 4): (n,) in m, 0 inside."""
    x, y = point
    away: Array = np.hypot(
        np.maximum(0, np.maximum(rows[:, 0] - x, x - rows[:, 2])),
        np.maximum(0, np.maximum(rows[:, 1] - y, y - rows[:, 3])),
    )
    return away


LENGTH, DEPTH, CORRIDOR = (41.0, 48.0), (17.0, 24.0), (1.8, 2.6)
"""Of a floor and of its corridor in m: least and most."""
ROOM, DOOR, THICKNESS = (3.2, 8.5), (0.95, 1.3), (0.12, 0.2)
GLAZED = 0.15
"""Share of the rooms whose wall to the corridor is of glass."""
CONNECTED = 0.3
"""Share of neighboring rooms with a door between them."""
SWINGS = 0.8
"""m around a door in which nothing stands."""
MOVED, TAKEN, BROUGHT = 0.25, 0.1, 0.15
"""Shares of the furniture that was moved, taken away and brought since the map was made."""


@dataclass(frozen=True, eq=False)
class Building:
    """A floor: `size` in m, boxes (n, 4) of `walls`, `glass` and `furniture`, the middles (r, 2) of its `rooms`.

    `middle` is the x of the wall between its two halves, which only the corridor crosses.
    """

    size: tuple[float, float]
    middle: float
    walls: Array
    glass: Array
    furniture: Array
    rooms: Array
    doors: Array


def building(number: int, rebuilt: int = 0) -> Building:
    """The floor of a number: always the same. `rebuilt` ones have other rooms and furniture right of the middle."""
    streams = Streams(number)
    rng = streams.generator("floor")
    length, depth = rng.uniform(*LENGTH), rng.uniform(*DEPTH)
    width = rng.uniform(*CORRIDOR)
    low = rng.uniform(0.35, 0.6) * (depth - width)
    middle = rng.uniform(0.45, 0.55) * length
    thickness = rng.uniform(*THICKNESS)
    halves = [
        _half(streams.generator(name), ends, (0.0, low, low + width, depth), thickness)
        for name, ends in (("left", (0.0, middle)), (f"right {rebuilt}" if rebuilt else "right", (middle, length)))
    ]
    hull = [
        wall((0, 0), (length, 0), 0.3), wall((0, depth), (length, depth), 0.3), wall((0, 0), (0, depth), 0.3),
        wall((length, 0), (length, depth), 0.3),
    ]  # fmt: skip
    walls, glass, furniture, rooms, doors = (np.concatenate(part) for part in zip(*halves, strict=True))
    return Building((length, depth), middle, np.concatenate((*hull, walls)), glass, furniture, rooms, doors)


def _half(
    rng: np.random.Generator, ends: tuple[float, float], levels: tuple[float, ...], thickness: float
) -> tuple[Array, Array, Array, Array, Array]:
    """Walls, glass, furniture, rooms and doors of one half; `levels` are the y of outer and corridor walls."""
    walls, glass, furniture, rooms, doors = ([np.empty((0, k))] for k in (4, 4, 4, 2, 2))
    for outer, inner in ((levels[0], levels[1]), (levels[3], levels[2])):
        cuts = _cuts(rng, *ends)
        for a, b in pairwise(cuts):
            back = outer + np.sign(inner - outer) * (rng.uniform(0.5, 1.5) if rng.random() < 0.4 else 0.0)
            if back != outer:
                walls.append(wall((a, back), (b, back), thickness))
            opening = _opening(rng, b - a)
            front = wall((a, inner), (b, inner), thickness, [opening])
            (glass if rng.random() < GLAZED else walls).append(front)
            low, high = sorted((back, inner))
            door = np.array([[a + sum(opening) / 2, inner]])
            if b < ends[1] and rng.random() < CONNECTED:
                gap = _opening(rng, high - low)
                walls.append(wall((b, low), (b, high), thickness, [gap]))
                door = np.concatenate((door, [[b, low + sum(gap) / 2]]))
            else:
                walls.append(wall((b, low), (b, high), thickness))
            doors.append(door)
            rooms.append(np.array([[(a + b) / 2, (low + high) / 2]]))
            furniture.append(boxes(_furniture(rng, (a, low, b, high), np.concatenate(doors))))
    furniture.append(boxes(_along_corridor(rng, ends, levels[1:3], np.concatenate(doors))))
    return tuple(np.concatenate(part) for part in (walls, glass, furniture, rooms, doors))  # type: ignore[return-value]


def _cuts(rng: np.random.Generator, begin: float, end: float) -> list[float]:
    """Where walls between rooms stand, the ends of the row included."""
    cuts = [begin]
    while end - cuts[-1] > ROOM[1]:
        cuts.append(min(cuts[-1] + rng.uniform(*ROOM), end - ROOM[0]))
    return [*cuts, end]


def _opening(rng: np.random.Generator, length: float) -> tuple[float, float]:
    """A door in a wall of this length."""
    width = rng.uniform(*DOOR)
    begin = rng.uniform(0.3, length - width - 0.3)
    return begin, begin + width


def _furniture(
    rng: np.random.Generator, room: tuple[float, float, float, float], doors: Array
) -> Iterator[tuple[float, float, float, float]]:
    """Desks and shelves along the walls of a room, some things in the middle."""
    left, low, right, high = room
    for _ in range(int((right - left) * (high - low) / rng.uniform(4, 9))):
        a, b = rng.uniform((0.5, 0.3), (1.8, 0.8))
        if rng.random() < 0.5:
            a, b = b, a
        x, y = rng.uniform((left, low), (right - a, high - b))
        if rng.random() < 0.7:
            x, y = ((left, y), (right - a, y), (x, low), (x, high - b))[rng.integers(4)]
        if _clear_of(doors, (x, y, x + a, y + b)):
            yield x, y, x + a, y + b


def _along_corridor(
    rng: np.random.Generator, ends: tuple[float, float], levels: tuple[float, ...], doors: Array
) -> Iterator[tuple[float, float, float, float]]:
    """Cupboards and copiers against the walls of the corridor."""
    for _ in range(int(rng.integers(2, 6))):
        a, b = rng.uniform((0.5, 0.25), (1.6, 0.45))
        x = rng.uniform(ends[0], ends[1] - a)
        y = levels[0] if rng.random() < 0.5 else levels[1] - b
        if _clear_of(doors, (x, y, x + a, y + b)):
            yield x, y, x + a, y + b


def _clear_of(doors: Array, box: tuple[float, float, float, float]) -> bool:
    return all(distance_to(boxes([box]), door)[0] > SWINGS for door in doors.tolist())


def lived_in(floor: Building, rng: np.random.Generator) -> Array:
    """The furniture (n, 4) as it stands now: some of it moved, some taken away, some brought."""
    stays = rng.random(len(floor.furniture))
    now = floor.furniture[stays > TAKEN].copy()
    moved = stays[stays > TAKEN] < TAKEN + MOVED
    shift = rng.normal(0, 0.6, (int(moved.sum()), 2))
    now[moved] += np.hstack((shift, shift))
    brought = []
    for _ in range(int(BROUGHT * len(floor.furniture))):
        x, y = floor.rooms[rng.integers(len(floor.rooms))] + rng.normal(0, 1.2, 2)
        a, b = rng.uniform(0.3, 0.9, 2)
        if _clear_of(floor.doors, (x, y, x + a, y + b)):
            brought.append((x, y, x + a, y + b))
    return np.concatenate((now, boxes(brought)))
