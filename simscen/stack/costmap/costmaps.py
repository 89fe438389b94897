"""Global costmap for planning and local costmap for control, as in Nav2."""

import math
from dataclasses import replace

from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.stack import StackSpec
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.costmap.grid_frame import MAX_ROLL_OFFSET_M
from simscen.stack.frames import Frames, transform_polygon
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.odometry_history import OdometryHistory
from simscen.stack.protocols import Surroundings

MIN_LOCAL_SIZE_M = 3.0
"""Size of Nav2's local costmap, and the default minimum size of this one."""
ZONE_TOLERANCE_M = 0.02
"""Displacement of zones in the odom frame from which they are drawn again."""


class Costmaps:
    """Keeps both up to date, each at its own rate.

    The global one is in the map frame: the map, and what was seen from where the robot believed itself. The local one
    rolls with the robot in the odom frame, knows no map, and shows where things are from the robot: a correction of
    the localizer moves nothing in it but keepout zones, which are known in the map frame alone.
    """

    def __init__(self, spec: StackSpec, surroundings: Surroundings, reach: float, latency: int = 0) -> None:
        """`reach`: how far in meters the controller looks ahead; `latency`: ticks that an update takes."""
        self.wide = Costmap(spec.costmap, surroundings)
        near = spec.local_costmap.completed(spec.costmap)
        edge = max(MIN_LOCAL_SIZE_M, 2.0 * (reach + surroundings.robot.circumscribed_radius + MAX_ROLL_OFFSET_M))
        size = spec.local_costmap.width or edge, spec.local_costmap.height or edge
        bare = replace(surroundings, map=None, keepout=(), masks=replace(surroundings.masks, keepout=None))
        self.near = Costmap(near, bare, size, MAX_ROLL_OFFSET_M)
        self._reach = max(size) / 2
        self._wide = _Rhythm(math.ceil(surroundings.tick_rate / spec.costmap.update_frequency), latency)
        self._near = _Rhythm(math.ceil(surroundings.tick_rate / near.update_frequency), latency)
        self._zones = Zones(surroundings.keepout, (), surroundings.masks)
        self._odom_from_map: Pose2 | None = None
        self._painted = False
        self.next: float = 0
        """The tick before which an update has nothing to do."""

    def see(self, seen: Scan | Image) -> None:
        """Store a reading for the next update."""
        for rhythm in (self._wide, self._near):
            rhythm.seen[seen.sensor] = seen

    def due(self, tick: int) -> bool:
        """Return whether it is time for an update of the global costmap."""
        return self._wide.due(tick)

    def set_zones(self, zones: Zones) -> None:
        """Keep out of these from now on, and of no others."""
        self._zones, self._odom_from_map = zones, None
        self.wide.set_zones(zones)

    def update(self, tick: int, frames: Frames, odometry: OdometryHistory) -> None:
        """Feed the newest reading of each sensor to the costmaps that are due, seen from where it was taken."""
        if tick >= self._wide.next:
            for base, seen, _ in self._wide.take(tick, frames, frames.pose, odometry):
                self.wide.update(base, seen)
        if tick >= self._near.next:
            for base, seen, then in self._near.take(tick, frames, frames.odometry, odometry):
                self._paint_zones(then)
                self.near.update(base, seen)
        self.next = min(self._wide.next, self._near.next)

    def clear(self) -> None:
        """Forget every live obstacle but those that the newest scans show (Nav2's ClearEntireCostmap of both)."""
        self.wide.clear()
        self.clear_local()

    def clear_around(self) -> None:
        """Clear both costmaps as far as the local costmap reaches (Nav2's ClearCostmapAroundRobot).

        What lies farther off is in no controller's way, and who forgets a dead end drives into it again.
        """
        self.wide.clear(self._reach)
        self.clear_local()

    def clear_local(self) -> None:
        """Clear the local costmap, except for cells that no lidar sees: the robot backs up by this costmap."""
        self.near.clear(unseen=self._reach)

    def clear_global(self, *, entirely: bool) -> None:
        """Forget live obstacles in the global costmap alone: all but those in sight, or as far as `clear_around`."""
        self.wide.clear(math.inf if entirely else self._reach)

    def _paint_zones(self, frames: Frames) -> None:
        """Keepout zones where they belong in the odom frame by now."""
        mask, known = self._zones.masks.keepout, self._odom_from_map
        if not self._zones.keepout and mask is None and not self._painted:
            return
        if known is not None and frames.moved(known, self._reach) <= ZONE_TOLERANCE_M:
            return
        moved, self._painted = frames.odom_from_map, True
        self._odom_from_map = moved
        polygons = tuple(transform_polygon(moved, polygon) for polygon in self._zones.keepout)
        here = None if mask is None else replace(mask, origin=moved.compose(mask.origin))
        self.near.set_zones(Zones(polygons, (), replace(self._zones.masks, keepout=here)))


class _Rhythm:
    """When a costmap is updated, and the readings that it has not taken in yet."""

    def __init__(self, period: int, latency: int) -> None:
        self._period, self._updated = max(period, latency), -period
        self._underway = LatencyQueue[_View](latency)
        self.next: float = 0
        """The tick before which there is nothing to take."""
        self.seen: dict[str, Scan | Image] = {}

    def due(self, tick: int) -> bool:
        return tick - self._updated >= self._period

    def take(self, tick: int, frames: Frames, base: Pose2, odometry: OdometryHistory) -> list["_View"]:
        """Return the readings to be processed by now, for a robot at `base`. An update waits for a first reading."""
        if self.seen and self.due(tick):
            self._updated = tick
            for one in self.seen.values():
                if isinstance(one, Image) or not _blind(one):
                    self._underway.put(tick, (odometry.then(base, one.tick), one, frames))
            self.seen.clear()
        there: list[_View] = []
        while tick >= self._underway.due:
            there.append(self._underway.take())
        self.next = min(self._updated + self._period, self._underway.due)
        return there


def _blind(scan: Scan) -> bool:
    """Return whether no beam of a scan measured free space or a hit: all are invalid or too close."""
    ranges, nearest = scan.ranges, scan.range_min
    return not len(ranges) or not (ranges.item(0) >= nearest or bool((ranges >= nearest).any()))


_View = tuple[Pose2, Scan | Image, Frames]
"""Pose of the robot at a reading, the reading, and the frames when the update began."""
