"""What people may see beside walls and each other, where it is at one moment."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.pedestrians.forces import Numbers


@dataclass(frozen=True, eq=False)
class ObservedRobot:
    """A robot: its base's pose, velocity (m/s) in the world, radius (m), and outline (n, 2) in its own frame."""

    name: str
    pose: Pose2
    velocity: tuple[float, float]
    radius: float
    outline: Array


@dataclass(frozen=True, eq=False)
class ObservedObject:
    """An object that is no person: its outlines (n, 2) in the world."""

    name: str
    outlines: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """All robots and things, in the order of their names."""

    robots: tuple[ObservedRobot, ...] = ()
    things: tuple[ObservedObject, ...] = ()


def edges(outlines: Sequence[Array]) -> Array:
    """Return the edges of rings as segments (n, 2, 2)."""
    rings = [np.stack((ring, np.roll(ring, -1, axis=0)), axis=1) for ring in outlines]
    return np.concatenate(rings) if rings else np.empty((0, 2, 2))


# Walls: the nearest ones that block pedestrians, and what they hide from view.
CELL = 1.0
"""m; what is near is remembered for each square of this size."""
REACH = 1.2
"""m within which a wall counts: 1 m of air leaves 0.00014 m/s² of its force."""
SIGHT_CELL = 0.1
"""m; what hides is remembered in squares of this size, or larger ones in a world of more than MOST_CELLS."""
MOST_CELLS = 4_000_000
Near = tuple[Numbers, Numbers, Array]
ARMS_LENGTH = 0.3
"""m from one's own middle and from that of what one looks at, within which nothing hides it."""


class WallMap:
    """Segments (n, 2, 2) in meters, each of the solid `owners` (n,); those that are `opaque` (n,) hide what is behind.

    Raises ValueError for segments that are not finite.
    """

    def __init__(self, segments: Array, owners: Numbers, opaque: npt.NDArray[np.bool_]) -> None:
        if not np.isfinite(segments).all():
            raise ValueError("a wall is not finite")
        self._segments, self._owners = segments, owners
        self._low, self._high = segments.min(axis=1), segments.max(axis=1)
        self._known: dict[tuple[int, int], Numbers] = {}
        self._sight = _Sight(segments[opaque])

    def near(self, points: Array) -> Near:
        """Each meeting of a point (n, 2) with a segment within REACH: point, owner, and the nearest place (k, 2)."""
        cells = np.floor(points / CELL).astype(np.int64).tolist()
        found = [self._around(column, row) for column, row in cells]
        who = np.repeat(np.arange(len(points)), [len(some) for some in found])
        which = np.concatenate(found) if found else np.empty(0, dtype=np.int64)
        return who, self._owners[which], nearest_on(self._segments[which], points[who])

    def _around(self, column: int, row: int) -> Numbers:
        """Return the segments that may be within REACH of any point of a grid square."""
        if (column, row) not in self._known:
            low = np.array([column, row]) * CELL
            outside = np.maximum(np.maximum(self._low - low - CELL, low - self._high), 0.0)
            self._known[column, row] = np.flatnonzero(np.hypot(outside[:, 0], outside[:, 1]) <= REACH)
        return self._known[column, row]

    def gap(self, point: tuple[float, float]) -> float:
        """Meters from a point to the nearest wall; inf beyond REACH."""
        here = np.array([point])
        _, _, nearest = self.near(here)
        return float(np.hypot(*(nearest - here).T).min(initial=math.inf))

    def visible(self, eyes: Array, things: Array) -> npt.NDArray[np.bool_]:
        """Whether no wall hides things (n, 2) from eyes (n, 2)."""
        return self._sight.clear(eyes, things)


class _Sight:
    """What hides, as squares that are opaque."""

    def __init__(self, segments: Array) -> None:
        self._low = segments.reshape(-1, 2).min(axis=0, initial=0.0) - SIGHT_CELL
        size = segments.reshape(-1, 2).max(axis=0, initial=0.0) + SIGHT_CELL - self._low
        self._cell = max(SIGHT_CELL, math.sqrt(float(size[0] * size[1]) / MOST_CELLS))
        self._opaque = np.zeros(np.ceil(size / self._cell).astype(np.int64) + 1, dtype=np.bool_)
        steps = 1 + np.ceil(np.hypot(*(segments[:, 1] - segments[:, 0]).T) / (self._cell / 4)).astype(np.int64)
        which = np.repeat(np.arange(len(segments)), steps)
        first = np.repeat(np.cumsum(steps) - steps, steps)
        part = (np.arange(len(which)) - first) / np.maximum(np.repeat(steps, steps) - 1, 1)
        points = segments[which, 0] + part[:, np.newaxis] * (segments[which, 1] - segments[which, 0])
        cells = np.floor((points - self._low) / self._cell).astype(np.int64)
        self._opaque[cells[:, 0], cells[:, 1]] = True

    def clear(self, eyes: Array, things: Array) -> npt.NDArray[np.bool_]:
        """Return which lines of sight are clear, sampled once per grid square, as walls are thicker or closed."""
        away = things - eyes
        distance = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-9)
        looks = np.maximum(np.ceil((distance - 2 * ARMS_LENGTH) / self._cell), 0).astype(np.int64)
        line = np.repeat(np.arange(len(eyes)), looks)
        number = np.arange(len(line)) - np.repeat(np.cumsum(looks) - looks, looks)
        part = (ARMS_LENGTH + number * self._cell) / distance[line]
        cells = ((eyes[line] - self._low + away[line] * part[:, np.newaxis]) / self._cell).astype(np.int64)
        inside = ((cells >= 0) & (cells < self._opaque.shape)).all(axis=1)
        hit = line[inside][self._opaque[cells[inside, 0], cells[inside, 1]]]
        seen = np.ones(len(eyes), dtype=np.bool_)
        seen[hit] = False
        return seen


def nearest_on(segments: Array, points: Array) -> Array:
    """Return the point (n, 2) on each segment (n, 2, 2) that is nearest to each point (n, 2)."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    squared = np.maximum(np.sum(along * along, axis=1), 1e-18)
    part = np.clip(np.sum((points - start) * along, axis=1) / squared, 0.0, 1.0)
    place: Array = start + part[:, np.newaxis] * along
    return place
