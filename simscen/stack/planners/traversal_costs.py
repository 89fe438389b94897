"""Traversal costs on a costmap: costs of cells, motions, and paths for planners, as in Nav2's planners."""

import copy
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.costmap.distance_transform import squared_distances_within
from simscen.stack.protocols import MAX_NON_OBSTACLE, NO_INFORMATION, CostmapView, RobotModel

UNKNOWN_COST = 253
"""Cost of an unknown cell: just above the maximum cost of a free cell (nav2_navfn_planner)."""
NO_ROTATION_COST_FACTOR = 4.0
"""Factor of the costs of cells in which a robot that is not round cannot turn in place."""
EXEMPT_HALF_SIDE_M = 0.5
"""Half the side length of the squares around start and goal in which narrow gaps are allowed."""
SAMPLE_SPACING_CELLS = 0.67
"""Spacing in cells of cost samples along a path, and minimum spacing along a motion of a search."""
SAMPLE_SPACING_RATIO = 0.4
"""Spacing of cost samples along a motion of a search, relative to the inscribed radius."""


class TraversalCosts:
    """Traversal costs per meter on a costmap, `rates` (height, width): 1 in free space, inf in blocked cells.

    Rates are 1 + `multiplier` · cost / 252, as in nav2_smac_planner, and higher where the robot cannot turn in place.
    A cell is blocked if the inscribed circle of the robot does not fit there. Without `allow_unknown`, an unknown cell
    is blocked as well.
    """

    def __init__(self, costmap: CostmapView, robot: RobotModel, multiplier: float, allow_unknown: bool) -> None:
        self.costmap, self.inscribed = costmap, robot.inscribed_radius
        self.height, self.width = costmap.costs.shape
        self.resolution, self.origin = costmap.resolution, costmap.origin
        relative = np.minimum(np.arange(256), UNKNOWN_COST) / MAX_NON_OBSTACLE
        table = (1.0 + multiplier * relative).astype(np.float32)
        if not allow_unknown:
            table[NO_INFORMATION] = np.inf
        rates = table[costmap.costs]
        if robot.circumscribed_radius > robot.inscribed_radius:
            rates[costmap.distance <= np.float32(robot.circumscribed_radius)] *= np.float32(NO_ROTATION_COST_FACTOR)
        rates[costmap.distance <= np.float32(robot.inscribed_radius)] = np.inf
        self.rates: npt.NDArray[np.float32] = rates
        self._per_meter = 1.0 / costmap.resolution
        self._flat_rates = _padded_view(rates)
        # An obstacle blocks at least a disc of the inscribed radius. In contrast, an unknown cell blocks only itself.
        search_spacing = SAMPLE_SPACING_RATIO * robot.inscribed_radius if allow_unknown else 0.0
        self.stride = max(SAMPLE_SPACING_CELLS * costmap.resolution, search_spacing)
        """Distance in m between two samples of `between`."""
        self.cache: dict[object, Any] = {}
        """Cached results derived from these costs. The next plan uses them if the costs have not changed."""
        self._last_motion: tuple[float, float, float, float] | None = None
        self._last_cost = 0.0

    def without_narrow_gaps(self, clearance: float, exempt: Sequence[tuple[float, float]]) -> "TraversalCosts":
        """Return a copy in which gaps are blocked if a robot in the middle has less than `clearance` m on each side.

        Cells near the `exempt` points (x, y) keep their costs.
        """
        reach = math.ceil(clearance * self._per_meter)
        wide = self.costmap.distance > np.float32(self.inscribed + clearance)
        is_narrow = squared_distances_within(wide, reach) > reach * reach
        half_side = math.ceil(EXEMPT_HALF_SIDE_M * self._per_meter)
        for point in exempt:
            row, column = self.cell(point)
            rows = slice(max(0, row - half_side), row + half_side + 1)
            is_narrow[rows, max(0, column - half_side) : column + half_side + 1] = False
        costs = copy.copy(self)
        costs.rates = np.where(is_narrow, np.float32(np.inf), self.rates)
        costs._flat_rates, costs.cache, costs._last_motion = _padded_view(costs.rates), {}, None
        costs.__dict__.pop("_costly_cells", None)
        return costs

    @cached_property
    def _costly_cells(self) -> Any:
        """Summed-area table (height + 1, width + 1) of cells with a rate other than 1, as a flat memoryview."""
        table = np.zeros((self.height + 1, self.width + 1), dtype=np.int32)
        np.cumsum(self.rates != 1.0, axis=0, out=table[1:, 1:])
        np.cumsum(table, axis=1, out=table)
        flat: Any = table.reshape(-1)
        return memoryview(flat)

    def share_cache(self, previous: "TraversalCosts | None") -> "TraversalCosts":
        """Use the cache of the costs of the previous plan if the costs are equal. Return this object."""
        if previous is not None and np.array_equal(previous.rates, self.rates):
            self.cache = previous.cache
        return self

    @property
    def free(self) -> npt.NDArray[np.bool_]:
        """Mask (height, width) of the cells that are not blocked."""
        return np.isfinite(self.rates)

    def cell(self, point: tuple[float, float]) -> tuple[int, int]:
        """Return the cell (row, column) at a point. The cell may be outside the map."""
        x, y = (point[0] - self.origin[0]) / self.resolution, (point[1] - self.origin[1]) / self.resolution
        return math.floor(y), math.floor(x)

    def at(self, points: Array) -> npt.NDArray[np.float32]:
        """Return the costs per meter (…,) at points (…, 2); inf outside the map."""
        across = (points[..., 0] - self.origin[0]) * self._per_meter
        up = (points[..., 1] - self.origin[1]) * self._per_meter
        outside = (up < 0) | (across < 0) | (up >= self.height) | (across >= self.width)
        columns = np.clip(across, 0, self.width - 1).astype(np.int32)
        rates = self.rates[np.clip(up, 0, self.height - 1).astype(np.int32), columns]
        rates[outside] = np.inf
        return rates

    def between(self, ax: float, ay: float, bx: float, by: float) -> float:
        """Return the cost of the straight motion from (ax, ay) to (bx, by), both on the map; inf if blocked."""
        motion = (ax, ay, bx, by)
        if motion == self._last_motion:  # OMPL asks for cost and validity of a motion one after the other
            return self._last_cost
        dx, dy = bx - ax, by - ay
        length = math.sqrt(dx * dx + dy * dy)
        per_meter, flat_rates, width = self._per_meter, self._flat_rates, self.width
        u, v = (ax - self.origin[0]) * per_meter, (ay - self.origin[1]) * per_meter
        du, dv = dx * per_meter, dy * per_meter
        total: float = flat_rates[int(v + 0.5 * dv) * width + int(u + 0.5 * du)]
        if total < math.inf:
            count = int(length / self.stride) + 1
            if total == 1.0 and self._is_free_box(u, v, u + du, v + dv):
                total = count
            else:
                du, dv = du / count, dv / count
                u, v = u + 0.5 * du, v + 0.5 * dv
                total = 0.0
                for _ in range(count):
                    total += flat_rates[int(v) * width + int(u)]
                    u += du
                    v += dv
            total *= length / count
        self._last_motion, self._last_cost = motion, total
        return total

    def _is_free_box(self, u: float, v: float, end_u: float, end_v: float) -> bool:
        """Return whether all cells between two corners (column, row) cost 1 per meter."""
        table, width = self._costly_cells, self.width + 1
        if u > end_u:
            u, end_u = end_u, u
        if v > end_v:
            v, end_v = end_v, v
        bottom, top, left, right = int(v) * width, (int(end_v) + 1) * width, int(u), int(end_u) + 1
        is_free: bool = table[top + right] - table[top + left] == table[bottom + right] - table[bottom + left]
        return is_free

    def along(self, points: Array) -> float:
        """Return the cost of a polyline (n, 2); inf if it leads through a blocked cell."""
        steps = np.diff(points, axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        counts = np.ceil(lengths * self._per_meter / SAMPLE_SPACING_CELLS).astype(np.int64)
        segment = np.repeat(np.arange(len(steps)), counts)
        number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        fraction = (number + 0.5) / counts[segment]
        rates = self.at(points[segment] + fraction[:, None] * steps[segment])
        return float((rates * (lengths / np.maximum(counts, 1))[segment]).sum())


def _padded_view(rates: npt.NDArray[np.float32]) -> Any:
    """Return the rates as a flat memoryview, padded with inf, for fast indexing."""
    padded: Any = np.append(rates.reshape(-1), np.full(rates.shape[1] + 1, np.inf, dtype=np.float32))
    return memoryview(padded)
