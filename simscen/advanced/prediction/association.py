"""Data association: which cluster of a scan updates which track, and which starts a new one."""

import math

from simscen.advanced.prediction.clusters import BOTH_EDGES, Cluster, Points, fit_circle
from simscen.advanced.prediction.scan_outline import LidarPose
from simscen.advanced.prediction.tracks import Track
from simscen.core.decorators import fast_dataclass

CENTER_STD_M, CENTER_STD_PER_M, HIDDEN_STD_M = 0.02, 0.004, 0.10
"""Standard deviation in m of a measured center: constant part, part per meter of range, and part if partly hidden."""
INITIAL_STD_M = 0.1
"""Additional standard deviation in m of the first measurement of a track."""
GATE_M, GATE_SIGMAS = 0.25, 3.0
"""Gate of the association: a distance in m plus a number of standard deviations."""
MIN_RADIUS_M = 0.15
"""Minimum radius in m of a cluster that starts a track without having appeared in free space."""
MIN_HIDDEN_RADIUS_M = 0.3
"""Minimum radius in m of a partly hidden cluster that starts a track: that of a person."""
RADIUS_GAIN = 0.3
"""Gain of the radius update with a completely visible cluster."""


@fast_dataclass(eq=False)
class ScanClusters:
    """The clusters of a scan with their hits `points` (m,), measured by a lidar at `lidar` in the odom frame.

    `appeared` marks clusters where earlier scans saw free space, `was_occupied` those where they hit something.
    """

    tick: int
    points: Points
    clusters: list[Cluster]
    lidar: LidarPose
    appeared: list[bool]
    was_occupied: list[bool]

    def is_static(self, index: int) -> bool:
        """Return whether an obstacle was at the position of a cluster before."""
        return self.was_occupied[index] and not self.appeared[index]


def associate(tracks: list[Track], current: ScanClusters) -> set[int]:
    """Update each track with the nearest cluster, nearest pairs first. Return the indices of the clusters used."""
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
    """Return whether a static cluster is the one that the track was last updated with."""
    return abs(lidar.to_lidar(track.updates[-1].position) - center) <= GATE_M + hidden


def _update(assigned: list[tuple[Track, int]], current: ScanClusters) -> None:
    """Update tracks with their clusters."""
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
    """Start tracks for unused clusters that are in formerly free space."""
    # While something moves, it may have hidden the free space in which another obstacle appears.
    min_radius = MIN_RADIUS_M if any(track.is_moving for track in tracks) else math.inf
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
