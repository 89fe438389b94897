"""Tracking of moving obstacles in the scans of one lidar.

A cluster of hits starts a track if it is in formerly free space, through which beams of an earlier scan passed. Later
clusters near the predicted position update the track. A track with a significant speed over some updates counts as
moving.
"""

from dataclasses import replace

import numpy as np

from simscen.advanced.prediction.association import ScanClusters, associate, start_tracks
from simscen.advanced.prediction.clusters import Cluster, Mask, Points, Segments, find_clusters, find_segments
from simscen.advanced.prediction.current_scan import CurrentScan
from simscen.advanced.prediction.free_space_memory import NO_HIT_RANGE_M, EarlierScan, FreeSpaceMemory
from simscen.advanced.prediction.tracks import Track, TrackLifecycle
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Prediction
from simscen.stack.moving_obstacles import MovingObstacle, MovingObstacles

CHECKED_BEAMS = 120
"""Approximate number of beams that are checked while there are no tracks. All beams are processed if one of these beams
hits something in formerly free space."""
MIN_NEW_SHARE, MIN_NEW_HITS = 0.3, 3
"""Minimum share and number of a cluster's hits in formerly free space for `appeared`."""
STATIC_SHARE = 0.5
"""Minimum share of a cluster's hits where an earlier scan hit something, for `was_occupied`."""
MIN_RADIUS_M = 0.25
"""Minimum radius of a moving obstacle. The lidar may see only the mast of a robot or the leg of a person."""


class Tracker:
    """Tracks moving obstacles in the scans of one lidar, in the odom frame."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        self._spec, self._rate = spec, tick_rate
        self._memory = FreeSpaceMemory(tick_rate)
        self._stride = 1
        self._directions = self._checked_directions = np.zeros(0, dtype=np.complex128)
        self._tracks, self._lifecycle = list[Track](), TrackLifecycle(spec, tick_rate)
        self.tick = 0
        """Tick of the latest scan."""
        self.first_tick: int | None = None
        """Tick of the first scan."""
        self.moving_hits: Mask | None = None
        """Mask of the beams of the latest scan that hit moving obstacles; None if there are none."""
        self.moving = MovingObstacles((), spec.acceleration)
        """Moving obstacles at the tick of the latest scan."""

    @property
    def has_moving_obstacles(self) -> bool:
        """Whether `moving` is not empty."""
        return len(self.moving) > 0

    def on_scan(self, scan: Scan, odometry: Pose2) -> None:
        """Process a scan that was taken with the base at `odometry` in the odom frame."""
        if scan.angle_increment < 0.0:
            self.on_scan(_counterclockwise(scan), odometry)
            if self.moving_hits is not None:
                self.moving_hits = self.moving_hits[::-1]
            return
        lidar = odometry.compose(scan.mount)
        if len(self._directions) != len(scan.ranges):
            self._set_directions(scan)
        if self.first_tick is None:
            self.first_tick = scan.tick
        seconds, self.tick = (scan.tick - self.tick) / self._rate, scan.tick
        if seconds > 0:
            for track in self._tracks:
                track.predict(seconds, self._spec.acceleration)
        self.moving_hits, self.moving = None, MovingObstacles((), self._spec.acceleration)
        earlier = self._memory.scan_before(scan.tick)
        if self._tracks or (earlier is not None and self._has_new_hit(scan, lidar, earlier)):
            self._update_tracks(CurrentScan(scan, _ends(scan.ranges, self._directions), lidar, earlier))
        self._memory.add(scan, lidar)

    def _set_directions(self, scan: Scan) -> None:
        self._stride = max(1, len(scan.ranges) // CHECKED_BEAMS)
        self._directions = np.exp(1j * scan.angles())
        self._checked_directions = self._directions[:: self._stride].copy()

    def _has_new_hit(self, scan: Scan, lidar: Pose2, earlier: EarlierScan) -> bool:
        """Return whether one of the CHECKED_BEAMS hits something in formerly free space."""
        ranges = scan.ranges[:: self._stride]
        has_appeared = earlier.compare(_ends(ranges, self._checked_directions), lidar).has_appeared()
        return bool((has_appeared & (ranges >= scan.range_min) & (ranges <= self._max_range(scan))).any())

    def _max_range(self, scan: Scan) -> float:
        """Return the range in m up to which hits are processed."""
        return min(scan.range_max, self._spec.max_range)

    def _update_tracks(self, current: CurrentScan) -> None:
        """Update, start, and end tracks with all hits of a scan."""
        scan, lifecycle, tracks = current.scan, self._lifecycle, self._tracks
        segments = find_segments(scan.ranges, current.ends, scan.angle_increment, scan.range_min, self._max_range(scan))
        new_hits = occupied_hits = np.zeros(len(segments.beams), dtype=np.bool_)
        if current.earlier is not None:
            comparison = current.earlier.compare(segments.points, current.lidar_pose)
            new_hits = comparison.has_appeared()
            if tracks:
                occupied_hits = comparison.was_occupied()
        if not tracks and not self._starts_track(segments, new_hits):
            return
        clusters = [
            _compare_cluster(cluster, new_hits, occupied_hits)
            for cluster in find_clusters(
                segments, scan.ranges, scan.angle_min, scan.angle_increment, self._spec.max_radius
            )
        ]
        found = ScanClusters(scan.tick, segments.points, clusters, current.lidar)
        start_tracks(tracks, found, associate(tracks, found))
        remaining: list[Track] = []
        for track in tracks:
            lifecycle.update_motion(track, scan.tick, tracks, current.has_left)
            if not lifecycle.has_ended(track, scan.tick, tracks, current.sees_past):
                remaining.append(track)
        self._tracks = remaining
        if moving := [track for track in remaining if track.is_moving]:
            self._update_moving(moving, current)

    def _starts_track(self, segments: Segments, new_hits: Mask) -> bool:
        """Return whether enough hits of a segment are new, including one of the CHECKED_BEAMS."""
        is_checked = segments.beams[new_hits] % self._stride == 0
        return segments.has_segment_with(MIN_NEW_HITS, new_hits) and bool(is_checked.any())

    def _update_moving(self, moving: list[Track], current: CurrentScan) -> None:
        """Set `moving` and `moving_hits` from the moving tracks."""
        scan, ends, lidar = current.scan, current.ends, current.lidar
        obstacles = [
            MovingObstacle(
                each.position,
                each.velocity,
                max(each.radius, MIN_RADIUS_M),
                each.variance,
                each.covariance,
                each.velocity_variance,
            )
            for each in moving
        ]
        self.moving = MovingObstacles(obstacles, self._spec.acceleration)
        hits = np.zeros(len(ends), dtype=np.bool_)
        for obstacle in obstacles:
            hits |= np.abs(ends - lidar.to_lidar(obstacle.position)) <= self._spec.margin + obstacle.radius
        self.moving_hits = hits & (scan.ranges >= scan.range_min) & (scan.ranges <= scan.range_max)


def _counterclockwise(scan: Scan) -> Scan:
    """Return the scan of a lidar that rotates clockwise with its beams in reverse order."""
    angle_min = scan.angle_min + (len(scan.ranges) - 1) * scan.angle_increment
    return replace(scan, ranges=scan.ranges[::-1], angle_min=angle_min, angle_increment=-scan.angle_increment)


def _ends(ranges: Array, directions: Points) -> Points:
    """Return the endpoints of beams (n,). Beams without a valid range end farther away than any range of a lidar."""
    ends: Points = np.fmin(np.abs(ranges), 2 * NO_HIT_RANGE_M) * directions  # the range of too close beams is -inf
    return ends


def _compare_cluster(cluster: Cluster, new_hits: Mask, occupied_hits: Mask) -> Cluster:
    """Return the cluster with `appeared` and `was_occupied`, from masks (m,) of the hits of the scan."""
    hits, count = slice(cluster.first, cluster.last + 1), cluster.last + 1 - cluster.first
    appeared = int(np.count_nonzero(new_hits[hits])) >= max(MIN_NEW_HITS, MIN_NEW_SHARE * count)
    was_occupied = int(np.count_nonzero(occupied_hits[hits])) > STATIC_SHARE * count
    return cluster._replace(appeared=appeared, was_occupied=was_occupied)
