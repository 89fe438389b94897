"""A costmap: static map below, live obstacles above, inflated, updated where something changed."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.core.sensing import Scan
from simscen.core.zones import Zones
from simscen.model.stack import Costmap as CostmapSpec
from simscen.stack.costmap.frame import Cells, Frame
from simscen.stack.costmap.inflation_layer import FAR, Inflation, squared_distances
from simscen.stack.costmap.obstacle_layer import crossed, hits
from simscen.stack.costmap.rolling import carried_over, left_behind, window_around, within
from simscen.stack.costmap.static_layer import StaticLayer, empty_layer, static_layer
from simscen.stack.protocols import CostmapView, Surroundings

BESIDE_A_WALL = 2
"""Hits within one cell (squared distance 2) of a mapped wall are the wall itself: marking them would tell nothing."""
BEYOND_HULL = 0.5
"""Metres beyond the hull up to which distances are told, or the inflation radius if that is more."""


class Costmap:
    """Keeps costs and distances up to date; `view` shows them.

    The distance field of the static map is computed once. A scan changes few cells, so distances to live obstacles
    are computed again only around those. For that to suffice, distances end at a reach of the inflation radius, or
    half a metre beyond the hull: farther away than that, nothing asks how far.

    Where there is no map it is a window that rolls with the robot, `size` metres along x and y. It lives in the frame
    in which it is told where the robot is: that of the map, or odom.
    """

    def __init__(
        self,
        spec: CostmapSpec,
        surroundings: Surroundings,
        size: tuple[float, float] | None = None,
        no_farther: float = math.inf,
    ) -> None:
        self._spec, self._surroundings = spec, surroundings
        self._rolling = surroundings.map is None
        self._size, self._no_farther = size or (spec.rolling_size, spec.rolling_size), no_farther
        self._inscribed = surroundings.robot.inscribed_radius
        resolution = spec.resolution if surroundings.map is None else surroundings.map.resolution
        reach = max(spec.inflation_radius, surroundings.robot.circumscribed_radius + BEYOND_HULL)
        scaling = spec.cost_scaling_factor
        self._inflation = Inflation(resolution, self._inscribed, spec.inflation_radius, scaling, reach)
        self._margin = math.ceil(reach / resolution)
        self._revision = 0
        self._zoned = 0
        self._newest: dict[str, tuple[Pose2, Scan]] = {}
        self._lay(self._layer(Pose2(0.0, 0.0)))
        self._show(np.zeros(self._frame.shape, dtype=bool))

    @property
    def view(self) -> CostmapView:
        """The costmap now. Its arrays are windows on this costmap and valid until the next update."""
        return CostmapView(self._costs, self._distance, self._frame.resolution, self._frame.origin, self._revision)

    @property
    def obstacle_cells(self) -> int:
        """How many cells are marked as live obstacles, or were forbidden since the start."""
        return int(np.count_nonzero(self._live)) + self._zoned

    def update(self, base: Pose2, scan: Scan) -> None:
        """Clear what the beams pass through, then mark what they hit, seen from the robot at `base`."""
        if self._rolling and left_behind(self._frame, base, self._no_farther):
            before = self._frame
            self._lay(self._layer(base))
            self._show(carried_over(self._live, before, self._frame))
        around = self._around(base, scan)
        corner = np.array((around[0].start, around[1].start))
        live = self._live[around]
        was = live.copy()
        marked = np.argwhere(live) + corner
        if len(marked):
            self._set(marked[crossed(marked, self._frame, scan, base, self._spec)], False)
        self._set(self._hit(base, scan), True)
        if len(marked):
            self._set(marked[self._under_robot(marked, base)], False)
        self._newest[scan.sensor] = (base, scan)
        self._refresh(np.argwhere(was != live) + corner)

    def clear(self) -> None:
        """Forget every live obstacle but those that the newest scans show."""
        self._show(np.zeros(self._frame.shape, dtype=bool))
        for base, scan in list(self._newest.values()):
            self.update(base, scan)

    def set_zones(self, zones: Zones) -> None:
        """Keep out of these from now on, and of no others."""
        before = self._forbidden()
        self._surroundings = replace(self._surroundings, keepout=zones.keepout, masks=zones.masks)
        self._lay(self._layer_in(self._frame))
        self._zoned += self._forbidden() - before
        self._show(self._live)

    def _forbidden(self) -> int:
        return int(np.count_nonzero(self._static_squared == 0))

    def fits_static(self, pose: Pose2, tolerance: float) -> bool:
        """Whether the pose is off the walls of the map and the robot's inscribed circle fits somewhere so near it."""
        row, column = self._frame.cells(np.array([[pose.x, pose.y]]))[0].tolist()
        if self._static_squared[row, column] == 0:
            return False
        near = self._frame.window((row, column), (row, column), math.ceil(tolerance / self._frame.resolution))
        fits = self._inflation.metres[self._static_squared[near]] > self._inscribed
        points = self._frame.centres(np.argwhere(fits) + np.array((near[0].start, near[1].start)))
        return bool((np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y) <= tolerance).any())

    def aim(self, start: Pose2, goal: Pose2) -> Pose2:
        """Where to plan to: the goal, or when it is beyond a rolling window the nearest point to it inside."""
        return within(self._frame, start, goal) if self._rolling else goal

    def _layer(self, centre: Pose2) -> StaticLayer:
        return self._layer_in(window_around(centre, self._size, self._spec.resolution))

    def _layer_in(self, window: Frame) -> StaticLayer:
        """What never changes but by an order; in this window, where there is no map."""
        grid, keepout, mask = self._surroundings.map, self._surroundings.keepout, self._surroundings.masks.keepout
        return empty_layer(window, keepout, mask) if grid is None else static_layer(grid, keepout, mask)

    def _lay(self, layer: StaticLayer) -> None:
        self._frame, self._unknown = layer.frame, layer.unknown
        self._static_squared = squared_distances(layer.lethal)

    def _show(self, live: npt.NDArray[np.bool_]) -> None:
        """Take these live obstacles and compute everything again."""
        self._live = live
        squared = np.minimum(self._static_squared, squared_distances(live))
        self._costs = self._inflation.costs(squared, self._unknown)
        self._distance = self._inflation.metres[squared]
        self._revision += 1

    def _set(self, cells: Cells, marked: bool) -> None:
        self._live[cells[:, 0], cells[:, 1]] = marked

    def _around(self, base: Pose2, scan: Scan) -> tuple[slice, slice]:
        """The cells that the scan can reach."""
        row, column = self._frame.cells(np.array([[base.x, base.y]]))[0].tolist()
        far = max(self._spec.raytrace_max_range, self._spec.obstacle_max_range) + math.hypot(scan.mount.x, scan.mount.y)
        return self._frame.window((row, column), (row, column), math.ceil(far / self._frame.resolution) + 1)

    def _under_robot(self, cells: Cells, base: Pose2) -> npt.NDArray[np.bool_]:
        """Nav2's footprint_clearing_enabled, for the inscribed circle."""
        offset = self._frame.centres(cells) - np.array([base.x, base.y])
        return np.asarray(np.hypot(offset[:, 0], offset[:, 1]) < self._inscribed)

    def _hit(self, base: Pose2, scan: Scan) -> Cells:
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
        self._costs[inner] = self._inflation.costs(squared, self._unknown[inner])
        self._revision += 1
