"""Layered costmap: inflates the obstacles of the static layer (map) and of the obstacle layer (sensors)."""

import math
from collections import deque
from dataclasses import replace
from functools import cached_property

import numpy as np

from simscen.core.environment.costmap_filters import Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.distance_transform import SquaredDistanceTransform, squared_distances_within
from simscen.stack.costmap.grid_frame import (
    CellIndices,
    GridFrame,
    Mask,
    clip_goal,
    shift_layer,
    should_roll,
    window_around,
)
from simscen.stack.costmap.inflation import DISTANCE_MARGIN_M, Costs, inflation_for
from simscen.stack.costmap.obstacle_layer import (
    NO_CELLS,
    WHOLE_GRID,
    ObstacleLayer,
    Window,
    crossed_cells,
    remove_small_groups,
)
from simscen.stack.costmap.static_layer import StaticLayer, map_layer, static_layer
from simscen.stack.localizers.beams import ComplexPoints
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES
from simscen.stack.protocols import CostmapView, RobotModel, Surroundings

SCANS_PER_UNKNOWN_UPDATE = 5
"""Unknown cells are updated with every n-th scan: once per second at the default rate."""
MAX_REVISIONS = 16
"""Number of revisions for which the changed cells are stored."""
Cell = tuple[int, int]
"""(row, column)."""


class LayeredCostmap:
    """Costs of cells and distances to the nearest obstacle, available as `view`.

    Updates recompute only the surroundings of changed cells. All poses are in the frame of the costmap: map or odom.
    Live obstacles are the obstacles that sensors have seen.

    Without a map, the costmap is a window of `size` (x, y) in m that rolls with the robot. The window is moved when the
    robot is farther than `max_offset` m from the center of the window.
    """

    def __init__(
        self,
        spec: CostmapSpec,
        surroundings: Surroundings,
        size: tuple[float, float] | None = None,
        max_offset: float = math.inf,
    ) -> None:
        self._spec, self._surroundings = spec, surroundings
        self._is_rolling = surroundings.map is None
        self._size, self._max_offset = size or (spec.rolling_size, spec.rolling_size), max_offset
        self._inscribed = surroundings.robot.inscribed_radius
        resolution = spec.resolution if surroundings.map is None else surroundings.map.resolution
        self._inflation = inflation_for(spec, surroundings.robot, resolution)
        self._min_group_size = spec.denoise_layer.minimal_group_size if spec.denoise_layer.enabled else 0
        self._margin_cells = self._inflation.reach_cells + self._min_group_size
        """Distance in cells up to which a changed cell affects other cells."""
        self._static = self._static_layer_in(window_around(Pose2(0.0, 0.0), self._size, spec.resolution))
        self._frame = self._static.frame
        rows, columns = self._frame.shape
        self._whole: tuple[Cell, Cell] = (0, 0), (rows - 1, columns - 1)
        """Lowest and highest cell of the costmap."""
        # A change of a small costmap affects most cells. Recomputing all cells is then faster.
        self._recomputes_all = max(rows, columns) <= 4 * self._inflation.reach_cells
        self._live = ObstacleLayer(spec, self._inscribed, self._frame)
        self._unknown = None if self._static.unknown is None else self._static.unknown.copy()
        self._scan_count = 0
        self._latest_readings: dict[str, tuple[Pose2, Scan | Image]] = {}
        """Newest reading of each sensor, with the pose of the robot. The newest of all readings is the last item."""
        self._revision, self._added_keepout_cells = 0, 0
        self._changes = deque[CellIndices | None](maxlen=MAX_REVISIONS)
        """Cells with changed obstacles for each of the last revisions; None if all cells may have changed."""
        self._outdated: tuple[Cell, Cell] | None = None
        """Lowest and highest cell of the bounding box of all changes that `view` does not contain yet."""
        self._view: CostmapView | None = None
        self.moving = NO_MOVING_OBSTACLES
        """Moving obstacles in the frame of the costmap, included in the view."""
        self._reset_to_static_layer(self._static.costs(self._inflation).copy())

    @property
    def publish_frequency(self) -> float:
        """Maximum rate in Hz at which to publish the costmap; 0 means never."""
        return self._spec.publish_frequency

    @property
    def view(self) -> CostmapView:
        """The current costmap. Its arrays are valid until the next update.

        The first access after one or more updates computes costs and distances.
        """
        if self._outdated is not None:
            self.refresh(*self._outdated)
        view, revision = self._view, self._revision
        if view is None or view.revision != revision or view.moving is not self.moving:
            frame, radius, moving = self._frame, self._spec.inflation_radius, self.moving
            view = CostmapView(self._costs, self._distance, frame.resolution, frame.origin, revision, radius, moving)
            self._view = view
        return view

    @property
    def revision(self) -> int:
        """Revision of the costmap; increases with each update that changes a cell."""
        return self._revision

    def changed_near(self, revision: int, points: ComplexPoints, distance: float) -> bool:
        """Return whether obstacles within `distance` m of `points` x + iy (n,) may have changed since a revision."""
        count = self._revision - revision
        if count > len(self._changes):
            return True
        changes = list(self._changes)[len(self._changes) - count :]
        reach = distance + (1 + self._min_group_size) * math.sqrt(2.0) * self._frame.resolution  # between cell centers
        for cells in changes:
            if cells is None or (np.abs(self._frame.points(cells)[:, None] - points) <= reach).any():
                return True
        return False

    @property
    def obstacle_cell_count(self) -> int:
        """Number of cells with live obstacles, plus the number of lethal cells that `set_zones` has added."""
        return self._live.count + self._added_keepout_cells

    def update(self, base: Pose2, reading: Scan | Image) -> None:
        """Clear the cells that a sensor sees through, then mark the obstacles it sees. `base`: pose of the robot."""
        self.follow(base)
        self._latest_readings.pop(reading.sensor, None)  # so that the newest reading is the last one
        self._latest_readings[reading.sensor] = (base, reading)
        if isinstance(reading, Image):
            cells = self._live.on_image(base, reading, self._static.squared)
            if len(cells):
                (top, left), (bottom, right) = cells.min(axis=0).tolist(), cells.max(axis=0).tolist()
                self._mark_changed((top, left), (bottom, right), None)
            return
        changed = self._live.on_scan(base, reading, self._static.squared if self._static.has_lethal else None)
        if len(changed):
            self._mark_changed(*(self._whole if self._recomputes_all else self._frame.extent(changed)), changed)
        if self._unknown is not None:
            self._update_unknown(base, reading, self._unknown)

    def follow(self, base: Pose2) -> None:
        """Move a rolling window if the robot, at the pose `base`, is too far from the center of the window."""
        if self._is_rolling and should_roll(self._frame, base, self._max_offset):
            self._roll(base)

    def clear(self, clear_within: float = math.inf, unseen_margin: float = DISTANCE_MARGIN_M) -> None:
        """Clear the live obstacles within `clear_within` m along x and y, except those in the newest readings.

        Marks of lidars outside the present field of view of all lidars are kept up to `unseen_margin` m beyond the
        circumscribed radius, because the robot may back up into these obstacles.
        """
        latest = list(self._latest_readings.values())
        scans = [(base, reading) for base, reading in latest if isinstance(reading, Scan)]
        radius = self._surroundings.robot.circumscribed_radius + unseen_margin
        out_of_view = self._live.cells_out_of_view(scans[-1][0], radius, scans) if scans else None
        if latest and math.isfinite(clear_within):
            self._live.clear_around(latest[-1][0], clear_within)
        else:
            self._live.reset(self._frame)
        if out_of_view is not None:
            self._live.mark(out_of_view)
        self._reset_to_static_layer()
        for base, reading in latest:
            self.update(base, reading)

    def set_zones(self, zones: Zones) -> None:
        """Replace all keepout zones and masks."""
        old_count = self._static.lethal_cell_count
        self._surroundings = replace(self._surroundings, keepout=zones.keepout, masks=zones.masks)
        self._static = self._static_layer_in(self._frame)
        self._added_keepout_cells += self._static.lethal_cell_count - old_count
        self._reset_to_static_layer()

    def fits_static(self, pose: Pose2, tolerance: float) -> bool:
        """Return whether the robot fits on the map near a pose, without live obstacles.

        The pose must not be in a wall, and the inscribed circle must fit at a point within `tolerance` m of the pose.
        For a pose outside the costmap, where walls are unknown, the result is True.
        """
        center = self._frame.cell(pose.x, pose.y)
        if not self._frame.covers(pose.x, pose.y):
            return True
        if self._static.squared[center] == 0:
            return False
        window = self._frame.window(center, center, math.ceil(tolerance / self._frame.resolution))
        fits = self._inflation.meters.take(self._static.squared[window]) > self._inscribed
        points = self._frame.centers(np.argwhere(fits) + np.array((window[0].start, window[1].start)))
        return bool((np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y) <= tolerance).any())

    def goal_in_window(self, start: Pose2, goal: Pose2) -> Pose2:
        """Return the goal; if it is outside a rolling window, a pose in the window on the line from start to goal."""
        return clip_goal(self._frame, start, goal) if self._is_rolling else goal

    def _roll(self, base: Pose2) -> None:
        """Move the window so that the robot is at its center. New cells are unknown if unknown space is tracked."""
        old_frame, self._frame = self._frame, window_around(base, self._size, self._spec.resolution)
        if self._surroundings.keepout or self._surroundings.masks.keepout is not None:
            self._static = self._static_layer_in(self._frame)
        self._live.roll(self._frame)
        if self._unknown is not None:
            self._unknown = shift_layer(self._unknown, old_frame, self._frame, True)
        self._mark_changed(*self._whole, None)

    def _static_layer_in(self, window: GridFrame) -> StaticLayer:
        """Return the static layer of the map, or of this window if there is no map."""
        return static_layer(self._spec, self._surroundings, window, self._inflation.reach_cells)

    def _reset_to_static_layer(self, costs: Costs | None = None) -> None:
        """Reset costs and distances to the static layer. The next `view` adds live obstacles.

        `costs` are the costs of the static layer; None to compute them.
        """
        squared = self._static.squared
        self._costs = self._inflation.costs(squared, self._unknown) if costs is None else costs
        self._distance = self._inflation.meters.take(squared)
        self._add_revision(None)
        self._outdated = None
        if len(marked := self._live.cells):
            self._mark_changed(*self._frame.extent(marked), None)

    def _obstacles(self, window: Window) -> Mask:
        """Return which cells of a window are live obstacles, without small groups if the denoise layer is enabled."""
        marked = self._live.marked(window)
        if not self._min_group_size:
            return marked
        return remove_small_groups(marked, self._static.squared[window] == 0, self._spec.denoise_layer)

    def _update_unknown(self, base: Pose2, scan: Scan, unknown: Mask) -> None:
        """With every n-th scan, remove the cells that beams cross from the mask `unknown`."""
        self._scan_count += 1
        if self._scan_count % SCANS_PER_UNKNOWN_UPDATE != 1:
            return
        frame = self._frame
        window = self._live.window_around_robot(base, math.hypot(scan.mount.x, scan.mount.y))
        cells = frame.from_window(window, np.flatnonzero(unknown[window]))
        if not len(cells):
            return
        crossed, _ = crossed_cells(frame.points(cells), frame.resolution, scan, base, self._spec)
        cells = cells[crossed]
        if len(cells):
            unknown[np.divmod(cells, frame.shape[1])] = False
            self._mark_changed(*frame.extent(cells), NO_CELLS)

    def _mark_changed(self, low: Cell, high: Cell, obstacles: CellIndices | None) -> None:
        """Mark the window from cell `low` to `high` as outdated, and add a revision (see `_add_revision`)."""
        if self._outdated is not None:
            outdated_low, outdated_high = self._outdated
            low = min(low[0], outdated_low[0]), min(low[1], outdated_low[1])
            high = max(high[0], outdated_high[0]), max(high[1], outdated_high[1])
        self._outdated = low, high
        self._add_revision(obstacles)

    def _add_revision(self, obstacles: CellIndices | None) -> None:
        """Add a revision. `obstacles`: flat indices of cells with changed obstacles; None if all may have changed."""
        self._revision += 1
        self._changes.append(obstacles)

    def refresh(self, low: Cell, high: Cell) -> None:
        """Recompute distances and costs of all cells affected by changes in the window from cell `low` to `high`."""
        self._outdated = None
        if (low, high) == self._whole:
            self._refresh_all()
            return
        affected = self._frame.window(low, high, self._margin_cells)
        outer = self._frame.window(low, high, 2 * self._margin_cells)  # contains all obstacles that affect `affected`
        affected_in_outer = (
            slice(affected[0].start - outer[0].start, affected[0].stop - outer[0].start),
            slice(affected[1].start - outer[1].start, affected[1].stop - outer[1].start),
        )
        squared = squared_distances_within(self._obstacles(outer), self._inflation.reach_cells)[affected_in_outer]
        if self._static.has_lethal:
            squared = np.minimum(self._static.squared[affected], squared)
        self._distance[affected] = self._inflation.meters.take(squared)
        self._costs[affected] = self._inflation.costs(
            squared, None if self._unknown is None else self._unknown[affected]
        )

    @cached_property
    def _transform(self) -> SquaredDistanceTransform:
        return SquaredDistanceTransform(self._frame.shape, self._inflation.reach_cells)

    def _refresh_all(self) -> None:
        squared = self._transform.transform(self._obstacles(WHOLE_GRID))
        if self._static.has_lethal:
            squared = np.minimum(self._static.squared, squared)
        indices = squared.astype(np.intp)  # converted once for both lookups
        self._distance = self._inflation.meters.take(indices)
        self._costs = self._inflation.costs(indices, self._unknown)


def precompute(spec: CostmapSpec, robot: RobotModel, grid: OccupancyGrid) -> None:
    """Compute and cache the costs of a map without keepout zones, before worker processes are forked."""
    inflation = inflation_for(spec, robot, grid.resolution)
    layer = map_layer(grid, spec.lethal_cost_threshold, spec.track_unknown_space, inflation.reach_cells)
    layer.costs(inflation)
