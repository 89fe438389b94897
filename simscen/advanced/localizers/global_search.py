"""Search of the whole map for the pose of a robot, by correlative scan matching over the likelihood field.

Source: Olson, Real-time correlative scan matching (ICRA 2009), section III. The score of a pose combines the nearness
of endpoints to obstacles of the map, and the share of points along the beams that are in free space. All poses of a
coarse grid get a score, and the best poses are refined.
"""

import cmath
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from simscen.advanced.cell_blocks import pool_blocks
from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.geometry import Array, wrap_array
from simscen.stack.localizers.beams import ComplexPoints, evenly_spaced
from simscen.stack.localizers.distance_field import DistanceField, Float32, evaluate_in_blocks
from simscen.stack.localizers.particles import pose_errors
from simscen.stack.localizers.sensor_models import obstacle_field

ENDPOINT_STD_M = 0.2
"""Standard deviation of the distance of an endpoint from an obstacle, in the score of the endpoint."""
MAX_DISTANCE_M = 4 * ENDPOINT_STD_M
"""Distance from obstacles beyond which the score of an endpoint is 0."""
COARSE_CELL_M, HEADING_COUNT = 0.2, 180
"""Cell size and number of headings of the coarse grid."""
COARSE_POINTS, FINAL_POINTS = 80, 240
"""Maximum number of endpoints, and of points along beams, in the search and for the final scores."""
MAX_RANGE_M = 15.0
"""Range beyond which points are ignored, because the headings of the coarse grid are too far apart for them."""
COARSE_POSES, REFINED_POSES, MAX_RESULTS = 3000, 250, 40
"""Maximum numbers of poses that are taken from the coarse grid, that are refined, and that are returned."""
NEARBY_STEPS = ((6, 0.2), (9, 0.035))
"""Grid of `search_near`: number of steps to each side and step size, for x and y in m, and for yaw in rad."""
REFINED_NEARBY_POSES = 12
"""Maximum number of poses that `search_near` refines."""
REFINEMENT_STEPS = ((0.1, 1.0), (0.05, 0.5))
"""Step sizes (m, degrees) of successive refinements of a pose."""
MIN_SEPARATION = (0.5, 0.2)
"""Two poses are distinct if they differ by more than either value (m, rad)."""
PASSED_SHARES = (0.3, 0.55, 0.8)
"""Points along a beam, as shares of its length, that should be free."""
FREE_WEIGHT = 0.5
"""Weight of the points along beams in a score. The weight of the endpoints is 1."""

Levels = npt.NDArray[np.uint8]
"""Scores as integers, 0 … 255."""


@dataclass(frozen=True, eq=False)
class View:
    """Points that one or several scans show, in the base frame as x + iy in m.

    `ends` (n,) are the endpoints of beams. `passed` (m,) are points along the beams, which should be free.
    """

    ends: ComplexPoints
    passed: ComplexPoints

    def thinned(self, count: int) -> "View":
        """Return at most `count` of `ends` and of `passed`, evenly spaced."""
        return View(*(
            points if len(points) <= count else points[evenly_spaced(len(points), count)]
            for points in (self.ends, self.passed)
        ))  # fmt: skip

    def within_max_range(self) -> "View":
        """Return the points within MAX_RANGE_M."""
        return View(*(points[np.abs(points) < MAX_RANGE_M] for points in (self.ends, self.passed)))


class GlobalSearch:
    """Finds the poses at which the points of a view fit a map best."""

    def __init__(self, grid: OccupancyGrid, field: DistanceField | None = None) -> None:
        """Prepare searches on the map `grid`. `field` is the map's field of distances from obstacles.

        The field is computed if `field` is None, or if its distances do not reach MAX_DISTANCE_M.
        """
        if field is None or field.limit < MAX_DISTANCE_M:
            field = obstacle_field(grid, MAX_DISTANCE_M)
        self._grid, self._field = grid, field

    def precompute(self) -> None:
        """Compute the lookup tables now instead of in the first search."""
        _ = self._nearness_table, self._free_table

    def search(self, view: View) -> tuple[Array, Array]:
        """Return at most MAX_RESULTS poses (k, 3) in the map frame and their scores (k,) in 0 … 1, best first."""
        near_view = view.within_max_range()
        if not len(near_view.ends):
            return np.empty((0, 3)), np.empty(0)
        poses = self._search_coarse_grid(near_view.thinned(COARSE_POINTS))
        return self._refine(poses, near_view, REFINED_POSES, REFINEMENT_STEPS)

    def search_near(self, view: View, pose: Array) -> tuple[Array, Array]:
        """Return poses and scores as `search` does, but only for poses within NEARBY_STEPS of `pose` (3,)."""
        offsets, turn = (np.arange(-steps, steps + 1) * step for steps, step in NEARBY_STEPS)
        poses = pose + np.stack(np.meshgrid(offsets, offsets, turn, indexing="ij"), axis=-1).reshape(-1, 3)
        steps = (*REFINEMENT_STEPS, REFINEMENT_STEPS[-1])
        return self._refine(poses, view.within_max_range(), REFINED_NEARBY_POSES, steps)

    def _refine(
        self, poses: Array, view: View, max_count: int, steps: tuple[tuple[float, float], ...]
    ) -> tuple[Array, Array]:
        """Refine the best `max_count` of the `poses` (n, 3) with each of `steps` (m, degrees). Return as `search`."""
        coarse = view.thinned(COARSE_POINTS)
        poses, _ = select_distinct(poses, self.score(poses, coarse), max_count)
        for meters, degrees in steps:
            poses = self._improve(poses, coarse, meters, np.radians(degrees))
        return select_distinct(poses, self.score(poses, view.thinned(FINAL_POINTS)), MAX_RESULTS)

    def score(self, poses: Array, view: View) -> Array:
        """Return the scores (n,) in 0 … 1 of `poses` (n, 3) for a view."""
        parts = [(self._nearness_table, view.ends, 1.0), (self._free_table, view.passed, FREE_WEIGHT)]
        nonempty = [(table, points, weight) for table, points, weight in parts if len(points)]
        total = sum(weight * self._mean_level(table, poses, points) for table, points, weight in nonempty)
        scores: Array = np.asarray(total) / sum(weight for _, _, weight in nonempty)
        return scores

    def _mean_level(self, table: Levels, poses: Array, points: ComplexPoints) -> Array:
        """Return for each of `poses` (n, 3) the mean (n,), 0 … 1, of the table values at the `points` of a view."""
        return evaluate_in_blocks(
            lambda block: table.take(self._field.endpoint_cells(block, points)).mean(axis=1) / 255, poses
        )

    @cached_property
    def _nearness_table(self) -> Levels:
        """Score 0 … 255 of an endpoint in each cell, by the distance to the nearest obstacle."""
        return self._field.tabulate(_nearness, np.uint8)

    @cached_property
    def _free_table(self) -> Levels:
        """255 for free cells, 0 for all others."""
        levels: Levels = np.pad(np.where(self._grid.cells == FREE, 255, 0).astype(np.uint8), 1).ravel()
        return levels

    @cached_property
    def _coarse_grid(self) -> tuple[int, Levels, Levels]:
        """Factor, nearness table, and free table of the coarse grid.

        A coarse cell consists of `factor` x `factor` map cells, and has the largest value of these cells.
        """
        factor = max(1, round(COARSE_CELL_M / self._grid.resolution))
        rows, columns = self._grid.shape
        shape = rows + 2, columns + 2
        nearness = pool_blocks(self._nearness_table.reshape(shape)[1:-1, 1:-1], factor, np.maximum, 0)
        free = pool_blocks(self._free_table.reshape(shape)[1:-1, 1:-1], factor, np.maximum, 0)
        return factor, nearness, free

    def _search_coarse_grid(self, view: View) -> Array:
        """Return the best poses of the coarse grid, unordered."""
        factor, nearness, free = self._coarse_grid
        cell = factor * self._grid.resolution
        rows, columns = nearness.shape
        border = int(MAX_RANGE_M / cell) + 2
        tables = [np.pad(nearness, border), np.pad(free, border)]
        weights = [4, max(1, round(4 * FREE_WEIGHT * len(view.ends) / max(1, len(view.passed))))]
        scores = np.empty((HEADING_COUNT, rows, columns), dtype=np.uint16)
        turns = np.arange(HEADING_COUNT, dtype=np.float64) * (2 * np.pi / HEADING_COUNT)
        for turn, heading_scores in zip(turns.tolist(), scores, strict=True):
            total = np.zeros((rows, columns), dtype=np.uint32)
            for table, points, weight in zip(tables, (view.ends, view.passed), weights, strict=True):
                moved = (points * (cmath.rect(1.0, turn) / cell)).view(np.float64).reshape(-1, 2)
                offsets = np.floor(moved + 0.5).astype(np.int64) + border
                part = np.zeros((rows, columns), dtype=np.uint32 if len(points) > 257 else np.uint16)
                for right, up in offsets.tolist():
                    part += table[up : up + rows, right : right + columns]
                total += np.uint32(weight) * part
            heading_scores[:] = total >> 3
        scores *= free > 0
        heading, row, column = np.unravel_index(_highest(scores.ravel(), COARSE_POSES), scores.shape)
        positions: Array = (np.column_stack((column, row)).astype(np.float64) + 0.5) * cell
        yaw: Array = turns[heading] + self._grid.origin.yaw
        return np.column_stack((self._grid.origin.apply(positions), wrap_array(yaw)))

    def _improve(self, poses: Array, view: View, meters: float, turn: float) -> Array:
        """Return each pose (n, 3), or the best of its neighbors at steps of `meters` and `turn` rad."""
        steps = np.array([(x, y, a) for x in (0, -1, 1) for y in (0, -1, 1) for a in (0, -1, 1)])
        around = (poses[:, None] + steps * (meters, meters, turn)).reshape(-1, 3)
        best = self.score(around, view).reshape(len(poses), -1).argmax(axis=1)
        improved: Array = around.reshape(len(poses), -1, 3)[np.arange(len(poses)), best]
        improved[:, 2] = wrap_array(improved[:, 2])
        return improved


def _nearness(meters: Float32) -> Levels:
    """Return the scores 0 … 255 of endpoints at distances from the nearest obstacle."""
    nearness = np.exp(np.square(np.minimum(meters, np.float32(MAX_DISTANCE_M))) / (-2 * ENDPOINT_STD_M**2))
    levels: Levels = np.round(255 * nearness).astype(np.uint8)
    return levels


def _highest(scores: npt.NDArray[np.uint16], count: int) -> npt.NDArray[np.int64]:
    """Return the indices of the `count` highest scores in ascending order. Of equal scores, the first are chosen."""
    # np.argpartition would need four times the memory of the scores.
    count = min(count, len(scores))
    lowest = np.partition(scores, -count)[-count]
    better, equal = (scores > lowest).nonzero()[0], (scores == lowest).nonzero()[0]
    return np.sort(np.concatenate((better, equal[: count - len(better)])))


def select_distinct(poses: Array, scores: Array, max_count: int) -> tuple[Array, Array]:
    """Return the best distinct poses (see `are_distinct`) of `poses` (n, 3), and their scores, best first."""
    order = np.argsort(-scores, kind="stable")
    chosen: list[int] = []
    while len(order) and len(chosen) < max_count:
        chosen.append(int(order[0]))
        order = order[are_distinct(poses[order[0]], poses[order])]
    return poses[chosen], scores[chosen]


def are_distinct(pose: Array, others: Array) -> npt.NDArray[np.bool_]:
    """Return which of the poses `others` (n, 3) differ from `pose` (3,) by more than MIN_SEPARATION."""
    x, y, turn = pose_errors(pose, others).T
    distinct: npt.NDArray[np.bool_] = (np.hypot(x, y) > MIN_SEPARATION[0]) | (np.abs(turn) > MIN_SEPARATION[1])
    return distinct
