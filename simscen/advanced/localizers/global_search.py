"""Search of a robot's pose on the whole map by correlative scan matching over the likelihood field.

Source: Olson, Real-time correlative scan matching (ICRA 2009), section III. Each pose of a coarse grid is scored by the
share of endpoints that lie near obstacles of the map and by the share of the beams' paths that is free. The best poses
are refined. The search is deterministic, and its time depends only on the size of the map.
"""

import cmath
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, wrap_array
from simscen.stack.localizers.beams import Plane, evenly_spaced
from simscen.stack.localizers.distance_field import DistanceField, Float32
from simscen.stack.localizers.likelihood_field import surfaces

ENDPOINT_STD_M = 0.2
"""Standard deviation of the distance of an endpoint from its obstacle."""
MAX_DISTANCE_M = 4 * ENDPOINT_STD_M
"""Distance from obstacles beyond which an endpoint fits nothing."""
COARSE_CELL_M = 0.2
HEADINGS = 180
"""Number of headings of the coarse grid."""
COARSE_POINTS, POINTS = 80, 240
"""Maximum number of points that are matched on the coarse grid, and later."""
MAX_RANGE_M = 15.0
"""Endpoints farther away are ignored, because the resolution of the coarse headings moves them too far."""
COARSE_POSES, REFINED_POSES, MAX_RESULTS = 3000, 250, 40
"""Number of poses that the coarse search and the refinement pass on, and of the results."""
NEARBY_STEPS, REFINED_NEARBY_POSES = ((6, 0.2), (9, 0.035)), 12
"""Number and size of the steps to each side of a search nearby (m, rad), and number of poses that are refined."""
DISTINCT = (0.5, 0.2)
"""Poses that are closer to each other than both of these (m, rad) are the same."""
PASSED_SHARES = (0.3, 0.55, 0.8)
"""Positions along a beam, as shares of its length, that must be free."""
FREE_WEIGHT = 0.5
"""Weight of the free paths. The weight of the endpoints is 1."""

Levels = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class View:
    """Endpoints of beams, `ends` (n,), and points on their paths, `passed` (m,), in the frame of a pose."""

    ends: Plane
    passed: Plane

    def thinned(self, count: int) -> "View":
        """Return at most `count` of each, evenly spaced."""
        return View(_thin(self.ends, count), _thin(self.passed, count))


def _within_reach(view: View) -> View:
    return View(*(points[np.abs(points) < MAX_RANGE_M] for points in (view.ends, view.passed)))


def _thin(points: Plane, count: int) -> Plane:
    if len(points) <= count:
        return points
    return points[evenly_spaced(len(points), count)]


class GlobalSearch:
    """Finds the poses on a map that explain a view best."""

    def __init__(self, grid: OccupancyGrid, field: DistanceField | None = None) -> None:
        """Search this map. `field` is the obstacle field of the same map, if it is already known."""
        self._grid, self._known = grid, field

    def precompute(self) -> None:
        """Compute the tables of `near` and `fit`, which are otherwise computed when first used."""
        _ = self._near, self._open

    def places(self, view: View) -> tuple[Array, Array]:
        """Return poses (k, 3) in the map frame and their scores (k,) in 0 … 1, best first, at most MAX_RESULTS."""
        near = _within_reach(view)
        if not len(near.ends):
            return np.empty((0, 3)), np.empty(0)
        poses = self._search_coarse_grid(near.thinned(COARSE_POINTS))
        fine = near.thinned(POINTS)
        coarse = near.thinned(COARSE_POINTS)
        poses, _ = distinct(poses, self.fit(poses, coarse), REFINED_POSES)
        for meters, turn in ((0.1, 1.0), (0.05, 0.5)):
            poses = self._improve(poses, coarse, meters, np.radians(turn))
        return distinct(poses, self.fit(poses, fine), MAX_RESULTS)

    def near(self, view: View, pose: Array) -> tuple[Array, Array]:
        """Return the same within NEARBY_STEPS of `pose` (3,)."""
        close = _within_reach(view)
        coarse, fine = close.thinned(COARSE_POINTS), close.thinned(POINTS)
        aside, turn = (np.arange(-steps, steps + 1) * step for steps, step in NEARBY_STEPS)
        poses = pose + np.stack(np.meshgrid(aside, aside, turn, indexing="ij"), axis=-1).reshape(-1, 3)
        poses, _ = distinct(poses, self.fit(poses, coarse), REFINED_NEARBY_POSES)
        for meters, degrees in ((0.1, 1.0), (0.05, 0.5), (0.05, 0.5)):
            poses = self._improve(poses, coarse, meters, np.radians(degrees))
        return distinct(poses, self.fit(poses, fine), MAX_RESULTS)

    def fit(self, poses: Array, view: View) -> Array:
        """Return the scores (n,) of a view at each of the `poses` (n, 3), in 0 … 1."""
        parts = [(self._near, view.ends, 1.0), (self._open, view.passed, FREE_WEIGHT)]
        nonempty = [(table, points, weight) for table, points, weight in parts if len(points)]
        score = sum(weight * self._mean(table, poses, points) for table, points, weight in nonempty)
        fitting: Array = np.asarray(score) / sum(weight for _, _, weight in nonempty)
        return fitting

    def hits(self, poses: Array, view: View) -> Array:
        """Return the share (n,) of the endpoints that fit at each of the `poses` (n, 3)."""
        return self._mean(self._near, poses, view.ends)

    def _mean(self, table: Levels, poses: Array, points: Plane) -> Array:
        blocks = [
            table.take(self._field.endpoint_cells(poses[begin : begin + 512], points)).mean(axis=1)
            for begin in range(0, len(poses), 512)
        ]
        mean: Array = np.concatenate(blocks) / 255
        return mean

    @cached_property
    def _field(self) -> DistanceField:
        if self._known is not None and self._known.limit >= MAX_DISTANCE_M:
            return self._known
        return DistanceField(self._grid, surfaces(self._grid.cells == OCCUPIED), MAX_DISTANCE_M, walled=False)

    @cached_property
    def _near(self) -> Levels:
        """Score of an endpoint in each cell by its distance to the nearest obstacle, 0 … 255."""
        return self._field.tabulate(_nearness, np.uint8)

    @cached_property
    def _open(self) -> Levels:
        """255 for free cells, 0 for others."""
        levels: Levels = np.pad(np.where(self._grid.cells == FREE, 255, 0).astype(np.uint8), 1).ravel()
        return levels

    @cached_property
    def _coarse(self) -> tuple[int, Levels, Levels, npt.NDArray[np.bool_]]:
        """Map cells per coarse cell; for each coarse cell the maximum of both tables, and whether it has free cells."""
        each = max(1, round(COARSE_CELL_M / self._grid.resolution))
        rows, columns = self._grid.shape
        shape = rows + 2, columns + 2
        near = _pooled(self._near.reshape(shape)[1:-1, 1:-1], each)
        open_ = _pooled(self._open.reshape(shape)[1:-1, 1:-1], each)
        return each, near, open_, open_ > 0

    def _search_coarse_grid(self, view: View) -> Array:
        """Return the best poses of the coarse grid, unordered."""
        each, near, open_, room = self._coarse
        cell = each * self._grid.resolution
        rows, columns = near.shape
        border = int(MAX_RANGE_M / cell) + 2
        tables = [np.pad(near, border), np.pad(open_, border)]
        weights = [4, max(1, round(4 * FREE_WEIGHT * len(view.ends) / max(1, len(view.passed))))]
        scores = np.empty((HEADINGS, rows, columns), dtype=np.uint16)
        turns = np.arange(HEADINGS, dtype=np.float64) * (2 * np.pi / HEADINGS)
        for turn, score in zip(turns.tolist(), scores, strict=True):
            total = np.zeros((rows, columns), dtype=np.uint32)
            for table, points, weight in zip(tables, (view.ends, view.passed), weights, strict=True):
                moved = (points * (cmath.rect(1.0, turn) / cell)).view(np.float64).reshape(-1, 2)
                offsets = np.floor(moved + 0.5).astype(np.int64) + border
                part = np.zeros((rows, columns), dtype=np.uint32 if len(points) > 257 else np.uint16)
                for right, up in offsets.tolist():
                    part += table[up : up + rows, right : right + columns]
                total += np.uint32(weight) * part
            score[:] = total >> 3
        scores *= room
        flat = scores.ravel()
        best = np.argpartition(flat, -min(COARSE_POSES, flat.size))[-COARSE_POSES:]
        heading, row, column = np.unravel_index(np.sort(best), scores.shape)
        places: Array = (np.column_stack((column, row)).astype(np.float64) + 0.5) * cell
        yaw: Array = turns[heading] + self._grid.origin.yaw
        return np.column_stack((self._grid.origin.apply(places), wrap_array(yaw)))

    def _improve(self, poses: Array, view: View, meters: float, turn: float) -> Array:
        """Return each pose (n, 3), or the best of its neighbors, `meters` and `turn` rad away."""
        steps = np.array([(x, y, a) for x in (0, -1, 1) for y in (0, -1, 1) for a in (0, -1, 1)])
        around = (poses[:, None] + steps * (meters, meters, turn)).reshape(-1, 3)
        best = self.fit(around, view).reshape(len(poses), -1).argmax(axis=1)
        climbed: Array = around.reshape(len(poses), -1, 3)[np.arange(len(poses)), best]
        climbed[:, 2] = wrap_array(climbed[:, 2])
        return climbed


def _nearness(meters: Float32) -> Levels:
    fitting = np.exp(np.square(np.minimum(meters, np.float32(MAX_DISTANCE_M))) / (-2 * ENDPOINT_STD_M**2))
    levels: Levels = np.round(255 * fitting).astype(np.uint8)
    return levels


def _pooled(levels: Levels, each: int) -> Levels:
    """Return the maximum of each block of `each` x `each` cells."""
    rows, columns = (-(-size // each) for size in levels.shape)
    padded = np.pad(levels, ((0, rows * each - levels.shape[0]), (0, columns * each - levels.shape[1])))
    pooled: Levels = padded.reshape(rows, each, columns, each).max(axis=(1, 3))
    return pooled


def distinct(poses: Array, scores: Array, most: int) -> tuple[Array, Array]:
    """Return the best DISTINCT poses of `poses` (n, 3), best first, at most `most`, and their scores."""
    order = np.argsort(-scores, kind="stable")
    left = poses[order]
    kept: list[int] = []
    while len(order) and len(kept) < most:
        kept.append(int(order[0]))
        off = np.abs(left - left[0])
        off[:, 2] = np.abs(wrap_array(off[:, 2]))
        other = (np.hypot(off[:, 0], off[:, 1]) > DISTINCT[0]) | (off[:, 2] > DISTINCT[1])
        order, left = order[other], left[other]
    chosen = np.array(kept, dtype=np.int64)
    return poses[chosen], scores[chosen]
