"""The costmap of a robot: static map below, live obstacles above, inflated, updated where something changed."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.core.sensing import Scan
from simscen.model.stack import Costmap as CostmapSpec
from simscen.stack.costmap.frame import Cells, Frame
from simscen.stack.costmap.inflation_layer import FAR, Inflation, squared_distances
from simscen.stack.costmap.obstacle_layer import crossed, hits
from simscen.stack.costmap.static_layer import StaticLayer, empty_layer, static_layer
from simscen.stack.protocols import CostmapView, Surroundings

BESIDE_A_WALL = 2
"""Hits within one cell (squared distance 2) of a mapped wall are the wall itself: marking them would tell nothing."""
LIDAR_OFFSET = 1.0
"""Metres: no lidar is mounted farther from its robot's base."""
EDGE = 0.6
"""Metres inside a rolling window's edge where a goal beyond it is aimed at."""


class Costmap:
    """Keeps costs and distances up to date; `view` shows them.

    The distance field of the static map is computed once. A scan changes few cells, so distances to live obstacles
    are computed again only around those. For that to suffice, distances end at a `reach` of the inflation radius, or
    half a metre beyond the hull: farther away than that, nothing asks how far.
    """

    def __init__(self, spec: CostmapSpec, surroundings: Surroundings) -> None:
        self._spec, self._surroundings = spec, surroundings
        self._robot = surroundings.robot
        self._inscribed = surroundings.robot.inscribed_radius
        self._rolling = surroundings.map is None
        layer = self._layer(Pose2(0.0, 0.0))
        resolution = layer.frame.resolution
        reach = max(spec.inflation_radius, self._robot.circumscribed_radius + 0.5)
        self._inflation = Inflation(resolution, self._inscribed, spec.inflation_radius, spec.cost_scaling_factor, reach)
        self._margin = math.ceil(reach / resolution)
        self._revision = 0
        self._newest: dict[str, tuple[Pose2, Scan]] = {}
        self._install(layer, np.zeros(layer.frame.shape, dtype=bool))

    @property
    def view(self) -> CostmapView:
        """The costmap now. Its arrays are windows on this costmap and valid until the next update."""
        return CostmapView(self._costs, self._distance, self._frame.resolution, self._frame.origin, self._revision)

    @property
    def static(self) -> StaticLayer:
        """What never changes."""
        return self._layer_now

    @property
    def obstacle_cells(self) -> int:
        """How many cells are marked as live obstacles."""
        return int(np.count_nonzero(self._live))

    def update(self, base: Pose2, scan: Scan) -> None:
        """Clear what the beams pass through, then mark what they hit, seen from the robot at `base`."""
        if self._rolling:
            self._follow(base)
        around = self._around(base)
        corner = np.array((around[0].start, around[1].start))
        live = self._live[around]
        seen = np.argwhere(live) + corner
        before = live.copy()
        gone = seen[crossed(seen, self._frame, scan, base, self._spec)]
        self._live[gone[:, 0], gone[:, 1]] = False
        marked = self._marks(base, scan)
        self._live[marked[:, 0], marked[:, 1]] = True
        under = seen[self._under_footprint(seen, base)]
        self._live[under[:, 0], under[:, 1]] = False
        changed = np.argwhere(before != live) + corner
        self._newest[scan.sensor] = (base, scan)
        self._refresh(changed)

    def clear(self) -> None:
        """Forget every live obstacle but those that the newest scans show."""
        self._install(self._layer_now, np.zeros(self._frame.shape, dtype=bool))
        for base, scan in list(self._newest.values()):
            self.update(base, scan)

    def fits_static(self, pose: Pose2, tolerance: float) -> bool:
        """Whether the pose is off the walls of the map and the robot's inscribed circle fits somewhere so near it."""
        row, column = self._frame.cells(np.array([[pose.x, pose.y]]))[0].tolist()
        if self._static_squared[row, column] == 0:
            return False
        near = self._frame.window((row, column), (row, column), math.ceil(tolerance / self._frame.resolution))
        fits = self._inflation.metres[self._static_squared[near]] > self._inscribed
        points = self._frame.centres(np.argwhere(fits) + np.array((near[0].start, near[1].start)))
        return bool((np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y) <= tolerance).any())

    def clipped(self, start: Pose2, goal: Pose2) -> Pose2:
        """The goal; or, when it is beyond a rolling window, the point of the straight way to it just inside."""
        size = self._frame.shape[0] * self._frame.resolution
        if not self._rolling or self._frame.covers(goal.x, goal.y):
            return goal
        part = 1.0
        for along, low, here in (
            (goal.x - start.x, self._frame.origin[0], start.x),
            (goal.y - start.y, self._frame.origin[1], start.y),
        ):
            edge = low + size - EDGE if along > 0 else low + EDGE
            if along != 0.0:
                part = min(part, (edge - here) / along)
        part = max(part, 0.0)
        x, y = start.x + part * (goal.x - start.x), start.y + part * (goal.y - start.y)
        return Pose2(x, y, math.atan2(goal.y - start.y, goal.x - start.x))

    def _layer(self, centre: Pose2) -> StaticLayer:
        grid = self._surroundings.map
        if grid is not None:
            return static_layer(grid, self._surroundings.keepout)
        resolution = self._spec.resolution
        cells = math.ceil(self._spec.rolling_size / resolution)
        column, row = round(centre.x / resolution) - cells // 2, round(centre.y / resolution) - cells // 2
        frame = Frame((column * resolution, row * resolution), resolution, (cells, cells))
        return empty_layer(frame, self._surroundings.keepout)

    def _install(self, layer: StaticLayer, live: npt.NDArray[np.bool_]) -> None:
        self._layer_now, self._frame, self._live = layer, layer.frame, live
        self._static_squared = squared_distances(layer.lethal)
        squared = np.minimum(self._static_squared, squared_distances(live))
        self._costs = self._inflation.costs(squared, layer.unknown)
        self._distance = self._inflation.metres[squared]
        self._revision += 1

    def _follow(self, base: Pose2) -> None:
        """Shift the rolling window when the robot has come an eighth of its size away from the middle."""
        size = self._frame.shape[1] * self._frame.resolution
        middle = (self._frame.origin[0] + size / 2, self._frame.origin[1] + size / 2)
        if max(abs(base.x - middle[0]), abs(base.y - middle[1])) < size / 8:
            return
        layer = self._layer(base)
        live = np.zeros(layer.frame.shape, dtype=bool)
        kept = np.argwhere(self._live)
        moved = layer.frame.cells(self._frame.centres(kept))
        moved = moved[layer.frame.inside(moved)]
        live[moved[:, 0], moved[:, 1]] = True
        self._install(layer, live)

    def _around(self, base: Pose2) -> tuple[slice, slice]:
        row, column = self._frame.cells(np.array([[base.x, base.y]]))[0].tolist()
        far = max(self._spec.raytrace_max_range, self._spec.obstacle_max_range) + LIDAR_OFFSET
        return self._frame.window((row, column), (row, column), math.ceil(far / self._frame.resolution))

    def _under_footprint(self, cells: Cells, base: Pose2) -> npt.NDArray[np.bool_]:
        offset = self._frame.centres(cells) - np.array([base.x, base.y])
        inside: npt.NDArray[np.bool_] = np.hypot(offset[:, 0], offset[:, 1]) < self._inscribed
        return inside

    def _marks(self, base: Pose2, scan: Scan) -> Cells:
        points = hits(scan, base, self._spec.obstacle_min_range, self._spec.obstacle_max_range)
        cells = self._frame.cells(points)
        cells = cells[self._frame.inside(cells)]
        return cells[self._static_squared[cells[:, 0], cells[:, 1]] > BESIDE_A_WALL]

    def _refresh(self, changed: Cells) -> None:
        """Compute distances and costs again wherever one of the changed cells can matter."""
        if not len(changed):
            return
        low, high = changed.min(axis=0).tolist(), changed.max(axis=0).tolist()
        inner = self._frame.window((low[0], low[1]), (high[0], high[1]), self._margin)
        outer = self._frame.window((low[0], low[1]), (high[0], high[1]), 2 * self._margin)
        near = squared_distances(self._live[outer])
        near[near > self._margin * self._margin] = FAR
        part = (
            slice(inner[0].start - outer[0].start, inner[0].stop - outer[0].start),
            slice(inner[1].start - outer[1].start, inner[1].stop - outer[1].start),
        )
        squared = np.minimum(self._static_squared[inner], near[part])
        self._distance[inner] = self._inflation.metres[squared]
        self._costs[inner] = self._inflation.costs(squared, self._layer_now.unknown[inner])
        self._revision += 1
