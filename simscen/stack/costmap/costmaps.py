"""The global costmap for planning and the local costmap for control, and the schedules of their updates."""

import math
from dataclasses import replace
from typing import NamedTuple

from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import transform_polygon
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.stack import StackSpec
from simscen.stack.costmap.grid_frame import MAX_ROLL_OFFSET_M
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.frames import Frames
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.odometry_history import OdometryHistory
from simscen.stack.protocols import Surroundings

MIN_LOCAL_SIZE_M = 3.0
"""Minimum of the default size of the local costmap: the size in Nav2."""
MAX_UPDATE_DELAY_S = 1.0
"""If updates are late by more than this time, windows and zones move with the robot without an update."""
ZONE_TOLERANCE_M = 0.02
"""Shift of the map frame in the odom frame above which keepout zones are moved in the local costmap."""


class Costmaps:
    """Global and local costmap of one robot, each updated at its own rate.

    The global costmap is in the map frame and contains the map, if any. The local costmap is in the odom frame, rolls
    with the robot, and does not contain the map. When the localizer corrects the pose, only the keepout zones of the
    local costmap move, not its obstacles.
    """

    def __init__(
        self, spec: StackSpec, surroundings: Surroundings, lookahead_distance: float, latency: int = 0
    ) -> None:
        """Create both costmaps. An update takes `latency` ticks.

        The local costmap covers at least `lookahead_distance` m ahead of the robot, unless its size is specified.
        """
        self.global_costmap = LayeredCostmap(spec.costmap, surroundings)
        local_spec = spec.local_costmap.with_defaults_from(spec.costmap)
        min_half_size = lookahead_distance + surroundings.robot.circumscribed_radius + MAX_ROLL_OFFSET_M
        default_size = max(MIN_LOCAL_SIZE_M, 2.0 * min_half_size)
        size = spec.local_costmap.width or default_size, spec.local_costmap.height or default_size
        without_map = replace(surroundings, map=None, keepout=(), masks=replace(surroundings.masks, keepout=None))
        self.local_costmap = LayeredCostmap(local_spec, without_map, size, MAX_ROLL_OFFSET_M)
        self._local_range = max(size) / 2
        tick_rate = surroundings.tick_rate
        self._global_schedule = _UpdateSchedule(math.ceil(tick_rate / spec.costmap.update_frequency), latency)
        self._local_schedule = _UpdateSchedule(math.ceil(tick_rate / local_spec.update_frequency), latency)
        self._zones = Zones(surroundings.keepout, (), surroundings.masks)
        self._odom_from_map: Pose2 | None = None
        """Transform with which the keepout zones were put into the local costmap; None if the zones have changed."""
        slowest = max(self._global_schedule.period, self._local_schedule.period)
        self._max_update_age = slowest + round(MAX_UPDATE_DELAY_S * tick_rate)
        self._updated_at: int | None = None
        """Tick of the latest update; before the first update, of the first reading; None without any reading."""
        self._has_local_zones = False
        """Whether the local costmap has or had keepout zones."""
        self.next_update_tick: float = 0
        """The tick at which to call `update` again."""

    def add_reading(self, reading: Scan | Image) -> None:
        """Store a reading for the next update of each costmap, instead of an earlier reading of the same sensor."""
        if self._updated_at is None:
            self._updated_at = reading.tick
        for schedule in (self._global_schedule, self._local_schedule):
            schedule.readings[reading.sensor] = reading

    def is_global_due(self, tick: int) -> bool:
        """Return whether an update of the global costmap may start at this tick."""
        return self._global_schedule.is_due(tick)

    def set_zones(self, zones: Zones) -> None:
        """Replace all keepout zones and the keepout mask."""
        self._zones, self._odom_from_map = zones, None
        self.global_costmap.set_zones(zones)

    def update(self, tick: int, frames: Frames, odometry: OdometryHistory) -> None:
        """Update the costmaps that are due with the newest reading of each sensor.

        If there are no usable readings for some time, only windows and zones move with the robot.
        """
        if self._updated_at is None or tick - self._updated_at > self._max_update_age:
            self.global_costmap.follow(frames.pose)
            self._update_local_zones(frames)
            self.local_costmap.follow(frames.odometry)
        if tick >= self._global_schedule.next_tick:
            for base, reading, _ in self._global_schedule.take(tick, frames, frames.pose, odometry):
                self.global_costmap.update(base, reading)
                self._updated_at = tick
        if tick >= self._local_schedule.next_tick:
            for base, reading, frames_at_start in self._local_schedule.take(tick, frames, frames.odometry, odometry):
                self._update_local_zones(frames_at_start)
                self.local_costmap.update(base, reading)
                self._updated_at = tick
        self.next_update_tick = min(self._global_schedule.next_tick, self._local_schedule.next_tick)

    def clear(self) -> None:
        """Clear both costmaps (Nav2's ClearEntireCostmap).

        Obstacles in the newest readings remain, and nearby obstacles outside the field of view of all lidars.
        """
        self.clear_global(entirely=True)
        self.clear_local()

    def clear_around(self) -> None:
        """Clear both costmaps in the area of the local costmap (Nav2's ClearCostmapAroundRobot)."""
        self.clear_global(entirely=False)
        self.clear_local()

    def clear_local(self) -> None:
        """Clear the local costmap, except for obstacles outside the field of view of all lidars."""
        self.local_costmap.clear(unseen_margin=self._local_range)

    def clear_global(self, *, entirely: bool) -> None:
        """Clear the global costmap: entirely, or only in the area of the local costmap."""
        self.global_costmap.clear(math.inf if entirely else self._local_range)

    def _update_local_zones(self, frames: Frames) -> None:
        """Move the keepout zones of the local costmap to their current position in the odom frame."""
        mask, previous = self._zones.masks.keepout, self._odom_from_map
        if not self._zones.keepout and mask is None and not self._has_local_zones:
            return
        if previous is not None and frames.map_shift(previous, self._local_range) <= ZONE_TOLERANCE_M:
            return
        odom_from_map, self._has_local_zones = frames.odom_from_map, True
        self._odom_from_map = odom_from_map
        polygons = tuple(transform_polygon(odom_from_map, polygon) for polygon in self._zones.keepout)
        local_mask = None if mask is None else replace(mask, origin=odom_from_map.compose(mask.origin))
        self.local_costmap.set_zones(Zones(polygons, (), replace(self._zones.masks, keepout=local_mask)))


class _Update(NamedTuple):
    """Update of a costmap with one reading.

    base:     pose of the robot at the time of the reading, in the frame of the costmap
    reading:  scan or depth image
    frames:   poses of the robot at the start of the update
    """

    base: Pose2
    reading: Scan | Image
    frames: Frames


class _UpdateSchedule:
    """Update times of one costmap, and the readings for its next update."""

    def __init__(self, period: int, latency: int) -> None:
        """Take the time between two starts of updates and the duration of an update, in ticks.

        If an update takes longer than `period`, the next update starts when this update ends.
        """
        self.period = max(period, latency)
        """Minimum time between two starts of updates in ticks."""
        self._started_at = -self.period
        """Tick at which the latest update started."""
        self._updates = LatencyQueue[_Update](latency)
        self.next_tick: float = 0
        """The tick of the next start or end of an update."""
        self.readings: dict[str, Scan | Image] = {}
        """Newest reading of each sensor since the start of the latest update."""

    def is_due(self, tick: int) -> bool:
        """Return whether an update may start at this tick."""
        return tick - self._started_at >= self.period

    def take(self, tick: int, frames: Frames, base: Pose2, odometry: OdometryHistory) -> list[_Update]:
        """Start an update if it is due and there are readings. Return the updates that are complete at this tick.

        `base` is the current pose of the robot in the frame of the costmap.
        """
        if self.readings and self.is_due(tick):
            self._started_at = tick
            for reading in self.readings.values():
                if isinstance(reading, Image) or not _is_blind(reading):
                    self._updates.put(tick, _Update(odometry.past_pose(base, reading.tick), reading, frames))
            self.readings.clear()
        complete: list[_Update] = []
        while tick >= self._updates.due:
            complete.append(self._updates.take())
        self.next_tick = min(self._started_at + self.period, self._updates.due)
        return complete


def _is_blind(scan: Scan) -> bool:
    """Return whether all ranges of a scan are invalid or too short."""
    ranges, range_min = scan.ranges, scan.range_min
    return not len(ranges) or not (ranges.item(0) >= range_min or bool((ranges >= range_min).any()))
