"""Surroundings of pedestrians: walls, robots, and other objects, and geometric queries about them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.pedestrians.forces import Indices

WALL_CELL_M = 1.0
"""Size of the grid cells for which WallMap caches the nearby wall segments."""
OBSTACLE_RANGE_M = 1.2
"""Distance from the center of a pedestrian within which walls and objects act on it."""
SIGHT_CELL_M = 0.1
"""Minimum cell size of the visibility grid. Cells are larger if the grid would have more than MAX_SIGHT_CELLS."""
MAX_SIGHT_CELLS = 4_000_000
"""Approximate maximum number of cells of the visibility grid."""
SIGHT_MARGIN_M = 0.3
"""Length at both ends of a line of sight in which walls do not block the view."""

NearestPoints = tuple[Indices, Indices, Array]
"""Indices of pedestrians (k,), indices of solids (k,), and points (k, 2) in m in the world frame.

Each row belongs to a pedestrian and a nearby wall segment: the solid that the segment belongs to, and the point of the
segment that is nearest to the pedestrian.
"""


@dataclass(frozen=True, eq=False)
class ObservedRobot:
    """State of a robot in the current step.

    pose:      pose of the base in the world frame
    velocity:  velocity of the base in m/s along x and y of the world frame
    radius:    radius in m of a circle around the base that contains the body
    outline:   corners (n, 2) of the body in m in the base frame
    """

    name: str
    pose: Pose2
    velocity: tuple[float, float]
    radius: float
    outline: Array


@dataclass(frozen=True, eq=False)
class ObservedObject:
    """Outlines of an object in the current step, each as corners (n, 2) in m in the world frame."""

    name: str
    outlines: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """All robots and objects in the current step, sorted by name."""

    robots: tuple[ObservedRobot, ...] = ()
    objects: tuple[ObservedObject, ...] = ()


class WallMap:
    """Walls that block pedestrians. Opaque walls also block the view of pedestrians."""

    def __init__(self, segments: Array, owners: Indices, is_opaque: npt.NDArray[np.bool_]) -> None:
        """Create the map. Raises ValueError for coordinates that are not finite.

        segments (n, 2, 2):  ends of the segments in m in the world frame
        owners (n,):         index of the solid that each segment belongs to
        is_opaque (n,):      whether each segment blocks the view
        """
        if not np.isfinite(segments).all():
            raise ValueError("a wall segment has coordinates that are not finite")
        self._segments, self._owners = segments, owners
        self._low, self._high = segments.min(axis=1), segments.max(axis=1)
        self._segments_by_cell: dict[tuple[int, int], Indices] = {}
        self._sight = _SightGrid(segments[is_opaque])

    def nearest_points(self, points: Array) -> NearestPoints:
        """Return the nearest point of each nearby wall segment for pedestrians at `points` (n, 2).

        Segments are nearby up to OBSTACLE_RANGE_M. The result also contains some segments that are a little farther
        away.
        """
        cells = np.floor(points / WALL_CELL_M).astype(np.int64).tolist()
        candidates = [self._segments_near(column, row) for column, row in cells]
        point_index = np.repeat(np.arange(len(points)), [len(each) for each in candidates])
        segment_index = np.concatenate(candidates) if candidates else np.empty(0, dtype=np.int64)
        nearest = _nearest_points_on(self._segments[segment_index], points[point_index])
        return point_index, self._owners[segment_index], nearest

    def _segments_near(self, column: int, row: int) -> Indices:
        """Return the indices of segments that may be within OBSTACLE_RANGE_M of any point of a cell of WALL_CELL_M."""
        if (column, row) not in self._segments_by_cell:
            low = np.array([column, row]) * WALL_CELL_M
            outside = np.maximum(np.maximum(self._low - low - WALL_CELL_M, low - self._high), 0.0)
            self._segments_by_cell[column, row] = np.flatnonzero(
                np.hypot(outside[:, 0], outside[:, 1]) <= OBSTACLE_RANGE_M
            )
        return self._segments_by_cell[column, row]

    def distance(self, point: tuple[float, float]) -> float:
        """Return the distance in m from a point to the nearest wall; inf without a wall in `nearest_points`."""
        points = np.array([point])
        _, _, nearest = self.nearest_points(points)
        return float(np.hypot(*(nearest - points).T).min(initial=math.inf))

    def visible(self, viewers: Array, targets: Array) -> npt.NDArray[np.bool_]:
        """Return for each pair of a viewer (n, 2) and a target (n, 2) whether no wall hides the target."""
        return self._sight.clear_lines(viewers, targets)


class _SightGrid:
    """Grid whose cells block lines of sight if an opaque wall segment passes through them."""

    def __init__(self, segments: Array) -> None:
        ends = segments.reshape(-1, 2) if len(segments) else np.zeros((1, 2))
        self._low = ends.min(axis=0) - SIGHT_CELL_M
        size = ends.max(axis=0) + SIGHT_CELL_M - self._low
        self._cell = max(SIGHT_CELL_M, math.sqrt(float(size[0] * size[1]) / MAX_SIGHT_CELLS))
        self._opaque = np.zeros(np.ceil(size / self._cell).astype(np.int64) + 1, dtype=np.bool_)
        steps = 1 + np.ceil(np.hypot(*(segments[:, 1] - segments[:, 0]).T) / (self._cell / 4)).astype(np.int64)
        segment = np.repeat(np.arange(len(segments)), steps)
        first = np.repeat(np.cumsum(steps) - steps, steps)
        ratio = (np.arange(len(segment)) - first) / np.maximum(np.repeat(steps, steps) - 1, 1)
        points = segments[segment, 0] + ratio[:, np.newaxis] * (segments[segment, 1] - segments[segment, 0])
        cells = np.floor((points - self._low) / self._cell).astype(np.int64)
        self._opaque[cells[:, 0], cells[:, 1]] = True

    def clear_lines(self, viewers: Array, targets: Array) -> npt.NDArray[np.bool_]:
        """Return for each pair of a viewer (n, 2) and a target (n, 2) whether the line between both is clear."""
        # One sample per cell length suffices, because walls are closed outlines or thicker than a cell.
        offset = targets - viewers
        distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
        samples = np.maximum(np.ceil((distance - 2 * SIGHT_MARGIN_M) / self._cell), 0).astype(np.int64)
        line = np.repeat(np.arange(len(viewers)), samples)
        number = np.arange(len(line)) - np.repeat(np.cumsum(samples) - samples, samples)
        ratio = (SIGHT_MARGIN_M + number * self._cell) / distance[line]
        points = viewers[line] - self._low + offset[line] * ratio[:, np.newaxis]
        cells = np.floor(points / self._cell).astype(np.int64)
        inside = ((cells >= 0) & (cells < self._opaque.shape)).all(axis=1)
        blocked = line[inside][self._opaque[cells[inside, 0], cells[inside, 1]]]
        is_clear = np.ones(len(viewers), dtype=np.bool_)
        is_clear[blocked] = False
        return is_clear


def _nearest_points_on(segments: Array, points: Array) -> Array:
    """Return for each pair of a segment (n, 2, 2) and a point (n, 2) the nearest point (n, 2) on the segment."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    squared = np.maximum(np.sum(along * along, axis=1), 1e-18)
    ratio = np.clip(np.sum((points - start) * along, axis=1) / squared, 0.0, 1.0)
    nearest: Array = start + ratio[:, np.newaxis] * along
    return nearest


def nearest_by_solid(person: Indices, solid: Indices, distance: Array) -> Indices:
    """Return the indices of the nearest points: one index for each pair of a pedestrian and a solid.

    Point k is on the solid `solid[k]`, `distance[k]` m away from the pedestrian `person[k]`.
    """
    order = np.lexsort((distance, solid, person))
    pairs = np.stack((person[order], solid[order]), axis=1)
    is_first = np.ones(len(order), dtype=np.bool_)
    is_first[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    first: Indices = order[is_first]
    return first


def nearest_outline_points(
    outlines: Sequence[Array], indices: Indices, positions: Array, of_each_segment: bool = False
) -> tuple[Indices, Array]:
    """Find the pedestrians within OBSTACLE_RANGE_M of closed outlines, and the nearest point of the outlines to each.

    Returns the indices (k,) of these pedestrians, and the points (k, 2) in m. With `of_each_segment`, returns instead
    one index and one point for each pair of a pedestrian and a segment of an outline within this range.

    outlines:          corners (m, 2) of each outline
    indices:           indices of the pedestrians to examine
    positions (n, 2):  positions of all pedestrians in m
    """
    rings = [np.stack((ring, np.roll(ring, -1, axis=0)), axis=1) for ring in outlines]
    segments = np.concatenate(rings) if rings else np.empty((0, 2, 2))
    repeated = np.repeat(indices, len(segments))
    points = _nearest_points_on(np.tile(segments, (len(indices), 1, 1)), positions[repeated])
    distance = np.hypot(*(points - positions[repeated]).T)
    near = np.flatnonzero(distance <= OBSTACLE_RANGE_M)
    if not of_each_segment:
        near = near[nearest_by_solid(repeated[near], np.zeros_like(near), distance[near])]
    return repeated[near], points[near]
