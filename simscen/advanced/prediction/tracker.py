"""Tracking of moving obstacles in the scans of one lidar.

A cluster of hits starts a track if it is in formerly free space, through which beams of an earlier scan passed. Later
clusters near the predicted position update the track. A track with a significant speed over some updates counts as
moving.
"""

import math

import numpy as np

from simscen.advanced.prediction.clusters import (
    BOTH_EDGES,
    Cluster,
    Hits,
    Mask,
    Points,
    Segments,
    count_marked_hits,
    divide_into_segments,
    find_clusters,
    find_valid_hits,
    fit_circle,
)
from simscen.advanced.prediction.tracks import Track, TrackLifecycle
from simscen.advanced.prediction.visibility import NO_HIT_RANGE_M, CurrentScan, EarlierScan, FreeSpaceMemory, LidarPose
from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.guards import Prediction
from simscen.stack.moving_obstacles import MovingObstacle, MovingObstacles, no_moving_obstacles

CENTER_STD_M, CENTER_STD_PER_M, HIDDEN_STD_M = 0.02, 0.004, 0.10
"""Standard deviation of a measured center: a constant, a part per meter of range, and a part for hidden edges."""
INITIAL_STD_M = 0.1
"""Additional standard deviation of the first measurement of a track."""
GATE_M, GATE_SIGMAS = 0.25, 3.0
"""Maximum distance between a track and a cluster that updates it: a constant plus a number of standard deviations."""
MIN_START_RADIUS_M = 0.15
"""Minimum radius of a cluster that starts a track outside formerly free space."""
MIN_HIDDEN_RADIUS_M = 0.3
"""Minimum radius of a new track with a partly hidden cluster: the radius of a person."""
RADIUS_GAIN = 0.3
"""Gain of the update of a track's radius by a completely visible cluster."""


@fast_dataclass(eq=False)
class ScanClusters:
    """Clusters of a scan. `points` (n,) are all hits of the scan in the lidar frame.

    `lidar` is the pose of the lidar in the odom frame. For each cluster, `appeared` states whether it is in formerly
    free space, and `was_occupied` whether an earlier scan hit something there.
    """

    tick: int
    points: Points
    clusters: list[Cluster]
    lidar: LidarPose
    appeared: list[bool]
    was_occupied: list[bool]

    def is_static(self, index: int) -> bool:
        """Return whether an earlier scan saw the same obstacle at the position of a cluster."""
        return self.was_occupied[index] and not self.appeared[index]


def associate(tracks: list[Track], current: ScanClusters) -> set[int]:
    """Update each track with a nearby cluster, nearest pairs first. Return the indices of the used clusters."""
    clusters, lidar = current.clusters, current.lidar
    if not tracks or not clusters:
        return set()
    possible: list[tuple[float, int, int]] = []
    for number, track in enumerate(tracks):
        expected, gate = lidar.to_lidar(track.position), GATE_M + GATE_SIGMAS * track.position_std
        for index, (_, _, center, _, edges) in enumerate(clusters):
            # The center of a partly hidden obstacle can be off by its radius.
            distance, hidden = abs(expected - center), 0.0 if edges == BOTH_EDGES else track.radius
            if distance <= gate + hidden and (
                not current.is_static(index) or _is_last_cluster(track, center, lidar, hidden)
            ):
                possible.append((distance, number, index))
    possible.sort()
    assigned: dict[int, int] = {}
    used: set[int] = set()
    for _, number, index in possible:
        if number not in assigned and index not in used:
            used.add(index)
            assigned[number] = index
    if assigned:
        _update([(tracks[number], index) for number, index in assigned.items()], current)
    return used


def _is_last_cluster(track: Track, center: complex, lidar: LidarPose, hidden: float) -> bool:
    """Return whether a static cluster is near the last update of a track: within GATE_M plus `hidden` in m."""
    return abs(lidar.to_lidar(track.updates[-1].position) - center) <= GATE_M + hidden


def _update(assigned: list[tuple[Track, int]], current: ScanClusters) -> None:
    """Update each track with the cluster of the given index."""
    lidar = current.lidar
    for track, number in assigned:
        first, last, guess, radius, edges = current.clusters[number]
        if edges == BOTH_EDGES:
            track.radius += RADIUS_GAIN * (radius - track.radius)
        else:
            guess = lidar.to_lidar(track.position)
        center = fit_circle(current.points[first : last + 1].tolist(), track.radius, guess)
        hidden = 0.0 if edges == BOTH_EDGES else HIDDEN_STD_M
        track.correct(lidar.to_parent(center), CENTER_STD_M + CENTER_STD_PER_M * abs(center) + hidden)
        track.record_update(
            current.tick, current.appeared[number], current.was_occupied[number], edges, track.position_std
        )


def start_tracks(tracks: list[Track], current: ScanClusters, used: set[int]) -> None:
    """Start tracks for clusters that are not in `used`, if they are in formerly free space.

    While something moves, clusters of at least MIN_START_RADIUS_M also start tracks where no earlier scan hit
    something.
    """
    # While something moves, it may have hidden the free space in which another obstacle appears.
    min_radius = MIN_START_RADIUS_M if any(track.is_moving for track in tracks) else math.inf
    for number, (_, _, center, radius, edges) in enumerate(current.clusters):
        appeared, was_occupied = current.appeared[number], current.was_occupied[number]
        if number in used or not (appeared or (radius >= min_radius and not was_occupied)):
            continue
        # A partly hidden obstacle may be larger than its visible part.
        is_fully_visible, noise = edges == BOTH_EDGES, CENTER_STD_M + CENTER_STD_PER_M * abs(center)
        size = radius if is_fully_visible else max(radius, MIN_HIDDEN_RADIUS_M)
        track = Track.start(current.tick, current.lidar.to_parent(center), noise + INITIAL_STD_M, size)
        track.record_update(
            current.tick, appeared, was_occupied, 0, noise if is_fully_visible else noise + HIDDEN_STD_M
        )
        tracks.append(track)


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
        """Take the parameters and the tick rate in Hz."""
        self._spec, self._rate = spec, tick_rate
        self._memory = FreeSpaceMemory(tick_rate)
        self._stride, self._had_new_hits = 1, False
        self._directions = self._checked_directions = np.zeros(0, dtype=np.complex128)
        self._tracks, self._lifecycle = list[Track](), TrackLifecycle(spec, tick_rate)
        self.tick = 0
        """Tick of the latest scan."""
        self.first_tick: int | None = None
        """Tick of the first scan."""
        self.moving_hits: Mask | None = None
        """Mask of the beams of the latest scan that hit moving obstacles; None if there are none."""
        self._no_obstacles = no_moving_obstacles(spec.acceleration)
        self.moving = self._no_obstacles
        """Moving obstacles at the tick of the latest scan."""

    @property
    def has_moving_obstacles(self) -> bool:
        """Whether `moving` is not empty."""
        return self.moving is not self._no_obstacles

    def on_scan(self, scan: Scan, odometry: Pose2) -> None:
        """Process a scan that was taken with the base at `odometry` in the odom frame."""
        lidar = odometry.compose(scan.mount)
        if len(self._directions) != len(scan.ranges):
            self._set_directions(scan)
        if self.first_tick is None:
            self.first_tick = scan.tick
        seconds, self.tick = (scan.tick - self.tick) / self._rate, scan.tick
        if seconds > 0:
            for track in self._tracks:
                track.predict(seconds, self._spec.acceleration)
        self.moving_hits, self.moving = None, self._no_obstacles
        earlier = self._memory.scan_before(scan.tick)
        if self._tracks or (earlier is not None and (self._had_new_hits or self._has_new_hit(scan, lidar, earlier))):
            self._update_tracks(CurrentScan(scan, _ends(scan.ranges, self._directions), lidar, earlier))
        self._memory.add(scan, lidar)

    def _set_directions(self, scan: Scan) -> None:
        """Compute the directions of all beams, and of the CHECKED_BEAMS."""
        self._stride = max(1, len(scan.ranges) // CHECKED_BEAMS)
        self._directions = np.exp(1j * scan.angles())
        self._checked_directions = self._directions[:: self._stride].copy()

    def _has_new_hit(self, scan: Scan, lidar: Pose2, earlier: EarlierScan) -> bool:
        """Return whether one of the CHECKED_BEAMS hits something in formerly free space."""
        ranges = scan.ranges[:: self._stride]
        comparison = earlier.compare(_ends(ranges, self._checked_directions), lidar)
        is_new = comparison.was_free()
        if not is_new.any():
            return False
        is_new &= (ranges >= scan.range_min) & (ranges <= self._max_range(scan))
        return bool(comparison.has_appeared(is_new).any())

    def _max_range(self, scan: Scan) -> float:
        """Return the range in m up to which hits are processed."""
        return min(scan.range_max, self._spec.max_range)

    def _update_tracks(self, current: CurrentScan) -> None:
        """Update, start, and end tracks with all hits of a scan."""
        scan_clusters = self._compare_clusters(current)
        if scan_clusters is None:
            return
        tracks, lifecycle, tick = self._tracks, self._lifecycle, current.scan.tick
        start_tracks(tracks, scan_clusters, associate(tracks, scan_clusters))
        remaining: list[Track] = []
        for track in tracks:
            lifecycle.update_motion(track, tick, tracks, current.has_left)
            if not lifecycle.has_ended(track, tick, tracks, current.sees_past):
                remaining.append(track)
        self._tracks = remaining
        if moving := [track for track in remaining if track.is_moving]:
            self._update_moving(moving, current)

    def _compare_clusters(self, current: CurrentScan) -> ScanClusters | None:
        """Return the clusters, compared with an earlier scan. None if there is no track and none can start."""
        scan, earlier, tracks = current.scan, current.earlier, self._tracks
        hits = find_valid_hits(scan.ranges, current.ends, scan.angle_increment, scan.range_min, self._max_range(scan))
        comparison = (
            None if earlier is None or not len(hits.beams) else earlier.compare(hits.points, current.lidar_pose)
        )
        free = None if comparison is None else comparison.was_free()
        if not tracks and (free is None or not self._may_start_track(hits, free)):
            return None
        segments = divide_into_segments(hits)
        new_hits = None if comparison is None or free is None else comparison.has_appeared(free)
        if not tracks and (new_hits is None or not self._starts_track(segments, new_hits)):
            return None
        found = find_clusters(segments, scan.ranges, scan.angle_min, scan.angle_increment, self._spec.max_radius)
        appeared = was_occupied = [False] * len(found)
        if comparison is not None and new_hits is not None and found:
            counts = count_marked_hits(found, new_hits)
            appeared = [count >= max(MIN_NEW_HITS, MIN_NEW_SHARE * total) for count, total in counts]
            if tracks:
                counts = count_marked_hits(found, comparison.was_occupied())
                was_occupied = [count > STATIC_SHARE * total for count, total in counts]
        return ScanClusters(scan.tick, hits.points, found, current.lidar, appeared, was_occupied)

    def _may_start_track(self, hits: Hits, free: Mask) -> bool:
        """Return whether enough hits in formerly free space may belong to one obstacle."""
        indices = free.nonzero()[0].tolist()
        self._had_new_hits = len(indices) > 0
        return hits.may_share_segment(indices, MIN_NEW_HITS)

    def _starts_track(self, segments: Segments, new_hits: Mask) -> bool:
        """Return whether enough hits of a segment are new, including one of the CHECKED_BEAMS."""
        checked = segments.hits.beams[new_hits] % self._stride == 0
        return segments.share_segment(new_hits, MIN_NEW_HITS) and bool(checked.any())

    def _update_moving(self, moving: list[Track], current: CurrentScan) -> None:
        """Update the attributes `moving` and `moving_hits` with the moving tracks."""
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
        self.moving = MovingObstacles.of(obstacles, self._spec.acceleration)
        hits = np.zeros(len(ends), dtype=np.bool_)
        for obstacle in obstacles:
            hits |= np.abs(ends - lidar.to_lidar(obstacle.position)) <= self._spec.margin + obstacle.radius
        self.moving_hits = hits & (scan.ranges >= scan.range_min) & (scan.ranges <= scan.range_max)


def _ends(ranges: Array, directions: Points) -> Points:
    """Return the endpoints of beams (n,). Beams without a valid range end farther away than any range of a lidar."""
    ends: Points = np.fmin(np.abs(ranges), 2 * NO_HIT_RANGE_M) * directions  # the range of too close beams is -inf
    return ends
