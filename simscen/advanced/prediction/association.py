"""Association of the clusters of a scan with tracks: updates of tracks, and new tracks."""

import math

from simscen.advanced.prediction.clusters import Cluster, Points, fit_circle
from simscen.advanced.prediction.current_scan import LidarPose
from simscen.advanced.prediction.tracks import Track
from simscen.core.decorators import fast_dataclass

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
    """Clusters of a scan. `points` (n,) are all hits of the scan in the lidar frame; `lidar` is in the odom frame."""

    tick: int
    points: Points
    clusters: list[Cluster]
    lidar: LidarPose


def associate(tracks: list[Track], current: ScanClusters) -> set[int]:
    """Update each track with a nearby cluster, nearest pairs first. Return the indices of the used clusters."""
    lidar = current.lidar
    candidates: list[tuple[float, int, int]] = []  # distance in m, index of the track, index of the cluster
    for track_index, track in enumerate(tracks):
        expected, gate = lidar.to_lidar(track.position), GATE_M + GATE_SIGMAS * track.position_std
        for cluster_index, cluster in enumerate(current.clusters):
            # The center of a partly hidden obstacle can be off by the obstacle's radius.
            distance, center_error = abs(expected - cluster.center), 0.0 if cluster.is_fully_visible else track.radius
            if distance > gate + center_error:
                continue
            # A static cluster updates only a track whose last update was at the cluster.
            last = track.updates[-1].position
            if not cluster.is_static or abs(lidar.to_lidar(last) - cluster.center) <= GATE_M + center_error:
                candidates.append((distance, track_index, cluster_index))
    updated_tracks, used_clusters = set[int](), set[int]()
    for _, track_index, cluster_index in sorted(candidates):
        if track_index not in updated_tracks and cluster_index not in used_clusters:
            updated_tracks.add(track_index)
            used_clusters.add(cluster_index)
            _update(tracks[track_index], current.clusters[cluster_index], current)
    return used_clusters


def _update(track: Track, cluster: Cluster, current: ScanClusters) -> None:
    """Update a track with a cluster."""
    if cluster.is_fully_visible:
        track.radius += RADIUS_GAIN * (cluster.radius - track.radius)
        guess, hidden_std = cluster.center, 0.0
    else:
        guess, hidden_std = current.lidar.to_lidar(track.position), HIDDEN_STD_M
    center = fit_circle(current.points[cluster.first : cluster.last + 1].tolist(), track.radius, guess)
    track.correct(current.lidar.to_parent(center), CENTER_STD_M + CENTER_STD_PER_M * abs(center) + hidden_std)
    track.record_update(current.tick, cluster.appeared, cluster.was_occupied, cluster.edges, track.position_std)


def start_tracks(tracks: list[Track], current: ScanClusters, used_clusters: set[int]) -> None:
    """Start tracks for clusters that are not in `used_clusters`, if they are in formerly free space.

    While an obstacle moves, clusters of at least MIN_START_RADIUS_M also start tracks where no earlier scan hit
    something.
    """
    # A moving obstacle may have hidden the free space in which another obstacle appears.
    min_radius = MIN_START_RADIUS_M if any(track.is_moving for track in tracks) else math.inf
    for index, cluster in enumerate(current.clusters):
        if index in used_clusters or cluster.is_static or not (cluster.appeared or cluster.radius >= min_radius):
            continue
        radius, noise = cluster.radius, CENTER_STD_M + CENTER_STD_PER_M * abs(cluster.center)
        std = noise + INITIAL_STD_M
        if not cluster.is_fully_visible:  # the obstacle may be larger than its visible part
            radius, noise = max(radius, MIN_HIDDEN_RADIUS_M), noise + HIDDEN_STD_M
        track = Track.start(current.tick, current.lidar.to_parent(cluster.center), std, radius)
        track.record_update(current.tick, cluster.appeared, cluster.was_occupied, 0, noise)
        tracks.append(track)
