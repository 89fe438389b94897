"""Finding a robot anywhere on its map: correlative scan matching, coarse to fine, over the likelihood field.

Olson, Real-time correlative scan matching (ICRA 2009), section III: every place and heading of a coarse grid is scored
by how many of the points seen fall near what the map shows; here also by how much of the way to them it shows as free.
The best are refined. Nothing is drawn by chance, and the work is bounded by the size of the map.
"""

import cmath
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, wrap_array
from simscen.stack.localizers.beams import Plane, evenly
from simscen.stack.localizers.distance_field import DistanceField, Float32
from simscen.stack.localizers.likelihood_field import surfaces

WIDTH = 0.2
"""m: the standard deviation of a point from what it belongs to."""
FAR = 4 * WIDTH
"""m beyond which a point belongs to nothing."""
COARSE = 0.2
"""m: the coarsest grid of places."""
HEADINGS = 180
"""Of the coarsest grid, in a full turn."""
COARSE_POINTS, POINTS = 80, 240
"""At most so many points are matched on the coarsest grid, and later."""
REACH = 15.0
"""m: points further off are left out; a coarse heading moves them too far."""
KEPT, REFINED, ANSWERS = 3000, 250, 40
"""How many places go from the coarsest grid to the next stage, and to the last; how many are told."""
NEARBY, REFINED_NEARBY = ((6, 0.2), (9, 0.035)), 12
"""Steps of so many m, and of so many rad, to each side; and how many of these places are refined."""
APART = (0.5, 0.2)
"""m and rad: two places nearer than both are one."""
SHARES = (0.3, 0.55, 0.8)
"""Of a beam's length: where the points lie that it passed."""
WAYS = 0.5
"""What it counts that the ways to all points are free, beside 1 for all points being where the map shows something."""

Levels = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class View:
    """What was seen around a pose, in its frame: `ends` (n,) of beams, and points (m,) that they `passed`."""

    ends: Plane
    passed: Plane

    def thinned(self, count: int) -> "View":
        """At most `count` of each, evenly chosen."""
        return View(_evenly(self.ends, count), _evenly(self.passed, count))


def _within_reach(view: View) -> View:
    return View(*(points[np.abs(points) < REACH] for points in (view.ends, view.passed)))


def _evenly(points: Plane, count: int) -> Plane:
    if len(points) <= count:
        return points
    return points[evenly(len(points), count)]


class GlobalSearch:
    """The most likely places of a map for what was seen."""

    def __init__(self, grid: OccupancyGrid, field: DistanceField | None = None) -> None:
        """`field` is that of the surfaces of the same map, if anyone has it."""
        self._grid, self._known = grid, field

    def ready(self) -> None:
        """Work out now what `near` and `fit` look up."""
        _ = self._near, self._open

    def places(self, view: View) -> tuple[Array, Array]:
        """Poses (k, 3) in the map frame, and how well each fits (k,), 0 … 1, best first; k is at most ANSWERS."""
        near = _within_reach(view)
        if not len(near.ends):
            return np.empty((0, 3)), np.empty(0)
        poses = self._coarsely(near.thinned(COARSE_POINTS))
        fine = near.thinned(POINTS)
        some = near.thinned(COARSE_POINTS)
        poses, _ = distinct(poses, self.fit(poses, some), REFINED)
        for meters, turn in ((0.1, 1.0), (0.05, 0.5)):
            poses = self._climbed(poses, some, meters, np.radians(turn))
        return distinct(poses, self.fit(poses, fine), ANSWERS)

    def near(self, view: View, pose: Array) -> tuple[Array, Array]:
        """As `places`, but only those within NEARBY of `pose` (3,)."""
        close = _within_reach(view)
        some, fine = close.thinned(COARSE_POINTS), close.thinned(POINTS)
        aside, turn = (np.arange(-steps, steps + 1) * step for steps, step in NEARBY)
        poses = pose + np.stack(np.meshgrid(aside, aside, turn, indexing="ij"), axis=-1).reshape(-1, 3)
        poses, _ = distinct(poses, self.fit(poses, some), REFINED_NEARBY)
        for meters, degrees in ((0.1, 1.0), (0.05, 0.5), (0.05, 0.5)):
            poses = self._climbed(poses, some, meters, np.radians(degrees))
        return distinct(poses, self.fit(poses, fine), ANSWERS)

    def fit(self, poses: Array, view: View) -> Array:
        """How well a view fits at each of `poses` (n, 3): (n,), 0 … 1."""
        parts = [(self._near, view.ends, 1.0), (self._open, view.passed, WAYS)]
        told = [(table, points, weight) for table, points, weight in parts if len(points)]
        score = sum(weight * self._mean(table, poses, points) for table, points, weight in told)
        fitting: Array = np.asarray(score) / sum(weight for _, _, weight in told)
        return fitting

    def hits(self, poses: Array, view: View) -> Array:
        """The share of the ends of a view that fit at each of `poses` (n, 3): (n,), 0 … 1."""
        return self._mean(self._near, poses, view.ends)

    def _mean(self, table: Levels, poses: Array, points: Plane) -> Array:
        blocks = [
            table.take(self._field.cells_seen(poses[begin : begin + 512], points)).mean(axis=1)
            for begin in range(0, len(poses), 512)
        ]
        mean: Array = np.concatenate(blocks) / 255
        return mean

    @cached_property
    def _field(self) -> DistanceField:
        if self._known is not None and self._known.limit >= FAR:
            return self._known
        return DistanceField(self._grid, surfaces(self._grid.cells == OCCUPIED), FAR, walled=False)

    @cached_property
    def _near(self) -> Levels:
        """How near each cell is to an obstacle, 0 … 255."""
        return self._field.told(_nearness, np.uint8)

    @cached_property
    def _open(self) -> Levels:
        """Which cells are known to be free, 0 or 255."""
        levels: Levels = np.pad(np.where(self._grid.cells == FREE, 255, 0).astype(np.uint8), 1).ravel()
        return levels

    @cached_property
    def _coarse(self) -> tuple[int, Levels, Levels, npt.NDArray[np.bool_]]:
        """Cells of the map for one coarse one, and what each coarse one has best of nearness, openness and room."""
        each = max(1, round(COARSE / self._grid.resolution))
        rows, columns = self._grid.shape
        shape = rows + 2, columns + 2
        near = _pooled(self._near.reshape(shape)[1:-1, 1:-1], each)
        open_ = _pooled(self._open.reshape(shape)[1:-1, 1:-1], each)
        return each, near, open_, open_ > 0

    def _coarsely(self, view: View) -> Array:
        """The best KEPT poses of the coarsest grid, in no order."""
        each, near, open_, room = self._coarse
        cell = each * self._grid.resolution
        rows, columns = near.shape
        border = int(REACH / cell) + 2
        tables = [np.pad(near, border), np.pad(open_, border)]
        weights = [4, max(1, round(4 * WAYS * len(view.ends) / max(1, len(view.passed))))]
        scores = np.empty((HEADINGS, rows, columns), dtype=np.uint16)
        turns = np.arange(HEADINGS, dtype=np.float64) * (2 * np.pi / HEADINGS)
        for turn, score in zip(turns.tolist(), scores, strict=True):
            total = np.zeros((rows, columns), dtype=np.uint32)
            for table, points, weight in zip(tables, (view.ends, view.passed), weights, strict=True):
                moved = (points * (cmath.rect(1.0, turn) / cell)).view(np.float64).reshape(-1, 2)
                offsets = np.floor(moved + 0.5).astype(np.int64) + border
                some = np.zeros((rows, columns), dtype=np.uint32 if len(points) > 257 else np.uint16)
                for right, up in offsets.tolist():
                    some += table[up : up + rows, right : right + columns]
                total += np.uint32(weight) * some
            score[:] = total >> 3
        scores *= room
        flat = scores.ravel()
        best = np.argpartition(flat, -min(KEPT, flat.size))[-KEPT:]
        heading, row, column = np.unravel_index(np.sort(best), scores.shape)
        places: Array = (np.column_stack((column, row)).astype(np.float64) + 0.5) * cell
        yaw: Array = turns[heading] + self._grid.origin.yaw
        return np.column_stack((self._grid.origin.apply(places), wrap_array(yaw)))

    def _climbed(self, poses: Array, view: View, meters: float, turn: float) -> Array:
        """Each pose, or the better one of those around it."""
        steps = np.array([(x, y, a) for x in (0, -1, 1) for y in (0, -1, 1) for a in (0, -1, 1)])
        around = (poses[:, None] + steps * (meters, meters, turn)).reshape(-1, 3)
        best = self.fit(around, view).reshape(len(poses), -1).argmax(axis=1)
        climbed: Array = around.reshape(len(poses), -1, 3)[np.arange(len(poses)), best]
        climbed[:, 2] = wrap_array(climbed[:, 2])
        return climbed


def _nearness(meters: Float32) -> Levels:
    fitting = np.exp(np.square(np.minimum(meters, np.float32(FAR))) / (-2 * WIDTH**2))
    levels: Levels = np.round(255 * fitting).astype(np.uint8)
    return levels


def _pooled(levels: Levels, each: int) -> Levels:
    """The greatest of every `each` x `each` cells."""
    rows, columns = (-(-size // each) for size in levels.shape)
    padded = np.pad(levels, ((0, rows * each - levels.shape[0]), (0, columns * each - levels.shape[1])))
    pooled: Levels = padded.reshape(rows, each, columns, each).max(axis=(1, 3))
    return pooled


def distinct(poses: Array, scores: Array, most: int) -> tuple[Array, Array]:
    """The best of `poses` (n, 3) that are APART, best first, at most `most` of them, and their scores."""
    order = np.argsort(-scores, kind="stable")
    left = poses[order]
    kept: list[int] = []
    while len(order) and len(kept) < most:
        kept.append(int(order[0]))
        off = np.abs(left - left[0])
        off[:, 2] = np.abs(wrap_array(off[:, 2]))
        other = (np.hypot(off[:, 0], off[:, 1]) > APART[0]) | (off[:, 2] > APART[1])
        order, left = order[other], left[other]
    chosen = np.array(kept, dtype=np.int64)
    return poses[chosen], scores[chosen]
