"""Cost per meter of path on a costmap, as Nav2's planners count it."""

import copy
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.costmap.distance_transform import squared_distances_within
from simscen.stack.protocols import CostmapView, RobotModel

MAX_NON_OBSTACLE, NO_INFORMATION = 252, 255
UNKNOWN_COSTS = 253
"""nav2_navfn_planner: what is not known costs as much as what is barely free."""
NO_ROTATION_COST_FACTOR = 4.0
"""Times that a meter costs more where a hull with corners fits, but could not turn in place: it may get stuck there."""
EXEMPT_RADIUS_M = 0.5
"""Half side of the square around start and goal in which a plan may have less clearance than elsewhere."""
SAMPLE_SPACING_CELLS = 0.67
"""Cells between two looks at what a path leads over."""
SAMPLE_SPACING_RATIO = 0.4
"""Of the inscribed radius: between two looks at a motion of a search. Each obstacle blocks at least a disc of that
radius, and between two looks no line comes deeper into one than 2 % of it."""


class TraversalCosts:
    """Costs of a meter on a costmap: 1 where it is free, 1 + `multiplier` beside obstacles, inf where none can be.

    That is nav2_smac_planner's count, 1 + cost_travel_multiplier · cost / 252, taken along the way instead of from cell
    to cell. A robot can be where its inscribed circle is (and where it is known, if `allow_unknown` is false).
    """

    def __init__(self, costmap: CostmapView, robot: RobotModel, multiplier: float, allow_unknown: bool) -> None:
        self.costmap, self.inscribed = costmap, robot.inscribed_radius
        self.height, self.width = costmap.costs.shape
        self.resolution, self.origin = costmap.resolution, costmap.origin
        counted = np.minimum(np.arange(256), UNKNOWN_COSTS) / MAX_NON_OBSTACLE
        table = (1.0 + multiplier * counted).astype(np.float32)
        if not allow_unknown:
            table[NO_INFORMATION] = np.inf
        rates = table[costmap.costs]
        if robot.circumscribed_radius > robot.inscribed_radius:
            rates[costmap.distance <= np.float32(robot.circumscribed_radius)] *= np.float32(NO_ROTATION_COST_FACTOR)
        rates[costmap.distance <= np.float32(robot.inscribed_radius)] = np.inf
        self.rates: npt.NDArray[np.float32] = rates
        self._per_meter = 1.0 / costmap.resolution
        self._look = _padded_view(rates)
        coarse = SAMPLE_SPACING_RATIO * robot.inscribed_radius if allow_unknown else 0.0  # a single cell may be unknown
        self.stride = max(SAMPLE_SPACING_CELLS * costmap.resolution, coarse)
        self.kept: dict[object, Any] = {}
        """Cached results derived from these costs, reused by the next plan if the costs have not changed."""
        self._asked: tuple[float, float, float, float] | None = None
        self._answer = 0.0

    def without_narrow_gaps(self, clearance: float, exempt: Sequence[tuple[float, float]]) -> "TraversalCosts":
        """Return these costs with all gaps blocked in which the robot has less than `clearance` m on each side.

        A cell is part of such a gap if no cell within `clearance` has more clearance. Cells near one of the `exempt`
        points keep their costs.
        """
        reach = math.ceil(clearance * self._per_meter)
        wide = self.costmap.distance > np.float32(self.inscribed + clearance)
        narrow = squared_distances_within(wide, reach) > reach * reach
        side = math.ceil(EXEMPT_RADIUS_M * self._per_meter)
        for point in exempt:
            row, column = self.cell(point)
            narrow[max(0, row - side) : row + side + 1, max(0, column - side) : column + side + 1] = False
        costs = copy.copy(self)
        costs.rates = np.where(narrow, np.float32(np.inf), self.rates)
        costs._look, costs.kept, costs._asked = _padded_view(costs.rates), {}, None
        return costs

    def after(self, before: "TraversalCosts | None") -> "TraversalCosts":
        """Return these costs; if they equal those of the last plan, with the values cached for it."""
        if before is not None and np.array_equal(before.rates, self.rates):
            self.kept = before.kept
        return self

    @property
    def free(self) -> npt.NDArray[np.bool_]:
        """Cells (height, width) where the robot can be."""
        return np.isfinite(self.rates)

    def cell(self, point: tuple[float, float]) -> tuple[int, int]:
        """Return the row and column of a point, which may be off the map."""
        x, y = (point[0] - self.origin[0]) / self.resolution, (point[1] - self.origin[1]) / self.resolution
        return math.floor(y), math.floor(x)

    def at(self, points: Array) -> npt.NDArray[np.float32]:
        """Costs of a meter (…,) at points (…, 2); inf off the map."""
        across = (points[..., 0] - self.origin[0]) * self._per_meter
        up = (points[..., 1] - self.origin[1]) * self._per_meter
        outside = (up < 0) | (across < 0) | (up >= self.height) | (across >= self.width)
        columns = np.clip(across, 0, self.width - 1).astype(np.int32)
        rates = self.rates[np.clip(up, 0, self.height - 1).astype(np.int32), columns]
        rates[outside] = np.inf
        return rates

    def between(self, ax: float, ay: float, bx: float, by: float) -> float:
        """Return the cost of the straight motion from a to b, both on the map; inf if it is blocked.

        OMPL asks for cost and validity of a motion one after the other: the second answer is the first.
        """
        asked = (ax, ay, bx, by)
        if asked == self._asked:
            return self._answer
        dx, dy = bx - ax, by - ay
        length = math.sqrt(dx * dx + dy * dy)
        per_meter, look, width = self._per_meter, self._look, self.width
        u, v = (ax - self.origin[0]) * per_meter, (ay - self.origin[1]) * per_meter
        du, dv = dx * per_meter, dy * per_meter
        total: float = look[int(v + 0.5 * dv) * width + int(u + 0.5 * du)]
        if total < math.inf:
            count = int(length / self.stride) + 1
            du, dv = du / count, dv / count
            u, v = u + 0.5 * du, v + 0.5 * dv
            total = 0.0
            for _ in range(count):
                total += look[int(v) * width + int(u)]
                u += du
                v += dv
            total *= length / count
        self._asked, self._answer = asked, total
        return total

    def along(self, points: Array) -> float:
        """Return the cost of a polyline (n, 2); inf if it is blocked."""
        steps = np.diff(points, axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        counts = np.ceil(lengths * self._per_meter / SAMPLE_SPACING_CELLS).astype(np.int64)
        which = np.repeat(np.arange(len(steps)), counts)
        number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        part = (number + 0.5) / counts[which]
        rates = self.at(points[which] + part[:, None] * steps[which])
        return float((rates * (lengths / np.maximum(counts, 1))[which]).sum())


def _padded_view(rates: npt.NDArray[np.float32]) -> Any:
    """Return the cells row by row, with inf after the last: indexing a memoryview takes a tenth of numpy's time."""
    padded: Any = np.append(rates.reshape(-1), np.full(rates.shape[1] + 1, np.inf, dtype=np.float32))
    return memoryview(padded)
