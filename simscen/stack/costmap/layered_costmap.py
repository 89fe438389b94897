"""A costmap: static map below, live obstacles above, inflated, updated where something changed."""

import math
from collections import deque
from dataclasses import replace
from functools import cached_property

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.environment.costmap_filters import Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.distance_transform import MAX_REACH_CELLS, SquaredDistanceTransform
from simscen.stack.costmap.grid_frame import (
    CellIndices,
    Cells,
    GridFrame,
    clip_goal,
    shift_layer,
    should_roll,
    window_around,
)
from simscen.stack.costmap.inflation_layer import Costs, Inflation, inflation, squared_distances
from simscen.stack.costmap.obstacle_layer import (
    NO_CELLS,
    WHOLE_GRID,
    ObstacleLayer,
    Window,
    crossed_cells,
    remove_small_groups,
)
from simscen.stack.costmap.static_layer import (
    Mask,
    StaticLayer,
    empty_layer,
    free_layer,
    static_distances,
    static_layer,
)
from simscen.stack.localizers.beams import Plane
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES
from simscen.stack.protocols import CostmapView, RobotModel, Surroundings

DISTANCE_MARGIN_M = 0.5
"""Margin beyond the hull up to which distances are computed; the inflation radius if that is larger."""
SCANS_PER_UNKNOWN_UPDATE = 5
"""Every which scan is asked what unknown cells it shows to be free: once a second at the default rate, Nav2's own for
the global costmap. Nothing that drives waits for it, and of a map's outside there are many."""
KEPT_REVISIONS = 16
"""The newest revisions of which it is known what changed."""


class LayeredCostmap:
    """Keeps costs and distances up to date; `view` shows them.

    The distance field of the static map is computed once. A scan changes few cells, so distances to live obstacles
    are computed again only around those. For that to suffice, distances end at a reach of the inflation radius, or
    half a meter beyond the hull: farther away than that, nothing asks how far.

    Where there is no map it is a window that rolls with the robot, `size` meters along x and y. It lives in the frame
    in which it is told where the robot is: that of the map, or odom.
    """

    def __init__(
        self,
        spec: CostmapSpec,
        surroundings: Surroundings,
        size: tuple[float, float] | None = None,
        no_farther: float = math.inf,
    ) -> None:
        self._spec, self._surroundings, self._tracks = spec, surroundings, spec.track_unknown_space
        self._rolling = surroundings.map is None
        self._size, self._no_farther = size or (spec.rolling_size, spec.rolling_size), no_farther
        self._inscribed = surroundings.robot.inscribed_radius
        resolution = spec.resolution if surroundings.map is None else surroundings.map.resolution
        self._inflation = _inflation(spec, surroundings.robot, resolution)
        self._margin = _cells(_reach(spec, surroundings.robot), resolution)
        self._speck = spec.denoise_layer.minimal_group_size if spec.denoise_layer.enabled else 0
        self._revision, self._zoned, self._scans = 0, 0, 0
        self._newest: dict[str, tuple[Pose2, Scan | Image]] = {}
        self._view: CostmapView | None = None
        self._changed: tuple[tuple[int, int], tuple[int, int]] | None = None
        self._changes = deque[CellIndices | None](maxlen=KEPT_REVISIONS)
        self.moving = NO_MOVING_OBSTACLES
        """Moving obstacles in the frame of the costmap, included in the view."""
        layer = self._layer(Pose2(0.0, 0.0))
        self._frame: GridFrame = layer.frame
        self._live = ObstacleLayer(spec, self._inscribed, layer.frame)
        self._lay(layer)
        self._unknown = layer.unknown.copy()
        grid = None if self._forbidding else surroundings.map
        self._show(None if grid is None else _costs(grid, self._inflation, self._margin, self._tracks).copy())

    @property
    def view(self) -> CostmapView:
        """The costmap now. Its arrays are windows on this costmap and valid until the next update.

        What updates have changed is computed here, once for all of them that nobody looked at.
        """
        if self._changed is not None:
            self.refresh(*self._changed)
        view, revision = self._view, self._revision
        if view is None or view.revision != revision or view.moving is not self.moving:
            frame, radius, moving = self._frame, self._spec.inflation_radius, self.moving
            view = CostmapView(self._costs, self._distance, frame.resolution, frame.origin, revision, radius, moving)
            self._view = view
        return view

    @property
    def revision(self) -> int:
        """Another one after each update that changed something."""
        return self._revision

    def changed_near(self, revision: int, places: Plane, meters: float) -> bool:
        """Return whether obstacles may have changed within so many meters of a position since that revision.

        `places` are x + iy (n,). Where it says no, the view need not be looked at for how far obstacles are from these.
        """
        since = self._revision - revision
        if since > len(self._changes):
            return True
        changes = list(self._changes)[len(self._changes) - since :]
        reach = meters + (1 + self._speck) * math.sqrt(2.0) * self._frame.resolution  # of cells, told by their middles
        for cells in changes:
            if cells is None or (np.abs(self._frame.points(cells)[:, None] - places) <= reach).any():
                return True
        return False

    @property
    def obstacle_cells(self) -> int:
        """How many cells are marked as live obstacles, or were forbidden since the start."""
        return self._live.count + self._zoned

    def update(self, base: Pose2, seen: Scan | Image) -> None:
        """Clear what a sensor sees through, then mark what it sees, from the robot at `base`."""
        if self._rolling and should_roll(self._frame, base, self._no_farther):
            self._roll(base)
        self._newest[seen.sensor] = (base, seen)
        if isinstance(seen, Image):
            self._touch_cells(self._live.on_image(base, seen, self._static_squared))
            return
        changed = self._live.on_scan(base, seen, self._static_squared if self._walled else None)
        if len(changed):
            self._touch(*(self._whole if self._small else self._frame.extent(changed)), changed)
        if self._tracks:
            self._learn(base, seen)

    def clear(self, clip_goal: float = math.inf, unseen: float = DISTANCE_MARGIN_M) -> None:
        """Forget every live obstacle `within` so many meters of the robot along x and y, but those that it sees now.

        Nav2's ClearEntireCostmap, or ClearCostmapAroundRobot. What is `unseen`, where no lidar looks, so many meters
        beyond the hull at most, is kept: that nobody sees it does not tell that it has gone, and the next thing a robot
        does may be to back up.
        """
        newest = list(self._newest.values())
        scans = [(base, seen) for base, seen in newest if isinstance(seen, Scan)]
        blind = self._surroundings.robot.circumscribed_radius + unseen
        kept = self._live.out_of_view(scans[-1][0], blind, scans) if scans else None
        if newest and math.isfinite(clip_goal):
            self._live.forget_around(newest[-1][0], clip_goal)
        else:
            self._live.forget(self._frame)
        if kept is not None:
            self._live.mark(kept)
        self._show()
        for base, seen in newest:
            self.update(base, seen)

    def set_zones(self, zones: Zones) -> None:
        """Keep out of these from now on, and of no others."""
        before = self._forbidden()
        self._surroundings = replace(self._surroundings, keepout=zones.keepout, masks=zones.masks)
        self._lay(self._layer_in(self._frame))
        self._zoned += self._forbidden() - before
        self._show()

    def _forbidden(self) -> int:
        return int(np.count_nonzero(self._static_squared == 0))

    def fits_static(self, pose: Pose2, tolerance: float) -> bool:
        """Return whether the pose is off mapped walls and the inscribed circle fits within the tolerance."""
        here = self._frame.cell(pose.x, pose.y)
        if self._static_squared[here] == 0:
            return False
        near = self._frame.window(here, here, math.ceil(tolerance / self._frame.resolution))
        fits = self._inflation.meters.take(self._static_squared[near]) > self._inscribed
        points = self._frame.centers(np.argwhere(fits) + np.array((near[0].start, near[1].start)))
        return bool((np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y) <= tolerance).any())

    def aim(self, start: Pose2, goal: Pose2) -> Pose2:
        """Return the goal, or if it is beyond a rolling window, the nearest point to it inside."""
        return clip_goal(self._frame, start, goal) if self._rolling else goal

    def _roll(self, base: Pose2) -> None:
        """Follow the robot; what is new in the window is unknown, where that is tracked."""
        before, window = self._frame, window_around(base, self._size, self._spec.resolution)
        if self._forbidding:
            self._lay(self._layer_in(window))
        self._frame = window  # where nothing is forbidden, the cells of one window are those of any other
        self._live.roll(window)
        if self._tracks:
            self._unknown = shift_layer(self._unknown, before, window, True)
        self._touch(*self._whole)

    def _layer(self, center: Pose2) -> StaticLayer:
        return self._layer_in(window_around(center, self._size, self._spec.resolution))

    def _layer_in(self, window: GridFrame) -> StaticLayer:
        """Return the static layer in this window, or on the map if there is one."""
        grid, keepout, mask = self._surroundings.map, self._surroundings.keepout, self._surroundings.masks.keepout
        unknown = self._tracks
        if grid is None:
            return empty_layer(window, keepout, mask, unknown)
        if not self._forbidding:
            return free_layer(grid, unknown)
        return static_layer(grid, keepout, mask, unknown)

    @property
    def _forbidding(self) -> bool:
        """Whether keepout zones or a keepout mask apply."""
        return bool(self._surroundings.keepout) or self._surroundings.masks.keepout is not None

    def _lay(self, layer: StaticLayer) -> None:
        self._frame = layer.frame
        rows, columns = layer.frame.shape
        self._whole = (0, 0), (rows - 1, columns - 1)
        # Who looks for what has changed in such a window finds that most of it is near that.
        self._small = max(rows, columns) <= 4 * self._margin and self._margin <= MAX_REACH_CELLS
        grid = None if self._forbidding else self._surroundings.map
        if grid is None:
            self._static_squared = squared_distances(layer.lethal, self._margin)
        else:
            self._static_squared = static_distances(grid, self._margin)
        self._walled = bool(layer.lethal.any())

    def _show(self, costs: Costs | None = None) -> None:
        """Compute everything again, but for `costs` that are known."""
        if costs is None:
            costs = self._inflation.costs(self._static_squared, self._unknown if self._tracks else None)
        self._costs = costs
        self._distance = self._inflation.meters.take(self._static_squared)
        self._note(None)
        self._changed = None
        if len(marked := self._live.cells):
            self._touch(*self._frame.extent(marked))

    def _obstacles(self, window: Window) -> Mask:
        """Live obstacles in a window, without specks where they are noise."""
        marked = self._live.marked(window)
        if not self._speck:
            return marked
        return remove_small_groups(marked, self._static_squared[window] == 0, self._spec.denoise_layer)

    def _learn(self, base: Pose2, scan: Scan) -> None:
        """Unknown cells that the beams pass through are known from now on."""
        self._scans += 1
        if self._scans % SCANS_PER_UNKNOWN_UPDATE != 1:
            return
        frame = self._frame
        around = self._live.around(base, math.hypot(scan.mount.x, scan.mount.y))
        cells = frame.within(around, np.flatnonzero(self._unknown[around]))
        if not len(cells):
            return
        passed, _ = crossed_cells(frame.points(cells), frame.resolution, scan, base, self._spec)
        cells = cells[passed]
        if len(cells):
            self._unknown[np.divmod(cells, frame.shape[1])] = False
            self._touch(*frame.extent(cells), NO_CELLS)

    def _touch_cells(self, cells: Cells) -> None:
        """Mark these cells (n, 2) as changed."""
        if len(cells):
            (top, left), (bottom, right) = cells.min(axis=0).tolist(), cells.max(axis=0).tolist()
            self._touch((top, left), (bottom, right))

    def _touch(self, low: tuple[int, int], high: tuple[int, int], which: CellIndices | None = None) -> None:
        """Cells from `low` to `high` have changed: obstacles came to, or went from, these at most, if that is known."""
        if self._changed is not None:
            before_low, before_high = self._changed
            low = min(low[0], before_low[0]), min(low[1], before_low[1])
            high = max(high[0], before_high[0]), max(high[1], before_high[1])
        self._changed = low, high
        self._note(which)

    def _note(self, which: CellIndices | None) -> None:
        """Another revision, in which obstacles came to or went from these cells, or anywhere."""
        self._revision += 1
        self._changes.append(which)

    def refresh(self, low: tuple[int, int], high: tuple[int, int]) -> None:
        """Compute distances and costs again wherever one of the cells from `low` to `high` can matter."""
        self._changed = None
        if (low, high) == self._whole:
            self._refresh_all()
            return
        inner = self._frame.window(low, high, self._margin + self._speck)
        outer = self._frame.window(low, high, 2 * (self._margin + self._speck))
        part = (
            slice(inner[0].start - outer[0].start, inner[0].stop - outer[0].start),
            slice(inner[1].start - outer[1].start, inner[1].stop - outer[1].start),
        )
        squared = squared_distances(self._obstacles(outer), self._margin)[part]
        if self._walled:
            squared = np.minimum(self._static_squared[inner], squared)
        self._distance[inner] = self._inflation.meters.take(squared)
        self._costs[inner] = self._inflation.costs(squared, self._unknown[inner] if self._tracks else None)

    @cached_property
    def _around(self) -> SquaredDistanceTransform:
        """Distance transform for small windows."""
        return SquaredDistanceTransform(self._frame.shape, self._margin)

    def _refresh_all(self) -> None:
        """Compute the distances and costs of all cells again."""
        obstacles = self._obstacles(WHOLE_GRID)
        squared = self._around.of(obstacles) if self._small else squared_distances(obstacles, self._margin)
        if self._walled:
            squared = np.minimum(self._static_squared, squared)
        places = squared.astype(np.intp)  # once, for both look-ups
        self._distance = self._inflation.meters.take(places)
        self._costs = self._inflation.costs(places, self._unknown if self._tracks else None)


def _reach(spec: CostmapSpec, robot: RobotModel) -> float:
    """Return the largest distance from obstacles that is computed, in m."""
    return max(spec.inflation_radius, robot.circumscribed_radius + DISTANCE_MARGIN_M)


def ready(spec: CostmapSpec, robot: RobotModel, grid: OccupancyGrid) -> None:
    """Work out now what a robot's costmap needs to know of its map, as long as nothing is forbidden there."""
    tables, margin = _inflation(spec, robot, grid.resolution), _cells(_reach(spec, robot), grid.resolution)
    _costs(grid, tables, margin, spec.track_unknown_space)


@cached_on_instance
def _costs(grid: OccupancyGrid, tables: Inflation, margin: int, tracks: bool) -> Costs:
    """Return the costs of the cells of a map without zones and readings, computed once for all runs."""
    return tables.costs(static_distances(grid, margin), free_layer(grid, tracks).unknown if tracks else None)


def _inflation(spec: CostmapSpec, robot: RobotModel, resolution: float) -> Inflation:
    inscribed, reach = robot.inscribed_radius, _reach(spec, robot)
    return inflation(resolution, inscribed, spec.inflation_radius, spec.cost_scaling_factor, reach)


def _cells(reach: float, resolution: float) -> int:
    return max(2, math.ceil(reach / resolution))  # coarse cells beside a wall still know it
